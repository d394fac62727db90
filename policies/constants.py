"""Policies whose rule is a vector of constants that a search found and a file keeps."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from teamsight.policies.compiled import CompiledPolicy

#: The shapes of the parts of a vector of constants by name, in order.
Blocks = Mapping[str, tuple[int, ...]]


SCHEMA = 1


def ends(blocks: Blocks) -> list[int]:
    """Return where each part ends in the vector; the last is the size of the vector."""
    return list(accumulate(math.prod(shape) for shape in blocks.values()))


@dataclass(frozen=True, repr=False)
class ConstantsPolicy(CompiledPolicy):
    """A policy whose kernel reads a vector of constants.

    Parameters
    ----------
    constants : sequence of float, optional
        The constants, in the order of `blocks`; by default those shipped.

    Attributes
    ----------
    blocks : mapping of str to tuple of int
        The shapes of the parts of the vector by name, in order.
    file : Path
        The file that ships.
    cure : str
        What makes such a file.
    spreads : mapping of str to float
        Standard deviations of the constants when a search begins, by the name of their part, where it is not 1.
    """

    constants: tuple[float, ...] = ()

    blocks: ClassVar[Blocks]
    file: ClassVar[Path]
    cure: ClassVar[str]
    spreads: ClassVar[Mapping[str, float]] = {}

    def __post_init__(self) -> None:
        super().__post_init__()
        given = np.array(self.constants if len(self.constants) else self.shipped(), float)
        size = ends(self.blocks)[-1]
        if given.shape != (size,):
            raise ValueError(f"constants: has the shape {given.shape}; it must be ({size},)")
        if not np.isfinite(given).all():
            raise ValueError(f"constants: number {int(np.argmin(np.isfinite(given)))} is not finite")
        object.__setattr__(self, "constants", tuple(given.tolist()))

    def __repr__(self) -> str:
        digest = hashlib.blake2b(np.array(self.constants).tobytes(), digest_size=4).hexdigest()
        return f"{type(self).__name__}({'' if self.constants == self.shipped() else f'<{digest}>'})"

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.constants

    @classmethod
    @cache
    def shipped(cls) -> tuple[float, ...]:
        """Return the constants that ship with the package."""
        return cls._read(cls.file)

    @classmethod
    def beginning(cls, seed: int) -> npt.NDArray[np.float64]:
        """Return the constants with which a search begins: those that ship.

        Parameters
        ----------
        seed : int
            Seed of what is drawn.
        """
        return np.array(cls.shipped())

    @classmethod
    def deviations(cls) -> npt.NDArray[np.float64]:
        """Return the standard deviation of each constant when a search begins."""
        parts = [np.full(math.prod(shape), cls.spreads.get(name, 1.0)) for name, shape in cls.blocks.items()]
        return np.concatenate(parts)

    def content(self, made: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of a file of the constants; `made` describes how they were made."""
        parts = {name: part.tolist() for name, part in self.parts(self.constants).items()}
        return {"schema": SCHEMA, "made": dict(made), "constants": parts}

    @classmethod
    def parts(cls, constants: npt.ArrayLike) -> dict[str, npt.NDArray[np.float64]]:
        """Return the parts of a vector by name."""
        pieces = np.split(np.asarray(constants, float), ends(cls.blocks)[:-1])
        return {name: piece.reshape(shape) for piece, (name, shape) in zip(pieces, cls.blocks.items(), strict=True)}

    @classmethod
    def vector(cls, parts: Mapping[str, Any]) -> tuple[float, ...]:
        """Return the vector of parts given by name.

        Raises
        ------
        KeyError
            If one is missing.
        ValueError
            If one has another shape, or holds what is no number.
        """
        found = []
        for name, shape in cls.blocks.items():
            try:
                found.append(np.array(parts[name], float))
            except (TypeError, ValueError) as error:
                raise ValueError(f"{name}: {error}") from None
            if found[-1].shape != shape:
                raise ValueError(f"{name} has the shape {found[-1].shape}, not {shape}")
        return tuple(np.concatenate([part.ravel() for part in found]).tolist())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Return the policy with the constants in a file.

        Raises
        ------
        FileNotFoundError
            If the file does not exist.
        ValueError
            If it holds no constants.
        """
        return cls(cls._read(Path(path)))

    @classmethod
    def _read(cls, path: Path) -> tuple[float, ...]:
        try:
            return cls.vector(cls._content(json.loads(path.read_text(encoding="utf-8"))))
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path}: holds no constants of {cls.__name__} ({error}); {cls.cure}") from error

    @classmethod
    def _content(cls, content: Any) -> Mapping[str, Any]:
        """Return the parts in the content of a file."""
        schema = content.get("schema", SCHEMA)
        if schema != SCHEMA:
            raise ValueError(f"has the schema {schema}, but this version reads {SCHEMA}")
        found: Mapping[str, Any] = content["constants"]
        return found
