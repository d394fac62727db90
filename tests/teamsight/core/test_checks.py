"""Checks: what passes comes back as a plain number, what does not is named with limit and cure."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.kernel import plain


@pytest.mark.parametrize("value", [3, 3.0, np.int64(3), np.float32(3)])
def test_whole_numbers_of_all_kinds_are_counts(value: Any) -> None:
    found = checks.count("n", value)
    assert found == 3
    assert type(found) is int


@pytest.mark.parametrize("value", [True, np.True_, "3", None, 3.5, math.nan, math.inf, [3], 3j, Decimal("3.5")])
def test_other_things_are_no_counts(value: Any) -> None:
    with pytest.raises(TypeError, match=r"n=.*: must be a whole number of at least 2"):
        checks.count("n", value, least=2)


def test_a_count_too_small_names_limit_and_cure() -> None:
    with pytest.raises(ValueError, match=r"^n=1: must be at least 2; take another$"):
        checks.count("n", 1, least=2, cure="take another")


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_come_back_as_they_are(value: float) -> None:
    assert checks.number("x", value) == value
    for limits, good in (({"above": 0.0}, value > 0), ({"least": 0.0}, value >= 0), ({"most": 1.0}, value <= 1)):
        if good:
            assert checks.number("x", value, **limits) == value
        else:
            with pytest.raises(ValueError, match="x="):
                checks.number("x", value, **limits)


@pytest.mark.parametrize("value", [True, "1", None, 1j, [1.0], np.array([1.0, 2.0])])
def test_other_things_are_no_numbers(value: Any) -> None:
    with pytest.raises(TypeError, match="x=.*: must be a number"):
        checks.number("x", value)


def test_both_limits_are_named() -> None:
    with pytest.raises(ValueError, match=r"^x=2\.0: must be a finite number, above 0 and at most 1$"):
        checks.number("x", 2, above=0, most=1)


def test_the_nearest_choice_is_suggested() -> None:
    with pytest.raises(ValueError, match=r"^c='Rnig': unknown; did you mean 'ring'\? known are none, ring$"):
        checks.choice("c", "Rnig", {"ring": 1, "none": 2})
    with pytest.raises(ValueError, match=r"^c=\['ring'\]: unknown; "):
        checks.choice("c", ["ring"], ["ring", "none"])
    assert checks.choice("c", "ring", ["ring"]) == "ring"


@given(st.floats(0, 1))
def test_directions_are_unit_vectors_at_their_angle(fraction: float) -> None:
    x, y = plain(direction)(fraction)
    assert x == pytest.approx(math.cos(2 * math.pi * fraction), abs=1e-15)
    assert y == pytest.approx(math.sin(2 * math.pi * fraction), abs=1e-15)
    assert math.hypot(x, y) == pytest.approx(1, abs=4e-16)


class Unwritable:
    def __repr__(self) -> str:
        raise RuntimeError


@pytest.mark.short
@pytest.mark.parametrize(
    "value",
    [
        10**400, -(10**400), 10**5000, Fraction(10**400), Fraction(1, 3), Decimal("1e999999"), Decimal("NaN"), Decimal("sNaN"), Decimal("-Infinity"),
        np.float64(1e308), np.longdouble("1e4000"), np.uint64(2**64 - 1), math.inf, math.nan, "9" * 10_000, b"9" * 10_000, 5e-324, "\n", Unwritable(),
        np.zeros(10_000), [0] * 10_000, {"a": "b" * 10_000}, np.float16("nan"), np.complex128(1), np.datetime64("2000-01-01"),
    ],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_whatever_is_given_is_refused_on_a_short_line_or_is_right(value: Any) -> None:
    checked = [
        lambda: checks.count("n", value, most=10), lambda: checks.count("n", value, least=2), lambda: checks.number("n", value, least=1, most=10),
        lambda: checks.number("n", value), lambda: checks.flag("n", value),
        lambda: checks.choice("n", value, ("a", "b")), lambda: checks.seed(value, None), lambda: checks.seed(1, value),
    ]  # fmt: skip
    for number, check in enumerate(checked):
        try:
            found = check()
            assert type(found) in (int, float)
            # A seed is drawn from several numbers.
            assert found == value or isinstance(value, list) or math.isclose(found, value)
        except (TypeError, ValueError) as error:
            message = str(error)
            assert ("n=" in message or "rng=" in message or "seed=" in message), (number, message)
            assert len(message) < 200, (number, message)
            assert "\n" not in message


@pytest.mark.parametrize("value", [Decimal(3), Fraction(3), np.uint8(3), np.float16(3)])
def test_numbers_of_all_kinds_are_numbers(value: Any) -> None:
    assert (checks.count("n", value), checks.number("n", value)) == (3, 3.0)


def test_a_count_too_large_names_limit_and_cure() -> None:
    with pytest.raises(ValueError, match=r"^n=\(about 10\^400\): must be at most 9; take another$"):
        checks.count("n", 10**400, most=9, cure="take another")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        ("position=(4.9, 4.9): must be inside the arena, Disc(radius=5.0)", "position (4.9, 4.9): must be inside the arena, disc (radius 5.0)"),
        ("robot_speed=-1.0: must be at least 0", "speed of robots -1.0: must be at least 0"),
        ("policy='a=b': needs 'robot_speed'; use awareness='shared' (--awareness shared)", "policy 'a=b': needs 'robot_speed'; use awareness 'shared'"),
        ("arena=Disc(radius=5.0).with_ob…: <Robot 1 of 'robots'> is in it; move it, as in agent.position = (0, 1), or not", "arena: Robot 1 of 'robots' is in it; move it, or not"),
        ("Disc(radius=5.0).with_obstacles(RoundThing(x=1)): has none", "disc (radius 5.0) with obstacles (round thing (x 1)): has none"),
        ("robot_speed: give robot_speed, not robot_id, my_robot_speed.csv or the teammates' robot_speed.", "speed of robots: give speed of robots, not robot_id, my_robot_speed.csv or the teammates' speed of robots."),
        ("delta: the best delta is small, and policy.gain=3", "delta: the best delta is small, and gain 3"),
    ],
)  # fmt: skip
def test_errors_in_the_words_of_a_page(error: str, words: str) -> None:
    assert checks.in_words(error, {"robot_speed": "speed of robots", "delta": "δ", "policy.gain": "gain"}) == words


@given(st.text().map(checks.shown), st.sampled_from(["radius", "robot_speed", "a.b"]))
def test_a_text_that_was_given_stays_as_it_is(value: str, name: str) -> None:
    assert checks.in_words(f"{name}={value}: is refused") == f"{name.replace('_', ' ')} {value}: is refused"
