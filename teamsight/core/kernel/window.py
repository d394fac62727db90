"""Windows: a record shows a kernel only some consecutive rows of its arrays, without copying them.

A kernel that handles n robots, one row each, is called for robots a to b − 1 by moving the addresses in its record by
a rows and setting the length of the rows to b − a. This is done in compiled code, before each call.
"""

from __future__ import annotations

from operator import attrgetter
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel.decorators import inlined
from teamsight.core.kernel.record import Packed

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


def window(packed: Packed[Any], *, last_axis: tuple[str, ...] = (), numbers: tuple[str, ...] = ()) -> Window:
    """Return the window of a record over the axis whose length is called "n".

    Parameters
    ----------
    packed : Packed
        The record; it must not be replaced as long as the window is used.
    last_axis : tuple of str
        Arrays, by path, whose last axis has the rows too, under another name.
    numbers : tuple of str
        Numbers, by path, that are those of the first row and grow by 1 from row to row.
    """
    length, moves = -1, []
    for leaf in packed.leaves:
        if leaf.path in numbers:
            moves.append((leaf.slot, packed.words[leaf.slot], 1))
            continue
        if not leaf.lengths:
            continue
        array: npt.NDArray[Any] = attrgetter(leaf.path)(packed.value)
        if leaf.lengths[0].name == "n":
            length = leaf.lengths[0].slot
            moves.append((leaf.slot, packed.words[leaf.slot], array.itemsize * int(np.prod(array.shape[1:]))))
        elif leaf.path in last_axis:
            moves.append((leaf.slot, packed.words[leaf.slot], array.itemsize))
    return Window(packed.words, length, np.array(moves, np.int64).reshape(-1, 3))


def entry_moves(packed: Packed[Any], path: str) -> Integers:
    """Return the moves to show a neighbour list of a record, given by its path, from one of its entries on."""
    moves = []
    for leaf in packed.leaves:
        if leaf.path.startswith(f"{path}.") and leaf.lengths and leaf.lengths[0].name == "k":
            array: npt.NDArray[Any] = attrgetter(leaf.path)(packed.value)
            moves.append((leaf.slot, packed.words[leaf.slot], array.itemsize * int(np.prod(array.shape[1:]))))
            room = leaf.lengths[0].slot, packed.words[leaf.lengths[0].slot], -1
    return np.array([*moves, room], np.int64)


@inlined
def move(words: Any, moves: Any, first: int) -> None:
    """Show rows, or entries, from `first` on."""
    for at in range(moves.shape[0]):
        words[moves[at, 0]] = moves[at, 1] + first * moves[at, 2]


@inlined
def show_rows(window: Any, first: int, last: int) -> None:
    """Show rows `first` to `last` − 1."""
    move(window.words, window.moves, first)
    window.words[window.length] = last - first
