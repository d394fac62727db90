"""The layout of a record: the length, address or number that each word holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np


class Length(NamedTuple):
    """The length of one axis: the word `slot` of the record plus the number `plus`, or that number alone."""

    name: str  # in the annotation, without the leading dot; "" for a number alone
    slot: int  # the word that holds it; −1 for a number alone
    plus: int  # the number to add
    # If the length is the last element of an array: the slots of that array's address and of its length, and the
    # number to add to the latter.
    last: tuple[int, ...] = ()


class Leaf(NamedTuple):
    """One array or number of a record."""

    path: str  # within the record, as in ``percept.targets.start``
    slot: int  # the word that holds its address, or the number itself
    dtype: np.dtype[Any] | None  # of the elements or of the number; None for the address of an entry or a record
    lengths: tuple[Length, ...] | None  # of the array's axes; None for a number
    is_list: bool = False  # whether it is an array of addresses of records


class Node(NamedTuple):
    """A NamedTuple of a record: its class and its fields."""

    kind: type
    parts: tuple[Any, ...]

    def leaves(self) -> list[Leaf]:
        """Return all arrays and numbers, in the order of the fields."""
        return [leaf for part in self.parts for leaf in (part.leaves() if isinstance(part, Node) else [part])]


class Layout:
    """Assigns a word to each length, address and number."""

    def __init__(self, parts: Mapping[str, type] | None = None) -> None:
        self.size = 0
        # The NamedTuples that replace declared ones, by the path of the field.
        self._parts = parts or {}
        # The word of each length: by its name, or, if that is local, by the path of its NamedTuple and its name.
        self._slots: dict[str, int] = {}
        self._leaves: dict[str, Leaf] = {}

    def _next(self) -> int:
        self.size += 1
        return self.size - 1

    def node(self, kind: type, path: str, rules: dict[str, str]) -> Node:
        """Return the layout of a NamedTuple.

        Parameters
        ----------
        kind : type
            The NamedTuple.
        path : str
            The prefix of the names of its fields.
        rules : dict of str to str
            For the name of a length, the array whose last element is that length, as ``start[-1]``.
        """
        parts: list[Any] = []
        for name, hint in get_type_hints(kind, include_extras=True).items():
            inner, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
            where = f"{path}{name}"
            inner = self._parts.get(where, inner)
            if hasattr(inner, "_fields"):
                inside = dict(part.replace(" ", "").split("=") for part in notes)
                parts.append(self.node(inner, f"{where}.", inside))
                continue
            lengths = [self._length(note, path, rules) for note in notes if not isinstance(note, np.dtype)]
            self._leaves[where] = self._leaf(where, inner, notes, tuple(lengths))
            parts.append(self._leaves[where])
        return Node(kind, tuple(parts))

    def _leaf(self, path: str, kind: Any, notes: list[Any], lengths: tuple[Length, ...]) -> Leaf:
        if kind in (int, bool, float):
            return Leaf(path, self._next(), np.dtype(np.float64 if kind is float else np.int64), None)
        if get_origin(kind) is list:
            return Leaf(path, self._next(), np.dtype(np.int64), (self._length(".records", f"{path}.", {}),), True)
        if not notes:
            return Leaf(path, self._next(), None, None)
        dtype = notes[0] if isinstance(notes[0], np.dtype) else np.dtype(_scalar(kind))
        return Leaf(path, self._next(), dtype, lengths)

    def _length(self, note: Any, path: str, rules: dict[str, str]) -> Length:
        if isinstance(note, int):
            return Length("", -1, note)
        name, _, plus = note.replace(" ", "").partition("+")
        key = path + name if name.startswith(".") else name
        if key not in self._slots:
            self._slots[key] = self._next()
        last: tuple[int, ...] = ()
        if name in rules:
            array = self._leaves[path + rules[name].removesuffix("[-1]")]
            assert array.lengths is not None
            last = array.slot, array.lengths[0].slot, array.lengths[0].plus
        return Length(name.removeprefix("."), self._slots[key], int(plus or 0), last)


def _scalar(kind: Any) -> Any:
    """Return the scalar type of an array type; NumPy versions differ in whether ``NDArray[T]`` is an alias."""
    while arguments := get_args(kind):
        kind = arguments[-1]
    return kind
