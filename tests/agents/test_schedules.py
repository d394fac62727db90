"""Whatever comes, goes, fails and is repaired: no agent outside the arena, no ghost in any list, one result on all paths."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings
from schedules import Schedule

TestSchedule = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")(Schedule.TestCase)
TestSchedule.settings = settings(
    max_examples=16, stateful_step_count=20, deadline=None, suppress_health_check=list(HealthCheck)
)
