"""Modules against one table over all: rates and their bounds, sides at a capture, and claims that can fail."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teamsight.analysis.papers.ono_fukumoto1996 import (
    CONDITIONS,
    LATE,
    PAPER,
    PARTS,
    SIDE,
    Surrounding,
    expected_steps,
    information,
    late_steps,
    page_values,
    random_steps,
    verdicts,
)
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED
from teamsight.policies import LatticeWalk
from teamsight.tasks.pursuit import Pursuit

WALK = LatticeWalk(5)
STEPS = 4000


def _runs(condition: str, late: list[int], **more: Any) -> pd.DataFrame:
    runs = len(late)
    parts = [[0] * (PARTS - LATE) + [one // LATE] * LATE for one in late]
    columns: dict[str, Any] = {
        "replicate": range(runs), "steps": STEPS, "late": late, "captures": late, "parts": parts,
        "information": math.nan, "chance": math.nan, "watched": 0,
    }  # fmt: skip
    return pd.DataFrame({"condition": condition, **columns, **more})


def _verdict(table: pd.DataFrame, of: str) -> str:
    return next(one.verdict for one in verdicts(table) if of in one.claim)


def test_captures_and_sides_are_those_of_the_world() -> None:
    how: dict[str, Any] = {"depth": 1, "rule": "surround", "torus": True, "policy": WALK, "prey_policy": WALK}
    measured = Surrounding(3)(Pursuit(4, 1, 3, **how, rng=2), 4000)
    world = Pursuit(4, 1, 3, **how, rng=2)
    sides = np.zeros((4, 4), int)
    for step in range(4000):
        world.step()
        if step >= 2000 and world.recording.history["captures"].iloc[-1]:
            gaps = world.hunters.position - world.prey.position
            gaps -= 3 * np.rint(gaps / 3)
            for hunter, gap in enumerate(gaps.astype(int).tolist()):
                sides[[[1, 0], [-1, 0], [0, 1], [0, -1]].index(gap), hunter] += 1
    captures = world.recording.history["captures"].to_numpy()
    assert measured["captures"] == captures.sum() > 10
    assert measured["late"] == captures[-1000:].sum()
    assert measured["watched"] == sides[0].sum() > 2
    # The mutual information is half the G statistic of the table, over its total, in bits.
    g = stats.chi2_contingency(sides, lambda_="log-likelihood", correction=False)[0]
    assert measured["information"] == pytest.approx(g / (2 * math.log(2) * sides.sum()))


def test_information_of_hunters_that_specialise_and_of_those_that_do_not() -> None:
    rng = np.random.default_rng(1)
    fixed = information(np.tile([2, 0, 3, 1], (50, 1)), rng)
    assert fixed["information"] == pytest.approx(2.0)
    assert fixed["chance"] < 0.2
    mixed = information(rng.permuted(np.tile(np.arange(4), (400, 1)), axis=1), rng)
    # By chance the G statistic, 2 ln 2 · 1600 bit, is like χ² of 9 degrees of freedom: below 40 but once in 100,000.
    assert mixed["information"] < 40 / (2 * math.log(2) * 1600)
    assert information(np.zeros((0, 4), np.int64), rng)["watched"] == 0


def test_random_hunters_have_poissons_interval() -> None:
    table = _runs("random", [3, 5])
    found = random_steps(table, "random")
    assert found.mean == 2 * STEPS / 8
    assert 2 * STEPS / found.low == pytest.approx(stats.chi2.ppf(0.975, 18) / 2)
    assert 2 * STEPS / found.high == pytest.approx(stats.chi2.ppf(0.025, 16) / 2)
    none = random_steps(_runs("random", [0, 0]), "random")
    assert none.mean == none.high == math.inf
    assert none.low == pytest.approx(2 * STEPS / -math.log(0.025))


def test_runs_without_a_capture_leave_the_steps_open() -> None:
    late = STEPS * LATE / PARTS
    some = late_steps(_runs("a", [100, 0, 100]), "a")
    assert some.high == math.inf
    none = late_steps(_runs("a", [0, 0]), "a")
    assert none.mean == math.inf
    assert none.low == pytest.approx(2 * late / -math.log(0.025))
    assert late_steps(_runs("a", [100, 100]), "a").mean == pytest.approx(late / 100)


def test_random_hunters_need_about_as_long_as_the_formula_says() -> None:
    found = []
    for seed in range(3):
        world = Pursuit(4, 1, 4, depth=1, rule="surround", torus=True, policy=WALK, prey_policy=WALK, rng=seed)
        world.run(100_000, progress=False)
        found.append(world.recording.history["captures"].sum())
    # Hunters stay beside the prey, so that it is less: by a factor of 1.7 here. About 80 captures in each.
    assert 0.4 < 300_000 / sum(found) / expected_steps(4) < 0.9


def test_claims_can_hold_fail_and_stay_undecided() -> None:
    random = _runs(f"random, side {SIDE}", [0] * 4)
    many = {"holds": [200, 220, 210, 190], "undecided": [4, 5, 0, 6]}
    for verdict, late in many.items():
        table = pd.concat([random.assign(steps=10**8), _runs("modular, depth 2", late)])
        if verdict == "undecided":
            table = pd.concat([random, _runs("modular, depth 2", late)])
        assert _verdict(table, "O1") == verdict
    often = random.assign(captures=[300, 310, 290, 300])
    assert _verdict(pd.concat([often, _runs("modular, depth 2", many["holds"])]), "O1") == FAILS
    modular = _runs("modular, depth 2", many["holds"])
    for late, verdict in (([0] * 4, HOLDS), (many["holds"], FAILS), ([100, 1, 300, 2], UNDECIDED)):
        assert _verdict(pd.concat([modular, _runs("monolithic, depth 2", late)]), "O2") == verdict
    bits = {"chance": 0.01, "watched": 50}
    for found, verdict in (([1.0, 1.1, 0.9, 1.2], HOLDS), ([0.01, 0.5, 0.0, 0.0], UNDECIDED), ([0.0] * 4, FAILS)):
        table = _runs("modular, depth 2", many["holds"], information=found, **bits)
        assert _verdict(table, "O3") == verdict
    with_three = _runs("nearest 3, depth 2", [100, 110, 90, 100])
    for late, verdict in (([10, 12, 9, 10], HOLDS), ([300, 310, 290, 300], FAILS)):
        assert _verdict(pd.concat([with_three, _runs("nearest 2, depth 2", late)]), "δ = 2") == verdict


def test_every_claim_has_its_conditions() -> None:
    every = pd.concat([_runs(name, [5, 6]) for name in CONDITIONS])
    assert len(verdicts(every)) == 9


def test_tables_of_modules_grow_slowly() -> None:
    assert "| 2 | 26 | 2,028 | 456,976 | 10,140 | 2,284,880 |" in page_values(pd.DataFrame({"condition": []}), PAPER.plan())["sizes"]
