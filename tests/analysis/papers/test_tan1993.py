"""Tan's tables: the ledger's verdicts follow from intervals, claims can fail, and files are made."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teamsight.analysis.papers.tan1993 import (
    BLOCK,
    CONDITIONS,
    VALUES,
    Pursuits,
    crossing,
    crossings,
    gains,
    ledger,
    next_trials,
    verdicts,
)
from teamsight.analysis.runs.planned_runs import run_rows
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED
from teamsight.tasks.pursuit.world import Pursuit

SMALL = Pursuits(runs=2, share=0.02, tests=20, seed=5, names=("1/1 random", "1/1 depth 2", "1/2 one table"))


def _table(condition: str, *, training: Any = (), test: Any = (), curve: Any = ()) -> pd.DataFrame:
    size = max(len(training), len(test), len(curve))
    missing = [math.nan] * size
    columns = {"training": list(training) or missing, "test": list(test) or missing, "curve": list(curve) or missing}
    return pd.DataFrame({"condition": condition, "replicate": range(size), **columns, "neighbours": 1})


def _first(condition: str, **more: Any) -> Any:
    return ledger(_table(condition, **more)).iloc[0]


def test_all_values_of_tan_have_a_condition() -> None:
    every = pd.concat([_table(name, training=[1.0, 2.0], test=[1.0, 2.0]) for name in CONDITIONS])
    found = ledger(every)
    assert found["where"].str.startswith("Table").sum() == 28
    assert found["where"].str.startswith("Fig").sum() == 9
    assert {line.split("|")[1].strip() for line in VALUES.strip().splitlines()} == set(found["condition"])


def test_every_run_can_be_repeated_from_its_row() -> None:
    table = run_rows(SMALL.planned())
    assert len(table) == 6
    again = run_rows(SMALL.planned())
    assert table.equals(again)
    row = table[(table["condition"] == "1/1 depth 2") & (table["replicate"] == 1)].iloc[0]
    world = Pursuit(**CONDITIONS["1/1 depth 2"].parameters, rng=int(row["seed"]))
    lengths = next_trials(world, BLOCK)
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
