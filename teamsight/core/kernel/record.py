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
time of the call; otherwise it is that of the array when it was packed. With `READ_ONLY` beside the lengths, a kernel
that writes into the array does not compile.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Collection, Iterable, Mapping
from operator import attrgetter
from typing import Annotated, Any, Generic, NamedTuple, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel.parts import Intrinsic, inlined

#: In the annotation of an array: kernels must not write into it.
READ_ONLY = object()


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
    is_read_only: bool = False  # whether kernels must not write into it


class Node(NamedTuple):
    """A NamedTuple of a record: its class and its fields."""

    kind: type
    parts: tuple[Any, ...]


def _scalar(kind: Any) -> Any:
    """Return the scalar type of an array type; NumPy versions differ in whether ``NDArray[T]`` is an alias."""
    while arguments := get_args(kind):
        kind = arguments[-1]
    return kind


_NO_BYTES = ctypes.c_char * 0


def address_of(array: npt.NDArray[Any]) -> int:
    """Return the address of the first element of a contiguous array, in a quarter of the time of ``ctypes.data``."""
    try:
        return ctypes.addressof(_NO_BYTES.from_buffer(array))  # type: ignore[arg-type]
    except TypeError:
        # A read-only array, which is no such buffer.
        return int(array.ctypes.data)


T = TypeVar("T")


