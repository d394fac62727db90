"""Tan's tables: the ledger's verdicts follow from intervals, claims can fail, and files are made."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teamsight.analysis.pursuit import reproduce, results
from teamsight.analysis.pursuit.claims import FAILS, HOLDS, UNDECIDED, crossing, crossings, gains, verdicts
from teamsight.analysis.pursuit.conditions import CONDITIONS
from teamsight.analysis.pursuit.ledger import AGREES, DIFFERS, rows
from teamsight.analysis.pursuit.paper import VALUES
from teamsight.analysis.pursuit.plan import Plan
from teamsight.analysis.pursuit.trials import BLOCK, next_trials, trials_of
from teamsight.analysis.reproduction import Request
from teamsight.analysis.runs.simulate import run_rows
from teamsight.tasks.pursuit import Pursuit

SMALL = Plan(runs=2, share=0.02, tests=20, seed=5, names=("1/1 random", "1/1 depth 2", "1/2 one table"))


def _table(condition: str, *, training: Any = (), test: Any = (), curve: Any = ()) -> pd.DataFrame:
    size = max(len(training), len(test), len(curve))
    missing = [math.nan] * size
    columns = {"training": list(training) or missing, "test": list(test) or missing, "curve": list(curve) or missing}
    return pd.DataFrame({"condition": condition, "replicate": range(size), **columns, "neighbours": 1})


def test_all_values_of_tan_have_a_condition() -> None:
    assert sum(value.where.startswith("Table") for value in VALUES) == 28
    assert sum(value.where.startswith("Fig") for value in VALUES) == 9
    assert {value.condition for value in VALUES} <= set(CONDITIONS)


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
    assert trials_of(world).tolist() == [ends[0], *(np.diff(ends) - 1).tolist()]
    assert trials_of(world)[:30].tolist() == lengths.tolist()


def test_verdicts_of_values_follow_from_welchs_interval() -> None:
    value = next(one for one in VALUES if one.where == "Table 3" and one.condition == "1/2 depth 2")
    near = np.array([20.0, 21.0, 20.5, 19.8, 20.6])
    row = rows(_table("1/2 depth 2", training=near, test=near))[0]
    assert row.value == value
    # Tan's error from his half width: Student's t with 4 degrees of freedom at 95 %.
    his, own = value.half / 2.131846786, near.std(ddof=1) / math.sqrt(5)  # type: ignore[operator]
    freedom = (his**2 + own**2) ** 2 / (his**4 / 4 + own**4 / 4)
    wide = stats.t.ppf(0.975, freedom) * math.hypot(his, own)
    assert row.difference == pytest.approx(near.mean() - value.steps)
    assert (row.low, row.high) == pytest.approx((row.difference - wide, row.difference + wide))
    assert row.verdict == AGREES
    assert rows(_table("1/2 depth 2", training=near + 9, test=near))[0].verdict == DIFFERS
    spread = np.array([5.0, 40.0, 10.0, 35.0, 12.0])
    assert rows(_table("1/2 depth 2", training=spread, test=near))[0].verdict == "undecided"


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
    assert [crossings(pd.concat(parts), depth).tolist() for depth in (2, 3, 4)] == [[0.0] * 4] * 3


def test_gains_are_paired_by_run() -> None:
    table = pd.concat([_table("a", curve=[[3.0, 3.0], [5.0, 5.0]]), _table("b", curve=[[1.0, 2.0], [1.0, 1.0]])])
    assert gains(table, "a", "b").tolist() == [[2.0, 1.0], [4.0, 4.0]]


def test_files_are_made_and_not_replaced_by_other_settings(tmp_path: Path) -> None:
    request = Request(tmp_path, formats=("png", "svg"))
    said = results.REPRODUCTION.make(SMALL, request, None, lambda phase, done, total: None)
    assert (
        said[-1] == "Each claim is judged by its own 95 % interval: if nothing made a difference, at most one in 40 "
        "would hold by chance, 0.0 of 0."
    )
    made = {file.name for file in tmp_path.iterdir()}
    assert made == {"pursuit.parquet", "pursuit-ledger.parquet", "pursuit.md", "pursuit.png", "pursuit.svg"}
    text = (tmp_path / "pursuit.md").read_text(encoding="utf-8")
    assert "47.14 ± 1.28" in text
    assert "123.08" in text
    (tmp_path / "pursuit.md").write_text("mine", encoding="utf-8")
    with pytest.raises(ValueError, match=r"pursuit\.md"):
        results.REPRODUCTION.check(SMALL, request)


def test_nothing_is_simulated_if_a_file_of_the_second_part_must_not_be_replaced(tmp_path: Path) -> None:
    (tmp_path / "pursuit-modules.md").write_text("mine", encoding="utf-8")
    request = Request(tmp_path, quick=True)
    with pytest.raises(ValueError, match=r"pursuit-modules\.md"):
        reproduce.reproduce(request, None, lambda phase, done, total: None)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="steps=10: trials end with a capture; give the number of runs"):
        reproduce.reproduce(replace(request, steps=10), None, lambda phase, done, total: None)  # type: ignore[arg-type]
