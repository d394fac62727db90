"""Drain: the watcher that keeps the charge of batteries, and stops a run when one becomes low or empty."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.watching import Bound, Watcher
from teamsight.agents.group import Group
from teamsight.core.kernel import Entry, Record

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: The level of a battery.
ENOUGH, LOW, EMPTY = range(3)
#: The share of the capacity below which a charge is 0.
ROUNDING = 1e-9


class DrainArrays(NamedTuple):
    """The record of the batteries of a group.

    Attributes
    ----------
    member : ndarray, shape (n,), int64
        The member of each row.
    active : ndarray, shape (n,), bool
        Who takes part; others drain nothing.
    moved : ndarray, shape (n, 2), float64
        The displacement of the last step [length].
    decided_at : ndarray, shape (n,) or (0,), int64
        The tick at which each last decided; empty if all active agents decide at every step.
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    charge : ndarray, shape (n,), float64
        Written: the charge.
    supply : ndarray, shape (members,), float64
        By member, the charge that a battery gains in a step while it is charged; 0 while it is not.
    level : ndarray, shape (members,), int64
        Written: by member, `ENOUGH`, `LOW` or `EMPTY`.
    capacity, low, per_distance, per_tick, per_decision : float
        As for `Batteries`.
    """

    member: Annotated[Integers, "n"]
    active: Annotated[npt.NDArray[np.bool_], "n"]
    moved: Annotated[Floats, "n", 2]
    decided_at: Annotated[Integers, "deciding"]
    moment: Annotated[Integers, 1]
    charge: Annotated[Floats, "n"]
    supply: Annotated[Floats, "members"]
    level: Annotated[Integers, "members"]
    capacity: float
    low: float
    per_distance: float
    per_tick: float
    per_decision: float


DRAIN = Record(DrainArrays)
_drain_at = DRAIN.at


def _drain(address: int) -> int:
    here = _drain_at(address)
    has_changed = 0
    rounding = ROUNDING * here.capacity
    for i in range(here.member.shape[0]):
        m = here.member[i]
        charge = here.charge[i]
        if here.supply[m] > 0.0:
            charge = min(charge + here.supply[m], here.capacity)
        elif here.active[i]:
            x = here.moved[i, 0]
            y = here.moved[i, 1]
            has_decided = here.decided_at.shape[0] == 0 or here.decided_at[i] == here.moment[0] - 1
            decision = here.per_decision if has_decided else 0.0
            charge -= here.per_tick + decision + here.per_distance * math.sqrt(x * x + y * y)
        # Ten drains of 0.1 must empty a battery of 1.
        charge = charge if charge > rounding else 0.0
        here.charge[i] = charge
        level = EMPTY if charge == 0.0 else LOW if charge <= here.low + rounding else ENOUGH
        if level != here.level[m]:
            here.level[m] = level
            has_changed = 1
    return has_changed


class Drain(Watcher):
    """Drains and charges the batteries of a group in each step.

    Parameters
    ----------
    group : Group
        The group; its column `column` has the charge of each agent.
    column : str
        The name of that column.
    rates : tuple of five float
        Capacity, low, per distance, per tick and per decision.
    report : callable
        Called after a step in which levels have changed.

    Attributes
    ----------
    supply, level : ndarray, shape (members,)
        As for `DrainArrays`.
    """

    entry = Entry(_drain)

    def __init__(self, group: Group, column: str, rates: tuple[float, ...], report: Callable[[], None]) -> None:
        self._group, self._column, self._rates, self._report = group, column, rates, report
        self.supply, self.level = np.zeros(0), np.zeros(0, np.int64)
        self.begin()

    def begin(self) -> None:
        """Begin with full batteries, none of which is being charged."""
        self.supply[:], self.level[:] = 0.0, ENOUGH
        self.make_room()

    def make_room(self) -> None:
        """Make room for the members that have come."""
        more = self._group.members_so_far - len(self.level)
        if more > 0:
            self.supply = np.append(self.supply, np.zeros(more))
            self.level = np.append(self.level, np.full(more, ENOUGH))

    def bind(self, bound: Bound) -> None:
        """Pack the record from the present arrays."""
        self.make_room()
        bodies, charge, table = self._group.bodies, self._group.columns.array(self._column), self._group.timetable
        self.record = DRAIN.pack(DrainArrays(
            bodies.member, bodies.active, bodies.moved, np.zeros(0, np.int64) if table is None else table.decided_at,
            bound.moment, charge, self.supply, self.level, *self._rates,
        ))  # fmt: skip

    def happened(self) -> None:
        """Report changed levels."""
        self._report()