class Packed(Generic[T]):
    """A record in memory. It keeps a reference to each array whose address it holds.

    Attributes
    ----------
    address : int
        The address of the record; it never changes.
    words : ndarray, shape (words,), int64
        Its memory; see `Window`.
    record : Record
        The layout.
    """

    def __init__(self, record: Record[T], value: T | None = None) -> None:
        self.record = record
        self.words = np.zeros(record.size, np.int64)
        self.address = address_of(self.words)
        if value is not None:
            self.put(value)

    def put(self, value: T) -> None:
        """Replace the whole content of the record.

        Raises
        ------
        TypeError, ValueError
            If an array has another type or shape than declared; the record is then unchanged.
        """
        self.words[:], self._kept = self.record.words(value, self.words)
        self._made: Callable[[], T] | None
        # Keeps alive what the record points to, but for the lists of addresses.
        self._value, self._made = value, None

    @property
    def value(self) -> T:
        """The arrays and numbers that were packed, or as they are now; see `follow`."""
        return self._value if self._made is None else self._made()

    def follow(self, made: Callable[[], T]) -> None:
        """Let `value` be what ``made()`` returns, since compiled code changes lengths and numbers of the record."""
        self._made = made

    def word(self, name: str) -> int:
        """Return the address of the word of a length or a number; see `Record.slots`."""
        return self.address + self.words.itemsize * self.record.slots[name]

    @property
    def leaves(self) -> list[Leaf]:
        """The layout of its arrays and numbers."""
        return [*self.record.leaves.values()]

    @property
    def slots(self) -> dict[str, int]:
        """The word of each length and of each number; see `Record.slots`."""
        return self.record.slots

    def update(self, **fields: Any) -> None:
        """Replace some fields, as `put` does; lengths that other fields have too must stay."""
        value = self.value._replace(**fields)  # type: ignore[attr-defined]
        slots, words = self.record.part(tuple(fields))
        self.words[slots], kept = words(value, self.words)
        self._value, self._made, self._kept = value, None, self._kept | kept


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
    leaves : dict of str to Leaf
        Its arrays and numbers, by path, in the order of the fields.
    slots : dict of str to int
        The word of each length, by its name (a local one after the path of its NamedTuple), and of each number.
    """

    def __init__(self, kind: Callable[..., T], parts: Mapping[str, type] | None = None) -> None:
        self.size = 0
        self._parts = parts or {}
        # The word of each length: by its name, or, if that is local, by the path of its NamedTuple and its name.
        self._lengths: dict[str, int] = {}
        self.leaves: dict[str, Leaf] = {}
        self.node = self._node(cast(type, kind), "", {})
        numbers = {path: leaf.slot for path, leaf in self.leaves.items() if leaf.lengths is None}
        self.slots = self._lengths | numbers
        self.words: Packing = _packing([*self.leaves.values()], range(self.size), ())
        self._packings: dict[tuple[str, ...], tuple[list[int], Packing]] = {}
        # No T: in kernels, entries and other records are addresses.
        self.at: Callable[[Any], Any] = Intrinsic(_content, self.node)

    def pack(self, value: T) -> Packed[T]:
        """Return a record of these arrays and numbers; raises what `Packed.put` raises."""
        return Packed(self, value)

    def part(self, fields: tuple[str, ...]) -> tuple[list[int], Packing]:
        """Return the words that depend on these fields alone, and the function that packs them."""
        if fields not in self._packings:
            changed = [leaf for leaf in self.leaves.values() if leaf.path.partition(".")[0] in fields]
            others = [leaf for leaf in self.leaves.values() if leaf not in changed]
            fixed = _lengths(changed) & _lengths(others)
            own = [leaf.slot for leaf in changed] + [*_lengths(changed) - fixed]
            self._packings[fields] = own, _packing(changed, own, fixed)
        return self._packings[fields]

    def _next(self) -> int:
        self.size += 1
        return self.size - 1

    def _node(self, kind: type, path: str, rules: dict[str, str]) -> Node:
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
            is_read_only = any(note is READ_ONLY for note in notes)
            notes = [note for note in notes if note is not READ_ONLY]
            where = f"{path}{name}"
            inner = self._parts.get(where, inner)
            if hasattr(inner, "_fields"):
                inside = dict(part.replace(" ", "").split("=") for part in notes)
                parts.append(self._node(inner, f"{where}.", inside))
                continue
            is_list, dtype = get_origin(inner) is list, None
            lengths: tuple[Length, ...] | None = None
            if inner in (int, bool, float):
                dtype = np.dtype(np.float64 if inner is float else np.int64)
            elif is_list:
                dtype, lengths = np.dtype(np.int64), (self._length(".records", f"{where}.", {}),)
            elif notes:
                dtype = notes[0] if isinstance(notes[0], np.dtype) else np.dtype(_scalar(inner))
                lengths = tuple(self._length(note, path, rules) for note in notes if not isinstance(note, np.dtype))
            self.leaves[where] = Leaf(where, self._next(), dtype, lengths, is_list, is_read_only)
            parts.append(self.leaves[where])
        return Node(kind, tuple(parts))

    def _length(self, note: Any, path: str, rules: dict[str, str]) -> Length:
        if isinstance(note, int):
            return Length("", -1, note)
        name, _, plus = note.replace(" ", "").partition("+")
        key = path + name if name.startswith(".") else name
        if key not in self._lengths:
            self._lengths[key] = self._next()
        last: tuple[int, ...] = ()
        if name in rules:
            array = self.leaves[path + rules[name].removesuffix("[-1]")]
            assert array.lengths is not None
            last = array.slot, array.lengths[0].slot, array.lengths[0].plus
        return Length(name.removeprefix("."), self._lengths[key], int(plus or 0), last)


def _lengths(leaves: list[Leaf]) -> set[int]:
    """Return the words that hold lengths of these leaves."""
    return {length.slot for leaf in leaves for length in leaf.lengths or () if length.slot >= 0}


#: Turns a NamedTuple, and the present words, into new words and the arrays to keep alive, by number.
Packing = Callable[[Any, Any], tuple[list[int], dict[int, Any]]]


def _content(record: Any) -> Any:
    """Return the content of a record, which plain Python passes in place of its address."""
    return record


def _packing(leaves: list[Leaf], slots: Iterable[int], fixed: Collection[int]) -> Packing:
    """Return the function that packs these leaves into the words `slots`; the `fixed` words, which are lengths, stay.

    The function is generated without loops, which is twice as fast: building a world packs hundreds of arrays.
    """
    lines, known = ["def words(value, present):"], {-1, *fixed}
    lines += [f"w{slot} = int(present[{slot}])" for slot in fixed]
    names: dict[str, Any] = {"leaves": leaves, "bits": _bits, "misfit": _misfit, "addresses": _addresses}
    names |= {"view": _NO_BYTES.from_buffer, "addressof": ctypes.addressof, "unusual": _unusual_address}
    for at, leaf in enumerate(leaves):
        lines.append(f"a{at} = value.{leaf.path}")
        if leaf.lengths is None:
            number = "0 if a{0} is None else int(a{0}.address)" if leaf.dtype is None else "int(a{0})"
            if leaf.dtype is not None and leaf.dtype.kind == "f":
                number = "bits(a{0})"
            lines.append(f"w{leaf.slot} = {number.format(at)}")
            continue
        if leaf.is_list:
            lines.append(f"b{at}, a{at} = a{at}, addresses(a{at})")
        wrong = f"raise misfit(leaves[{at}], a{at})"
        names[f"t{at}"] = leaf.dtype
        # Most have the very type, which is found sooner than an equal one.
        is_other = f"a{at}.dtype is not t{at} and a{at}.dtype != t{at}"
        lines += [f"shape = a{at}.shape", f"if {is_other} or len(shape) != {len(leaf.lengths)}: {wrong}"]
        wrong_sizes = []
        for axis, length in enumerate(leaf.lengths):
            plus = f" + {length.plus}" if length.plus else ""
            if length.slot not in known:
                known.add(length.slot)
                lines.append(f"w{length.slot} = shape[{axis}] - {length.plus}")
            else:
                size = f"w{length.slot}{plus}" if length.slot >= 0 else f"{length.plus}"
                wrong_sizes.append(f"shape[{axis}] != {size}")
        if wrong_sizes:
            lines.append(f"if {' or '.join(wrong_sizes)}: {wrong}")
        # As `address_of`, without a call.
        lines += [
            f"try: w{leaf.slot} = addressof(view(a{at}))",
            f"except TypeError: w{leaf.slot} = unusual(leaves[{at}], a{at})",
        ]
    kept = ", ".join(f"{leaf.slot}: (a{at}, b{at})" for at, leaf in enumerate(leaves) if leaf.is_list)
    lines.append(f"return [{', '.join(f'w{slot}' for slot in slots)}], {{{kept}}}")
    exec("\n    ".join(lines), names)
    return cast(Packing, names["words"])


def _addresses(records: list[Packed[Any]]) -> npt.NDArray[np.int64]:
    return np.array([record.address for record in records], np.int64)


def _unusual_address(leaf: Leaf, array: npt.NDArray[Any]) -> int:
    """Return the address of an array that cannot be written; refuse one whose elements are not in order."""
    if not array.flags.c_contiguous:
        raise _misfit(leaf, array)
    return address_of(array)


def _bits(value: Any) -> int:
    return int(struct.unpack("q", struct.pack("d", value))[0])


def _misfit(leaf: Leaf, array: npt.NDArray[Any]) -> Exception:
    """Return the error for an array that compiled code would misread."""
    if array.dtype != leaf.dtype or not array.flags.c_contiguous:
        return TypeError(f"{leaf.path}: is an array of {array.dtype}; it must be a C-contiguous array of {leaf.dtype}")
    names = [f"{length.name} + {length.plus}" if length.name else str(length.plus) for length in leaf.lengths or ()]
    shape = ", ".join(names).replace(" + 0", "")
    return ValueError(f"{leaf.path}: has the shape {array.shape}; it must be ({shape}), to match the other arrays")


Integers = npt.NDArray[np.int64]


class Window(NamedTuple):
    """How the words of a record change with the first row and the number of rows.

    Attributes
    ----------
    words : ndarray, shape (words,), int64
        The record itself. Writing into it shows its kernel other rows.
    length : int
        The word that holds the number of rows.
    moves : ndarray, shape (moves, 3), int64
        The words that depend on the first row: the word, its value for row 0, and its change from row to row.
    """

    words: Annotated[Integers, ".words"]
    length: int
    moves: Annotated[Integers, ".moves", 3]


def window(packed: Packed[Any], *, last_axis: tuple[str, ...] = ()) -> Window:
    """Return the window of a record over the axis whose length is called "n".

    Parameters
    ----------
    packed : Packed
        The record; it must not be replaced as long as the window is used.
    last_axis : tuple of str
        Arrays, by path, whose last axis has the rows too, under another name.
    """
    length, moves = -1, []
    for leaf in packed.leaves:
        if leaf.lengths and leaf.lengths[0].name == "n":
            length = leaf.lengths[0].slot
            moves.append(_move(packed, leaf, 0))
        elif leaf.path in last_axis:
            moves.append(_move(packed, leaf, -1))
    return Window(packed.words, length, np.array(moves, np.int64).reshape(-1, 3))


def _move(packed: Packed[Any], leaf: Leaf, axis: int) -> tuple[int, int, int]:
    """Return the word of an array's address, its value, and its change from one element of an axis to the next."""
    return leaf.slot, packed.words[leaf.slot], attrgetter(leaf.path)(packed.value).strides[axis]


@inlined
def move(words: Any, moves: Any, first: int) -> None:
    """Show rows from `first` on."""
    for at in range(moves.shape[0]):
        words[moves[at, 0]] = moves[at, 1] + first * moves[at, 2]


@inlined
def show_rows(window: Any, first: int, last: int) -> None:
    """Show rows `first` to `last` − 1."""
    move(window.words, window.moves, first)
    window.words[window.length] = last - first
