"""The policy with the learned rule, and the file that its constants are kept in."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.evolved.layout import BLOCKS, SIZE
from teamsight.policies.evolved.rule import decide
from teamsight.policies.evolved.senses import FIELDS, ROWS, TRACKS
from teamsight.policies.handmade.target_tracks import IDENTITY
from teamsight.policies.interface import PolicyState

SCHEMA = 1

_SHIPPED = Path(__file__).with_name("constants.json")


@dataclass(frozen=True, repr=False)
class Evolved(CompiledPolicy):
    """Observe targets by forces that evolution shaped, with a memory of targets, teammates, trail and ground.

    Each target and each teammate pulls or pushes; a piecewise linear law and a small network give the strength, from
    how near it is, how near teammates are to it, whether it goes away, how many others could be held with it, how
    crowded the place was lately and how large the known ground is. Five more forces come from memory. It was shaped
    under `RingAwareness(16)` and runs under every degree that shows teammates; without any it would observe less than a
    random walk, and is refused.

    Parameters
    ----------
    constants : sequence of float, optional
        The `SIZE` constants of the rule, see `teamsight.policies.evolved.layout`; those shipped.

    Raises
    ------
    ValueError
        If there are not `SIZE` of them, or one is not finite.

    Notes
    -----
    *Source:* none; the forces begin as Parker's. Made by ``teamsight evolve train``; see
    docs/evolved.md. A robot remembers up to 16 targets, and sees no more than these.
    """

    constants: tuple[float, ...] = ()

    kernel = decide
    draws = 2
    needs = ("teammates",)

    def __post_init__(self) -> None:
        given = np.array(self.constants if len(self.constants) else shipped(), float)
        if given.shape != (SIZE,):
            raise ValueError(f"constants: has the shape {given.shape}; the learned rule has ({SIZE},)")
        if not np.isfinite(given).all():
            raise ValueError(f"constants: number {int(np.argmin(np.isfinite(given)))} is not finite")
        object.__setattr__(self, "constants", tuple(given.tolist()))

    def __repr__(self) -> str:
        if self.constants == shipped():
            return "Evolved()"
        return f"Evolved(<{hashlib.blake2b(np.array(self.constants).tobytes(), digest_size=4).hexdigest()}>)"

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.constants

    def start(self, size: int) -> PolicyState:
        whole = np.zeros((size, TRACKS, 3), np.int64)
        whole[:, :, IDENTITY] = -1
        return PolicyState(np.zeros((size, ROWS, FIELDS)), whole)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Evolved:
        """Return the policy with the constants of a file.

        Raises
        ------
        FileNotFoundError
            If there is none.
        ValueError
            If it is not such a file.
        """
        return cls(_read(Path(path)))


@cache
def shipped() -> tuple[float, ...]:
    """Return the constants that come with the package."""
    return _read(_SHIPPED)


def made(path: str | os.PathLike[str] = _SHIPPED) -> dict[str, Any]:
    """Return what made the constants of a file."""
    return dict(json.loads(Path(path).read_text(encoding="utf-8"))["made"])


def to_json(constants: npt.ArrayLike, made: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a file of constants; `made` says what made them."""
    vector = np.asarray(constants, float)
    blocks = {
        name: vector[block.first : block.first + int(np.prod(block.shape))].reshape(block.shape).tolist()
        for name, block in BLOCKS.items()
    }
    return {"schema": SCHEMA, "made": dict(made), "constants": blocks}


def _read(path: Path) -> tuple[float, ...]:
    cure = "make it anew with `teamsight evolve train`"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        schema, blocks = content["schema"], [content["constants"][name] for name in BLOCKS]
    except (KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: holds no constants of the learned rule ({error}); {cure}") from error
    if schema != SCHEMA:
        raise ValueError(f"{path}: has the schema {schema}, and this version reads {SCHEMA}; {cure}")
    parts = []
    for values, (name, block) in zip(blocks, BLOCKS.items(), strict=True):
        try:
            parts.append(np.array(values, float))
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {name}: {error}; {cure}") from None
        if parts[-1].shape != block.shape:
            raise ValueError(f"{path}: {name} has the shape {parts[-1].shape}, not {block.shape}; {cure}")
    return tuple(np.concatenate([part.ravel() for part in parts]).tolist())
