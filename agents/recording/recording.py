"""The recording of a world: its history, positions and transitions on demand, recorders, and its data collector."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mesa
import pandas as pd

from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.recording.history import Stretch, Sums, trajectory_frame
from teamsight.agents.recording.transitions import Transitions, joined
from teamsight.agents.world_data import Timeline, WorldData
from teamsight.core import checks

REPORTERS = {
    name: name
    for name in ("observed", "observed_fraction", "mean_degree", "mean_neighbours", "max_neighbours", "seed_used")
}


@dataclass(slots=True)
class Rows:
    """Rows of a stretch that are still to be collected, and sums over all rows before them.

    Attributes
    ----------
    stretch : Stretch
        The stretch.
    first, last : int
        The first row, and the row after the last.
    tick : int
        The step of the last row.
    earlier : Sums
        The sums of earlier stretches.
    """

    stretch: Stretch
    first: int
    last: int
    tick: int
    earlier: Sums


class HistoryCollector(mesa.DataCollector):  # type: ignore[misc]
    """A DataCollector that is filled from the history, so that it needs no Python between steps.

    It reports ``observed`` and ``mean_degree`` of each step, ``observed_fraction``, ``mean_neighbours`` and
    ``max_neighbours`` over all steps so far, and ``seed_used``, with which a run of a batch can be repeated.
    """

    def __init__(self) -> None:
        self._pending: list[Rows] = []
        self._tick: int | None = None
        super().__init__(model_reporters=REPORTERS)

    def emptied(self) -> HistoryCollector:
        """Return an empty collector with the same reporters."""
        # Ten times as fast as `copy.copy`.
        other = object.__new__(HistoryCollector)
        other.__dict__.update(vars(self))
        other._pending, other._tick = [], None
        other._model_vars = {name: [] for name in REPORTERS}
        if hasattr(self, "_steps"):
            other._steps = []
        return other

    @property
    def model_vars(self) -> dict[str, list[Any]]:
        """The collected values. Rows of the history are converted when they are read."""
        pending, self._pending = self._pending, []
        for rows in pending:
            self._fill(rows)
        return self._model_vars

    @model_vars.setter
    def model_vars(self, value: dict[str, list[Any]]) -> None:
        self._model_vars = value

    def collect(self, model: Any) -> None:
        """Collect the present values, several times as fast as mesa's own method; see `CollectOnce`."""
        is_again, self._tick = model.tick == self._tick, model.tick
        for name, values in self.model_vars.items():
            values[len(values) - is_again :] = [getattr(model, name)]
        if hasattr(self, "_steps") and not is_again:
            self._steps.append(float(model.tick))

    @property
    def has_begun(self) -> bool:
        """Whether anything was collected."""
        return bool(self._pending or self._model_vars["observed"])

    @property
    def _collection_steps(self) -> list[float]:
        """The list of steps of mesa 3.5; mesa 3.3 does not use it."""
        return self._steps if self.model_vars else []

    @_collection_steps.setter
    def _collection_steps(self, value: list[float]) -> None:
        self._steps = value

    def collect_rows(self, rows: Rows) -> None:
        """Collect rows of the history, with the same result as `collect` after each of these steps."""
        self._tick = rows.tick
        last = self._pending[-1] if self._pending else None
        if last is not None and last.stretch is rows.stretch and last.last == rows.first:
            last.last, last.tick = rows.last, rows.tick
        else:
            self._pending.append(rows)

    def _fill(self, new: Rows) -> None:
        columns = new.stretch.columns(new.first, new.last)
        count = new.last - new.first
        before = new.earlier.plus(new.stretch.sums(new.first))
        values = {"observed": columns["observed"], "mean_degree": columns["mean_neighbours"]}
        for name, column in (values | new.stretch.running(before, new.first, new.last)).items():
            self._model_vars[name].extend(column.tolist())
        # The seed of a model does not change while it runs.
        self._model_vars["seed_used"].extend(self._model_vars["seed_used"][-1:] * count)
        if hasattr(self, "_steps"):
            self._steps.extend(map(float, range(new.tick - count + 1, new.tick + 1)))


