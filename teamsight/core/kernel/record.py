"""Records: how Python hands arrays to compiled code.

An entry takes one number, the address of a record. A record is a row of 64-bit words: lengths, addresses of arrays and
plain numbers. What it holds is declared once, as a NamedTuple whose annotations give the shape of each array::

    class Shift(NamedTuple):
        position: Annotated[Floats, "bodies", 2]
        speed: Annotated[Floats, "bodies"]
        factor: float

    SHIFT = Record(Shift)
    shift_at = SHIFT.at                      # for kernels: the address of a record -> Shift
    packed = SHIFT.pack(Shift(position, speed, 2.0))
    Entry(kernel_that_calls_shift_at)(packed)

A length is a number, which the compiler knows; a name, which is the same number throughout the record; a name plus a
number, as in ``"bodies + 1"``; or a name that begins with a dot, which belongs to its own NamedTuple. A nested
NamedTuple annotated with ``".neighbours = start[-1]"`` has arrays as long as the last element of its array `start` says
at the time of the call. Without this annotation arrays are as long as they were packed.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Annotated, Any, Generic, NamedTuple, TypeVar, cast, get_args, get_origin, get_type_hints

import numba
import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from teamsight.core.kernel.intrinsics import array_value

T = TypeVar("T")

_WORD = ir.IntType(64)


class Length(NamedTuple):
    """The length of one axis: the word `slot` of the record, plus a number; or, without a slot, the number alone.

    Attributes
    ----------
    name : str
        The name in the annotation, without the leading dot; "" for a number alone.
    slot : int
        Which word holds it; −1 for a number alone.
    plus : int
        What is added.
    last : tuple of int
        Where the length is the last element of an array: the slot of that array's address and of its length, and what
        is added to the latter; otherwise empty.
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
        Its name with those of the NamedTuples around it, as in ``percept.targets.start``.
    slot : int
        Which word of the record holds its address, or the number itself.
    dtype : numpy.dtype or None
        The type of the array's elements, or of the number; None for the address of an entry or of another record.
    lengths : tuple of Length or None
        The lengths of the array's axes; None for a number.
    """

    path: str
    slot: int
    dtype: np.dtype[Any] | None
    lengths: tuple[Length, ...] | None


class Node(NamedTuple):
    """A NamedTuple of a record: its class and its fields."""

    kind: type
    parts: tuple[Any, ...]

    def leaves(self) -> list[Leaf]:
        """Return all arrays and numbers, in the order of the fields."""
        return [
            leaf for part in self.parts for leaf in (part.leaves() if isinstance(part, Node) else (part,))
        ]  # fmt: skip


class Packed(Generic[T]):
    """A record in memory. It keeps the arrays alive whose addresses it holds.

    Attributes
    ----------
    address : int
        Where the record lies; it never changes.
    value : NamedTuple
        The arrays and numbers that were packed.
    """

    def __init__(self, record: Record[T], value: T) -> None:
        self._record = record
        self._words = np.zeros(record.size, np.int64)
        self.address = int(self._words.ctypes.data)
        self.put(value)

    def put(self, value: T) -> None:
        """Replace everything that the record holds.

        Raises
        ------
        TypeError, ValueError
            If an array has another type or shape than declared; the record is then unchanged.
        """
        self._words[:], self._kept = self._record.words(value)
        self.value = value

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

    Attributes
    ----------
    at : kernel
        Return the NamedTuple for the address of a record. Arrays are views of the memory that was packed.
    size : int
        How many words a record has.
    """

    def __init__(self, kind: Callable[..., T]) -> None:
        builder = _Layout()
        self.node = builder.node(cast(type, kind), "", {})
        self.leaves = self.node.leaves()
        self.size = builder.size
        # A loop over the fields of nested tuples would take longer than all else in `words`.
        self._flat: Callable[[T], tuple[Any, ...]] = eval(f"lambda v: ({_places(self.node, 'v')})")
        self._plan, known = [], set[int]()
        for leaf in self.leaves:
            axes = None if leaf.lengths is None else [_axis(length, known) for length in leaf.lengths]
            self._plan.append((leaf, axes, leaf.dtype))
        # No T: in kernels, entries and other records are addresses.
        self.at: Callable[[Any], Any] = unpacking(self.node, Plain())

    def pack(self, value: T) -> Packed[T]:
        """Return a record of these arrays and numbers.

        Raises
        ------
        TypeError, ValueError
            If an array has another type or shape than declared.
        """
        return Packed(self, value)

    def words(self, value: T) -> tuple[list[int], list[Any]]:
        """Return the words of a record, and what must be kept alive."""
        # The last stands for the slot −1, that of a length which is a number alone.
        words = [0] * (self.size + 1)
        kept = list(self._flat(value))
        for at, (leaf, axes, dtype) in enumerate(self._plan):
            part = kept[at]
            if axes is None:
                words[leaf.slot] = _number(leaf, part)
                continue
            if isinstance(part, list):
                kept.append(part)
                part = kept[at] = np.array([record.address for record in part], np.int64)
            shape = part.shape
            if part.dtype != dtype or not part.flags.c_contiguous or len(shape) != len(axes):
                raise _misfit(leaf, part)
            for size, (slot, plus, is_first) in zip(shape, axes, strict=True):
                if is_first:
                    words[slot] = size - plus
                elif size != words[slot] + plus:
                    raise _misfit(leaf, part, words[slot] + plus)
            words[leaf.slot] = part.ctypes.data
        return words[:-1], kept


