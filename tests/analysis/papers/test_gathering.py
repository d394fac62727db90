"""The gathering index on a task whose team gathers and on CMOMMT, and the claims on cells of known answers."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from toy_tasks import GATHER, LEARN, SOON

from teamsight import TASKS
from teamsight.agents.awareness import NoAwareness
from teamsight.analysis.papers.gathering import (
    PAPER,
    UNRELIABLE,
    Cell,
    CellVerdict,
    DeltaInterval,
    GatheringPlan,
    by_chance,
    cautions,
    delta_interval,
    gather,
    index_rows,
    iterate_delta,
    judge,
    ratio,
    saturation,
)
from teamsight.analysis.stats.paired import Interval

# 100 runs support a risk of 0.05 with the confidence of each bound, so no bound is N − 1 for want of runs.
PLAN = GatheringPlan([GATHER, "cmommt"], (4, 8), 100, steps=60)


@pytest.fixture(scope="module")
def found() -> Any:
    return gather(PLAN)


def of(verdicts: list[CellVerdict], claim: str, task: str) -> set[str]:
    return {one.outcome for one in verdicts if (one.claim, one.task) == (claim, task)}


def test_a_team_that_gathers_has_an_index_above_1(found: Any) -> None:
    for cell in found.cells:
        if cell.task == "gather":
            # All stand at the beacon in the end.
            assert cell.skilled == (cell.size - 1, cell.size - 1, cell.size - 1)
            assert cell.explore.high < cell.size - 1
            assert cell.ratio.low > 1
    assert of(found.verdicts, "G2", "gather") == {"holds"}
    assert of(found.verdicts, "G1", "gather") == of(found.verdicts, "G2", "cmommt") == set()


def test_a_team_that_disperses_has_an_index_of_at_most_1(found: Any) -> None:
    for cell in found.cells:
        if cell.task == "cmommt":
            assert cell.ratio.low <= 1
            assert cell.gain.low > 0
    assert "does not hold" not in of(found.verdicts, "G1", "cmommt")


def test_what_needs_no_awareness_saturates_at_0(found: Any) -> None:
    # Walkers to the beacon ignore each other: under each δ they do the same, to the last bit.
    for cell in found.cells:
        if cell.task == "gather":
            assert cell.saturation == (0, 0, 0)
            assert set(cell.shortfall.values()) == {Interval(0.0, 0.0, 0.0)}
            assert cell.is_enough(cell.explore.delta) == "yes"


def test_the_numbers_follow_from_the_table_of_runs(found: Any) -> None:
    cell = next(one for one in found.cells if (one.task, one.size) == ("cmommt", 8))
    rows = found.runs.query("task == 'cmommt' and size == 8")
    largest = rows.query("treatment == 'explore'")["max_neighbours"]
    assert (largest > cell.explore.delta).mean() <= PLAN.risk < (largest > cell.explore.delta - 1).mean()
    by_seed = rows.query("treatment == 'skilled' and delta >= 0").pivot_table("value", "seed", "delta")
    assert cell.gain.mean == pytest.approx((by_seed[7] - by_seed[0]).mean())
    assert cell.shortfall[1].mean == pytest.approx((by_seed[7] - by_seed[1]).mean())
    assert cell.objective == pytest.approx(by_seed[7].mean())


def test_robot_steps_are_counted_by_the_number_of_neighbours(found: Any) -> None:
    own = found.runs.query("delta == -1")
    assert found.runs.query("delta != -1")["robot_steps"].isna().all()
    for row in own.itertuples():
        assert sum(row.robot_steps) == row.size * PLAN.steps
        assert max(np.flatnonzero(row.robot_steps)) == row.max_neighbours
        mean = np.average(np.arange(len(row.robot_steps)), weights=row.robot_steps)
        assert mean == pytest.approx(row.mean_neighbours)
    # Counted in single steps, runs are those that are made at once.
    same = found.runs.query("task == 'gather' and treatment == 'skilled'").pivot_table("value", "seed", "delta")
    assert (same[-1] == same[3]).all()
    cell = next(one for one in found.cells if (one.task, one.size) == ("gather", 8))
    rows = own.query("task == 'gather' and size == 8 and treatment == 'skilled'")["robot_steps"]
    assert cell.crowded == pytest.approx(np.mean([sum(counts[cell.explore.delta + 1 :]) for counts in rows]) / 480)
    assert cell.crowded > 0.1


def test_a_team_with_skill_that_is_no_better_is_said(found: Any) -> None:
    assert {cell.has_skill for cell in found.cells} == {"yes"}
    assert cautions(found.cells) == []
    worse = gather(replace(PLAN, task=[replace(GATHER, objective=("closeness", "less"))], sizes=(4,)))
    (cell,) = worse.cells
    rows = worse.runs.query("delta == -1").pivot_table("value", "seed", "treatment")
    assert cell.skill.mean == pytest.approx((rows["explore"] - rows["skilled"]).mean())
    assert cell.has_skill == "no"
    (line,) = cautions([cell])
    assert line.startswith("gather, N=4: the team with skill is not better")
    assert "| 4 | **no** |" in index_rows([cell])
    # Its order is no verdict on the method.
    assert not {one.claim for one in worse.verdicts} & {"G1", "G2"}
    noise = gather(GatheringPlan([replace(GATHER, skilled=GATHER.explore)], (4,), 90, steps=20))
    assert noise.cells[0].skill == EXACT
    assert noise.cells[0].has_skill == "no"


def test_less_is_better_turns_gain_and_shortfall() -> None:
    cell = gather(GatheringPlan([SOON], (4,), 90, steps=40)).cells[0]
    assert cell.shortfall[0] == (0, 0, 0)
    assert 0 < cell.objective <= 40
    worse = replace(SOON, world=Slowed, name="slowed")
    cell = gather(GatheringPlan([worse], (4,), 90, steps=60)).cells[0]
    assert cell.gain.low > 0
    assert cell.saturation == (1, 1, 1)


def test_nothing_is_known_where_all_runs_are_censored() -> None:
    cell = gather(GatheringPlan([SOON], (4,), 10, steps=2)).cells[0]
    assert cell.censored == 1.0
    assert cell.is_enough(0) == "undecided"
    assert (cell.saturation.low, cell.saturation.high) == (0, 3)
    assert {one.outcome for one in judge([cell]) if one.claim in ("G3", UNRELIABLE[0])} == {"undecided"}


class Slowed(GATHER.world):  # type: ignore[misc, name-defined]
    """Walkers without awareness are slow, whatever they do."""

    def __init__(self, walkers: int = 6, side: float = 6.0, *, awareness: Any = "none", **further: Any) -> None:
        super().__init__(walkers, side, awareness=awareness, **further)
        if awareness == NoAwareness() and further["policy"] == "centroid":
            self.groups[0].speed = 0.02


def test_results_do_not_depend_on_workers_and_are_resumed(tmp_path: Path, two_workers: Any) -> None:
    plan = GatheringPlan([LEARN], (3,), 6, steps=20)
    one, two = PAPER.reproduce(plan, tmp_path), gather(plan, two_workers)
    pd.testing.assert_frame_equal(one.runs, two.runs)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "gathering-index.parquet", "gathering-rounds.parquet", "gathering.md", "gathering.parquet", "gathering.png",
    ]  # fmt: skip
    text = (tmp_path / "gathering.md").read_text(encoding="utf-8")
    assert "| learn | yes | 3 |" in text
    assert pd.read_parquet(tmp_path / "gathering-index.parquet")["ratio"].tolist() == [one.cells[0].ratio.mean]
    json.dumps(plan.conditions())
    with pytest.raises(ValueError, match="gathering"):
        PAPER.reproduce(replace(plan, seed=4), tmp_path)


def test_several_trainings_are_the_units_of_the_intervals() -> None:
    skill = iter(np.linspace(0.05, 0.1, 100))

    def train(scenario: Any, awareness: Any, rng: int) -> dict[str, Any]:
        return {"policy": "centroid", "speed": next(skill)}

    class Trained(GATHER.world):  # type: ignore[misc, name-defined]
        def __init__(self, *given: Any, speed: float = 0.1, rng: Any = None, **further: Any) -> None:
            super().__init__(*given, **further, rng=rng)
            self.groups[0].speed = speed

    task = replace(GATHER, skilled=train, world=Trained)
    result = gather(GatheringPlan([task], (3,), 5, steps=20, trainings=3))
    assert result.runs.query("delta == 0")["training"].tolist() == [0, 0, 1, 1, 2]
    assert sorted(result.runs.query("delta == 0")["replicate"]) == [0, 1, 2, 3, 4]
    assert set(result.runs.query("treatment == 'explore'")["training"]) == {0}
    # Of three trainings, not of five runs, by Student's t with two degrees of freedom.
    means = result.runs.query("delta >= 0").pivot_table("value", "training", "delta")
    gains = (means[2] - means[0]).to_numpy()
    assert result.cells[0].gain.high - result.cells[0].gain.mean == pytest.approx(4.3027 * gains.std(ddof=1) / 3**0.5, rel=1e-4)


def test_iterating_finds_the_neighbours_that_skill_brings() -> None:
    result = iterate_delta(GATHER, scenario={"walkers": 6}, runs=90, steps=60)
    assert result.delta == 5
    assert result.rounds["treatment"].tolist() == ["explore", "skilled", "skilled"]
    assert result.rounds["used"].tolist() == [-1, result.rounds["high"][0], 5]
    assert result.rounds["high"][0] < 5
    assert result.used == result.rounds["used"].tolist()[1:]
    assert (result.cost, result.runs, result.trainings) == (3.0, 180, 0)
    assert (result.shortfall, result.enough) == (EXACT, "yes")
    learned = iterate_delta(LEARN, runs=90, steps=60, trainings=3)
    assert (learned.trainings, learned.runs) == (6, 180)


def test_iterating_ends_where_exploration_suffices() -> None:
    result = iterate_delta("cmommt", scenario={"robots": 8}, runs=90, steps=60)
    assert result.used == [result.delta]
    assert result.rounds["high"][1] <= result.delta == result.rounds["high"][0]
    # The last round is the check with all teammates.
    assert result.rounds["used"].tolist() == [-1, result.delta, 7]
    best, own = result.rounds["objective"][2], result.rounds["objective"][1]
    assert result.shortfall.mean == pytest.approx(best - own)


class Shy(GATHER.world):  # type: ignore[misc, name-defined]
    """Walkers that go to the beacon only with all teammates in view of their degree, and else stay."""

    def __init__(self, walkers: int = 6, side: float = 6.0, *, awareness: Any = "none", **further: Any) -> None:
        super().__init__(walkers, side, awareness=awareness, **further)
        if further["policy"] == "centroid" and getattr(awareness, "delta", 0) < walkers - 1:
            self.groups[0].speed = 1e-9


def test_skill_that_needs_more_than_it_perceives_ends_the_rounds_too_early_and_is_found_out() -> None:
    result = iterate_delta(replace(GATHER, world=Shy, name="shy"), scenario={"walkers": 6}, runs=90, steps=60)
    assert result.delta < 5
    assert result.used == [result.delta]
    assert result.enough == "no"
    assert result.shortfall.low > 0


def test_a_team_of_the_same_policy_has_no_index_above_1() -> None:
    null = replace(GATHER, name="null", skilled=GATHER.explore)
    found = gather(GatheringPlan([null], (4,), 100, steps=60))
    (one,) = found.cells
    assert one.explore == one.skilled
    assert one.ratio.low <= 1 <= one.ratio.high
    assert "holds" not in of(found.verdicts, "G2", "null")


def test_shares_of_seeds_say_which_team_has_more_neighbours() -> None:
    swapped = replace(GATHER, name="swapped", explore=GATHER.skilled, skilled=GATHER.explore)
    same = replace(GATHER, name="same", skilled=GATHER.explore)
    fewer, more, none = gather(GatheringPlan([GATHER, swapped, same], (8,), 20, steps=60)).cells
    assert fewer.too_few > 0.9 > 0.1 > fewer.too_many
    assert more.too_many > 0.9 > 0.1 > more.too_few
    # The same policy meets the same noise.
    assert none.too_few == none.too_many == 0


def test_pure_noise_is_a_verdict_as_rarely_as_the_bounds_say() -> None:
    rng = np.random.default_rng(12)
    outcomes = []
    for _ in range(1000):
        # Both teams have the same distribution, and δ = 4 is exceeded with almost the accepted risk, the hardest case.
        one, other = (delta_interval(np.clip(rng.poisson(1.9, 100), 0, 7), 8, 0.05) for _ in range(2))
        outcomes.append(judge([cell(one, other, gathers=True)])[0].outcome)
    # The true δ are equal, so G2 is false: at most 5 % may hold, and 2.1 % is three standard errors of that.
    assert outcomes.count("holds") <= 1000 * 0.071


def test_a_claim_on_all_cells_allows_for_chance() -> None:
    more, fewer = cell((2, 2, 3), (5, 4, 5), gathers=True), cell((5, 4, 5), (2, 2, 3), gathers=True)
    open_ = cell((3, 3, 4), (3, 3, 4), gathers=True)

    def overall(*cells: Cell) -> str:
        return next(one.outcome for one in judge(cells) if (one.claim, one.task) == ("G2", ""))

    assert overall(more, more) == "holds"
    assert overall(more, open_) == "undecided"
    assert overall(fewer) == "does not hold"
    assert overall(*[more] * 9, fewer) == "undecided"
    assert overall(*[more] * 9, *[fewer] * 3) == "does not hold"
    # By the binomial distribution: of 10, more than 1 are against it with 8.6 %, more than 2 with 1.2 %.
    assert [by_chance(cells) for cells in (1, 10, 28)] == [0, 2, 3]


def test_runs_that_were_made_before_are_not_made_again() -> None:
    plan = GatheringPlan([GATHER], (3,), 6, steps=20)
    first = gather(plan)
    phases: list[str] = []
    again = gather(plan, watch=lambda phase, done, total: phases.append(phase), runs=first.runs)
    assert not phases
    pd.testing.assert_frame_equal(again.frame, first.frame)
    assert set(first.rounds["task"]) == {"gather"}


def test_scenarios_of_one_task_and_of_each_size() -> None:
    plan = GatheringPlan([GATHER, "cmommt"], (4, 8), 10, set={"gather.side": [5.0, 7.0], "cmommt.radius": 3.0})
    assert plan.scenario_of(GATHER, 4) == {"walkers": 4, "side": 5.0}
    assert plan.scenario_of(GATHER, 8) == {"walkers": 8, "side": 7.0}
    assert plan.scenario_of(TASKS["cmommt"], 8)["radius"] == 3.0
    assert json.loads(json.dumps(plan.conditions()))["scenario"]["gather.side"] == [5.0, 7.0]


EXACT = Interval(0.0, 0.0, 0.0)


def cell(explore: tuple[int, ...], skilled: tuple[int, ...], *, gathers: bool | None, size: int = 8, **more: Any) -> Cell:
    one, other = DeltaInterval(*explore), DeltaInterval(*skilled)
    given: dict[str, Any] = {
        "saturation": DeltaInterval(0, 0, 0), "shortfall": dict.fromkeys(range(size), EXACT), "objective": 1.0,
        "tolerance": 0.02, "gain": EXACT, "censored": 0.0,
    }  # fmt: skip
    return Cell("task", gathers, size, one, other, ratio(other, one), **{**given, **more})


ORDERS = [
    ((3, 3, 3), (3, 3, 3), "holds", "does not hold"),
    ((5, 4, 5), (3, 3, 4), "holds", "does not hold"),
    ((3, 3, 4), (3, 3, 4), "undecided", "undecided"),
    ((2, 2, 3), (5, 4, 5), "does not hold", "holds"),
]


@pytest.mark.parametrize(("explore", "skilled", "disperses", "gathers"), ORDERS)
def test_g1_and_g2_can_fail(explore: Any, skilled: Any, disperses: str, gathers: str) -> None:
    assert judge([cell(explore, skilled, gathers=False)])[0][:1] + judge([cell(explore, skilled, gathers=False)])[0][3:4] == (
        "G1", disperses,
    )  # fmt: skip
    verdict = judge([cell(explore, skilled, gathers=True)])[0]
    assert (verdict.claim, verdict.outcome) == ("G2", gathers)
    assert {"G1", "G2"}.isdisjoint(one.claim for one in judge([cell(explore, skilled, gathers=None)]))


def test_g2_is_not_judged_where_exploration_shows_all_teammates() -> None:
    # Skill cannot bring more than N − 1: it could only fail.
    for low, judged in ((6, True), (7, False)):
        verdicts = judge([cell((7, low, 7), (7, 7, 7), gathers=True)])
        assert ("G2" in {one.claim for one in verdicts}) == judged


SATURATIONS = [((2, 1, 3), "holds"), ((2, 1, 4), "undecided"), ((5, 4, 6), "does not hold"), ((3, 3, 5), "undecided")]


@pytest.mark.parametrize(("found_at", "outcome"), SATURATIONS)
def test_g3_can_fail(found_at: Any, outcome: str) -> None:
    verdicts = judge([cell((3, 3, 3), (3, 3, 3), gathers=None, saturation=DeltaInterval(*found_at))])
    assert {one.outcome for one in verdicts if one.claim == "G3"} == {outcome}


SHORTFALLS = [
    (Interval(0.5, 0.4, 0.6), "holds"), (Interval(0.0, -0.1, 0.01), "does not hold"),
    (Interval(0.0, -0.1, 0.1), "undecided"),
]  # fmt: skip


@pytest.mark.parametrize(("shortfall", "outcome"), SHORTFALLS)
def test_the_claim_on_exploration_can_fail(shortfall: Interval, outcome: str) -> None:
    one = cell((3, 3, 3), (3, 3, 3), gathers=None, shortfall={3: shortfall, 7: EXACT})
    verdict = judge([one])[-1]
    assert (verdict.claim, verdict.outcome) == (UNRELIABLE[0], outcome)


def test_one_of_many_cells_that_is_short_by_chance_decides_nothing() -> None:
    found = gather(GatheringPlan(["cmommt"], (4, 8), 10, steps=60, risk=0.9)).cells
    alone = gather(GatheringPlan(["cmommt"], (8,), 10, steps=60, risk=0.9)).cells[0]
    one = found[1]
    assert one.explored is not None
    assert alone.explored is not None
    assert one.shortfall == alone.shortfall
    assert one.explored.high - one.explored.mean > alone.explored.high - alone.explored.mean > 0
    # Outside by the bounds of the cell, but not by those for all cells.
    short = cell((3, 3, 3), (3, 3, 3), gathers=None, shortfall={3: Interval(0.5, 0.1, 0.9), 7: EXACT})
    assert judge([short])[-1].outcome == "holds"
    assert judge([short._replace(explored=Interval(0.5, -0.1, 1.1))])[-1].outcome == "undecided"


SIZES = [
    (4, (2, 2, 3), "G4 small", "holds"), (4, (1, 1, 1), "G4 small", "does not hold"), (4, (2, 1, 2), "G4 small", "undecided"),
    (8, (4, 4, 5), "G4 large", "holds"), (8, (6, 6, 7), "G4 large", "does not hold"), (8, (5, 5, 6), "G4 large", "undecided"),
]  # fmt: skip


@pytest.mark.parametrize(("size", "explore", "claim", "outcome"), SIZES)
def test_g4_can_fail(size: int, explore: Any, claim: str, outcome: str) -> None:
    verdicts = judge([cell(explore, (1, 1, 1), gathers=None, size=size, shortfall=dict.fromkeys(range(size), EXACT))])
    assert {one.outcome for one in verdicts if one.claim == claim} == {outcome}


def test_saturation_is_the_smallest_delta_from_which_on_all_are_enough() -> None:
    shortfall = {
        0: Interval(0.5, 0.4, 0.6), 1: Interval(0.0, -0.1, 0.1), 2: Interval(0.05, 0.03, 0.07),
        3: Interval(0.01, -0.03, 0.05), 7: EXACT,
    }  # fmt: skip
    # With 1 it is as good as with 7, but with 2 it is not: more information may hurt.
    assert saturation(shortfall, 0.02) == DeltaInterval(3, 3, 7)
    assert saturation({0: Interval(-1.0, -1.1, -0.9), 7: EXACT}, 0.02) == (0, 0, 0)


def test_delta_is_bounded_by_the_binomial_distribution() -> None:
    maxima = np.repeat([1, 2, 3], [50, 45, 5])
    # P(max > 2) is 5 of 100: within a risk of 0.05 as a point, and neither refuted nor supported.
    assert delta_interval(maxima, 5, 0.05) == DeltaInterval(2, 2, 3)
    assert delta_interval(maxima[:20], 5, 0.05) == DeltaInterval(1, 1, 4)


def test_a_ratio_of_zeros_is_1_and_of_one_zero_infinite() -> None:
    zero, two = DeltaInterval(0, 0, 0), DeltaInterval(2, 1, 3)
    assert ratio(zero, zero) == (1.0, 1.0, 1.0)
    assert ratio(two, zero) == (math.inf, math.inf, math.inf)
    assert ratio(two, DeltaInterval(1, 0, 2)) == (2.0, 0.5, math.inf)
    assert ratio(zero, two) == (0.0, 0.0, 0.0)


def test_deltas_end_at_all_teammates() -> None:
    assert GatheringPlan().deltas_of(2) == [0, 1]
    assert GatheringPlan().deltas_of(10, (7, 12)) == [0, 1, 2, 3, 4, 6, 7, 8, 9]
    assert GatheringPlan().deltas_of(30, (7, 11))[-4:] == [12, 16, 24, 29]
    assert GatheringPlan(deltas=(3, 1)).deltas_of(10, (7,)) == [0, 1, 3, 7, 9]


WRONG = [
    ({"task": "cmommt"}, "task='cmommt': must be several values"),
    ({"task": [GATHER, replace(GATHER, title="Another")]}, "'gather' is the name of two"),
    ({"task": [replace(GATHER, skilled=None)]}, "the task gather has no skilled team"),
    ({"task": []}, "task: there are none"),
    ({"sizes": (1,)}, "sizes=1: must be at least 2"),
    ({"set": {"robots": 4}}, "robots is N, the size of the team; give it as sizes"),
    ({"set": {"robts": 4}}, "robts: is no parameter of the scenario of cmommt; did you mean 'robots'"),
    ({"set": {"gather.side": 4}}, "'gather.side' is of the task 'gather', which is not compared; the tasks are cmommt"),
    ({"set": {"radius": [3, 4]}}, "radius=[3, 4] has 2 values; give one, or one for each of the 4 sizes"),
    ({"set": {"cmommt.robots": 4}}, "robots is N, the size of the team; give it as sizes"),
    ({"trainings": 300}, "trainings=300: must be at most 200; trainings share the runs, at least one each"),
    ({"degree": "pairwise"}, "degree='pairwise': unknown"),
    ({"runs": 1}, "runs=1: must be at least 2; an interval needs two runs"),
]


@pytest.mark.parametrize(("given", "message"), WRONG, ids=map(str, range(len(WRONG))))
def test_wrong_plans_are_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError)) as raised:
        GatheringPlan(**given)
    assert message in str(raised.value)


def test_cmommt_is_the_usual_task() -> None:
    assert GatheringPlan().tasks == (TASKS["cmommt"],)


def test_cells_that_show_all_teammates_say_nothing_of_what_is_enough() -> None:
    everyone = cell((7, 7, 7), (7, 7, 7), gathers=None, saturation=DeltaInterval(1, 1, 1))
    verdicts = judge([everyone])
    assert "G3" not in {one.claim for one in verdicts}
    assert verdicts[-1].outcome == "undecided"
