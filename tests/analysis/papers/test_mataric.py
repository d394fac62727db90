"""The claims on schemes of reinforcement: what each rule decides, and the runs that a plan makes."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.papers.mataric import OURS, SCHEMES, TOUZET, Collecting, differences, verdicts
from teamsight.analysis.papers.reproduction import RECALLED, column
from teamsight.analysis.runs.planned_runs import run_rows
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED
from teamsight.policies.basis import CLEAR_ROWS
from teamsight.policies.basis.basis_behaviours import share_correct

SMALL = Collecting(runs=2, times=(300, 600), judged=300, tests=2, steps=100, sizes=(3, 5))
INTRUDERS = [row for row in CLEAR_ROWS if row & 1]
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
    return [one.verdict for one in verdicts(data, Collecting())]


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
    for name in ("correct", "correct_intruder", "delivered_early", "delivered"):
        # The mean of each condition is the same; its differences to others change sign from run to run.
        data[name] = 0.25 + 0.1 * sign * number
    assert set(found(data)) == {UNDECIDED}


def test_what_is_recalled_never_holds() -> None:
    for data in (table(), table(spread=40.0)):
        for one in verdicts(data, Collecting()):
            assert one.source in (RECALLED, TOUZET, OURS)
            assert (one.source == RECALLED) <= (one.verdict not in (HOLDS, FAILS))


def test_differences_are_paired_by_run() -> None:
    data = table()
    shuffled = data.sample(frac=1.0, random_state=1)
    found = differences(shuffled, "count", "progress", "delivered", 4)
    count, progress = (column(data, "delivered", condition=name, robots=4) for name in ("count", "progress"))
    assert found.tolist() == (count - progress).tolist()


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
            assert row["correct_intruder"] == pytest.approx(np.mean([row["rows"][one] for one in INTRUDERS]))
    assert set(INTRUDERS) < set(CLEAR_ROWS)


def test_the_weights_have_the_sum_one() -> None:
    policies = SMALL.policies(3)
    for name in ("delayed", "events", "events + H", "events + I", "progress", "count", "ring"):
        assert sum(policies[name].parameters[1:4]) == pytest.approx(0.0 if name == "delayed" else 1.0)
    assert policies["events + H"].parameters[2] == policies["events + I"].parameters[3] == 0.0
