"""The benchmark: its file is what the code declares and makes, and its comparisons are what they say."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT
from teamsight.agents.awareness import PairwiseAwareness, RelayedAwareness, RingAwareness
from teamsight.agents.resolve import policy_of
from teamsight.analysis import benchmark, ceilings
from teamsight.analysis.benchmark import BOUND, CEILING, ENTRANTS, FLOOR, RUNS, SCENARIOS, STEPS, Entrant, Results
from teamsight.policies import CompiledPolicy


@pytest.fixture(scope="module")
def shipped() -> Results:
    return Results.read()


def made_of(observed: Mapping[str, list[int]], **teams: int) -> Results:
    """Results in which a team observes so many more in each run."""
    return Results({
        team: {"observed": {name: [count + more for count in part] for name, part in observed.items()}}
        for team, more in teams.items()
    })  # fmt: skip


def same_in_all(counts: list[int]) -> dict[str, list[int]]:
    return {name: [count * one.values["targets"] // 15 for count in counts] for name, one in SCENARIOS.items()}


def test_the_file_declares_what_the_code_does(shipped: Results) -> None:
    content = json.loads(benchmark.REFERENCE.read_text(encoding="utf-8"))
    assert {name: content[name] for name in benchmark.definition()} == json.loads(json.dumps(benchmark.definition()))
    assert not benchmark.outdated(shipped)
    assert {*shipped.teams} == {*ENTRANTS, BOUND}
    for name, team in ENTRANTS.items():
        observed = shipped.teams[name]["observed"]
        assert [*observed] == [title for title, scenario in SCENARIOS.items() if team.enters(scenario)]
        assert {len(part) for part in observed.values()} == {team.most}
    # Nothing in it depends on the day.
    assert not re.search(r"20[2-9]\d-\d\d|/home|/tmp", json.dumps(content))
    assert benchmark.REFERENCE.read_bytes() == shipped.content()


@pytest.mark.parametrize("name", [name for name, one in ENTRANTS.items() if not one.is_planner and one.learned < 1e5])
def test_rows_of_the_file_are_made_again_to_the_last_bit(name: str, shipped: Results) -> None:
    # Another part of the file for each team, and each scenario for some.
    teams, titles = list(ENTRANTS), list(SCENARIOS)
    first = teams.index(name)
    for title in [titles[(first + 7 * k) % len(titles)] for k in range(3)]:
        replicate = (first * 17) % RUNS
        ((_, run),) = ENTRANTS[name].planned(SCENARIOS[title], [replicate])
        world = (run.model or CMOMMT)(**run.parameters, rng=run.seed)
        found = run.measure(world, run.steps)
        assert found == {"observed": shipped.teams[name]["observed"][title][replicate]}, title


def test_a_planner_and_the_bound_are_made_again(shipped: Results) -> None:
    ((_, run),) = ENTRANTS[CEILING].planned(SCENARIOS["n5-r3"], [1])
    found = run.measure(run.model(**run.parameters, rng=run.seed), run.steps)  # type: ignore[misc]
    assert found == {
        "observed": shipped.teams[CEILING]["observed"]["n5-r3"][1],
        "bound": shipped.teams[BOUND]["observed"]["n5-r3"][1],
    }


def test_what_is_counted_are_targets_within_range_of_some_robot() -> None:
    ((_, run),) = Entrant("a-cmommt", "pairwise").planned(SCENARIOS["targets-5"], [3])
    world, count = CMOMMT(**run.parameters, rng=run.seed), 0
    for _ in range(60):
        world.step()
        away = np.linalg.norm(np.array(world.targets.position)[:, np.newaxis] - np.array(world.robots.position), axis=-1)
        count += int((away.min(axis=1) <= 1.0).sum())
    assert run.measure(CMOMMT(**run.parameters, rng=run.seed), 60) == {"observed": count}
    assert 0 < count < 60 * 5


def test_all_teams_meet_the_same_worlds() -> None:
    seeds = {}
    for name, team in ENTRANTS.items():
        for title, scenario in SCENARIOS.items():
            if team.enters(scenario):
                seeds.setdefault(title, {})[name] = [run.seed for _, run in team.planned(scenario, range(4))]
    for title, of_team in seeds.items():
        assert len({tuple(part) for part in of_team.values()}) == 1, title
        assert len(set(of_team[FLOOR])) == 4


def test_planners_enter_what_they_know_and_nothing_else() -> None:
    known = {name for name, one in SCENARIOS.items() if one.is_planned}
    assert {*benchmark.base_names()} < known
    assert known == {*benchmark.base_names(), "targets-5", "targets-40", "fast-targets", "own-speeds"}
    assert {*benchmark.base_names(False)} == {*SCENARIOS} - {*benchmark.base_names()}


class Bound(CompiledPolicy):
    degree = "pairwise"
    kernel = None  # type: ignore[assignment]


def test_reports_go_over_hops_where_each_teammate_is_shown() -> None:
    def degree(team: Entrant, title: str = "hops") -> Any:
        return team.parameters(SCENARIOS[title])["awareness"]

    assert degree(ENTRANTS["a-cmommt"]) == RelayedAwareness(2) == degree(ENTRANTS["b-cmommt"])
    assert degree(ENTRANTS["a-cmommt"], "n10-r5") == PairwiseAwareness()
    assert degree(ENTRANTS["evolved"]) == RingAwareness() == degree(ENTRANTS["learned-600"])
    # One that works under one degree alone keeps it.
    assert degree(Entrant(Bound(), "pairwise")) == PairwiseAwareness()


def test_the_way_is_0_at_the_floor_and_100_at_the_ceiling() -> None:
    results = made_of(same_in_all([3000, 3300, 3600]), **{FLOOR: 0, CEILING: 4000, "half": 2000, "more": 5000})
    assert results.way(FLOOR).mean == 0.0
    assert results.way(CEILING) == pytest.approx((100.0, 100.0, 100.0))
    scenarios = benchmark.base_names()
    assert results.way("half", scenarios) == pytest.approx((50.0, 50.0, 50.0))
    assert results.way("more", scenarios).mean == pytest.approx(125.0)
    assert math.isnan(results.way("half", ["noise"]).mean)
    assert math.isnan(made_of(same_in_all([1, 2]), half=0).way("half").mean)


def test_differences_are_paired_and_fewer_runs_are_the_first_ones() -> None:
    names = ["n5-r3", "n10-r5"]
    results = Results({
        "a": {"observed": {name: [900, 1800, 2700] for name in names}},
        "b": {"observed": {name: [450, 1350] for name in names}},
    })  # fmt: skip
    assert results.difference("a", "b", names) == pytest.approx((5.0, 5.0, 5.0))
    assert results.difference("b", "a", names) == pytest.approx((-5.0, -5.0, -5.0))
    assert results.mean("a", names)[0] == pytest.approx(20.0)  # type: ignore[index]
    assert results.difference("a", "b") is None


def test_teams_are_ranked_by_the_mean_of_all_scenarios() -> None:
    results = made_of(same_in_all([3000, 3300]), low=0, high=900, middle=450)
    part = {"observed": {"n5-r3": [9000, 9000]}}
    listed = Results({**results.teams, "part": part}).standings("middle")
    assert [(one.rank, one.team) for one in listed] == [(1, "high"), (2, "middle"), (3, "low"), (0, "part")]
    assert listed[1].less is None
    assert listed[0].less is not None
    assert listed[0].less.mean < 0.0
    assert listed[3].score is None


def test_fewer_runs_are_ranked_by_the_differences_in_them(shipped: Results) -> None:
    for name in ("group-forces", "a-cmommt", "straight"):
        team = shipped.teams[name]
        few = {**team, "observed": {title: part[:10] for title, part in team["observed"].items()}}
        ranks = {one.team: one.rank for one in Results({**shipped.teams, "few": few}).standings("few")}
        # Its mean over 10 runs is another than over all, so that by means it would not stand beside itself.
        assert ranks["few"] == ranks[name] + 1


def test_shares_of_the_way_have_their_interval(shipped: Results) -> None:
    assert "| 79 ± 1 | " in benchmark.page(shipped)
    assert [benchmark.way_text(shipped.way(name)) for name in (benchmark.FLOOR, benchmark.CEILING)] == ["0", "100"]


def test_a_team_that_is_not_in_the_file_runs_on_its_worlds(shipped: Results) -> None:
    again = benchmark.run({"again": ENTRANTS["straight"]}, 2, timed=False)
    for title, part in again.teams["again"]["observed"].items():
        assert part == shipped.teams["straight"]["observed"][title][:2], title
    assert again.teams["again"]["cpu_us_per_decision"] is None
    assert again.teams["again"]["inputs"] == {"5": 16, "10": 16, "20": 16}


def test_cpu_time_is_measured_for_each_kind_of_team() -> None:
    for team in (ENTRANTS["evolved"], ENTRANTS["learned-600"], Entrant("stationary")):
        assert 0.0 < benchmark.cpu_time(team) < math.inf


def test_from_many_transitions_it_is_learned_that_teammates_repel() -> None:
    few, many = (benchmark._learned(0, count).forces["teammate"] for count in (600, 100_000))
    assert np.abs(few).max() < 0.05 * np.abs(many).max()
    assert many.max() < 0.0


def test_what_is_written_can_be_read_and_another_version_is_refused(tmp_path: Path, shipped: Results) -> None:
    place = tmp_path / "benchmark.json"
    place.write_bytes(shipped.content())
    assert Results.read(place) == shipped
    content = json.loads(place.read_text(encoding="utf-8"))
    changes: dict[str, Any] = {
        "benchmark": "cmommt-0", "root": 7, "steps": 599,
        "scenarios": {**content["scenarios"], "n5-r3": {**content["scenarios"]["n5-r3"], "radius": 3.5}},
    }  # fmt: skip
    for name, value in changes.items():
        place.write_text(json.dumps({**content, name: value}), encoding="utf-8")
        with pytest.raises(ValueError, match="reference=.*cmommt-1.*(leave it out)") as refused:
            Results.read(place)
        assert ("cmommt-0" if name == "benchmark" else name) in str(refused.value)
    for text in ("{", "[]", "{}", '{"benchmark": "cmommt-1"}'):
        place.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match="holds no results of the benchmark"):
            Results.read(place)
    with pytest.raises(ValueError, match="holds no results"):
        Results.read(tmp_path / "none.json")


def test_a_policy_is_given_the_first_degree_that_it_takes() -> None:
    follow = "teamsight.policies.handmade.follow_free:FollowFree"
    for policy, options, degree in (
        ("a-cmommt", {}, "pairwise"), ("b-cmommt", {}, "shared"), (follow, {}, "ring"), (follow, {"teammates": 0}, "none"),
    ):  # fmt: skip
        assert ceilings.fitting(policy_of(policy, options)) == degree


def test_a_team_that_some_scenario_refuses_is_refused_before_it_runs() -> None:
    with pytest.raises(ValueError, match=r"needs 'relayed'.*scenario 'n5-r3' of cmommt-1"):
        benchmark.run({"b": Entrant("b-cmommt", "none")}, 1)


def test_the_page_is_short_and_names_all(shipped: Results) -> None:
    page = benchmark.page(shipped)
    prose = [line for line in page.splitlines() if not line.startswith("|")]
    assert len(" ".join(prose).split()) <= 800
    for name in (*SCENARIOS, *shipped.teams):
        assert name in page
    assert STEPS == 600
    assert f"{RUNS} runs" in page


def test_the_ends_of_the_file_are_in_order(shipped: Results) -> None:
    """What knows more than robots can observes more than they do; the bound is the most that is possible."""

    def observed(name: str) -> float:
        found = shipped.percent(name, benchmark.base_names())
        assert found is not None
        return float(found[:, :4].mean())

    assert observed(FLOOR) < observed("evolved") < min(observed("informed"), observed(CEILING))
    assert max(observed("sharing"), observed("informed"), observed(CEILING)) < observed(BOUND)