class _Layout:
    """Assigns a word to each length, address and number."""

    def __init__(self) -> None:
        self.size = 0
        self._shared: dict[str, int] = {}

    def _next(self) -> int:
        self.size += 1
        return self.size - 1

    def node(self, kind: type, path: str, rules: dict[str, str]) -> Node:
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
            return Leaf(path, self._next(), np.dtype(np.int64), (self._length(".records", {}, {}, done),))
        if not notes:
            return Leaf(path, self._next(), None, None)
        if isinstance(notes[0], np.dtype):
            dtype, notes = notes[0], notes[1:]
        else:
            dtype = np.dtype(get_args(get_args(kind)[1])[0])
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


def _places(node: Node, name: str) -> str:
    """Return Python for the arrays and numbers of a nested tuple, one after the other."""
    parts = [f"{name}[{at}]" for at in range(len(node.parts))]
    return "".join(
        _places(part, place) if isinstance(part, Node) else f"{place}, "
        for part, place in zip(node.parts, parts, strict=True)
    )


def _axis(length: Length, known: set[int]) -> tuple[int, int, bool]:
    """Return the slot of a length, what is added, and whether this axis is the first of this length."""
    is_first = length.slot >= 0 and length.slot not in known
    known.add(length.slot)
    return length.slot, length.plus, is_first


def _number(leaf: Leaf, value: Any) -> int:
    """Return the word for a number or an address."""
    if leaf.dtype is None:
        return 0 if value is None else int(value.address)
    if leaf.dtype.kind == "f":
        return int(struct.unpack("q", struct.pack("d", value))[0])
    return int(value)


def _misfit(leaf: Leaf, array: npt.NDArray[Any], wanted: int | None = None) -> Exception:
    """Return the error for an array that compiled code would misread."""
    if array.dtype != leaf.dtype or not array.flags.c_contiguous:
        return TypeError(f"{leaf.path}: is an array of {array.dtype}; it must be a dense one of {leaf.dtype}")
    lengths = leaf.lengths or ()
    names = ", ".join(f"{length.name} + {length.plus}" if length.name else str(length.plus) for length in lengths)
    limit = f", with an axis of {wanted}" if wanted is not None else ""
    return ValueError(f"{leaf.path}: has the shape {array.shape}; it must be ({names.replace(' + 0', '')}){limit}")


class Plain:
    """The arrays of a record as worlds read them; `guarded_record` has those that checks read."""

    code = ""

    def __repr__(self) -> str:
        # Part of the digest of kernels; the default names a place in memory.
        return f"{type(self).__name__}({self.code})"

    def kind(self, array: Any) -> Any:
        """Return numba's type of an array, from the plain one."""
        return array

    def value(self, context: Any, builder: Any, leaf: Leaf, kind: Any, array: Any, words: Any) -> Any:
        """Write code that makes an array of this kind from a plain one."""
        return array


def unpacking(node: Node, arrays: Any) -> Any:
    """Return the kernel that reads a record.

    Parameters
    ----------
    node : Node
        The layout.
    arrays : Plain
        What its arrays are.
    """
    # Text, so that the digest of kernels that read the record changes with the layout.
    layout = f"{node!r} {arrays.code}"

    def unpack(typing_context: Any, address: Any) -> Any:
        assert layout
        if not isinstance(address, numba.types.Integer):
            return None
        kind = _type(node, arrays)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            words = builder.inttoptr(arguments[0], _WORD.as_pointer())
            return _value(context, builder, words, node, kind, arrays)

        return kind(numba.types.int64), generate

    made = intrinsic(unpack)
    # Guarded copies of kernels read the same record in another way.
    made.node = node
    return made


def _type(part: Node | Leaf, arrays: Any) -> Any:
    """Return numba's type of a part of a record."""
    if isinstance(part, Node):
        types = [_type(inner, arrays) for inner in part.parts]
        return numba.types.BaseTuple.from_types(types, part.kind)
    if part.dtype is None:
        return numba.types.int64
    element = numba.from_dtype(part.dtype)
    if part.lengths is None:
        return element
    return arrays.kind(numba.types.Array(element, len(part.lengths), "C"))


def _value(context: Any, builder: Any, words: Any, part: Node | Leaf, kind: Any, arrays: Any) -> Any:
    """Write code that reads a part of a record."""
    if isinstance(part, Node):
        values = [
            _value(context, builder, words, inner, inner_kind, arrays)
            for inner, inner_kind in zip(part.parts, kind.types, strict=True)
        ]
        return context.make_tuple(builder, kind, values)
    word = load_word(builder, words, part.slot)
    if part.lengths is None:
        return builder.bitcast(word, ir.DoubleType()) if kind == numba.types.float64 else word
    lengths = [_length_value(builder, words, length) for length in part.lengths]
    value = array_value(context, builder, kind, word, lengths)
    return arrays.value(context, builder, part, kind, value, words)


def load_word(builder: Any, words: Any, slot: int) -> Any:
    """Write code that reads a word of a record."""
    return builder.load(builder.gep(words, [_WORD(slot)]))


def _length_value(builder: Any, words: Any, length: Length) -> Any:
    if length.slot < 0:
        return cgutils.intp_t(length.plus)
    if length.last:
        address, slot, plus = length.last
        array = builder.inttoptr(load_word(builder, words, address), _WORD.as_pointer())
        at = builder.add(load_word(builder, words, slot), _WORD(plus - 1))
        return builder.load(builder.gep(array, [at]))
    size = load_word(builder, words, length.slot)
    return builder.add(size, _WORD(length.plus)) if length.plus else size
