"""The ids of settings: digests of the values of all their parameters."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

# Settings whose ids are computed in one go, which bounds the memory for their texts.
_CHUNK = 65_536


def setting_ids(texts: Mapping[str, Sequence[str]], home: Mapping[str, int], sizes: Sequence[int]) -> NDArray[np.uint64]:
    """Return the ids of all settings.

    An id is the first 8 bytes of BLAKE2b over ``canonical`` of the setting: its parameters with their values, in the
    order of their names. So it depends on neither the order of the axes nor on which parameters are swept.

    Parameters
    ----------
    texts : mapping of str to sequence of str
        The canonical texts of the values of each parameter.
    home : mapping of str to int
        For each parameter the block that it is in; −1 for a fixed one, which has one value.
    sizes : sequence of int
        The number of values in each block; the last varies fastest.
    """
    settings = math.prod(sizes)
    strides = [math.prod(sizes[i + 1 :]) for i in range(len(sizes))]
    named = {name: [f"{name}={text}" for text in texts[name]] for name in sorted(texts)}
    ids = np.empty(settings, np.uint64)
    for start in range(0, settings, _CHUNK):
        which = np.arange(start, min(start + _CHUNK, settings))
        columns = [
            repeat(pieces[0], len(which))
            if home[name] < 0
            else map(pieces.__getitem__, (which // strides[home[name]] % sizes[home[name]]).tolist())
            for name, pieces in named.items()
        ]
        rows = map(", ".join, zip(*columns, strict=True)) if columns else iter([""])
        digests = b"".join(hashlib.blake2b(f"{{{row}}}".encode(), digest_size=8).digest() for row in rows)
        ids[start : start + len(which)] = np.frombuffer(digests, ">u8")
    return ids


def hex_of(ids: NDArray[np.uint64]) -> list[str]:
    """Return ids as texts of 16 hexadecimal digits."""
    return [f"{one:016x}" for one in ids.tolist()]


def run_id(setting: int, replicate: int) -> str:
    """Return the id of a run: that of its setting and the number of the replicate."""
    return f"{setting:016x}-{replicate}"
