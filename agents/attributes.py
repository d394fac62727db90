"""Attributes of agents, groups and worlds: types of values, what assignment does, and the columns that users add.

The names are for completion in editors; a test compares them with the registries. Any other name of a policy or a
degree of awareness is a ``str``, so that it may come from a variable; a wrong one raises an error at once.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypeAlias, TypeVar, overload

import numpy as np
import numpy.typing as npt
from numpy.lib.mixins import NDArrayOperatorsMixin

from teamsight.agents.awareness.interface import Awareness
from teamsight.core import checks
from teamsight.core.card import shown
from teamsight.core.table import Field, Table
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import Rule

if TYPE_CHECKING:
    from teamsight.agents.group import Group

PolicyName: TypeAlias = Literal[
    "a-cmommt",
    "adaptive-forces",
    "b-cmommt",
    "centroid",
    "evasive",
    "evolved",
    "group-forces",
    "lattice-walk",
    "lazy-collective",
    "lazy-cooperative",
    "p-cmommt",
    "ppo",
    "random-walk",
    "stationary",
]
AwarenessName: TypeAlias = Literal["none", "ring", "nearest", "pairwise", "shared", "relayed"]
PlacementName: TypeAlias = Literal["uniform", "spread", "cells"]

PolicyLike: TypeAlias = Policy | Rule | PolicyName | str
AwarenessLike: TypeAlias = Awareness | AwarenessName | str


class Arrayed(Protocol):
    """An array, or what NumPy turns into one: a `Column`, or a column of a table."""

    def __array__(self) -> npt.NDArray[Any]:
        """Return the array."""
        ...


# As npt.ArrayLike, but without strings, so that type checkers refuse those.
Numbers: TypeAlias = float | Sequence[float] | Sequence[Arrayed] | Arrayed
Points: TypeAlias = Sequence[float] | Sequence[Sequence[float]] | Sequence[Arrayed] | Arrayed
Rows: TypeAlias = Sequence[int] | Arrayed

# What `numpy.random.default_rng` takes, as SPEC 7 of Scientific Python wants it of every `rng`.
SeedLike: TypeAlias = (
    int | Sequence[int] | npt.NDArray[np.integer[Any]] | np.random.SeedSequence | np.random.BitGenerator
    | np.random.Generator | np.random.RandomState | None
)  # fmt: skip


C = TypeVar("C", bound=type)
Got = TypeVar("Got", covariant=True)
Given = TypeVar("Given", contravariant=True)


class Setting(Generic[Got, Given]):
    """An attribute that one function reads and another changes. What may be assigned can be of more types.

    Parameters
    ----------
    get : callable
        ``get(owner, name)`` returns the value.
    change : callable
        ``change(owner, name, value)`` checks a new value and sets it, or raises an error.
    doc : str
        Its docstring.
    """

    def __init__(self, get: Callable[[Any, str], Got], change: Callable[[Any, str, Any], None], doc: str) -> None:
        self._get, self._change = get, change
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, holder: None, owner: type) -> Setting[Got, Given]: ...
    @overload
    def __get__(self, holder: object, owner: type) -> Got: ...
    def __get__(self, holder: Any, owner: type) -> Any:
        return self if holder is None else self._get(holder, self._name)

    def __set__(self, holder: Any, value: Given) -> None:
        self._change(holder, self._name, value)


def refusing(**cures: str) -> Callable[[C], C]:
    """Return a class decorator: assignments to these read-only properties raise an error with the cure.

    For type checkers, which do not see it, the properties stay read-only.
    """

    def decorate(owner: C) -> C:
        for name, cure in cures.items():
            found = next(vars(base)[name] for base in owner.__mro__ if name in vars(base))
            setattr(owner, name, found.setter(_refusal(name, cure)))
        return owner

    return decorate


def _refusal(name: str, cure: str) -> Callable[[Any, Any], None]:
    def refuse(self: Any, value: Any) -> None:
        raise AttributeError(f"{name}={checks.shown(value)}: cannot be set; {cure}")

    return refuse


class Kept:
    """An attribute that is put into the object's dictionary by `put`, and cannot be set.

    Without a `__get__`, so reading it costs nothing.
    """

    def __init__(self, cure: str) -> None:
        self._cure = cure

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __set__(self, owner: Any, value: Any) -> None:
        raise AttributeError(f"{self._name}={checks.shown(value)}: cannot be set; {self._cure}")


def put(owner: object, **values: Any) -> None:
    """Put attributes that are `Kept` into an object's dictionary."""
    vars(owner).update(values)


