"""Room: buffers that grow in the middle of a run change no bit of its result."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.records import Phase
from teamsight.world import search

DEGREES = ["none", "ring", "nearest", "pairwise", "shared"]


def gathering(awareness: str) -> CMOMMT:
    """Far more robots than there is room for at first come together around a few targets."""
    return CMOMMT(
        robots=100, targets=20, radius=8.0, policy="centroid", awareness=awareness, sensing_range=20.0, awareness_range=1.5,
        robot_speed=0.4, target_speed=0.02, rng=fresh_seed(),
    )  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize("awareness", DEGREES)
def test_growing_in_the_middle_of_a_run(awareness: str, monkeypatch: pytest.MonkeyPatch) -> None:
    grown: list[int] = []
    grow = Engine._grow

    def counted(self: Engine, phase: Phase, need: int) -> None:
        grown.append(int(self._binding.progress["tick"][0]))
        grow(self, phase, need)

    model = gathering(awareness)
    again = {**model.settings, "rng": model.seed_used}
    stepped = CMOMMT(**again)
    monkeypatch.setattr(Engine, "_grow", counted)
    model.run(60)
    assert grown[-1] > 5
    assert model.max_neighbours == 99
    for _ in range(60):
        stepped.step()
    first = search.first_room
    monkeypatch.setattr(search, "first_room", lambda observers, observed: 800 * first(observers, observed))
    monkeypatch.setattr(Engine, "_grow", lambda *arguments: pytest.fail("there should have been room"))
    roomy = CMOMMT(**again)
    roomy.run(60)
    for other in (roomy, stepped):
        assert np.array_equal(model.robots.position, other.robots.position)
        assert np.array_equal(model.targets.position, other.targets.position)
        assert model.recording.history.equals(other.recording.history)
        for a, b in zip(model.robots.neighbours("teammates"), other.robots.neighbours("teammates"), strict=True):
            assert np.array_equal(a, b)


@pytest.mark.parametrize("awareness", DEGREES)
def test_growing_from_hardly_any_room(awareness: str, monkeypatch: pytest.MonkeyPatch) -> None:
    reference = CMOMMT(
        robots=20, targets=30, radius=1.5, policy="a-cmommt", awareness=awareness, target_policy="evasive", rng=2
    )
    reference.run(50)
    monkeypatch.setattr(search, "first_room", lambda observers, observed: 1)
    model = CMOMMT(**{**reference.settings, "rng": 2})
    model.run(20)
    for _ in range(30):
        model.step()
    assert np.array_equal(reference.robots.position, model.robots.position)
    assert reference.recording.history.equals(model.recording.history)


def test_python_policies_keep_what_they_know_when_buffers_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    def counts() -> list[int]:
        seen: list[int] = []

        def look(percept: Any, rng: Any) -> tuple[float, float]:
            seen.append(len(percept.teammates.identity) + 100 * len(percept.relayed.identity))
            toward = percept.targets.offset.mean(axis=0)
            return float(np.arctan2(*toward[::-1]) - np.arctan2(*percept.heading[::-1])), 0.3

        model = CMOMMT(**{**plan, "policy": look})
        for _ in range(15):
            model.step()
        return seen

    plan = {**gathering("shared").settings, "rng": 4}
    expected = counts()
    first = search.first_room
    monkeypatch.setattr(search, "first_room", lambda observers, observed: 800 * first(observers, observed))
    assert counts() == expected
