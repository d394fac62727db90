"""Whatever comes, goes, fails and is repaired: no agent outside the arena, no ghost in any list, one result on all paths."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings
from schedules import Schedule

from teamsight import Cycle, World


class ScheduleWithCycles(Schedule):
    """As above; the robots decide each by its own timetable."""

    def build(self, setting: str, awareness: str, sensor: str, seed: int) -> World:
        """Return a new world."""
        world = super().build(setting, awareness, sensor, seed)
        world.groups[0].cycle = Cycle(2.5, phase="random", jitter=1.0)
        world.groups[1].cycle = Cycle(2, delay=1)
        return world


_quiet = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
TestSchedule = _quiet(Schedule.TestCase)
TestScheduleWithCycles = _quiet(ScheduleWithCycles.TestCase)
TestSchedule.settings = TestScheduleWithCycles.settings = settings(
    max_examples=7, stateful_step_count=20, deadline=None, suppress_health_check=list(HealthCheck)
)
