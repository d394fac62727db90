"""Forces: Fig. 9, and its counterpart for targets."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import paper as naive

from teamsight.policies.handmade.forces import attraction, repulsion

corners = st.lists(st.floats(0, 5), min_size=4, max_size=4).map(sorted)
distances = st.floats(0, 8)


@pytest.mark.short
@given(distances, corners)
def test_forces_are_those_of_the_figure(distance: float, limits: list[float]) -> None:
    # Between corners that are closer than this, the force is a jump whose rounding is anybody's.
    assume(all(abs(distance - limit) > 1e-6 for limit in limits))
    assert repulsion(distance, *limits[:2]) == pytest.approx(naive.repulsion(distance, *limits[:2]), abs=1e-9)
    assert attraction(distance, *limits) == pytest.approx(naive.attraction(distance, *limits), abs=1e-9)


def test_the_corners_of_figure_9() -> None:
    assert repulsion([0, 0.481, 0.625, 0.769, 2], 0.481, 0.769).tolist() == pytest.approx([-1, -1, -0.5, 0, 0])


def test_the_corners_of_attraction() -> None:
    found = attraction([0, 0.154, 0.231, 0.308, 1.0, 1.077, 1.154, 9], 0.154, 0.308, 1.0, 1.154)
    assert found.tolist() == pytest.approx([-1, 0, 0.5, 1, 1, 0.5, 0, 0])


@given(st.lists(distances, max_size=5), corners)
def test_forces_stay_within_one_and_keep_the_shape(many: list[float], limits: list[float]) -> None:
    for found in (repulsion(many, *limits[:2]), attraction(many, *limits)):
        assert found.shape == (len(many),)
        assert np.all(np.abs(found) <= 1)
    assert repulsion(np.zeros((2, 3)), 1.0, 2.0).shape == (2, 3)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ((2.0, 1.0), "d2=1: must be at least d1=2"),
        ((-1.0, 1.0), "d1=-1: must be at least 0"),
        ((0.0, np.nan), "d2=nan: .*finite"),
    ],
)
def test_corners_out_of_order_are_named(limits: tuple[float, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        repulsion(1.0, *limits)
