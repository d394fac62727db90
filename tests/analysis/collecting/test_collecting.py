"""The claims on schemes of reinforcement: what each rule decides, the page, and the runs that a plan makes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.collecting.claims import OURS, RECALLED, TOUZET, difference, values, verdicts
from teamsight.analysis.collecting.figure import draw
from teamsight.analysis.collecting.learning import INTRUDER_ROWS
from teamsight.analysis.collecting.page import page, summary
from teamsight.analysis.collecting.plan import CODINGS, SCHEMES, Plan
from teamsight.analysis.collecting.reproduce import reproduce
from teamsight.analysis.reproduction import Request
from teamsight.analysis.reproductions import REPRODUCTIONS
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED
from teamsight.policies.basis import CLEAR_ROWS, share_correct

SMALL = Plan(runs=2, times=(300, 600), judged=300, tests=2, steps=100, sizes=(3, 5))
# Shares of rows right, of those with an intruder, and pucks, as Mataric's order would have it.
AS_SAID = {
    "delayed": (0.3, 0.2, 8.0), "events": (0.6, 0.2, 10.0), "events + H": (0.65, 0.2, 10.0), "events + I": (0.7, 0.9, 11.0),
    "progress": (0.9, 0.9, 12.0), "count": (0.9, 0.9, 13.0), "ring": (0.9, 0.9, 14.0),
}  # fmt: skip


def table(spread: float = 0.01, **changed: tuple[float, float, float]) -> pd.DataFrame:
    """Return a table of made-up runs, which differ by a little noise."""
    rng, rows = np.random.default_rng(5), []
    found = {**AS_SAID, "random": (0.0, 0.0, 3.0), "by hand": (1.0, 1.0, 15.0)}
    for name, shares in changed.items():
        found[name.replace("_", " ")] = shares
    for size in (4, 12):
        for condition, (correct, intruder, pucks) in found.items():
            if size == 12 and condition in SCHEMES and condition != "progress":
                continue
            for replicate in range(20):
                noise = rng.normal(0.0, spread, 4)
                share = correct + noise[0]
                rows.append({
                    "condition": condition, "robots": size, "replicate": replicate, "seed": replicate,
                    "curve": [share] * 7, "rows": [share] * 16, "correct": share, "correct_intruder": intruder + noise[1],
                    "delivered_early": pucks + noise[2], "delivered": pucks + noise[3], "slept_at_home": 0.5,
                })  # fmt: skip
    return pd.DataFrame(rows)


def found(data: pd.DataFrame) -> list[str]:
    return [one.verdict for one in verdicts(data, Plan())]


def test_claims_agree_where_shares_are_as_mataric_is_recalled() -> None:
    assert found(table()) == ["agrees"] * 6 + [HOLDS] * 5


def test_claims_differ_where_they_are_the_other_way_round() -> None:
    data = table(
        delayed=(0.95, 0.5, 14.0), events=(0.92, 0.5, 10.0), **{"events_+_H": (0.6, 0.95, 10.0)},
        count=(0.9, 0.9, 11.0), ring=(0.9, 0.9, 11.0),
    )  # fmt: skip
    data.loc[data["condition"] == "events + H", "correct_intruder"] += 0.75
    assert found(data) == ["differs"] * 6 + [FAILS] * 5


def test_wide_intervals_decide_nothing() -> None:
    data = table()
    sign = np.where(data["replicate"] % 2 == 0, 1.0, -1.0)
    number = data["condition"].map({name: place for place, name in enumerate(AS_SAID, 1)}).fillna(0.0)
    for column in ("correct", "correct_intruder", "delivered_early", "delivered"):
        # The mean of each condition is the same; its differences to others change sign from run to run.
        data[column] = 0.25 + 0.1 * sign * number
    assert set(found(data)) == {UNDECIDED}


def test_what_is_recalled_never_holds() -> None:
    for data in (table(), table(spread=40.0)):
        for one in verdicts(data, Plan()):
            assert one.source in (RECALLED, TOUZET, OURS)
            assert (one.source == RECALLED) <= (one.verdict not in (HOLDS, FAILS))


def test_differences_are_paired_by_run() -> None:
    data = table()
    shuffled = data.sample(frac=1.0, random_state=1)
    assert difference(shuffled, "count", "progress", "delivered", 4) == difference(data, "count", "progress", "delivered", 4)
    expected = values(data, "count", "delivered", 4) - values(data, "progress", "delivered", 4)
    assert difference(data, "count", "progress", "delivered", 4).mean == pytest.approx(expected.mean())


def test_runs_are_paired_and_scored_by_their_own_tables() -> None:
    planned = list(SMALL.planned())
    data = run_rows(planned)
    # The first size has all conditions; the others the codings, and what learns nothing.
    assert len(data) == 2 * (5 + 2 + 2) + 2 * (1 + 2 + 2)
    assert (data.groupby(["robots", "replicate"])["seed"].nunique() == 1).all()
    assert data["seed"].nunique() == 4
    tests = {seed for _, run in planned for seed in run.measure.tests}  # type: ignore[attr-defined]
    assert len(tests) == 2 * 2 * 2
    assert not tests & set(data["seed"])
    hand = data[data["condition"] == "by hand"]
    assert (hand["correct"] == 1.0).all()
    for columns, run in planned:
        if columns["condition"] == "progress":
            world = run.model(**run.parameters, rng=run.seed)  # type: ignore[misc]
            world.run(300)
            policy, state = world.robots.policy, world.robots.policy_state  # type: ignore[attr-defined]
            row = data[(data["seed"] == run.seed) & (data["condition"] == "progress")].iloc[0]
            assert row["correct"] == row["curve"][0] == share_correct(policy.values(state))
            assert row["correct_intruder"] == pytest.approx(np.mean([row["rows"][one] for one in INTRUDER_ROWS]))
    assert set(INTRUDER_ROWS) < set(CLEAR_ROWS)


def test_the_weights_have_the_sum_one() -> None:
    for policy in [*SCHEMES.values(), *CODINGS.values()]:
        assert sum(policy.parameters[1:4]) == pytest.approx(0.0 if policy.scheme == "delayed" else 1.0)
    assert SCHEMES["events + H"].parameters[2] == SCHEMES["events + I"].parameters[3] == 0.0


def test_a_reproduction_writes_table_page_and_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("teamsight.analysis.collecting.reproduce._QUICK", {"times": (300, 600), "judged": 300, "tests": 1})
    with WorkerPool(1) as pool:
        lines = reproduce(
            Request(tmp_path, runs=2, steps=60, quick=True, formats=("svg",)), pool, lambda phase, done, total: None
        )
    assert "claims that are recalled" in lines[0]
    assert {path.name for path in tmp_path.iterdir()} == {"collecting.parquet", "collecting.md", "collecting.svg"}
    assert "no reproduction of numbers" in (tmp_path / "collecting.md").read_text(encoding="utf-8")
    assert "collect" in REPRODUCTIONS


def test_the_page_has_each_condition_and_row() -> None:
    text = page(table(), Plan())
    assert all(f"| {name} |" in text for name in AS_SAID)
    assert text.count("| no |") == 5
    assert text.count("| yes |") == len(CLEAR_ROWS)
    assert len(summary(table(), Plan())) == 12
    assert draw(table(), Plan()).startswith(b"\x89PNG")