Array = npt.NDArray[Any]


class Column(NDArrayOperatorsMixin):
    """A property of the agents of a group, used like an array of shape (n, …).

    Each use reads or writes the elements of the agents that are then in the group. So, unlike an array, a column stays
    valid when agents are removed and states are restored.

    Parameters
    ----------
    columns : Columns
        The columns of the group.
    name : str
        Its name.
    """

    def __init__(self, columns: Columns, name: str) -> None:
        self._columns, self._name = columns, name

    @property
    def values(self) -> Array:
        """The present elements, shape (n, …): a view, valid until an agent is removed or a state is restored."""
        return self._columns.array(self._name)

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Array:
        values = self.values
        return np.array(values, dtype) if copy or dtype not in (None, values.dtype) else values

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **named: Any) -> Any:
        plain = [value.values if isinstance(value, Column) else value for value in inputs]
        out = named.get("out", ())
        if out:
            named["out"] = tuple(part.values if isinstance(part, Column) else part for part in out)
        changed = inputs[:1] if method == "at" else out
        with _kept_if_refused([part for part in changed if isinstance(part, Column)]):
            result = getattr(ufunc, method)(*plain, **named)
        return out[0] if len(out) == 1 else result

    def __getitem__(self, index: Any) -> Any:
        return self.values[index]

    def __setitem__(self, index: Any, value: Any) -> None:
        self._columns.assign(self._name, index, value)

    def __len__(self) -> int:
        return len(self.values)

    def __bool__(self) -> bool:
        return bool(self.values)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.values)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.values, name)

    def __repr__(self) -> str:
        return f"Column({self._name!r}, {self.values!r})"

    def _repr_html_(self) -> str | None:
        from teamsight.agents.group_card import column_html

        return shown(lambda: column_html(self._name, self.values))

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy is a plain array.
        return np.array, (self.values,)


def column_of(name: str) -> str:
    """Return the name under which a table holds a column of the user's, whose name may be that of another."""
    return f"own {name}"


