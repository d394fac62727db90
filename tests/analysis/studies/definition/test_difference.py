"""How two studies differ: a study may grow, and each other change is named."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight import Study
from teamsight.analysis.studies.definition.check import difference

OLD = Study(
    axes={"robots": [5, 10], "radius": [2.0, 3.0]}, fixed={"targets": 5}, replicates=3, steps=600,
    until={"interval": 0.5, "limit": 100},
)  # fmt: skip


def changes(**given: Any) -> list[str]:
    return difference(OLD, dataclasses.replace(OLD, **given))


@pytest.mark.short
@pytest.mark.parametrize(
    "given",
    [
        {}, {"replicates": 9}, {"axes": {"radius": [3, 2], "robots": [1, 10, 5]}}, {"name": "other"}, {"path": "/elsewhere"},
        {"fixed": {}, "axes": {**OLD.axes, "targets": [5]}}, {"fixed": {}, "axes": {**OLD.axes, "targets": [4, 5.0, 6]}},
        {"until": None}, {"until": {"interval": 0.25, "limit": 50}}, {"until": {"interval": 1, "measure": "max_neighbours"}},
        {"axes": {}, "points": {"robots": [5, 5, 10, 10], "radius": [2, 3, 2, 3]}},
        {"axes": {"robots": [5, 10]}, "sample": {"radius": [2.0, 2.5, 3.0]}},
    ],
)  # fmt: skip
def test_a_study_may_grow(given: dict[str, Any]) -> None:
    assert changes(**given) == []


@pytest.mark.short
@pytest.mark.parametrize(
    ("given", "lines"),
    [
        ({"steps": 800}, ["steps: 600 in the folder, 800 now"]),
        ({"seed": 1, "pairing": "none"}, ["seed: 0 in the folder, 1 now", "pairing: 'scenario' in the folder, 'none' now"]),
        ({"model": "a:b"}, ["model: 'cmommt' in the folder, 'a:b' now"]),
        ({"replicates": 2}, ["replicates: 3 in the folder, 2 now, which is fewer"]),
        ({"record": {"steps": True}}, ["record.steps: False in the folder, True now"]),
        ({"record": {"measure": "a:b"}}, ["record.measure: 'summary' in the folder, 'a:b' now"]),
        ({"axes": {"robots": [5], "radius": [2, 3]}}, ["robots: 10 in the folder, not among 5 now"]),
        ({"axes": {"robots": [5, 10]}}, ["radius: 2.0, 3.0 in the folder, not given now"]),
        ({"fixed": {"targets": 6}}, ["targets: 5 in the folder, not among 6 now"]),
        ({"fixed": {"targets": 5, "delta": 8}}, ["delta: not given in the folder, 8 now"]),
        ({"fixed": {"targets": True}}, ["targets: 5 in the folder, not among True now"]),
        ({"zip": [["robots", "radius"]]}, ["settings: 2 of 4 in the folder are not planned now"]),
        ({"axes": {"robots": [5, 10, "many"], "radius": [2, 3]}}, ["robots: numbers in the folder, texts now; a column has one type"]),
        ({"axes": {"robots": range(6, 16), "radius": [2, 3]}}, ["robots: 5 in the folder, not among 6, 7, 8, 9, 10 and 5 more now"]),
    ],
)  # fmt: skip
def test_each_other_change_is_named(given: dict[str, Any], lines: list[str]) -> None:
    assert changes(**given) == lines


VALUES = st.lists(st.integers(0, 4), min_size=1, max_size=4, unique=True)


@given(VALUES, VALUES, VALUES, VALUES, st.integers(1, 4), st.integers(1, 4))
def test_growth_is_all_that_keeps_each_run(
    a: list[int], b: list[int], c: list[int], d: list[int], one: int, other: int
) -> None:
    old, new = Study(axes={"a": a, "b": b}, replicates=one), Study(axes={"b": d, "a": c}, replicates=other)
    grows = set(a) <= set(c) and set(b) <= set(d) and one <= other
    assert (difference(old, new) == []) == grows
    assert difference(old, old) == difference(new, new) == []
