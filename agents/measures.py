"""What can be read of a world as a whole: its time, what is observed, and the neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

import mesa

from teamsight.agents import mesa_bases
from teamsight.agents.body import Body
from teamsight.agents.building import check_keywords
from teamsight.agents.engine.engine import Engine
from teamsight.agents.fixed import refusing
from teamsight.agents.group import Group
from teamsight.agents.recording.collector import collecting_once
from teamsight.agents.recording.recording import Recording
from teamsight.agents.stepping import Stepper
from teamsight.agents.teammates import Teammates, neighbours, teammates
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Arena
from teamsight.world.interaction import Interaction


@refusing(
    arena="all agents were placed in it; build another world",
    seed_used="start again with reset(rng)",
    tick="run(n) makes steps, reset() starts again, and restore(state) goes back",
    groups="add() adds one",
    interactions="interact() adds one, and adjust() changes one",
    path="it follows from the policies and from what is recorded",
    observed="it is measured",
    observed_fraction="it is measured; reset() starts again",
    mean_degree="it is measured",
    mean_neighbours="it is measured; reset() starts again",
    max_neighbours="it is measured; reset() starts again",
)


class Measures(mesa_bases.Model):
    """The measures of a world; `World` derives from it."""

    recording: Recording
    _data: WorldData
    _engine: Engine
    _stepper: Stepper

    def __new__(cls, *arguments: Any, **named: Any) -> Self:
        # Before Python's own error, which suggests nothing.
        check_keywords(cls, named)
        return super().__new__(cls)

    # Type checkers would take every attribute to exist.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if "_states" not in vars(self):
                what = f"{type(self).__name__}.__init__ uses {name!r} of a world that is not made"
                raise AttributeError(f"{what}; call super().__init__(arena, rng=rng), which makes it, first")
            # The error as it was: properties may have raised one of their own.
            return super().__getattribute__(name)

    @property
    def arena(self) -> Arena:
        """The arena. It cannot be changed: all agents were placed in it."""
        return self._data.arena

    @property
    def seed_used(self) -> int:
        """The seed. `reset` can set another."""
        return self._data.seed

    @property
    def tick(self) -> int:
        """The number of completed steps."""
        return self._data.timeline.tick

    @property
    def path(self) -> str:
        """How `run` makes its steps now: ``"compiled"``, or ``"step by step: "`` and the reason.

        The results are the same to the last bit; compiled steps take less time. With mesa's own events pending, single
        steps are made too.
        """
        reason = self._stepper.needs_python()
        return f"step by step: {reason}" if reason else "compiled"

    @property
    def observed(self) -> float:
        """The fraction of targets that at least one robot senses now, in [0, 1]."""
        return self._engine.present("observed")

    @property
    def observed_fraction(self) -> float:
        """The mean over the completed steps of the fraction of targets that at least one robot senses, in [0, 1]."""
        return self._data.history.observed_fraction

    @property
    def mean_degree(self) -> float:
        """The mean number of neighbours of a robot now: of robots within its awareness range."""
        return self._engine.present("mean_degree")

    @property
    def mean_neighbours(self) -> float:
        """The mean over robots and completed steps of the number of neighbours; `mean_degree` is the present one."""
        return self._data.history.mean_neighbours

    @property
    def max_neighbours(self) -> int:
        """The largest number of robots within any robot's awareness range in the completed steps."""
        return self._data.history.max_neighbours

    @property
    def teammates(self) -> Teammates:
        """The agents that are on a team now, in the order of groups; `neighbours` refers to their rows."""
        return teammates(self._data.groups)

    @property
    def neighbours(self) -> NeighbourList:
        """The present neighbours of each of `teammates`, by row: agents of its team within its awareness range."""
        self._engine.prepare()
        return neighbours(self._data.groups)

    @property
    def groups(self) -> tuple[Group[Body], ...]:
        """The groups, in the order in which they were added; `World.add` adds one."""
        return tuple(self._data.groups)

    @property
    def interactions(self) -> tuple[Interaction, ...]:
        """What happens between bodies in each step, in this order, as it is now; `World.interact` adds to it."""
        return tuple(placed.interaction for placed in self._data.interactions)

    @property
    def datacollector(self) -> mesa.DataCollector:
        """mesa's data collector, a `HistoryCollector` by default. It collects when it is set and after every step.

        There is one row a tick: ``world.datacollector.collect(world)`` replaces that of the present one.
        """
        return self.recording.collector

    @datacollector.setter
    def datacollector(self, collector: mesa.DataCollector) -> None:
        if not callable(getattr(collector, "collect", None)):
            raise TypeError(f"datacollector={checks.shown(collector)}: must be a mesa.DataCollector")
        self._engine.prepare()
        collecting_once(collector, self._data.timeline).collect(self)
        self.recording.collector = collector
