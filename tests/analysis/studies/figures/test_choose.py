"""The kind of picture suits the axes, and what cannot be drawn is refused with the cure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight.analysis.studies.figures.cells import Cells, cells_of, choose, matching, panels_of
from teamsight.analysis.studies.results import groups_of, settings_of
from teamsight.analysis.studies.study import Study

pytestmark = pytest.mark.short

NUMBERS, MORE, FEW = [2, 4, 8, 16], [1.0, 2.5, 4.0], [5, 10]
POLICIES, DEGREES = ["a-cmommt", "centroid", "evolved"], ["none", "ring"]


def cells(**study: Any) -> Cells:
    one = Study(**study)
    nothing = np.empty(0, np.int64)
    return cells_of(settings_of(one.plan()), groups_of(one), nothing.astype(float), nothing)


@pytest.mark.parametrize(
    ("axes", "wanted"),
    [
        ({}, ("distribution", None, None, [])),
        ({"robots": [3]}, ("distribution", None, None, [])),
        ({"robots": NUMBERS}, ("lines", "robots", None, [])),
        ({"policy": POLICIES}, ("lines", "policy", None, [])),
        ({"robots": NUMBERS, "radius": MORE}, ("heat-map", "robots", "radius", [])),
        ({"robots": NUMBERS, "radius": [2.0]}, ("lines", "robots", None, [])),
        ({"targets": FEW, "robots": NUMBERS}, ("lines", "robots", "targets", [])),
        ({"policy": POLICIES, "robots": NUMBERS}, ("lines", "robots", "policy", [])),
        ({"policy": POLICIES, "awareness": DEGREES}, ("heat-map", "policy", "awareness", [])),
        ({"policy": POLICIES, "robots": NUMBERS, "radius": MORE}, ("heat-map", "robots", "radius", ["policy"])),
        ({"policy": [f"p{i}" for i in range(11)], "robots": NUMBERS}, ("heat-map", "robots", "policy", [])),
        ({"policy": POLICIES, "awareness": DEGREES, "robots": NUMBERS}, ("lines", "robots", "policy", ["awareness"])),
    ],
)
def test_the_kind_suits_the_axes(axes: dict[str, Any], wanted: tuple[Any, ...]) -> None:
    found = choose(cells(axes=axes))
    names = [None if one is None else one.names[0] for one in (found.x, found.y)]
    assert (found.kind, *names, [one.names[0] for one in found.panels]) == wanted


def test_given_axes_and_kinds_are_kept() -> None:
    found = choose(cells(axes={"policy": POLICIES, "robots": NUMBERS, "radius": MORE}), "lines", y="radius")
    assert found.kind == "lines"
    assert found.x is not None
    assert found.y is not None
    assert (found.x.names, found.y.names) == (("robots",), ("radius",))


def test_zipped_axes_are_one_direction() -> None:
    found = choose(
        cells(axes={"robots": NUMBERS, "targets": [5, 6, 7, 8], "radius": MORE}, zip=[["robots", "targets"]])
    )
    assert found.kind == "heat-map"
    assert found.x is not None
    assert found.x.names == ("robots", "targets")
    assert found.x.texts[:2] == ("2, 5", "4, 6")


def test_settings_that_fill_no_grid_are_points() -> None:
    points = {"robots": [2, 3, 5, 7, 9], "radius": [1.0, 2.0, 3.5, 4.0, 9.0]}
    assert choose(cells(points=points)).kind == "scatter"


def test_points_that_fill_a_grid_are_a_grid() -> None:
    points = {"robots": [2, 3, 5] * 3, "radius": [1.0] * 3 + [2.0] * 3 + [3.0] * 3}
    assert choose(cells(points=points)).kind == "heat-map"


@pytest.mark.parametrize(
    ("study", "how", "message"),
    [
        ({"axes": {"robots": NUMBERS}}, {"kind": "heat-map"}, "kind=heat-map: needs two axes, but only robots varies.*lines"),
        ({}, {"kind": "lines"}, "kind=lines: needs an axis.*--kind distribution"),
        ({"axes": {"robots": NUMBERS}}, {"kind": "distribution", "x": "robots"}, "x=robots: a distribution .* give --y"),
        ({"axes": {"robots": list(range(11))}}, {"kind": "distribution"}, "y=robots: has 11 values, at most 10 curves.*--where robots=0"),
        ({"axes": {"robots": NUMBERS}}, {"kind": "pie"}, "kind='pie': .*heat-map"),
        ({"axes": {"robots": NUMBERS}}, {"x": "robot"}, "x='robot': .*robots"),
        ({"axes": {"robots": NUMBERS, "radius": MORE}}, {"x": "robots", "y": "robots"}, "y=robots: .*another axis"),
        (
            {"axes": {"robots": list(range(11)), "radius": list(range(1, 12))}}, {"kind": "lines"},
            "y=radius: has 11 values, at most 10 lines",
        ),
        (
            {"axes": {"robots": NUMBERS, "radius": MORE, "policy": POLICIES, "delta": [1, 2, 3, 4, 5]}}, {},
            "policy, delta: 15 panels.*at most 12.*--where delta=1",
        ),
        (
            {"points": {"robots": list(range(80)), "radius": list(range(80))}}, {"kind": "heat-map"},
            "kind=heat-map: the 80 settings are no grid .6,400 combinations.*--kind scatter",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused_with_the_cure(
    study: dict[str, Any], how: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        choose(cells(**study), **how)


def test_panels_divide_the_settings() -> None:
    found = choose(cells(axes={"robots": NUMBERS, "radius": MORE, "policy": POLICIES, "awareness": DEGREES}))
    panels = panels_of(found, 4 * 3 * 3 * 2)
    assert len(panels) == 6
    masks = np.array([settings for _, settings in panels])
    assert (masks.sum(axis=0) == 1).all()
    assert panels[0][0] == "policy = a-cmommt, awareness = none"


@pytest.mark.parametrize("value", ["4", 4, 4.0, "4.0"])
def test_where_takes_numbers_and_their_texts(value: object) -> None:
    settings = settings_of(Study(axes={"robots": NUMBERS, "policy": POLICIES}).plan())
    found = settings[matching(settings, {"robots": value})]
    assert found["robots"].tolist() == [4] * 3


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ({"robot": 4}, "where='robot'.*robots"),
        ({"robots": 5}, "where=robots=5: is no value of the study; give one of 2, 4, 8, 16"),
        ({"policy": "ring"}, "give one of a-cmommt, centroid, evolved"),
    ],
)
def test_where_names_the_values_that_there_are(where: dict[str, object], message: str) -> None:
    settings = settings_of(Study(axes={"robots": NUMBERS, "policy": POLICIES}).plan())
    with pytest.raises(ValueError, match=message):
        matching(settings, where)
