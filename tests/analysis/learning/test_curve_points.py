"""The gain from awareness, and the number of transitions from which it pays."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t

from teamsight.analysis.learning.curves import awareness_gains, crossings, mean_gains, pays_from
from teamsight.analysis.learning.plans import Curves

pytestmark = pytest.mark.short

SCENARIOS = ((5, 3.0), (10, 5.0))


def table_of(gain, memories: int = 6, worlds: int = 2, samples=Curves.samples[:4]) -> pd.DataFrame:  # type: ignore[no-untyped-def]
    """Return made-up tests of one learner, where ``gain(transitions, memory, scenario)`` is what awareness adds."""
    rng = np.random.default_rng(3)
    rows = []
    for transitions in samples:
        for memory in range(memories):
            for number, (robots, radius) in enumerate(SCENARIOS):
                for world in range(worlds):
                    base = rng.uniform(0.3, 0.6)
                    for degree, more in (("none", 0.0), ("ring", gain(transitions, memory, number))):
                        rows.append(
                            ("linear", transitions, 3.0, degree, memory, robots, radius, world, base + more)
                        )  # fmt: skip
    for memory in range(memories):
        for robots, radius in SCENARIOS:
            rows.append(("random walk", 0, np.nan, "none", memory, robots, radius, 0, 0.4))
            rows.append(("A-CMOMMT", 0, np.nan, "pairwise", memory, robots, radius, 0, 0.7))
    columns = [
        "learner",
        "transitions",
        "log10_size",
        "degree",
        "memory",
        "robots",
        "radius",
        "replicate",
        "observed_fraction",
    ]
    return pd.DataFrame(rows, columns=columns)


def test_gains_are_paired_on_memories_and_worlds() -> None:
    table = table_of(lambda transitions, memory, scenario: 0.01 * memory * (1 + scenario))
    gains = awareness_gains(table)
    learned = gains[gains["learner"] == "linear"]
    # Two scenarios and their mean.
    assert len(learned) == 4 * 3
    for number, factor in ((0, 1.0), (1, 2.0)):
        one = learned[(learned["robots"] == SCENARIOS[number][0]) & (learned["transitions"] == 40)].iloc[0]
        trials = 0.01 * factor * np.arange(6)
        assert one["gain"] == pytest.approx(trials.mean())
        # Noise that both share has no effect on the interval.
        assert one["high"] - one["gain"] == pytest.approx(t.ppf(0.975, 5) * trials.std(ddof=1) / np.sqrt(6))
        assert one["count"] == 6
        rows = table[(table["robots"] == SCENARIOS[number][0]) & (table["transitions"] == 40)]
        assert one["collective"] == pytest.approx(rows.loc[rows["degree"] == "none", "observed_fraction"].mean())
    mean = mean_gains(learned).iloc[0]
    assert mean["gain"] == pytest.approx(0.015 * 2.5)
    assert mean["high"] - mean["gain"] == pytest.approx(t.ppf(0.975, 5) * 0.015 * np.arange(6).std(ddof=1) / np.sqrt(6))
    designed = gains[gains["transitions"] == 0]
    assert designed["gain"].isna().all()
    assert mean_gains(designed).set_index("learner")["cooperative"]["A-CMOMMT"] == pytest.approx(0.7)


def test_points_without_an_observed_fraction_are_left_out() -> None:
    table = table_of(lambda *given: 0.0)
    table.loc[table["transitions"] == 40, "observed_fraction"] = np.nan
    assert set(awareness_gains(table)["transitions"]) == {0, 75, 150, 300}


def test_a_single_memory_has_no_interval_and_crosses_nowhere() -> None:
    gains = awareness_gains(table_of(lambda *given: 0.3, memories=1))
    learned = gains[gains["transitions"] > 0]
    assert (learned["low"] == -np.inf).all()
    assert crossings(gains)["crossing"].isna().all()


def gains_of(low: list[float]) -> pd.DataFrame:
    rows = {"learner": "linear", "log10_size": 3.0, "robots": 5.0, "radius": 3.0, "transitions": Curves.samples[: len(low)]}
    return pd.DataFrame(rows | {"low": low})


@pytest.mark.parametrize(
    ("low", "crossing"),
    [
        ([1, 1, 1], 40),
        ([-1, 1, 1], 75),
        ([1, -1, 1, 1], 150),
        ([1, -1, 1], np.nan),
        ([1], np.nan),
        ([1, 1, -1], np.nan),
        ([1, 1, 0], np.nan),
        ([-1, -1, -1], np.nan),
    ],
)
def test_it_pays_from_where_the_interval_stays_above_zero(low: list[float], crossing: float) -> None:
    # The order of the rows has no effect.
    (found,) = crossings(gains_of(low).iloc[::-1])["crossing"]
    assert found == pytest.approx(crossing, nan_ok=True)


def test_pure_noise_hardly_ever_crosses() -> None:
    rng, cases, memories = np.random.default_rng(11), 4_000, 24
    # The samples of a memory are nested: their noise is correlated.
    common = rng.normal(size=(cases, memories, 1))
    noise = 0.7 * common + rng.normal(size=(cases, memories, len(Curves.samples)))
    se = noise.std(axis=1, ddof=1) / np.sqrt(memories)
    low = noise.mean(axis=1) - t.ppf(0.975, memories - 1) * se
    points = gains_of([0.0] * len(Curves.samples))
    table = pd.concat([points] * cases, ignore_index=True).assign(
        low=low.ravel(), robots=np.arange(cases).repeat(len(Curves.samples))
    )
    rate = crossings(table)["crossing"].notna().mean()
    # Without correlation it were 0.025², with full correlation 0.025; the standard error of 0.003 is 0.001.
    assert rate < 0.01


def test_crossings_in_words() -> None:
    assert pays_from(2400.0, 38400) == "pays from 2,400 transitions"
    assert pays_from(np.nan, 38400) == "is not shown to pay within 38,400 transitions"


def test_the_best_learner_is_chosen_with_and_without_awareness_separately() -> None:
    table = table_of(lambda *given: 0.2)
    learned = table[table["transitions"] > 0]
    # Another learner observes 0.1 more without awareness, and gains nothing from it.
    without = learned[learned["degree"] == "none"].assign(learner="tabular")
    without["observed_fraction"] += 0.1
    gains = awareness_gains(pd.concat([table, without, without.assign(degree="ring")]))
    mean = mean_gains(gains).groupby("learner")["gain"].mean()
    assert mean["linear"] == pytest.approx(0.2)
    assert mean["tabular"] == pytest.approx(0.0)
    assert mean["best"] == pytest.approx(0.1)
    worst = gains[gains["learner"] == "best"].iloc[0]["worst"]
    rows = learned[(learned["robots"] == 5) & (learned["degree"] == "ring") & (learned["transitions"] == 40)]
    assert worst == pytest.approx(rows.groupby("memory")["observed_fraction"].mean().min())
