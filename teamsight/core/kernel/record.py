"""Records: how arrays are passed from Python to compiled code.

An entry takes one number, the address of a record. A record is a row of 64-bit words: lengths, addresses of arrays and
plain numbers. Its content is declared once, as a NamedTuple whose annotations give the shape of each array::

    class Shift(NamedTuple):
        position: Annotated[Floats, "bodies", 2]
        speed: Annotated[Floats, "bodies"]
        factor: float

    SHIFT = Record(Shift)
    shift_at = SHIFT.at                      # for kernels: the address of a record -> Shift
    packed = SHIFT.pack(Shift(position, speed, 2.0))
    Entry(kernel_that_calls_shift_at)(packed)

A length is a number, fixed at compile time; a name, which means the same length throughout the record; a name plus a
number, as in ``"bodies + 1"``; or a name that begins with a dot, which is local to its own NamedTuple. If a nested
NamedTuple is annotated with ``".neighbours = start[-1]"``, that length is the last element of its array `start` at the
time of the call; otherwise it is that of the array when it was packed.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar, cast

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel.layout import Layout, Leaf, Node
from teamsight.core.kernel.unpacking import unpacking

T = TypeVar("T")


class Packed(Generic[T]):
    """A record in memory. It keeps a reference to each array whose address it holds.

    Attributes
    ----------
    address : int
        The address of the record; it never changes.
    value : NamedTuple
        The arrays and numbers that were packed.
    words : ndarray, shape (words,), int64
        Its memory; see `teamsight.core.kernel.window`.
    """

    def __init__(self, record: Record[T], value: T) -> None:
        self._record = record
        self.words = np.zeros(record.size, np.int64)
        self.address = int(self.words.ctypes.data)
        self.put(value)

    def put(self, value: T) -> None:
        """Replace the whole content of the record.

        Raises
        ------
        TypeError, ValueError
            If an array has another type or shape than declared; the record is then unchanged.
        """
        self.words[:], self._kept = self._record.words(value)
        self.value = value

    @property
    def leaves(self) -> list[Leaf]:
        """The layout of its arrays and numbers."""
        return self._record.node.leaves()

    def update(self, **fields: Any) -> None:
        """Replace some fields, as `put` does."""
        self.put(self.value._replace(**fields))  # type: ignore[attr-defined]


class Record(Generic[T]):
    """The layout of a NamedTuple in memory, and the code that reads it.

    Parameters
    ----------
    kind : type
        A NamedTuple whose fields are arrays annotated with their lengths, numbers (`int`, `float`, `bool`), nested
        NamedTuples, and addresses: `Packed` for one record, ``list[Packed]`` for an array of addresses of records,
        `Entry` for a compiled function; None is the address 0.
    parts : mapping of str to type, optional
        NamedTuples to use instead of those in the annotations, by the path of the field, as in ``percept.channels``.

    Attributes
    ----------
    at : kernel
        Returns the NamedTuple for the address of a record. Its arrays are views of those that were packed.
    size : int
        The number of words of a record.
    """

    def __init__(self, kind: Callable[..., T], parts: Mapping[str, type] | None = None) -> None:
        builder = Layout(parts)
        self.node = builder.node(cast(type, kind), "", {})
        self.size = builder.size
        self.words: Callable[[T], tuple[list[int], tuple[Any, ...]]] = _packing(self.node, self.size)
        # No T: in kernels, entries and other records are addresses.
        self.at: Callable[[Any], Any] = unpacking(self.node)

    def pack(self, value: T) -> Packed[T]:
        """Return a record of these arrays and numbers; raises what `Packed.put` raises."""
        return Packed(self, value)


def _packing(node: Node, size: int) -> Callable[[Any], tuple[list[int], tuple[Any, ...]]]:
    """Return the function that turns a NamedTuple into the words of a record and the arrays to keep alive.

    The function is generated without loops, which is twice as fast: building a world packs hundreds of arrays.
    """
    lines, known = ["def words(value):"], set[int]()
    leaves = node.leaves()
    names: dict[str, Any] = {"leaves": leaves, "number": _number, "addresses": _addresses, "misfit": _misfit}
    for at, leaf in enumerate(leaves):
        lines.append(f"a{at} = value.{leaf.path}")
        if leaf.lengths is None:
            lines.append(f"w{leaf.slot} = number(leaves[{at}], a{at})")
            continue
        if leaf.is_list:
            lines.append(f"b{at}, a{at} = a{at}, addresses(a{at})")
        wrong = f"raise misfit(leaves[{at}], a{at})"
        names[f"t{at}"] = leaf.dtype
        fits = f"a{at}.dtype == t{at} and a{at}.ndim == {len(leaf.lengths)} and a{at}.flags.c_contiguous"
        lines += [f"if not ({fits}): {wrong}", f"shape = a{at}.shape"]
        for axis, length in enumerate(leaf.lengths):
            if length.slot >= 0 and length.slot not in known:
                known.add(length.slot)
                lines.append(f"w{length.slot} = shape[{axis}] - {length.plus}")
        sizes = [f"w{length.slot} + {length.plus}" if length.slot >= 0 else f"{length.plus}" for length in leaf.lengths]
        lines += [f"if shape != ({', '.join(sizes)},): {wrong}", f"w{leaf.slot} = a{at}.ctypes.data"]
    kept = [f"a{at}" for at in range(len(leaves))] + [f"b{at}" for at, leaf in enumerate(leaves) if leaf.is_list]
    lines.append(f"return [{', '.join(f'w{slot}' for slot in range(size))}], ({', '.join(kept)},)")
    exec("\n    ".join(lines), names)
    return cast(Callable[[Any], tuple[list[int], tuple[Any, ...]]], names["words"])


def _addresses(records: list[Packed[Any]]) -> npt.NDArray[np.int64]:
    return np.array([record.address for record in records], np.int64)


def _number(leaf: Leaf, value: Any) -> int:
    if leaf.dtype is None:
        return 0 if value is None else int(value.address)
    if leaf.dtype.kind == "f":
        return int(struct.unpack("q", struct.pack("d", value))[0])
    return int(value)


def _misfit(leaf: Leaf, array: npt.NDArray[Any]) -> Exception:
    """Return the error for an array that compiled code would misread."""
    if array.dtype != leaf.dtype or not array.flags.c_contiguous:
        return TypeError(f"{leaf.path}: is an array of {array.dtype}; it must be a C-contiguous array of {leaf.dtype}")
    names = [f"{length.name} + {length.plus}" if length.name else str(length.plus) for length in leaf.lengths or ()]
    shape = ", ".join(names).replace(" + 0", "")
    return ValueError(f"{leaf.path}: has the shape {array.shape}; it must be ({shape}), to match the other arrays")
