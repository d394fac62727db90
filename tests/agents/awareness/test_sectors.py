"""Sectors: the fast angle decides only where the exact one decides alike."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from teamsight.agents.awareness.interface import sector_of
from teamsight.core.angles import ANGLE_MARGIN, near_angle

pytestmark = pytest.mark.short

FULL_TURN = 2 * math.pi
PART = st.floats(-10, 10)


def exact_sector(left: float, ahead: float, sectors: int) -> int:
    return math.floor(math.atan2(left, ahead) * (sectors / FULL_TURN) + 0.5) % sectors


@given(left=PART, ahead=PART, sectors=st.integers(1, 10_000))
@example(left=0.0, ahead=0.0, sectors=16)
@example(left=-0.0, ahead=-1.0, sectors=5)
@example(left=-0.0, ahead=-1.0, sectors=16)
@example(left=5e-324, ahead=0.0, sectors=3)
def test_the_sector_is_that_of_the_exact_angle(left: float, ahead: float, sectors: int) -> None:
    assert sector_of(ahead, left, 1.0, 0.0, sectors) == exact_sector(left + 0.0, ahead, sectors)


@given(sectors=st.integers(1, 400), number=st.integers(0, 399), off=st.sampled_from([-1e-3, -1e-6, -1e-12, 0.0, 1e-12, 1e-6, 1e-3]))
def test_at_the_edges_of_sectors_too(sectors: int, number: int, off: float) -> None:
    angle = FULL_TURN * (number + 0.5) / sectors + off
    left, ahead = math.sin(angle), math.cos(angle)
    assert sector_of(ahead, left, 1.0, 0.0, sectors) == exact_sector(left, ahead, sectors)


def test_the_margin_is_twice_the_error_of_the_fast_angle() -> None:
    angles = np.linspace(-math.pi, math.pi, 20_001)[1:-1]
    error = max(abs(near_angle(math.sin(a), math.cos(a)) - a) for a in angles)
    assert 0.3 * ANGLE_MARGIN < error <= 0.6 * ANGLE_MARGIN
