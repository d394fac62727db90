"""Samples: what scipy draws, scaled to the axes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from teamsight.analysis.studies.definition.settings import sample_of

AXES = {"radius": {"from": 2, "to": 9.5}, "speed": {"from": 0.01, "to": 10, "scale": "log"}}


def drawn(**given: Any) -> dict[str, Any]:
    found = sample_of({"method": "sobol", "count": 64, "axes": AXES, **given})
    assert found is not None
    return found


@pytest.mark.parametrize(("method", "engine"), [("sobol", qmc.Sobol), ("latin-hypercube", qmc.LatinHypercube)])
def test_points_are_those_of_scipy(method: str, engine: Any) -> None:
    unit = engine(2, seed=np.random.default_rng(7)).random(64)
    found = drawn(method=method, seed=7)
    assert list(found) == ["radius", "speed"]
    assert found["radius"] == pytest.approx(2 + 7.5 * unit[:, 0], rel=1e-12)
    assert found["speed"] == pytest.approx(0.01 * 1000.0 ** unit[:, 1], rel=1e-9)
    assert all(type(value) is float for column in found.values() for value in column)


def test_the_seed_determines_the_sample() -> None:
    assert drawn(seed=3) == drawn(seed=3) != drawn(seed=4)
    assert drawn() == drawn(seed=0)


def test_integers_are_uniform_over_all_values_with_both_ends() -> None:
    axes = {"robots": {"from": 3, "to": 6, "integer": True}, "radius": {"from": 1, "to": 2}}
    robots = drawn(axes=axes, count=256)["robots"]
    assert all(type(value) is int for value in robots)
    # Of a Sobol sequence, each quarter holds exactly a quarter of the points.
    assert [robots.count(value) for value in (3, 4, 5, 6)] == [64] * 4


def test_a_latin_hypercube_has_one_point_in_each_slice() -> None:
    found = drawn(method="latin-hypercube", count=50)
    assert sorted(math.floor((value - 2) / 7.5 * 50) for value in found["radius"]) == list(range(50))


def test_values_of_a_log_axis_do_not_depend_on_the_last_digits_of_a_logarithm() -> None:
    assert all(float(f"{value:.12g}") == value for value in drawn()["speed"])


def test_columns_stay_as_they_are() -> None:
    found = drawn()
    assert sample_of(found) == found
    assert sample_of(None) is None


@pytest.mark.short
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"count": 100}, ["sample.count=100", "power of 2", "64 or 128"]),
        ({"count": 0}, ["sample.count=0", "at least 1"]),
        ({"count": 2**40}, ["sample.count=1099511627776", "at most 10000000"]),
        ({"method": "sobl"}, ["'sobl'", "did you mean 'sobol'"]),
        ({"sed": 1}, ["'sed'", "did you mean 'seed'"]),
        ({"seed": -1}, ["sample.seed=-1", "at least 0"]),
        ({"axes": {}}, ["sample.axes", "radius = {from = 2, to = 9}"]),
        ({"axes": {"radius": [1, 2]}}, ["sample.axes.radius=[1, 2]", "from"]),
        ({"axes": {"radius": {"from": 1}}}, ["sample.axes.radius", "'to'"]),
        ({"axes": {"radius": {"from": 2, "to": 1}}}, ["from=2", "less than to=1"]),
        ({"axes": {"radius": {"from": 1, "to": math.inf}}}, ["sample.axes.radius.to=inf", "finite"]),
        ({"axes": {"radius": {"from": 0, "to": 1, "scale": "log"}}}, ["from=0", "greater than 0"]),
        ({"axes": {"radius": {"from": 0, "to": 1, "step": 1}}}, ["'step'", "known are from"]),
        ({"axes": {"robots": {"from": 1, "to": 2.5, "integer": True}}}, ["to=2.5", "whole numbers"]),
        ({"axes": {"robots": {"from": 1, "to": 2, "integer": 1}}}, ["integer=1", "True or False"]),
        ({"axes": {"robots": {"from": 1, "to": 4, "integer": True}}}, ["sample.count=64", "only 4 different"]),
    ],
)
def test_errors_name_value_limit_and_cure(given: dict[str, Any], words: list[str]) -> None:
    with pytest.raises((TypeError, ValueError), match="^sample") as error:
        drawn(**given)
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize("given", [5, {}, {"method": "sobol"}, {"method": "sobol", "count": 4}, {"a": [1], "b": 2}])
def test_what_is_no_sample(given: Any) -> None:
    with pytest.raises((TypeError, ValueError), match="^sample"):
        sample_of(given)