class Columns(MutableMapping[str, Column]):
    """The columns of a group by name. Setting one assigns its elements.

    Parameters
    ----------
    group : str
        The name of the group, for errors.
    bodies : Table
        The table of the group, which holds them.
    changed : callable
        Called when a column comes or goes, since policies may read it.
    """

    def __init__(self, group: str, bodies: Table, changed: Callable[[], None]) -> None:
        self._group, self._bodies, self._changed = group, bodies, changed
        self._checks: dict[str, Callable[[Array], None]] = {}
        self._keepers: dict[str, str] = {}

    def keep(self, name: str, keeper: str, members: Table, fill: Any) -> None:
        """Note which interaction keeps a column: it stays, and members begin runs with what it holds now."""
        self._keepers[name] = keeper
        field = self._bodies.fields[column_of(name)]._replace(reset="first")
        self._bodies.fields[field.name] = field
        members.declare(field._replace(fill=fill))[self._bodies.member] = self.array(name)

    def array(self, name: str) -> Array:
        """Return the array that holds the present elements of a column."""
        if name not in self:
            have = ", ".join(self) or "none"
            raise KeyError(f"{name!r}: the group {self._group!r} has no such column; it has {have}")
        return self._bodies[column_of(name)]

    def assign(self, name: str, index: Any, value: Any) -> None:
        """Set elements of a column.

        Raises
        ------
        TypeError, ValueError
            If the column cannot hold the value, or its shape does not fit. Nothing is changed then.
        """
        array = self.array(name)
        self.check(name, value)
        try:
            _assign(name, array, index, value)
        except ValueError:
            size = len(array)
            raise ValueError(
                f"{name}={checks.shown(value)}: must be one value, or of the shape {np.shape(array[index])}; the group "
                f"{self._group!r} has {size} agent{'s' * (size != 1)}"
            ) from None

    def create(self, name: str, array: Array, *fill: Any) -> Column:
        """Add a column with these elements; `fill` is the element of agents that come later, if there is one."""
        given = fill[0] if fill else 0
        self._bodies.declare(
            Field(column_of(name), array.dtype, array.shape[1:], given, has_fill=bool(fill)), array
        )
        self._changed()
        return Column(self, name)

    def limit(self, name: str, check: Callable[[Array], None]) -> None:
        """Let ``check(values)`` refuse values of a column by an error."""
        self._checks[name] = check

    def check(self, name: str, value: Any) -> None:
        """Refuse a value that the column does not take; see `limit`."""
        if name in self._checks:
            self._checks[name](np.asarray(value))

    def of_new(self, count: int, given: Mapping[str, Any]) -> dict[str, Array]:
        """Return the elements of `count` new agents by the names of the table: those given, or the column's fill.

        Raises
        ------
        TypeError, ValueError
            If a column has no fill and no value is given, or the value does not fit.
        """
        elements: dict[str, Array] = {}
        for name in self:
            field = self._bodies.fields[column_of(name)]
            if name not in given and not field.has_fill:
                raise ValueError(
                    f"{name}: was added with one value for each agent, so it has none for new ones; give it, as in "
                    f"add(…, {name}=…)"
                )
            new = np.empty((count, *field.shape), field.dtype)
            value = given.get(name, field.fill)
            self.check(name, value)
            try:
                _assign(name, new, ..., value)
            except ValueError:
                raise ValueError(
                    f"{name}={checks.shown(value)}: must be one value, or {count}, one for each new agent"
                ) from None
            elements[field.name] = new
        return elements

    def arrays(self) -> dict[str, Array]:
        """Return the present arrays by name."""
        return {name: self.array(name) for name in self}

    def rules(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return copies of what is kept beside the table: checks and keepers."""
        return self._checks.copy(), self._keepers.copy()

    def put_rules(self, rules: tuple[dict[str, Any], dict[str, Any]]) -> None:
        """Go back to earlier `rules`."""
        self._checks, self._keepers = rules

    def __getitem__(self, name: str) -> Column:
        self.array(name)
        return Column(self, name)

    def __setitem__(self, name: str, value: Any) -> None:
        if name not in self:
            raise KeyError(f"{name!r}: the group {self._group!r} has no such column; make it with add_column({name!r})")
        self.assign(name, ..., value)

    def __delitem__(self, name: str) -> None:
        self.array(name)
        if name in self._keepers:
            raise ValueError(
                f"{name}: is kept by the interaction {self._keepers[name]}, which writes it in each step; build the "
                "world without it"
            )
        self._bodies.drop(column_of(name))
        self._checks.pop(name, None)
        self._changed()

    def __iter__(self) -> Iterator[str]:
        own = column_of("")
        return iter([name.removeprefix(own) for name in self._bodies.fields if name.startswith(own)])

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and column_of(name) in self._bodies


class Place(np.ndarray[Any, np.dtype[np.float64]]):
    """A read-only row of an array. ``agent.position += step`` makes a new row, which is then assigned."""

    def __iadd__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) + other

    def __isub__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) - other


def unwritable(row: npt.NDArray[Any]) -> Any:
    """Return a row of an array as a `Place`."""
    place = row.view(Place)
    place.flags.writeable = False
    return place


@contextlib.contextmanager
def _kept_if_refused(columns: list[Column]) -> Iterator[None]:
    """Let columns be changed in place; if one does not take its new values, all go back."""
    kept = [(column, column.values.copy()) for column in columns]
    yield
    try:
        for column, _ in kept:
            column._columns.check(column._name, column.values)
    except BaseException:
        for column, before in kept:
            column.values[...] = before
        raise


def _assign(name: str, array: Array, index: Any, value: Any) -> None:
    new = np.asarray(value)
    whole = array.dtype.kind in "iu" and new.dtype.kind in "iu"
    if not whole and array.dtype != object and not np.can_cast(new.dtype, array.dtype, "same_kind"):
        raise TypeError(
            f"{name}={checks.shown(value)}: the column has the type {array.dtype}, which cannot hold this value; "
            f"add the column with another fill, such as add_column({name!r}, {_fill_for(new)})"
        )
    array[index] = value


def _fill_for(values: Array) -> str:
    return {"f": "0.0", "c": "0j", "i": "0", "u": "0", "b": "False"}.get(values.dtype.kind, "None")


class ColumnAttribute:
    """An attribute of agents, or of groups, that is a column of some groups.

    In groups without the column it is an ordinary attribute of each agent, and groups do not have it.

    Parameters
    ----------
    name : str
        The name of the column.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, holder: Any, owner: type | None = None) -> Any:
        if holder is None:
            return self
        group, is_group = _group_of(holder)
        if self._name in group.columns:
            column = group.columns[self._name]
            if is_group:
                return column
            element = column[holder.row]
            return unwritable(element) if isinstance(element, np.ndarray) else element
        try:
            return vars(holder)[self._name]
        except KeyError:
            raise AttributeError(f"{holder!r} has no attribute or column {self._name!r}") from None

    def __set__(self, holder: Any, value: Any) -> None:
        group, is_group = _group_of(holder)
        if self._name in group.columns:
            group.columns[self._name][... if is_group else holder.row] = value
        elif is_group:
            raise AttributeError(f"{group!r} has no column {self._name!r}; make it with add_column({self._name!r})")
        else:
            holder.__dict__[self._name] = value

    def __delete__(self, holder: Any) -> None:
        group, is_group = _group_of(holder)
        if self._name in group.columns:
            raise AttributeError(f"{self._name}: is a column of {group.name!r}; remove it with del group.columns[…]")
        if is_group or holder.__dict__.pop(self._name, self) is self:
            raise AttributeError(self._name)


