"""Means and paired differences against what can be computed by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teamsight.analysis.stats.paired import cell_means, clustered, grid_of, interval_of, maxima, paired


def runs(values: dict[tuple[int, float], list[float]], shift: int = 0) -> pd.DataFrame:
    rows = [
        (robots, 15, radius, replicate, shift + 100 * robots + replicate, value)
        for (robots, radius), found in values.items()
        for replicate, value in enumerate(found)
    ]
    return pd.DataFrame(rows, columns=["robots", "targets", "radius", "replicate", "seed", "observed_fraction"])


def test_cell_means_agree_with_scipy() -> None:
    sample = [0.1, 0.4, 0.35, 0.8, 0.2]
    cells = cell_means(runs({(2, 1.0): sample, (1, 1.0): [1.0] * 5}), "observed_fraction")
    low, high = stats.ttest_1samp(sample, 0).confidence_interval(0.95)
    second = cells.iloc[1]
    assert (second["robots"], second["count"]) == (2, 5)
    assert [second["mean"], second["se"], second["low"], second["high"]] == pytest.approx(
        [np.mean(sample), stats.sem(sample), low, high]
    )
    assert cells.iloc[0][["se", "low", "high"]].tolist() == [0.0, 1.0, 1.0]


def test_the_interval_of_a_single_run_is_infinite() -> None:
    cell = cell_means(runs({(2, 1.0): [0.5]}), "observed_fraction").iloc[0]
    assert cell["mean"] == 0.5
    assert np.isnan(cell["se"])
    assert (cell["low"], cell["high"]) == (-np.inf, np.inf)


def test_the_interval_covers_as_often_as_it_says() -> None:
    noise = np.random.default_rng(1).normal(0.5, 0.1, (4000, 5))
    cells = cell_means(runs({(1 + row, 1.0): list(noise[row]) for row in range(len(noise))}), "observed_fraction")
    covered = ((cells["low"] < 0.5) & (cells["high"] > 0.5)).mean()
    assert covered == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / len(cells)))  # four standard errors


def test_differences_pair_runs_whatever_the_order_of_rows() -> None:
    table, base = runs({(1, 1.0): [0.5, 0.9], (2, 1.0): [0.7, 0.7]}), runs({(1, 1.0): [0.4, 0.5], (2, 1.0): [0.9, 0.6]})
    both = paired(table, base.iloc[::-1])
    assert both["difference"].tolist() == pytest.approx([0.1, 0.4, -0.2, 0.1])
    assert both["seed"].tolist() == table["seed"].tolist()


@pytest.mark.parametrize("shift", [0, 1])
def test_runs_without_a_partner_are_refused(shift: int) -> None:
    table = runs({(1, 1.0): [0.5, 0.9]})
    base = runs({(1, 1.0): [0.5, 0.9]}, shift) if shift else runs({(1, 1.0): [0.5]})
    with pytest.raises(ValueError, match="match: both tables need"):
        paired(table, base)


def test_grid_has_team_sizes_down_and_radii_across() -> None:
    cells = cell_means(
        runs({(10, 2.0): [0.5], (2, 1.0): [0.25], (2, 2.0): [1.0], (10, 1.0): [0.75]}), "observed_fraction"
    )
    grid = grid_of(cells)
    assert (list(grid.index), list(grid.columns)) == ([2, 10], [1.0, 2.0])
    assert grid.to_numpy().tolist() == [[0.25, 1.0], [0.75, 0.5]]


def test_maxima_are_over_replicates() -> None:
    table = runs({(2, 1.0): [7, 1, 1], (1, 1.0): [5, 9, 2], (1, 0.5): [0, 0, 0]})
    grid = maxima(table.rename(columns={"observed_fraction": "max_neighbours"}))
    assert (list(grid.index), list(grid.columns)) == ([1, 2], [0.5, 1.0])
    assert grid.loc[:, 1.0].tolist() == [9, 7]


def test_a_sum_of_cells_has_the_interval_of_the_groups_own_sums_if_none_is_missing() -> None:
    values = np.random.default_rng(3).normal(size=(7, 2, 3))
    weights = np.array([[0.5, 0.0, 0.5], [-1.0, 0.0, 0.0]])
    assert clustered(values, weights) == pytest.approx(interval_of((values * weights).sum(axis=(1, 2))))
    assert clustered(values[:1], weights)[1:] == (-np.inf, np.inf)


def test_the_variance_of_a_sum_of_cells_with_missing_values_is_unbiased() -> None:
    generator, count = np.random.default_rng(4), np.array([4, 10, 6])
    missing = np.arange(12)[:, None] >= count
    weights = np.array([0.2, 0.3, 0.5])
    squares = []
    for _ in range(4000):
        values = np.where(missing, np.nan, generator.normal(size=(12, 3)))
        found = clustered(values, weights)
        squares.append(((found.high - found.low) / 2 / stats.t.ppf(0.975, 9)) ** 2)
    # The standard error of a mean of 4,000 is 1 % here.
    assert np.mean(squares) == pytest.approx((weights**2 / count).sum(), rel=0.05)
    values[5:, 0] = np.nan
    values[1:, 1] = np.nan
    assert clustered(values, weights)[1:] == (-np.inf, np.inf)
