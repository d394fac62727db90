"""Tables: structs of arrays. A column is declared once; then all that adds, removes, saves or resets rows knows it."""

from __future__ import annotations

import copy
import math
from collections.abc import Collection, Iterable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

# Rows for which a table has room when it first grows, unless they take more bytes than this.
_SPARE, _MOST_SPARE_BYTES = 128, 2**24


class Field(NamedTuple):
    """The declaration of a column.

    Attributes
    ----------
    name : str
        Its name.
    dtype : dtype
        The type of its elements.
    shape : tuple of int
        The shape of an element.
    fill : object
        The element of new rows to which none is given.
    reset : {"keep", "fill", "first"}
        What a reset makes of it: nothing, its fill, or the element with which the row began.
    unit : str
        The unit of its elements, for people.
    has_fill : bool
        Whether new rows may have the fill; if not, each must be given an element.
    """

    name: str
    dtype: npt.DTypeLike = np.float64
    shape: tuple[int, ...] = ()
    fill: Any = 0
    reset: Literal["keep", "fill", "first"] = "keep"
    unit: str = ""
    has_fill: bool = True


class Table:
    """Named columns with one row for each agent, event or step, and room for more rows.

    A column is an attribute, an array of shape (rows, …): a view that is valid until rows are added or removed. Its
    memory stays where it is as long as there is room for all rows, so that compiled code may keep its address; only
    `arrange`, and `declare` of a column that is there, move it.

    Parameters
    ----------
    fields : iterable of Field
        The columns.
    rows : int
        The number of rows, which begin with the fills.
    room : int
        The number of rows for which there is room, if more.
    """

    def __init__(self, fields: Iterable[Field] = (), rows: int = 0, *, room: int = 0) -> None:
        self._fields: dict[str, Field] = {}
        self._arrays: dict[str, Array] = {}
        self._rows, self._room = rows, max(rows, room)
        # How often columns have come or moved, and what `reset` writes, as of one of these times.
        self._changes = 0
        self._resets: tuple[Any, list[tuple[Array, Any]], list[tuple[Array, Array]]] | None = None
        for field in fields:
            self.declare(field)

    def __len__(self) -> int:
        return self._rows

    def __contains__(self, name: object) -> bool:
        return name in self._fields

    def __getitem__(self, name: str) -> Array:
        # For names that are no attributes, as of a column of the user's.
        view = self.__dict__.get(name)
        return self.__getattr__(name) if view is None else view

    # Called where there is no view yet since rows were added or removed.
    def __getattr__(self, name: str) -> Array:
        arrays = self.__dict__.get("_arrays", {})
        if name not in arrays:
            raise AttributeError(f"the table has no column {name!r}, but {', '.join(arrays) or 'none'}")
        view: Array = arrays[name][: self._rows]
        self.__dict__[name] = view
        return view

    @property
    def fields(self) -> dict[str, Field]:
        """The declarations of the columns, by name."""
        return self._fields

    @property
    def room(self) -> int:
        """The number of rows for which there is room."""
        return self._room

    def whole(self, name: str) -> Array:
        """Return a column with all room, shape (room, …)."""
        return self._arrays[name]

    def declare(self, field: Field, values: npt.ArrayLike | None = None) -> Array:
        """Add a column, or replace it, with these elements or the fill; return it."""
        name, fill = field.name, field.fill
        array = np.zeros((self._room, *field.shape) if field.shape else self._room, field.dtype)
        self._fields[name], self._arrays[name] = field, array
        self._changes += 1
        self.__dict__[name] = view = array if self._rows == self._room else array[: self._rows]
        if values is not None:
            view[:] = values
        elif fill is not False and fill != 0:
            view[:] = fill
        return view

    def drop(self, *names: str) -> None:
        """Remove columns, if they are there."""
        for name in names:
            if name in self._fields:
                del self._fields[name], self._arrays[name]
                self.__dict__.pop(name, None)

    def append(self, count: int, given: Mapping[str, Any]) -> bool:
        """Add rows with these elements, or the fills; return whether columns were moved to make room."""
        first, last = self._rows, self._rows + count
        is_moved = self.make_room(count)
        arrays = self._arrays
        for name, field in self._fields.items():
            arrays[name][first:last] = given.get(name, field.fill)
        self._resize(last)
        return is_moved

    def make_room(self, count: int, *, most_spare: int | None = _MOST_SPARE_BYTES) -> bool:
        """Make room for this many more rows, and some to spare, of so many bytes; return whether columns moved."""
        rows = self._rows + count
        if rows <= self._room:
            return False
        size = sum(array.dtype.itemsize * math.prod(array.shape[1:]) for array in self._arrays.values())
        spare = max(rows, _SPARE)
        rows += spare if most_spare is None else min(spare, most_spare // max(size, 1))
        for name, array in self._arrays.items():
            longer = np.zeros((rows, *array.shape[1:]), array.dtype)
            longer[: self._rows] = array[: self._rows]
            self._arrays[name] = longer
        self._room = rows
        self._resize(self._rows)
        return True

    def remove(self, row: int) -> None:
        """Leave out one row; where columns are stays."""
        last = self._rows - 1
        for array in self._arrays.values():
            array[row:last] = array[row + 1 : last + 1]
        self._resize(last)

    def count(self, rows: int) -> None:
        """Have so many rows, since compiled code has written them into the room."""
        self._resize(rows)

    def cut(self, rows: int) -> None:
        """Leave out all rows from this one on."""
        self._resize(min(rows, self._rows))

    def arrange(self, index: npt.NDArray[np.int64]) -> None:
        """Put other rows in place of the present: copies of those at these indices, and new ones at −1."""
        before, rows, is_old = self._arrays, len(index), index >= 0
        self._arrays, self._room = {}, max(self._room, rows)
        for name, field in self._fields.items():
            array = np.zeros((self._room, *field.shape), field.dtype)
            array[:rows][~is_old] = field.fill
            array[:rows][is_old] = before[name][index[is_old]]
            self._arrays[name] = array
        self._resize(rows)

    def copy(self) -> Table:
        """Return a copy, with arrays of its own."""
        other = Table()
        other._rows = other._room = self._rows
        for name, field in self._fields.items():
            array = self[name]
            # Objects are copied too.
            other._arrays[name] = copy.deepcopy(array) if array.dtype == np.object_ else array.copy()
            other._fields[name] = field
        return other

    def assign(self, other: Table) -> None:
        """Be as another table: its rows and its columns, and no others. Columns stay where they are if they fit."""
        self.drop(*(name for name in list(self._fields) if name not in other))
        self._rows = min(self._rows, len(other))
        self.make_room(len(other) - self._rows, most_spare=0)
        self._resize(len(other))
        self.write(other)

    def write(self, other: Table, *, but: Collection[str] = ()) -> None:
        """Take the columns of another table with as many rows, `but` these; those that it does not have stay."""
        for name, field in other._fields.items():
            if name in but:
                continue
            if name in self._fields and field[:3] == self._fields[name][:3]:
                self[name][:] = other[name]
                self._fields[name] = field
                self._changes += 1
            else:
                self.declare(field, other[name])

    def reset(self, first: Table, member: Array | slice) -> None:
        """Let all columns be as their declarations say; `first` has the elements with which each `member` begins."""
        state = first, first._changes, self._changes
        if self._resets is None or self._resets[0] != state:
            # Listed once, since thousands of short runs begin with it.
            by_rule = {rule: [one for one in self._fields.values() if one.reset == rule] for rule in ("fill", "first")}
            fills = [(self[one.name], one.fill) for one in by_rule["fill"]]
            self._resets = state, fills, [(self[one.name], first[one.name]) for one in by_rule["first"]]
        _, fills, firsts = self._resets
        for column, fill in fills:
            column[...] = fill
        for column, values in firsts:
            column[...] = values[member]

    def _resize(self, rows: int) -> None:
        """Have so many rows; views of columns are made anew when they are used."""
        if rows > self._room:
            raise ValueError(f"rows={rows}: there is room for {self._room}; make more with make_room")
        self._rows, views = rows, self.__dict__
        self._changes += 1
        for name in self._arrays:
            views.pop(name, None)

    def __deepcopy__(self, memo: Any) -> Table:
        return self.copy()

    def __getstate__(self) -> dict[str, Any]:
        return {"fields": self._fields, "columns": {name: self[name] for name in self._fields}, "rows": self._rows}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__((), state["rows"])  # type: ignore[misc]
        for name, field in state["fields"].items():
            self.declare(field, state["columns"][name])
