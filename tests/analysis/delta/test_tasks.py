"""δ of a task: of the team that explores, of the one with skill, by object and by name."""

from __future__ import annotations

import pytest
from toy_tasks import GATHER, LEARN

from teamsight.analysis.delta import choose_delta


def test_cmommt_by_name_is_the_choice_by_its_parameters() -> None:
    by_name = choose_delta("cmommt", scenario={"robots": 8, "radius": 3.0}, runs=12, steps=50, risk=0.1, rng=3)
    given = {"robots": 8, "radius": 3.0, "policy": "random-walk"}
    by_parameters = choose_delta(given, runs=12, steps=50, risk=0.1, rng=3)
    assert by_name.maxima.equals(by_parameters.maxima)
    assert by_name.predicted_delta == by_parameters.predicted_delta is not None
    assert by_name.subject == "task cmommt, explore, robots=8, radius=3.0, 8 robots of team robots, 12 runs of 50 steps"


@pytest.mark.parametrize("task", [GATHER, LEARN])
def test_the_team_with_skill_gathers(task) -> None:  # type: ignore[no-untyped-def]
    explored = choose_delta(task, runs=20, risk=0.2, rng=3)
    skilled = choose_delta(task, treatment="skilled", runs=20, risk=0.2, rng=3)
    assert skilled.delta == 5
    assert explored.delta < 5
    assert explored.maxima["seed"].equals(skilled.maxima["seed"])
    assert explored.length == GATHER.steps


def test_a_treatment_is_for_a_task() -> None:
    with pytest.raises(ValueError, match="treatment='skilled': is for a task"):
        choose_delta({"robots": 3}, treatment="skilled", runs=2)
    with pytest.raises(ValueError, match="scenario={'robots': 3}: is for a task"):
        choose_delta(GATHER.world, scenario={"robots": 3}, runs=2)
    with pytest.raises(ValueError, match="task='gathre': unknown"):
        choose_delta("gathre", runs=2)
