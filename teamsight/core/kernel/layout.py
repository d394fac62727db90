"""The layout of a record: the length, address or number that each word holds."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np


class Length(NamedTuple):
    """The length of one axis: the word `slot` of the record plus the number `plus`, or that number alone.

    Attributes
    ----------
    name : str
        The name in the annotation, without the leading dot; "" for a number alone.
    slot : int
        The word that holds it; −1 for a number alone.
    plus : int
        The number to add.
    last : tuple of int
        If the length is the last element of an array: the slots of that array's address and of its length, and the
        number to add to the latter; otherwise empty.
    """

    name: str
    slot: int
    plus: int
    last: tuple[int, ...] = ()


class Leaf(NamedTuple):
    """One array or number of a record.

    Attributes
    ----------
    path : str
        Its name within the record, as in ``percept.targets.start``.
    slot : int
        The word of the record that holds its address, or the number itself.
    dtype : numpy.dtype or None
        The type of the array's elements, or of the number; None for the address of an entry or of another record.
    lengths : tuple of Length or None
        The lengths of the array's axes; None for a number.
    is_list : bool
        Whether it is an array of addresses of records.
    """

    path: str
    slot: int
    dtype: np.dtype[Any] | None
    lengths: tuple[Length, ...] | None
    is_list: bool = False


class Node(NamedTuple):
    """A NamedTuple of a record: its class and its fields."""

    kind: type
    parts: tuple[Any, ...]

    def leaves(self) -> list[Leaf]:
        """Return all arrays and numbers, in the order of the fields."""
        found: list[Leaf] = []
        for part in self.parts:
            found += part.leaves() if isinstance(part, Node) else [part]
        return found


class Layout:
    """Assigns a word to each length, address and number."""

    def __init__(self) -> None:
        self.size = 0
        self._shared: dict[str, int] = {}

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
        own: dict[str, int] = {}
        done: dict[str, Leaf] = {}
        parts: list[Any] = []
        for name, hint in get_type_hints(kind, include_extras=True).items():
            inner, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
            where = f"{path}{name}"
            if hasattr(inner, "_fields"):
                inside = dict(part.replace(" ", "").split("=") for part in notes)
                parts.append(self.node(inner, f"{where}.", inside))
                continue
            leaf = self._leaf(where, inner, notes, own, rules, done)
            done[name] = leaf
            parts.append(leaf)
        return Node(kind, tuple(parts))

    def _leaf(
        self, path: str, kind: Any, notes: list[Any], own: dict[str, int], rules: dict[str, str], done: Any
    ) -> Leaf:
        if kind in (int, bool, float):
            return Leaf(path, self._next(), np.dtype(np.float64 if kind is float else np.int64), None)
        if get_origin(kind) is list:
            return Leaf(path, self._next(), np.dtype(np.int64), (self._length(".records", {}, {}, done),), True)
        if not notes:
            return Leaf(path, self._next(), None, None)
        if isinstance(notes[0], np.dtype):
            dtype, notes = notes[0], notes[1:]
        else:
            dtype = np.dtype(_scalar(kind))
        return Leaf(path, self._next(), dtype, tuple(self._length(note, own, rules, done) for note in notes))

    def _length(self, note: Any, own: dict[str, int], rules: dict[str, str], done: dict[str, Leaf]) -> Length:
        if isinstance(note, int):
            return Length("", -1, note)
        name, _, plus = note.replace(" ", "").partition("+")
        slots = own if name.startswith(".") else self._shared
        if name not in slots:
            slots[name] = self._next()
        last: tuple[int, ...] = ()
        if name in rules:
            array = done[rules[name].removesuffix("[-1]")]
            assert array.lengths is not None
            last = array.slot, array.lengths[0].slot, array.lengths[0].plus
        return Length(name.removeprefix("."), slots[name], int(plus or 0), last)


def _scalar(kind: Any) -> Any:
    """Return the scalar type of an array type; NumPy versions differ in whether ``NDArray[T]`` is an alias."""
    while arguments := get_args(kind):
        kind = arguments[-1]
    return kind
