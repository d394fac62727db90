"""The claims on communication: what each rule decides, and the runs that a plan makes."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.papers.balch_arkin1994 import (
    Communication,
    UntilDone,
    gain,
    gains_by,
    page_values,
    verdicts,
)
from teamsight.analysis.papers.reproduction import column
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED
from teamsight.tasks import TASKS

SMALL = Communication(runs=2, steps=300, robots=(2, 3), attractors=(1,))


def table(spread: float = 5.0, **share: float) -> pd.DataFrame:
    """Return a table in which each level of communication takes a share of the time without, 1 by default."""
    rng, rows = np.random.default_rng(5), []
    for task in ("forage", "consume", "graze"):
        for robots in (2, 5):
            for replicate in range(30):
                base = 1000.0 / robots + rng.normal(0, 20)
                for level in ("none", "state", "goal"):
                    time = base * share.get(f"{task}_{level}", 1.0) + rng.normal(0, spread)
                    rows.append((task, robots, 3 if task != "graze" else 0, replicate, level, time, False, robots - 1))
    columns = ["task", "robots", "attractors", "replicate", "communication", "time", "censored", "max_neighbours"]
    return pd.DataFrame(rows, columns=columns)


def found(data: pd.DataFrame) -> list[str]:
    return [one.verdict for one in verdicts(data)]


def test_claims_hold_where_times_are_as_balch_and_arkin_say() -> None:
    data = table(forage_goal=0.81, forage_state=0.83, consume_state=0.9, consume_goal=0.93)
    assert found(data) == [HOLDS, "agrees", "agrees", HOLDS, "agrees", HOLDS, HOLDS, HOLDS]


def test_claims_fail_where_times_are_the_other_way_round() -> None:
    data = table(forage_goal=0.9, forage_state=1.1, consume_state=1.1, consume_goal=0.9, graze_state=1.2, graze_goal=0.8)
    assert found(data) == [HOLDS, "differs", "agrees", FAILS, "differs", FAILS, FAILS, FAILS]


def test_wide_intervals_decide_nothing() -> None:
    assert set(found(table(spread=600.0)[lambda data: data["replicate"] < 4])) == {UNDECIDED}


def test_goals_without_a_gain_leave_nothing_to_share() -> None:
    last = verdicts(table(forage_goal=1.1, forage_state=1.1))[-1]
    assert last.verdict == UNDECIDED
    assert "goals gain nothing" in last.measured


def test_a_gain_is_the_share_of_the_mean_time() -> None:
    data = table(spread=0.0, forage_goal=0.75)
    assert gain(data, "forage", "goal", "none") == pytest.approx((0.25, 0.25, 0.25))
    assert "| forage | goal over none | 19 % | +25.0 % (+25.0 to +25.0) | +25.0 % at N =" in page_values(data, SMALL)["percentages"]


def test_gains_of_opposite_sign_that_cancel_in_all_stand_by_number_of_attractors() -> None:
    one, alone = table(spread=0.0, forage_goal=0.8, forage_state=0.9), table(spread=0.0, forage_goal=0.1)
    many = table(spread=0.0, forage_goal=1.2).assign(attractors=lambda data: data["attractors"].replace(3, 7))
    # What a single robot gains is no matter of communication.
    found = gains_by(pd.concat([many, one, alone.assign(robots=1)], ignore_index=True)).splitlines()
    assert found[0] == "| task | attractors | state over none (95 %) | goal over none (95 %) |"
    assert found[2:5] == [
        "| forage | 3 | +10.0 % (+10.0 to +10.0) | +20.0 % (+20.0 to +20.0) |",
        "| forage | 7 | +0.0 % (+0.0 to +0.0) | −20.0 % (−20.0 to −20.0) |",
        found[4],
    ]
    assert found[4].startswith("| forage | all | +5.0 % (")
    assert "| +0.0 % (−" in found[4]
    assert [row.split(" | ")[:2] for row in found[5:]] == [["| consume", one] for one in ("3", "7", "all")]
    assert len(gains_by(alone.assign(robots=1)).splitlines()) == 2


def test_the_interval_of_a_gain_covers_the_ratio_of_means() -> None:
    rng, covered = np.random.default_rng(3), 0
    base = table()
    for _ in range(200):
        data = base[base["task"] == "forage"].copy()
        data["time"] = rng.normal(100.0, 30.0, len(data)) * np.where(data["communication"] == "goal", 0.8, 1.0)
        interval = gain(data, "forage", "goal", "none")
        covered += interval.low <= 0.2 <= interval.high
    # 190 are expected; fewer than 178 or more than 199 have a probability below 1e-3.
    assert 178 <= covered <= 199


def test_runs_are_paired_and_stop_when_they_are_done() -> None:
    data = run_rows(SMALL.planned())
    assert len(data) == 2 * (2 + 2 + 2) * 3
    assert (data.groupby(["task", "robots", "replicate"])["seed"].nunique() == 1).all()
    # Forage and consume meet the same places.
    assert data["seed"].nunique() == 8
    assert (data[data["censored"]]["time"] == 300).all()
    assert len(column(data, "time", task="graze", communication="goal")) == 4
    task = TASKS["graze"]
    world = task.build("skilled", rng=1, robots=20, side=20.0, obstacles=0.0)
    assert UntilDone(task)(world, 8000)["time"] < 250 == world.tick
