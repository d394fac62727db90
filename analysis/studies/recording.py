"""Makes one run of a study and records what the study asks for, with the recorders of the library."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from teamsight.analysis.studies.measured import Measured, measured_of
from teamsight.core import checks

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.agents.world import World
    from teamsight.analysis.studies.resolved import Resolved
    from teamsight.analysis.studies.study import Record


class MadeRun(NamedTuple):
    """What is recorded of a run: its measures, and the library's own tables by kind of part."""

    measured: Measured
    tables: dict[str, pd.DataFrame]


class Recorder:
    """Makes runs and records them.

    Parameters
    ----------
    record : Record
        What is recorded.
    steps : int
        Steps of each run.
    taken : frozenset of str
        Names of columns that a measure must not return.
    """

    def __init__(self, record: Record, steps: int, taken: frozenset[str]) -> None:
        self._record, self._steps, self._taken = record, steps, taken

    def make(self, worlds: ReusedWorlds, resolved: Resolved, parameters: Mapping[str, Any], seed: int) -> MadeRun:
        """Make a run and return what is recorded of it."""
        from teamsight.agents.world import World

        world = worlds.begin(resolved.model, parameters, seed)
        if not isinstance(world, World):
            raise TypeError(f"model returned {checks.shown(world)}: must return a World, such as CMOMMT(robots=5)")
        if self._record.trajectories:
            world.recording.record_positions(self._record.trajectories)
        found = resolved.measure(world, self._steps)
        return MadeRun(measured_of(found, self._taken, resolved.measure), self._tables(world))

    def _tables(self, world: World) -> dict[str, pd.DataFrame]:
        record = self._record
        tables = {}
        if record.steps:
            tables["steps"] = world.recording.history.reset_index()
        if record.trajectories:
            tables["trajectories"] = world.recording.trajectory
        if record.events:
            tables["events"] = world.events
        return tables