class CollectOnce:
    """The ``collect`` of a user's collector in a world: a row of the same tick replaces the one before.

    A world collects after each step by itself. Models that were written for mesa collect in their ``step`` too.

    Parameters
    ----------
    collector : mesa.DataCollector
        The collector, whose method this replaces.
    timeline : Timeline
        The time of the world.
    """

    def __init__(self, collector: mesa.DataCollector, timeline: Timeline) -> None:
        own = collector.collect
        self._collect: Callable[[Any], Any] = own._collect if isinstance(own, CollectOnce) else own
        self._collector, self._timeline = collector, timeline
        self._at: tuple[int, int] | None = None

    def __call__(self, model: Any) -> None:
        """Collect the present values."""
        # After `restore` a tick comes again, and its row is another one.
        at = self._timeline.tick, self._timeline.jumps
        tables = [*getattr(self._collector, "model_vars", {}).values()]
        rows = [len(values) for values in tables]
        steps = getattr(self._collector, "_collection_steps", [])
        step = len(steps)
        try:
            self._collect(model)
        except BaseException:
            # Of a reporter of the user's. A part of a row would shift the columns against each other.
            for values, before in zip(tables, rows, strict=True):
                del values[before:]
            del steps[step:]
            raise
        if at == self._at:
            for values, before in zip(tables, rows, strict=True):
                del values[max(before - 1, 0) : before]
            # Inside a step, mesa's time is that of its end already. Its tables of agents, which are by time, are
            # written again then.
            del steps[step:]
        self._at = at


def collecting_once(collector: mesa.DataCollector, timeline: Timeline) -> mesa.DataCollector:
    """Let a collector have one row a tick, and return it; see `CollectOnce`."""
    if not isinstance(collector, HistoryCollector):
        collector.collect = CollectOnce(collector, timeline)
    return collector


class Recording:
    """What is recorded of a world's run: ``world.recording``.

    Attributes
    ----------
    callbacks : list of callable
        Functions that are called with the world after each step. Steps are then made one by one.
    before_steps : list of callable
        Functions that are called with the world before steps are made, after all events that precede them: before each
        step of ``run(1)``, and once for all steps that one compiled call makes. They must change nothing.
    collector : mesa.DataCollector
        The data collector of the world; see `World.datacollector`.
    """

    def __init__(self, data: WorldData, engine: Engine) -> None:
        self._data, self._engine = data, engine
        self.callbacks: list[Callable[[Any], Any]] = []
        self.before_steps: list[Callable[[Any], Any]] = []
        self.collector: mesa.DataCollector = HistoryCollector()

    @property
    def history(self) -> pd.DataFrame:
        """One row for each completed step, indexed 1..n: observed, mean_neighbours, max_neighbours.

        The scores of interactions follow, under their names; then `bumps`, unless bodies pass through each other.
        """
        return self._data.history.frame(self._data.score_names)

    @property
    def mean_neighbours(self) -> float:
        """The mean over robots and completed steps of the number of robots within a robot's awareness range."""
        return self._data.history.sums.edges.mean_share

    def max_neighbours(self, team: str | None = None, first: int = 0) -> int:
        """Return the largest number of neighbours of any robot in the completed steps.

        Parameters
        ----------
        team : str, optional
            The name of a team; by default all teams count.
        first : int
            The number of steps to leave out at the start.
        """
        if team is None and not first:
            return self._data.history.sums.largest
        largest = self.max_neighbours_by_group(first)
        return max((degree for (_, name), degree in largest.items() if team in (None, name)), default=0)

    def max_neighbours_by_group(self, first: int = 0) -> dict[tuple[str, str], int]:
        """Return the largest number of neighbours of any robot in each group, by the names of group and team.

        Parameters
        ----------
        first : int
            The number of steps to leave out at the start.
        """
        return self._data.history.largest_by_group(first)

    def record_positions(self, every: int = 1) -> None:
        """Record the positions of all agents from now on, at each tick that `every` divides; see `trajectory`.

        Raises
        ------
        TypeError, ValueError
            If `every` is not a whole number of at least 1.
        """
        self._engine.record_positions(checks.count("every", every))

    @property
    def trajectory(self) -> pd.DataFrame:
        """The recorded positions: time [ticks], group, identity, x, y [length]."""
        return trajectory_frame(self._engine.trails)

    def record_transitions(self, group: Group) -> None:
        """Record the transitions of a group's robots from now on; see `transitions`.

        `World.reset` and `World.restore` discard those recorded so far.

        Raises
        ------
        ValueError
            If the group is not in this world.
        """
        self._engine.record_transitions(group)

    def transitions(self, group: Group) -> Transitions:
        """Return the recorded transitions of a group: one for each robot and step.

        Raises
        ------
        ValueError
            If none were recorded, or the width of the situation has changed meanwhile.
        """
        self._engine.prepare()
        return joined(group, [log for log in self._engine.transitions.logs if log.group is group])
