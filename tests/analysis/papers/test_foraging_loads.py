"""The study of loads: its runs, its gains by mass and number, and what each rule decides."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.papers.balch_arkin1994 import gains_by
from teamsight.analysis.papers.foraging_loads import Loads, less, saved, verdicts
from teamsight.analysis.papers.reproduction import column
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats.paired import Interval
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED


def table(goal: dict[tuple[float, bool], float], spread: float = 1.0) -> pd.DataFrame:
    """Return a table in which goals take a share of the time without, by the mass and whether there are several."""
    rng, rows = np.random.default_rng(3), []
    for mass in (50.0, 5.0):
        for attractors in (1, 7):
            for robots in (2, 5):
                for replicate in range(20):
                    base = 1000.0 + mass + rng.normal(0, 100)
                    for level in ("none", "state", "goal"):
                        share = goal.get((mass, attractors > 1), 1.0) if level == "goal" else 1.0
                        time = base * share + rng.normal(0, spread)
                        rows.append(("forage", mass, attractors, robots, replicate, level, time))
    return pd.DataFrame(rows, columns=["task", "mass", "attractors", "robots", "replicate", "communication", "time"])


@pytest.mark.parametrize(
    ("goal", "wanted"),
    [
        ({(5.0, False): 0.9, (5.0, True): 1.2, (50.0, True): 0.9}, [HOLDS, HOLDS, HOLDS, HOLDS]),
        ({(5.0, False): 1.1, (5.0, True): 0.9, (50.0, True): 1.1}, [FAILS, FAILS, FAILS, FAILS]),
        # With loads that cost less and still cost, only the difference is a gain.
        ({(5.0, False): 0.9, (5.0, True): 1.2, (50.0, True): 1.1}, [HOLDS, HOLDS, FAILS, HOLDS]),
    ],
)  # fmt: skip
def test_claims_are_judged_by_mass_and_number(goal: dict[tuple[float, bool], float], wanted: list[str]) -> None:
    assert [one.verdict for one in verdicts(table(goal), Loads(mass=(5.0, 50.0)))] == wanted


def test_wide_intervals_and_missing_cells_decide_nothing() -> None:
    plan = Loads(mass=(5.0, 50.0))
    wide = table({})
    # Goals save half of the time in every second run, and cost as much in the others.
    wide.loc[wide["communication"] == "goal", "time"] *= 1.0 - 0.5 * (-1.0) ** wide["replicate"]
    assert {one.verdict for one in verdicts(wide, plan)} == {UNDECIDED}
    only = verdicts(table({})[lambda data: data["attractors"] == 1], plan)
    assert [one.measured for one in only[1:]] == ["not known"] * 3
    assert {one.verdict for one in only[1:]} == {UNDECIDED}
    assert math.isnan(saved(table({}).iloc[:0]).mean)


def test_a_difference_of_independent_gains_has_the_root_of_the_sum_of_squares() -> None:
    found = less(Interval(5.0, 2.0, 8.0), Interval(1.0, -3.0, 5.0))
    assert found == pytest.approx((4.0, -1.0, 9.0))


def test_runs_of_all_masses_are_paired_with_themselves() -> None:
    data = table({(5.0, True): 0.5}, spread=0.0)
    mixed = data.sample(frac=1.0, random_state=1)
    none, goal = (column(mixed, "time", communication=level) for level in ("none", "goal"))
    share = goal / none
    assert sorted(set(share.round(9))) == [0.5, 1.0]
    assert gains_by(data, "mass").splitlines()[2] == "| 50 | 1 | +0.0 % (+0.0 to +0.0) | +0.0 % (+0.0 to +0.0) |"
    assert gains_by(data, "mass").splitlines()[6].startswith("| 5 | 7 | +0.0 % (+0.0 to +0.0) | +50.0 % (")


def test_levels_meet_the_same_places_and_masses_and_teams_others() -> None:
    data = run_rows(Loads(runs=2, steps=20, robots=(2, 3), attractors=(1,), mass=(5.0, 20.0)).planned())
    assert len(data) == 2 * 2 * 2 * 3
    assert (data.groupby(["mass", "robots", "replicate"])["seed"].nunique() == 1).all()
    assert data["seed"].nunique() == 8
