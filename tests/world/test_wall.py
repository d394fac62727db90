"""Steps that end within a rounding of the wall stay finite and inside."""

from __future__ import annotations

import math

import numpy as np

from teamsight.world.arena import Disc


def test_a_step_that_ends_on_the_wall_of_a_disc_is_finite() -> None:
    disc = Disc(8.0)
    confine = disc.confine.py_func
    noise = np.random.default_rng(3)
    worst = 0
    for angle, start, hair in zip(
        noise.uniform(0, 2 * math.pi, 4000), noise.uniform(0, 8, 4000), range(4000), strict=True
    ):
        place = np.array([math.cos(angle), math.sin(angle)])
        end = place * 8.0 * (1 + (hair % 5) * 2.0**-52)
        x, y = start * place[::-1]
        found = np.array(confine(x, y, end[0] - x, end[1] - y, place[0], place[1], disc.size))
        assert np.isfinite(found).all()
        assert math.hypot(*found[:2]) <= 8.0 * (1 + 1e-12)
        worst += math.hypot(*end) > 8.0
    # The cases really are beyond the wall, by less than a step's rounding.
    assert worst > 1000
