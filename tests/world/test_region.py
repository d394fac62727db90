"""Regions: a kernel's test of where bodies may be agrees with `contains` of every arena that ships."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from teamsight import Box, Circle, Disc, Polygon, Torus
from teamsight.core.kernel import Entry, Record
from teamsight.world.shapes import Region, is_in_region, region_of

L_SHAPE = Polygon([(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)])
ARENAS = [
    Disc(2.0), Box(4.0, 3.0), Torus(4.0, 3.0), L_SHAPE,
    Disc(2.0).with_obstacles(Circle((1.5, 0.0), 0.7), Polygon([(-1, -1), (0, -1), (-0.5, 0.5)])),
    Torus(4.0, 3.0).with_obstacles(Circle((1.9, 1.4), 0.6), Polygon([(-1, -1), (0, -1), (-0.5, 0.5), (-2.2, 0.1)])),
    L_SHAPE.with_obstacles(Circle((0.5, 0.5), 0.2), Circle((0.6, 0.6), 0.2)),
]  # fmt: skip


class Questions(NamedTuple):
    region: Region
    place: Annotated[npt.NDArray[np.float64], "n", 2]
    answer: Annotated[npt.NDArray[np.int64], "n"]


QUESTIONS = Record(Questions)
questions_at = QUESTIONS.at


def _ask(address: int) -> int:
    asked = questions_at(address)
    for i in range(asked.place.shape[0]):
        asked.answer[i] = is_in_region(asked.region, asked.place[i, 0], asked.place[i, 1])
    return 0


ASK = Entry(_ask)


def answers(arena: Any, place: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    asked = Questions(region_of(arena), np.ascontiguousarray(place), np.zeros(len(place), np.int64))
    ASK(QUESTIONS.pack(asked))
    return asked.answer.astype(bool)


@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_it_agrees_with_contains(arena: Any) -> None:
    rng = np.random.default_rng(1)
    low, high = arena.bounds
    place = rng.uniform(low - 0.5, high + 0.5, (4000, 2))
    found = answers(arena, place)
    assert (found == arena.contains(place)).all()
    assert 0.1 < found.mean() < 0.95
    inside = arena.place(*rng.random((2, 500)))
    assert answers(arena, inside).all()


@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_what_is_not_finite_is_outside(arena: Any) -> None:
    place = np.array([[np.nan, 0.0], [0.0, np.nan], [np.inf, 0.0], [0.0, -np.inf]])
    assert not answers(arena, place).any()