def new_column(group: Group, name: str, fill: Any) -> Column:
    """Add a column to a group; see `Group.add_column`."""
    if not isinstance(name, str) or not name:
        raise TypeError(f"name={name!r}: must be a string, such as 'battery'")
    if name in group.columns:
        raise ValueError(f"name={name!r}: the group {group.name!r} has this column; take another name")
    if not is_free(group, name):
        raise ValueError(f"name={name!r}: the agents of {group.name!r} have this attribute; take another name")
    value = np.asarray(fill)
    if value.dtype.kind in "US":
        # An array of strings would truncate longer ones.
        value = value.astype(object)
    if value.ndim and len(value) != len(group):
        raise ValueError(f"fill: has the shape {value.shape}; give one value, or {len(group)}, one for each agent")
    install(group, name)
    if value.ndim:
        return group.columns.create(name, np.array(value))
    return group.columns.create(name, np.full(len(group), value, value.dtype), value[()])


def install(group: Group, name: str) -> None:
    """Make a column an attribute of a group and of its agents."""
    if not isinstance(getattr(group.agent_class, name, None), ColumnAttribute):
        setattr(group.agent_class, name, ColumnAttribute(name))
    if not name.startswith("_") and not hasattr(group, name):
        setattr(type(group), name, ColumnAttribute(name))


def is_free(group: Group, name: str) -> bool:
    """Whether the agents of a group have no other attribute of this name, which a column would hide."""
    agents = group.agents
    # The class too: a group may be empty.
    known = (getattr(one, name, None) for one in {group.agent_class, *map(type, agents)})
    is_known = any(one is not None and not isinstance(one, ColumnAttribute) for one in known)
    return not is_known and not any(name in vars(agent) for agent in agents)


def _group_of(holder: Any) -> tuple[Group, bool]:
    """Return the group of an agent, or the given group; and whether a group was given."""
    group = vars(holder).get("group")
    return (holder, True) if group is None else (group, False)


def readonly(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a read-only view."""
    view = array.view()
    view.flags.writeable = False
    return view


def protected(value: Any) -> Any:
    """Return a percept, or a part of one, with read-only arrays."""
    return type(value)(*map(protected, value)) if isinstance(value, tuple) else readonly(value)
