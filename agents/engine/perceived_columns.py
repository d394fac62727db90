"""Columns in percepts: properties of agents, and what policies show, copied into arrays by identity at each step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.group import Group
from teamsight.core.kernel import Entry, Packed, Record, array_at
from teamsight.policies.interface import Policy, PolicyState
from teamsight.policies.registry import label

Array = npt.NDArray[Any]
Integers = npt.NDArray[np.int64]

_KINDS = {np.dtype(np.float64): 0, np.dtype(np.int64): 1, np.dtype(np.bool_): 2}


class SourceArrays(NamedTuple):
    """Where the values of a group's agents are: a column, or a field of the state of a policy.

    Attributes
    ----------
    values : int
        The address of that of the first agent.
    stride : int
        The number of elements from one agent to the next.
    kind : int
        0 for float64, 1 for int64, 2 for bool.
    row : int
        The row of `PerceivedArrays.values`.
    identity : ndarray, shape (n,), int64
        The agents.
    policy : int
        The index of the policy that shows it; −1 for a column.
    choice : ndarray, shape (n,) or (0,), int64
        The policy of each agent; empty if all have the first.
    """

    values: int
    stride: int
    kind: int
    row: int
    identity: Annotated[Integers, "n"]
    policy: int
    choice: Annotated[Integers, "choices"]


SOURCE = Record(SourceArrays)
source_at = SOURCE.at


class PerceivedArrays(NamedTuple):
    """The record of all columns that policies read: values by identity, and where they come from."""

    values: Annotated[npt.NDArray[np.float64], "columns", "identities"]
    sources: list[Packed[SourceArrays]]


PERCEIVED = Record(PerceivedArrays)
perceived_at = PERCEIVED.at


def _show(address: int) -> int:
    here = perceived_at(address)
    here.values[:] = np.nan
    for number in range(here.sources.shape[0]):
        source = source_at(here.sources[number])
        size = source.identity.shape[0]
        elements = size * source.stride
        for i in range(size):
            if source.policy >= 0 and source.policy != (source.choice[i] if source.choice.shape[0] > 0 else 0):
                continue
            at = i * source.stride
            if source.kind == 0:
                value = array_at(source.values, elements, np.float64)[at]
            elif source.kind == 1:
                value = np.float64(array_at(source.values, elements, np.int64)[at])
            else:
                value = np.float64(array_at(source.values, elements, np.bool_)[at])
            here.values[source.row, source.identity[i]] = value
    return 0


SHOW_COLUMNS = Entry(_show)


class Found(NamedTuple):
    """A column, or what a policy shows; `array` has a row for each agent, and its last part are the values."""

    name: str
    array: Array
    offset: int
    policy: int


def bind_columns(groups: list[Group]) -> tuple[Packed[PerceivedArrays] | None, list[Array]]:
    """Bind the columns that the policies of these groups read, and show them in the groups' percepts.

    Returns
    -------
    Packed of PerceivedArrays, or None
        The argument of `SHOW_COLUMNS`; None if no policy reads any.
    list of ndarray
        The arrays whose addresses it holds.

    Raises
    ------
    ValueError
        If a policy reads a column that no group has.
    """
    found = {group.number: list(_of_group(group)) for group in groups}
    have = list(dict.fromkeys(one.name for of_group in found.values() for one in of_group))
    read = {group.number: _read_by(group, have) for group in groups}
    names = list(dict.fromkeys(name for of_group in read.values() for name in of_group))
    most = max((int(group.bodies.identity.max(initial=0)) for group in groups), default=0)
    values = np.full((len(names), most + 1), np.nan)
    for group in groups:
        group.perceived_columns = {name: values[names.index(name)] for name in read[group.number]}
    if not names:
        return None, []
    sources = [
        _source(group, one, names.index(one.name))
        for group in groups for one in found[group.number] if one.name in names
    ]  # fmt: skip
    kept = [one.array for of_group in found.values() for one in of_group]
    return PERCEIVED.pack(PerceivedArrays(values, sources)), kept


def _read_by(group: Group, have: Iterable[str]) -> list[str]:
    """Return the columns that the policies of a group read; a function of one robot reads all."""
    names: list[str] = []
    for policy in group.policies:
        if not isinstance(policy, Policy):
            names += have
            continue
        for name in policy.columns:
            if name not in have:
                raise ValueError(
                    f"policy={label(policy)}: reads the column {name!r}, which no group has as one number for each "
                    f"agent, and no policy shows; add it: group.add_column({name!r}), or world.interact(…) with an "
                    "interaction that keeps it"
                )
            names.append(name)
    return list(dict.fromkeys(names))


def _of_group(group: Group) -> Iterator[Found]:
    """Yield all that others can perceive of the agents of a group."""
    for name, array in group.columns.arrays().items():
        if array.ndim == 1 and array.dtype in _KINDS:
            yield Found(name, array, 0, -1)
    for index, (policy, state) in enumerate(zip(group.policies, group.states, strict=True)):
        if isinstance(policy, Policy) and policy.shows and isinstance(state, PolicyState):
            for field, name in enumerate(policy.shows):
                if name in group.columns:
                    raise ValueError(
                        f"policy={label(policy)}: shows {name!r}, which is a column of {group.name!r} too; rename one"
                    )
                yield Found(name, state.floats, field, index)


def _source(group: Group, found: Found, row: int) -> Packed[SourceArrays]:
    array, table = found.array, group.timetable
    choice = np.zeros(0, np.int64) if table is None else table.policy
    stride = int(np.prod(array.shape[1:]))
    address = array.ctypes.data + found.offset * array.itemsize
    return SOURCE.pack(SourceArrays(
        address, stride, _KINDS[array.dtype], row, group.bodies.identity, found.policy, choice
    ))  # fmt: skip
