"""The noise of sensors has the distributions that it should have.

All seeds are fixed, so each test either always passes or always fails. A correct distribution fails one of them with a
probability below 1e-8.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from naive import sensing as naive
from scipy import stats

from teamsight.agents.sensing import Sensor
from teamsight.agents.sensing.sensor import normals, rotation
from teamsight.core.kernel import Entry, array_at
from teamsight.core.neighbour_list import NeighbourList

LEAST = 1e-9
SIZE = 4000


def _normals(address: int) -> int:
    words, numbers = array_at(address, 2, np.uint64), array_at(address, 2, np.float64)
    numbers[0], numbers[1] = normals(words[0], words[1])
    return 0


_NORMALS = Entry(_normals)
EDGES = [0, 1, 2, 2**16, 2**30, 2**31 - 1, 2**31, 3_037_000_499, 3_037_000_500, 2**32 - 2, 2**32 - 1]


@given(st.one_of(st.sampled_from(EDGES), st.integers(0, 2**32 - 1)), st.integers(0, 2**32 - 1))
def test_the_normal_numbers_of_two_words_are_those_of_the_slow_twin(word: int, other: int) -> None:
    place = np.array([word, other], np.uint64)
    _NORMALS(place.ctypes.data)
    expected = naive.normals((word + 0.5) / 2**32, (other + 0.5) / 2**32)
    # The length is accurate to its last bits, the angle to those of 2π.
    assert place.view(np.float64) == pytest.approx(expected, rel=2e-11, abs=1e-14)


def _rotation(address: int) -> int:
    row = array_at(address, 2, np.float64)
    row[0], row[1] = rotation(row[0])
    return 0


_ROTATION = Entry(_rotation)


@given(st.floats(-5, 5))
@example(0.125)
@example(-0.375)
def test_a_rotation_has_cosine_and_sine_of_its_turns(turns: float) -> None:
    row = np.array([turns, 0.0])
    _ROTATION(row.ctypes.data)
    assert row == pytest.approx([math.cos(2 * math.pi * turns), math.sin(2 * math.pi * turns)], abs=1e-12)


def at_half(sensor: Sensor, seed: int = 0) -> NeighbourList:
    """Return what observers sense that each have one agent ahead, at half their range."""
    here = np.column_stack([10.0 * np.arange(SIZE), np.zeros(SIZE)])
    return sensor.detect(here, here + [0.5, 0.0], np.tile([1.0, 0.0], (SIZE, 1)), 1.0, seed=seed)


def test_distances_and_bearings_are_normal_and_independent() -> None:
    sensed = at_half(Sensor(range_noise=0.05, bearing_noise=0.2))
    assert len(sensed.identity) == SIZE
    away = (sensed.distance - 0.5) / 0.05
    turned = np.arctan2(sensed.offset[:, 1], sensed.offset[:, 0]) / 0.2
    for noise in (away, turned):
        assert stats.kstest(noise, "norm").pvalue > LEAST
        assert stats.pearsonr(noise[1:], noise[:-1]).pvalue > LEAST
    assert stats.pearsonr(away, turned).pvalue > LEAST
    assert stats.pearsonr(np.abs(away), np.abs(turned)).pvalue > LEAST


@pytest.mark.parametrize("missed", [0.1, 0.5, 0.99])
def test_the_share_that_is_missed(missed: float) -> None:
    sensed = at_half(Sensor(missed=missed))
    assert stats.binomtest(SIZE - len(sensed.identity), SIZE, missed).pvalue > LEAST
    # What is measured does not depend on what is missed.
    noisy, all_noisy = (at_half(Sensor(missed=share, range_noise=0.1)) for share in (missed, 0.0))
    assert np.array_equal(noisy.distance, all_noisy.distance[noisy.identity])
    assert stats.kstest((noisy.distance - 0.5) / 0.1, "norm").pvalue > LEAST


def false_detections(sensor: Sensor) -> NeighbourList:
    """Return what observers sense who are nowhere near the eleven observed agents; half of them head to the left."""
    here = np.column_stack([10.0 * np.arange(SIZE), np.zeros(SIZE)])
    heading = np.tile([[0.0, 1.0], [-1.0, 0.0]], (SIZE // 2, 1))
    return sensor.detect(here, np.tile([0.0, 5000.0], (11, 1)), heading, 2.0)


@pytest.mark.parametrize("share", [0.01, 0.3, 1.0])
def test_the_share_of_false_detections(share: float) -> None:
    sensed = false_detections(Sensor(false_positives=share))
    assert stats.binomtest(len(sensed.identity), SIZE, share).pvalue > LEAST
    assert sensed.degree.max() == 1
    assert (sensed.identity < 0).all()


@pytest.mark.parametrize("width", [0.5, 4.0, 2 * math.pi])
def test_false_detections_are_anyone_anywhere_in_view(width: float) -> None:
    sensed = false_detections(Sensor(false_positives=1.0, field_of_view=width))
    assert stats.chisquare(np.bincount(~sensed.identity, minlength=11)).pvalue > LEAST
    ahead = np.angle(sensed.offset @ [1, 1j] / np.tile([1j, -1], SIZE // 2))
    assert stats.kstest(ahead, "uniform", (-width / 2, width)).pvalue > LEAST
    assert stats.kstest(sensed.distance**2, "uniform", (0, 4)).pvalue > LEAST
    assert stats.pearsonr(ahead, sensed.distance).pvalue > LEAST


def test_a_false_detection_is_nobody_that_is_sensed_and_not_oneself() -> None:
    here = np.column_stack([np.arange(6.0), np.zeros(6)])
    heading = np.tile([1.0, 0.0], (6, 1))
    counts = np.zeros((6, 6), int)
    for tick in range(600):
        sensed = Sensor(false_positives=1.0).detect(here, None, heading, 1.0, tick=tick)
        observer = np.repeat(np.arange(6), sensed.degree)
        is_false = sensed.identity < 0
        np.add.at(counts, (observer[is_false], ~sensed.identity[is_false]), 1)
    for i in range(6):
        others = [j for j in range(6) if abs(i - j) > 1]
        assert counts[i].sum() == counts[i, others].sum() == 600
        assert stats.chisquare(counts[i, others]).pvalue > LEAST


def test_nobody_is_imagined_where_everybody_is_sensed() -> None:
    here = np.column_stack([np.arange(3.0), np.zeros(3)])
    sensed = Sensor(false_positives=1.0).detect(here, None, np.tile([1.0, 0.0], (3, 1)), 5.0)
    assert sensed.identity.tolist() == [1, 2, 0, 2, 0, 1]
