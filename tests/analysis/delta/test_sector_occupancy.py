"""Merging in a ring, against counting by hand and balls thrown into urns."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from chance import generator
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight.analysis.delta import sector_occupancy
from teamsight.world.search import proximity_graph


@pytest.mark.parametrize(("neighbours", "sectors"), [(0, 3), (1, 5), (3, 4), (5, 3), (4, 1)])
def test_the_mean_is_that_of_all_throws(neighbours: int, sectors: int) -> None:
    throws = [len(set(throw)) for throw in product(range(sectors), repeat=neighbours)]
    assert sector_occupancy.expected_sectors(neighbours, sectors) == pytest.approx(np.mean(throws))


@pytest.mark.parametrize(("neighbours", "shown"), [(7, 5.8), (16, 10.3)])
def test_reference_values_for_sixteen_sensors(neighbours: int, shown: float) -> None:
    assert sector_occupancy.expected_sectors(neighbours, 16) == pytest.approx(shown, abs=0.05)


def _naive_sectors(position: np.ndarray, heading: np.ndarray, reach: float, sectors: int) -> list[int]:
    found = []
    for own, ahead in zip(position, heading, strict=True):
        seen = set()
        for other in position:
            gap = other - own
            if other is not own and not np.array_equal(other, own) and np.hypot(*gap) <= reach:
                turn = np.arctan2(gap[1], gap[0]) - np.arctan2(ahead[1], ahead[0])
                seen.add(round(turn / (2 * np.pi / sectors)) % sectors)
        found.append(len(seen))
    return found


@settings(deadline=None)  # the first example compiles
@given(size=st.integers(1, 12), sectors=st.integers(1, 20), seed=st.integers(0, 2**32 - 1))
def test_occupied_sectors_are_those_counted_one_by_one(size: int, sectors: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    position, heading = rng.uniform(0, 2, (size, 2)), rng.normal(size=(size, 2))
    found = sector_occupancy.bearings(proximity_graph(position, None, 1.0), heading)
    assert sector_occupancy.occupied_sectors(found, sectors).tolist() == _naive_sectors(position, heading, 1.0, sectors)


def test_a_bearing_dead_ahead_is_one_sector_whatever_the_rounding() -> None:
    found = sector_occupancy.Bearings(np.array([3]), np.array([0.0, np.nextafter(1.0, 0.0), 1e-17]))
    assert sector_occupancy.occupied_sectors(found, 16).tolist() == [1]


def test_robots_without_a_heading_are_left_out() -> None:
    position = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.5]])
    heading = np.array([[0.0, 0.0], [np.nan, 1.0], [0.0, 2.0]])
    found = sector_occupancy.bearings(proximity_graph(position, None, 2.0), heading)
    assert found.degree.tolist() == [2]
    assert sorted(found.turn) == pytest.approx([3 / 8, 5 / 8])


def test_tables_measure_what_uniform_neighbours_would_show() -> None:
    rng = generator()
    degree = rng.integers(0, 7, 30_000)
    found = sector_occupancy.Bearings(degree, rng.uniform(size=degree.sum()))
    ring = sector_occupancy.ring_table(found, (4, 16), largest=8)
    assert ring.groupby("sectors")["neighbours"].max().tolist() == [8, 8]
    met = ring[ring["samples"] > 0]
    # Some 4,000 samples, a standard deviation below 1: six standard errors.
    assert met["shown"].to_numpy() == pytest.approx(met["expected"].to_numpy(), abs=0.1)
    assert (met["hidden"] == met["neighbours"] - met["shown"]).all()
    assert ring[ring["neighbours"] > 6]["shown"].isna().all()


def test_gathering_nothing_is_empty() -> None:
    assert sector_occupancy.gather([]).degree.size == 0
    assert sector_occupancy.ring_table(sector_occupancy.gather([]), (16,), 0).empty
