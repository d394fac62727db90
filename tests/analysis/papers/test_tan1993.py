"""Tan's tables: the ledger's verdicts follow from intervals, claims can fail, and files are made."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teamsight.analysis.papers import tan1993
from teamsight.analysis.papers.tan1993 import (
    BLOCK,
    CONDITIONS,
    READINGS,
    REPORTED,
    EndlessError,
    Learning,
    Pursuits,
    Reading,
    Reported,
    crossing,
    crossings,
    gains,
    ledger,
    next_trials,
    runs_of,
    verdicts,
)
from teamsight.analysis.papers.tan1993_readings import Readings, at_most_half, counts, levers
from teamsight.analysis.papers.tan1993_readings import verdicts as scanned
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED
from teamsight.policies import BoundedPreyQ, BoundedWalk
from teamsight.tasks.pursuit import Pursuit

DOCS = Path(__file__).resolve().parents[3] / "docs" / "tasks"
SMALL = Pursuits(runs=2, share=0.02, tests=20, seed=5, names=("1/1 random", "1/1 depth 2", "1/2 one table"))


def _table(condition: str, *, training: Any = (), test: Any = (), curve: Any = ()) -> pd.DataFrame:
    size = max(len(training), len(test), len(curve))
    missing = [math.nan] * size
    columns = {"training": list(training) or missing, "test": list(test) or missing, "curve": list(curve) or missing}
    return pd.DataFrame({"reading": "ours", "condition": condition, "replicate": range(size), **columns, "neighbours": 1})


def _first(condition: str, **more: Any) -> Any:
    return ledger(_table(condition, **more)).iloc[0]


def test_all_values_of_tan_have_a_condition() -> None:
    every = pd.concat([_table(name, training=[1.0, 2.0], test=[1.0, 2.0]) for name in CONDITIONS])
    found = ledger(every)
    # 28 in tables, of which 12.21 is in two; 9 in figures, of which two are in a table too.
    assert found["where"].str.startswith("Table").sum() == 28 - 1
    assert found["where"].str.startswith("Fig").sum() == 9 - 2
    assert not found.duplicated(["condition", "phase"]).any()
    assert {value.condition for value in REPORTED} == set(found["condition"])


def test_every_run_can_be_repeated_from_its_row() -> None:
    table = run_rows(SMALL.planned())
    assert len(table) == len(READINGS) * 6
    again = run_rows(SMALL.planned())
    assert table.equals(again)
    rows = table[(table["condition"] == "1/1 depth 2") & (table["replicate"] == 1)].set_index("reading")
    for name, reading in READINGS.items():
        row = rows.loc[name]
        world = Pursuit(**CONDITIONS["1/1 depth 2"].parameters(reading), rng=int(row["seed"]))
        lengths = next_trials(world, BLOCK, soon=name != "ours")
        assert row["trials"] == BLOCK
        assert row["curve"] == [lengths.mean()]
        assert row["training"] == lengths.mean()


def test_trials_are_counted_from_the_history() -> None:
    world = Pursuit(side=4, depth=1, rng=1)
    lengths = next_trials(world, 30)
    history = world.recording.history
    # Each ended trial is followed by a step that begins the next.
    ends = np.flatnonzero(history["captures"]) + 1
    assert lengths.tolist() == [ends[0], *(np.diff(ends) - 1).tolist()][:30]


def test_training_ends_soon_if_wished_and_has_the_same_trials() -> None:
    parameters = CONDITIONS["2/2 joint passive"].parameters()
    worlds = [Pursuit(**parameters, rng=3) for _ in range(2)]
    late, soon = (next_trials(world, 2000, soon=soon) for world, soon in zip(worlds, (False, True), strict=True))
    assert np.array_equal(late, soon)
    # So much is made at once at most, and each trial has a step that begins it.
    assert worlds[1].tick <= soon.sum() + len(soon) + 20_000
    assert worlds[0].tick > worlds[1].tick


def test_verdicts_of_values_follow_from_welchs_interval() -> None:
    near = np.array([20.0, 21.0, 20.5, 19.8, 20.6])
    row = _first("1/2 depth 2", training=near, test=near)
    assert (row["where"], row["phase"], row["steps"], row["half"]) == ("Table 3", "training", 20.38, 0.57)
    # Tan's error from his half width: Student's t with 4 degrees of freedom at 95 %.
    his, own = row["half"] / 2.131846786, near.std(ddof=1) / math.sqrt(5)
    freedom = (his**2 + own**2) ** 2 / (his**4 / 4 + own**4 / 4)
    wide = stats.t.ppf(0.975, freedom) * math.hypot(his, own)
    assert row["difference"] == pytest.approx(near.mean() - row["steps"])
    assert (row["low"], row["high"]) == pytest.approx((row["difference"] - wide, row["difference"] + wide))
    assert row["verdict"] == "agrees"
    assert _first("1/2 depth 2", training=near + 9, test=near)["verdict"] == "differs"
    spread = np.array([5.0, 40.0, 10.0, 35.0, 12.0])
    assert _first("1/2 depth 2", training=spread, test=near)["verdict"] == "undecided"


def test_claims_can_hold_fail_and_stay_undecided() -> None:
    found = {}
    for name, shift in (("holds", 10.0), ("fails", -10.0), ("undecided", 0.0)):
        base = np.array([50.0, 52.0, 49.0, 51.0])
        other = base - shift + np.array([0.5, -0.4, 0.3, -0.3])
        table = pd.concat(
            [
                _table("2/2 joint", training=base, curve=[[100.0] * 200] * 4),
                _table("2/2 joint passive", training=other, curve=[[100.0 - shift] * 200] * 4),
            ]
        )
        found[name] = next(one.verdict for one in verdicts(table) if one.claim == "Seeing the partner helps")
    assert found == {"holds": HOLDS, "fails": FAILS, "undecided": UNDECIDED}


def test_the_crossing_is_where_the_gain_stays_positive() -> None:
    gain = np.concatenate([np.full(10, -1.0), np.full(20, 1.0)])
    assert BLOCK * 8 <= crossing(gain) <= BLOCK * 12
    assert crossing(-gain) == math.inf
    assert crossing(np.ones(30)) == 0.0


def test_a_longer_training_does_not_move_the_crossing() -> None:
    dip = [100.0] * 60 + [100.0, 40.0] * 70
    parts = [_table("2/2 joint", training=np.ones(4), curve=[dip] * 4)]
    parts.append(_table("2/2 joint passive", training=np.ones(4), curve=[[90.0] * 200] * 4))
    for depth in (2, 3):
        parts.append(_table(f"2/2 joint, depth {depth}", training=np.ones(4), curve=[[100.0] * 60] * 4))
        parts.append(_table(f"2/2 joint passive, depth {depth}", training=np.ones(4), curve=[[90.0] * 60] * 4))
    assert [one.tolist() for one in crossings(pd.concat(parts)).values()] == [[0.0] * 4] * 3


def test_gains_are_paired_by_run() -> None:
    table = pd.concat([_table("a", curve=[[3.0, 3.0], [5.0, 5.0]]), _table("b", curve=[[1.0, 2.0], [1.0, 1.0]])])
    assert gains(table, "a", "b").tolist() == [[2.0, 1.0], [4.0, 4.0]]


def test_a_value_is_near_within_a_tenth_and_two_steps_more_in_a_picture() -> None:
    for where, off in (("Table 1", 0.0), ("Fig. 7", 2.0)):
        value = Reported(where, "1/1 random", "training", 40.0, math.nan)
        assert [value.is_near(40.0 + sign * (4.0 + off)) for sign in (-1, 1)] == [True, True]
        assert [value.is_near(40.0 + sign * (4.01 + off)) for sign in (-1, 1)] == [False, False]


def test_the_interval_of_what_is_read_off_a_picture_is_longer() -> None:
    near = np.array([49.9, 50.1, 50.0])
    drawn = _first("2/2 joint passive", training=near)
    assert (drawn["where"], drawn["verdict"]) == ("Fig. 7", "agrees")
    assert _first("2/2 joint passive", training=near + 2)["verdict"] == "differs"
    half = (drawn["high"] - drawn["low"]) / 2
    assert half == pytest.approx(2.0 + stats.t.ppf(0.975, 2) * near.std(ddof=1) / math.sqrt(3))


def test_tests_are_greedy_or_soft_by_the_reading_and_leave_the_tables_as_they_are() -> None:
    found, tables = {}, {}
    for soft in (False, True, None):
        world = Pursuit(**CONDITIONS["1/1 depth 2"].parameters(), rng=3)
        found[soft] = Learning(BLOCK, 40, soft=soft)(world, 1)
        tables[soft] = world.hunters.policy_state.floats
        policy = world.hunters.policy
        assert (policy.learning_rate, policy.temperature) == (0.0, 0.0 if soft is False else 0.4)
    assert tables[None].any()
    assert np.array_equal(tables[False], tables[True])
    assert np.array_equal(tables[False], tables[None])
    assert found[False]["test"] == found[None]["test"] != found[True]["test"]
    assert "soft" in found[None]
    with pytest.raises(EndlessError, match=r"trials=9: only 0 have ended after 3 steps; give a smaller share"):
        next_trials(Pursuit(1, 1, 50, rng=1), 9, most=3)


def test_a_test_without_end_has_an_infinite_mean_where_both_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tan1993, "_LONGEST_TEST", 10)
    world = Pursuit(**CONDITIONS["1/1 depth 2"].parameters(), rng=3)
    found = Learning(BLOCK, 40)(world, 1)
    assert (found["test"], found["soft"]) == (math.inf, math.inf)
    assert math.isfinite(found["training"])
    assert not any(value.is_near(math.inf) for value in REPORTED)
    assert [next(runs_of(SMALL, "2/2 joint", one))[1].measure.soft for one in READINGS.values()] == [False, True, True]


def test_readings_change_what_they_name() -> None:
    def parameters(name: str, **more: bool) -> dict[str, Any]:
        return CONDITIONS[name].parameters(Reading(**more))

    ours = parameters("2/2 joint")
    assert not {"order", "diagonals", "prey_policy"} & set(ours)
    assert parameters("2/2 joint", in_turn=True)["order"] == "in turn"
    assert parameters("2/2 joint", sides=True)["diagonals"] is False
    assert parameters("2/2 joint", legal_prey=True)["prey_policy"] == BoundedWalk()
    assert isinstance(parameters("2/2 joint", legal_hunters=True)["policy"], BoundedPreyQ)
    assert parameters("1/1 random", legal_hunters=True)["policy"] == BoundedWalk()
    assert (ours["policy"].values_ends, parameters("2/2 joint", no_value=True)["policy"].values_ends) == (True, False)
    assert "order" not in parameters("1/1 depth 4", in_turn=True)
    halves = [next(runs_of(SMALL, "2/2 joint", Reading(short=short)))[0]["trials"] for short in (False, True)]
    assert halves == [200, 100]


def test_the_scan_counts_each_value_once_under_each_reading() -> None:
    plan = Readings(runs=1, share=0.001, tests=2, seed=4, names=("1/1 random", "1/1 depth 2"))
    rows = [columns for columns, _ in plan.planned()]
    # Random hunters do not learn; where one captures, the order and the neighbourhood are not open.
    assert [sum(row["condition"] == name for row in rows) for name in plan.names] == [4, 16]
    assert len({tuple(row[one] for one in ("condition", *Reading._fields[:-1])) for row in rows}) == len(rows)
    table = pd.DataFrame(rows)
    is_right = table["legal_prey"] & ~table["no_value"]
    table["training"] = np.where(table["condition"] == "1/1 random", 123.0, np.where(is_right, 47.0, 90.0))
    table["test"], table["soft"] = 10.0, 49.0
    found = counts(table)
    assert len(found) == 64 + 8
    # One value of random hunters; one of training, if both points are read so; one of tests, if they are soft.
    expected = 1 + (found["legal_prey"] & ~found["no_value"]) + found["soft"]
    assert (found["near"] == expected).all()
    assert found.iloc[0][list(Reading._fields)].tolist() == [False, True, False, False, False, False, True]
    assert levers(found) == {
        "in_turn": (0, 0.0), "legal_prey": (1, 20 / 36), "legal_hunters": (0, 0.0), "sides": (0, 0.0),
        "no_value": (0, -0.5), "short": (0, 0.0), "soft": (1, 1.0),
    }  # fmt: skip
    assert [one.verdict for one in scanned(table, plan)] == [UNDECIDED, FAILS]


def test_the_largest_of_many_counts_of_one_run_decides_only_far_from_half() -> None:
    assert [at_most_half(most, 34) for most in (11, 12, 15, 18, 22, 23)] == [HOLDS, *[UNDECIDED] * 4, FAILS]


def test_the_page_says_how_many_values_agree_under_each_reading() -> None:
    page = (DOCS / "pursuit.md").read_text(encoding="utf-8")
    table = pd.read_parquet(DOCS / "pursuit.parquet")
    for name in READINGS:
        rows = ledger(table, name)
        exactly = int((rows["difference"].abs() <= 0.1 * rows["steps"]).sum())
        agree, claims = (rows["verdict"] == "agrees").sum(), verdicts(table, reading=name)
        hold = sum(one.verdict == HOLDS for one in claims)
        assert f"| {name} | {rows['near'].sum()} of 34 | {exactly} | {agree} | {hold} of {len(claims)} |" in page
    best = counts(pd.read_parquet(DOCS / "pursuit-readings.parquet")).iloc[0]
    assert Reading(*best[list(Reading._fields)].astype(bool)) == READINGS["best"]
