"""Records whose arrays are guarded, for the checks of policies, degrees of awareness and arenas."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from llvmlite import ir

from teamsight.core.kernel.digest import digest
from teamsight.core.kernel.guard import LIMIT, READ_ONLY, VERSION, guarded_type, numbered
from teamsight.core.kernel.guarded_arrays import Axis, Named
from teamsight.core.kernel.layout import Leaf, Node
from teamsight.core.kernel.record import Record
from teamsight.core.kernel.unpacking import load_word, unpacking

_WORD = ir.IntType(64)


class GuardedRecord:
    """The code that reads a record with guarded arrays, and their names in errors.

    Parameters
    ----------
    record : Record
        The record.
    writable : tuple of str
        Prefixes of the paths of the arrays that a kernel may write; all others are read-only.
    axes : mapping of str to Axis
        The axis for each name of a length, or path and name as in ``"noise lanes"``; the key ``"2"`` is for axes of
        that fixed length.
    limits : mapping of str to str, optional
        For a path, the name of a length shorter than the last axis, beyond which elements must not be used.

    Attributes
    ----------
    at : kernel
        Returns the NamedTuple for the address of a record; its arrays are guarded.
    arrays : list of Named
        The arrays by number, for `run_guarded`.
    """

    def __init__(
        self,
        record: Record[Any],
        writable: tuple[str, ...],
        axes: Mapping[str, Axis],
        limits: Mapping[str, str] | None = None,
    ) -> None:
        leaves = [leaf for leaf in record.node.leaves() if leaf.lengths is not None]
        self.arrays = [Named("an array of its own", ())] + [_named(leaf, axes) for leaf in leaves]
        slots = {length.name: length.slot for leaf in leaves for length in leaf.lengths or ()}
        limiting = {path: slots[name] for path, name in (limits or {}).items()}
        numbers = {
            leaf.path: (number + (0 if leaf.path.startswith(writable) else READ_ONLY), limiting.get(leaf.path, -1))
            for number, leaf in enumerate(leaves, 1)
        }
        self.at = unpacking(record.node, Guards(numbers))


def _named(leaf: Leaf, axes: Mapping[str, Axis]) -> Named:
    found = []
    for length in leaf.lengths or ():
        key = f"{length.name} + {length.plus}" if length.name and length.plus else length.name or str(length.plus)
        found.append(axes[f"{leaf.path} {key}"] if f"{leaf.path} {key}" in axes else axes[key])
    return Named(leaf.path, tuple(found))


def guarded_at(node: Node) -> Any:
    """Return the kernel that reads a record in guarded copies of kernels."""
    return unpacking(node, Guards({}))


class Guards:
    """Makes the arrays of a record guarded.

    Parameters
    ----------
    numbers : dict of str to tuple
        For each array's path: its number, with `READ_ONLY` if it is, and the word that limits its last axis, or −1. An
        array that is missing here has the number 0.
    """

    def __init__(self, numbers: dict[str, tuple[int, int]]) -> None:
        self._numbers = numbers

    def __repr__(self) -> str:
        # Part of the digest of kernels, since the checks are part of the machine code.
        return f"{VERSION} {digest(Guards.value)} {self._numbers}"

    def kind(self, array: Any) -> Any:
        """Return numba's type of a guarded array, from that of the plain one."""
        return guarded_type(array)

    def value(self, context: Any, builder: Any, leaf: Leaf, kind: Any, array: Any, words: Any) -> Any:
        """Write code that makes a guarded array of this type from a plain one."""
        number, limit = self._numbers.get(leaf.path, (0, -1))
        flags: Any = _WORD(number)
        if limit >= 0:
            flags = builder.add(flags, builder.mul(load_word(builder, words, limit), _WORD(LIMIT)))
        return numbered(context, builder, kind, array, flags)
