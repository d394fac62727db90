"""The ids of settings and runs: digests of the values of all their parameters."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.values import text_of

# Settings whose ids are computed in one go, which bounds the memory for their texts.
_CHUNK = 65_536


def setting_ids(
    values: Mapping[str, Sequence[object]], strides: Mapping[str, int], settings: int
) -> NDArray[np.uint64]:
    """Return the ids of all settings.

    An id is the first 8 bytes of BLAKE2b of ``canonical`` of the setting: its parameters with their values, in the
    order of their names. So it depends on neither the order of the axes nor on which parameters are swept.

    Parameters
    ----------
    values : mapping of str to sequence
        The values of each parameter.
    strides : mapping of str to int
        For each parameter, how many settings follow each other with one of its values.
    settings : int
        Their number.

    Returns
    -------
    array of uint64
        The ids, (settings,).
    """
    ids = np.empty(settings, np.uint64)
    texts = {name: _texts(name, one) for name, one in sorted(values.items()) if len(one) <= _CHUNK}
    for start in range(0, settings, _CHUNK):
        which = np.arange(start, min(start + _CHUNK, settings))
        columns = []
        for name, one in sorted(values.items()):
            places = (which // strides[name] % len(one)).tolist()
            known = texts.get(name)
            columns.append([known[i] for i in places] if known else _texts(name, [one[i] for i in places]))
        rows = map(", ".join, zip(*columns, strict=True)) if columns else [""] * len(which)
        digests = b"".join([hashlib.blake2b(f"{{{row}}}".encode(), digest_size=8).digest() for row in rows])
        ids[start : start + len(which)] = np.frombuffer(digests, ">u8")
    return ids


def _texts(name: str, values: Sequence[Any]) -> list[str]:
    """Return the texts of a parameter's values as `canonical` has them; numbers may be many."""
    kinds = set(map(type, values))
    if kinds == {int}:
        return [f"{name}={one}" for one in values]
    if kinds == {float}:
        return [f"{name}={int(one) if one.is_integer() else one.hex()}" for one in values]
    return [f"{name}={text_of(one)}" for one in values]


def hex_of(setting: int) -> str:
    """Return the id of a setting as a text of 16 hexadecimal digits."""
    return f"{int(setting):016x}"


def run_id(setting: int, replicate: int) -> str:
    """Return the id of a run: that of its setting, and the number of the replicate."""
    return f"{hex_of(setting)}-{replicate}"
