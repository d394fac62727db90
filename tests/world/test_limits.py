"""Limits: lengths, speeds and their ratios for which floats keep their meaning."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight import CMOMMT, Box, Disc, Robot, Torus, World


@pytest.mark.short
@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (
            {"robot_speed": 1e155},
            r"robot_speed=1e\+155: must be at most 10000 in Disc\(radius=5\.0\); take a lower speed",
        ),
        ({"target_speed": 1e155}, r"target_speed=1e\+155: must be at most 10000 in"),
        ({"robot_speed": 10_001}, r"robot_speed=10001: must be at most 10000 in"),
        ({"radius": 1e-160}, r"radius=1e-160: must be from 1e-09 to 1e\+09; choose another unit"),
        ({"radius": 1e12}, r"radius=1e\+12: must be from 1e-09 to 1e\+09"),
        ({"radius": 1e-300}, r"radius=1e-300: must be from"),
        ({"sensing_range": 1e200}, r"sensing_range=1e\+200: must be from"),
        ({"awareness_range": 5e-324}, r"awareness_range=4\.94066e-324: must be from"),
        (
            {"radius": 1e9, "sensing_range": 0.1},
            r"sensing_range=0\.1: must be at least 2 in Disc\(.*; take a longer range",
        ),
        ({"radius": 1e9}, r"sensing_range=1: must be at least 2 in"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_model_of_lengths_without_meaning_is_refused(setting: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CMOMMT(**setting)


@pytest.mark.parametrize("make", [Disc, lambda side: Box(side, 1.0), lambda side: Torus(1.0, side)])
@pytest.mark.parametrize("length", [1e-10, 2e9, 1e308, 5e-324])
def test_an_arena_without_meaning_is_refused(make: Any, length: float) -> None:
    with pytest.raises(ValueError, match=r"(radius|width|height)=.*: must be from 1e-09 to 1e\+09"):
        make(length)


lengths = st.floats(-9, 9).map(lambda power: 10.0**power)


@given(lengths, lengths, st.floats(-12, 12).map(lambda power: 10.0**power), st.sampled_from([Disc, Box, Torus]))
def test_a_world_is_refused_or_stays_finite_and_inside(side: float, reach: float, speed: float, kind: Any) -> None:
    try:
        arena = kind(side) if kind is Disc else kind(side, side * 0.7)
        world = World(arena, rng=1)
        robots = world.add(
            Robot, 4, policy="a-cmommt", awareness="pairwise", speed=speed, sensing_range=reach, awareness_range=reach
        )
    except ValueError as error:
        assert "\n" not in str(error)
        assert any(name in str(error) for name in ("radius", "width", "height", "range", "speed"))
        return
    world.senses(
        robots, world.add(Robot, 3, policy="random-walk", speed=speed, awareness_range=reach, sensing_range=reach)
    )
    world.run(20)
    assert arena.contains(robots.position).all()
    assert np.isfinite(robots.position).all()
    assert np.hypot(*robots.heading.T) == pytest.approx(1.0)
