"""The diagnosis, on memories small enough to say by hand what it must find."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.learning.diagnosis import (
    BINS,
    DISTANCES,
    action_effect,
    approach,
    diagnose_explorations,
    diagnose_memory,
    diagnosis_points,
    matched_share,
    rewarded_share,
    shown_share,
    single_targets,
)
from teamsight.analysis.learning.diagnosis import memory_of as explored
from teamsight.analysis.learning.diagnosis_figure import draw, page
from teamsight.analysis.learning.plans import Diagnosis
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.policies import LazyQ
from teamsight.policies.lazy.lazy_q import shipped
from teamsight.policies.memory import LazyMemory

DOCS = Path(__file__).parents[3] / "docs"
OWN = 8
TINY = Diagnosis(samples=(60, 600), memories=2, learners=("lazy", "regression", "tabular"), k=3)


def bearing(sector: int) -> float:
    """Return the bearing of a sector as a rotation in (−π, π]."""
    return math.remainder(2 * math.pi * sector / OWN, 2 * math.pi)


def memory_of(rows: list[tuple[dict[int, float], float, float, int, int]]) -> LazyMemory:
    """Return a memory of transitions (readings by sector, rotation, share of the step, gained, lost)."""
    situation = np.ones((len(rows), OWN))
    for row, (readings, *_) in enumerate(rows):
        situation[row, list(readings)] = list(readings.values())
    _, rotation, share, gained, lost = zip(*rows, strict=True)
    facts = {"gained": gained, "lost": lost}
    return LazyMemory.of(situation, np.stack([rotation, share], axis=1), np.ones_like(situation), facts, own=OWN)


def gained_less_lost(memory: LazyMemory) -> Any:
    return memory.fact("gained") - memory.fact("lost")


@pytest.mark.short
def test_the_effect_counts_clear_moves_among_single_targets_only() -> None:
    toward, away = bearing(3), bearing(7)
    memory = memory_of(
        [
            ({3: 0.93}, toward, 1.0, 1, 0),
            ({3: 0.92}, toward - 0.7, 0.6, 0, 0),
            ({3: 0.94}, away, 1.0, 0, 1),
            ({3: 0.94}, away - 0.7, 1.0, 0, 1),
            # Sideways, half a step, two targets, none.
            ({3: 0.93}, toward - 0.9, 1.0, 0, 9),
            ({3: 0.93}, toward, 0.5, 0, 9),
            ({3: 0.93, 5: 0.2}, toward, 1.0, 0, 9),
            ({}, toward, 1.0, 0, 9),
            # At another distance.
            ({0: 0.5}, bearing(0), 1.0, 3, 0),
        ]
    )
    found = action_effect(memory, gained_less_lost)
    expected = np.full((2, BINS), np.nan)
    expected[:, 18] = 0.5, -1.0
    expected[0, 10] = 3.0
    np.testing.assert_array_equal(found, expected)


def blind_memory() -> LazyMemory:
    """Return transitions that teach to approach a target at 0.6 ranges, and many in which nothing is sensed."""
    seen = [({sector: 0.6}, bearing(sector), 1.0, 1, 0) for sector in range(OWN)]
    nothing = [({}, math.pi / 2, 0.25, 0, 0)] * 4
    return memory_of(seen + nothing)  # type: ignore[arg-type]


@pytest.mark.short
def test_a_target_at_the_rim_is_matched_with_nothing() -> None:
    # By eq. 1, nothing is 1 − d away from a target at d, and a target at 0.6 in its sector |d − 0.6|.
    memory = blind_memory()
    near = DISTANCES < 0.8
    np.testing.assert_array_equal(matched_share(memory, OWN, 1), near)
    # Four times nothing is nearer than a target in another sector, so that two matches in three are nothing.
    np.testing.assert_allclose(matched_share(memory, OWN, 3), np.where(near, 1 / 3, 0.0))
    assert shown_share(memory) == pytest.approx(3 / len(memory))
    policy = LazyQ(memory, gained_less_lost, k=1, discount=0)
    # A quarter of a step to the left, wherever the target is, cancels over the sectors.
    np.testing.assert_allclose(approach(policy), near, atol=1e-6)
    np.testing.assert_array_equal(rewarded_share(policy), near)


@pytest.mark.short
def test_the_literal_learner_repeats_the_luckiest_of_its_matches() -> None:
    # Two transitions approached the target and gained nothing; one fled, and a target came into range by chance.
    rows = []
    for sector in range(OWN):
        rows += [({sector: 0.9}, bearing(sector), 1.0, 0, 0)] * 2
        rows += [({sector: 0.9}, bearing(sector + OWN // 2), 0.5, 1, 0)]
    memory = memory_of(rows)  # type: ignore[arg-type]
    np.testing.assert_array_equal(matched_share(memory, OWN, 3)[18], 1)
    policy = LazyQ(memory, gained_less_lost, k=3, discount=0)
    assert approach(policy)[18] == pytest.approx(-0.5, abs=1e-6)
    assert rewarded_share(policy)[18] == 1


def test_a_target_one_sector_over_counts_as_there_and_two_sectors_over_does_not() -> None:
    for over, share in ((0, 1.0), (1, 1.0), (2, 0.0), (OWN - 1, 1.0)):
        memory = memory_of([({over: 0.5}, 0.0, 1.0, 0, 0)])
        expected = [abs(math.remainder(over - sector, OWN)) <= 1 for sector in range(OWN)]
        np.testing.assert_allclose(matched_share(memory, OWN, 1), np.mean(expected))
        assert expected[0] == share


def test_the_situations_show_one_target_in_each_sector_at_each_distance() -> None:
    found = single_targets(OWN, OWN + 3)
    assert found.shape == (BINS, OWN, OWN + 3)
    assert ((found < 1).sum(axis=-1) == 1).all()
    np.testing.assert_allclose(found[:, 5, 5], DISTANCES, rtol=1e-6)


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return diagnose_explorations(TINY)


def test_every_measurement_is_there_for_every_exploration(table: pd.DataFrame, two_workers: WorkerPool) -> None:
    # 4 of the action; chance for each sample; matches, two approaches and their reward for each sample and width.
    own, every = 4 + 2, 2 * 2 * (1 + 2 + 1)
    # A table of 16 and more sectors that are merged into 4 is small enough.
    every += 2 * 2
    assert len(table) == TINY.memories * BINS * (own + every)
    assert table["memory"].unique().tolist() == [0, 1]
    pd.testing.assert_frame_equal(diagnose_explorations(TINY, two_workers), table, check_exact=True)


def test_the_first_exploration_of_600_is_the_shipped_one() -> None:
    assert explored(TINY, 0, 600) == shipped()
    assert explored(TINY, 0, 60) == shipped().sample(60, seed=0)
    assert len(explored(TINY, 1, 1200)) == 1200


def test_a_given_memory_is_measured_like_an_exploration(table: pd.DataFrame) -> None:
    found = diagnose_memory(TINY, shipped())
    pd.testing.assert_frame_equal(found, table[table["memory"] == 0], check_exact=True)


def test_points_are_means_over_explorations(table: pd.DataFrame) -> None:
    points = diagnosis_points(table)
    matches = points[(points["quantity"] == "matches") & (points["transitions"] == 600) & (points["inputs"] == 16)]
    rim = matches[matches["distance"] == DISTANCES[-1]].iloc[0]
    both = [matched_share(explored(TINY, number, 600), 16, 3)[-1] for number in (0, 1)]
    assert rim["mean"] == pytest.approx(np.mean(both))
    assert rim["count"] == 2
    assert points["mean"].notna().all()


def test_drawing_and_tables_of_one_exploration_have_no_interval() -> None:
    points = diagnosis_points(diagnose_memory(TINY, shipped()))
    assert draw(points, "one").get_label().startswith("Steps toward a target")
    text = page(points, "one")
    assert "±" not in text
    assert "inf" not in text
    assert text.count("| regression | 16 | 600 |") == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"learners": ("sheppard",)}, "learner=sheppard: moves at random now and then, and learns meanwhile; leave it out"),
        ({"samples": (5, 600)}, "samples=5: fewer than the 10 transitions that eq. 1 matches; give larger samples, or a smaller k"),
        ({"memories": 0}, "memories=0"),
        ({"reward": "ours"}, "reward='ours': unknown"),
    ],
)  # fmt: skip
def test_what_cannot_be_diagnosed_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Diagnosis(**change)
