"""The evolved policy, and the file format of its constants."""

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
from teamsight.policies.evolved.layout import BLOCKS, SIZE, parts
from teamsight.policies.evolved.rule import decide
from teamsight.policies.evolved.senses import FIELDS, ROWS, TRACKS
from teamsight.policies.handmade.target_tracks import no_target_tracks
from teamsight.policies.interface import PolicyState

SCHEMA = 1

_SHIPPED = Path(__file__).with_name("constants.json")
_CURE = "make it again with `teamsight evolve train`"
_MADE = {"command": str, "trials": int, "robot_steps": int, "version": str}


@dataclass(frozen=True, repr=False)
class Evolved(CompiledPolicy):
    """Observe targets by evolved forces, with memories of targets, teammates, the own trail and the ground.

    Each target and each teammate exerts a force. A piecewise linear law and a small network compute its strength from
    its distance, the distance of teammates from it, whether it moves away, how many other targets are near it, how
    crowded the place was recently, and the size of the known ground. Five further forces come from the memories. The
    policy was evolved under `RingAwareness(16)` and runs under every degree that shows teammates. Without teammates it
    would observe less than a random walk, and is refused.

    Parameters
    ----------
    constants : sequence of float, optional
        The `SIZE` constants of the policy, see `teamsight.policies.evolved.layout`; by default those shipped.

    Raises
    ------
    ValueError
        If there are not `SIZE` of them, or one is not finite.

    Notes
    -----
    *Source:* none; the evolution starts with Parker's forces. Made by ``teamsight evolve train``; see
    docs/evolved.md. A robot handles at most 16 targets, sensed or remembered. It reads odometry (``percept.moved``)
    and a compass, the heading in the world's frame.
    """

    constants: tuple[float, ...] = ()

    kernel = decide
    draws = 2
    needs = ("teammates",)

    def __post_init__(self) -> None:
        given = np.array(self.constants if len(self.constants) else shipped(), float)
        if given.shape != (SIZE,):
            raise ValueError(f"constants: has the shape {given.shape}; it must be ({SIZE},)")
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
        return no_target_tracks(size, TRACKS)._replace(floats=np.zeros((size, ROWS, FIELDS)))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Evolved:
        """Return the policy with the constants in a file.

        Raises
        ------
        FileNotFoundError
            If the file does not exist.
        ValueError
            If it holds no constants.
        """
        return cls(_read(Path(path)))


@cache
def shipped() -> tuple[float, ...]:
    """Return the constants that ship with the package."""
    return _read(_SHIPPED)


def made(path: str | os.PathLike[str] = _SHIPPED) -> dict[str, Any]:
    """Return how the constants in a file were made: command, trials, robot_steps and version.

    Raises
    ------
    ValueError
        If the file does not say.
    """
    found = json.loads(Path(path).read_text(encoding="utf-8")).get("made")
    if not isinstance(found, dict) or any(type(found.get(name)) is not kind for name, kind in _MADE.items()):
        raise ValueError(f"{path}: does not say how the constants were made; {_CURE}")
    return found


def to_json(constants: npt.ArrayLike, made: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a file of constants; `made` describes how they were made."""
    blocks = {name: part.tolist() for name, part in parts(constants).items()}
    return {"schema": SCHEMA, "made": dict(made), "constants": blocks}


def _read(path: Path) -> tuple[float, ...]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        schema, blocks = content["schema"], [content["constants"][name] for name in BLOCKS]
    except (KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: holds no constants of the evolved policy ({error}); {_CURE}") from error
    if schema != SCHEMA:
        raise ValueError(f"{path}: has the schema {schema}, but this version reads {SCHEMA}; {_CURE}")
    found = []
    for values, (name, shape) in zip(blocks, BLOCKS.items(), strict=True):
        try:
            found.append(np.array(values, float))
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {name}: {error}; {_CURE}") from None
        if found[-1].shape != shape:
            raise ValueError(f"{path}: {name} has the shape {found[-1].shape}, not {shape}; {_CURE}")
    return tuple(np.concatenate([part.ravel() for part in found]).tolist())
