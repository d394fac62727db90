"""Readings of situations: against their slow twin, and where the answer is known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import regression as naive

from teamsight.policies.lazy.readings import KINDS, LAYOUTS, readings_of
from teamsight.policies.memory import LazyMemory

pytestmark = pytest.mark.short


def situations(rng: np.random.Generator, count: int, own: int, added: int, layout: str) -> Any:
    """Situations in which two inputs of three show nothing."""
    found = np.where(rng.random((count, own + added)) < 1 / 3, rng.random((count, own + added)), 1.0)
    if layout == "offsets":
        # Both readings of a teammate out of range are 1; the bearing of one in range may be any share of a turn.
        found[:, own + 1 :: 2] = np.where(found[:, own::2] < 1, rng.random((count, added // 2)), 1.0)
    return found.astype(np.float32)


def memory_of(situation: Any, action: Any, own: int) -> LazyMemory:
    return LazyMemory.of(situation, action, situation, {}, own=own)


@given(
    seed=st.integers(0, 2**32 - 1), own=st.integers(1, 70), added=st.integers(0, 70), layout=st.sampled_from(LAYOUTS),
    ratio=st.floats(0.3, 3), stride=st.floats(0.01, 2),
)  # fmt: skip
def test_as_the_slow_twin(seed: int, own: int, added: int, layout: str, ratio: float, stride: float) -> None:
    rng = np.random.default_rng(seed)
    added -= added % 2 if layout == "offsets" else 0
    action = np.stack([rng.uniform(-math.pi, math.pi, 6), rng.random(6)], axis=1)
    memory = memory_of(situations(rng, 6, own, added, layout), action, own)
    inputs = own + added if layout else own
    found = readings_of(memory, inputs, layout, ratio, stride)
    expected = naive.read(memory, inputs, layout, ratio, stride)
    assert [(KINDS[kind], i) for kind, i in zip(found.kind, found.transition, strict=True)] == [
        (kind, i) for kind, i, _, _ in expected
    ]
    assert found.distance == pytest.approx([distance for _, _, distance, _ in expected], abs=1e-6)
    assert found.moved == pytest.approx([moved for _, _, _, moved in expected], abs=1e-6)


def kinds(situation: list[float], own: int, layout: str, ratio: float = 1.0) -> list[str]:
    found = readings_of(memory_of([situation], [[0.0, 0.0]], own), len(situation), layout, ratio, 0.1)
    return [KINDS[kind] for kind in found.kind]


def test_a_target_belongs_to_the_robot_unless_a_teammate_is_nearer() -> None:
    # Four sectors each; the target is ahead, at 0.8.
    assert kinds([0.8, 1, 1, 1, 0.5, 1, 1, 1], 4, "sectors") == ["taken target", "teammate"]
    assert kinds([0.8, 1, 1, 1, 1, 0.5, 1, 1], 4, "sectors") == ["free target", "teammate"]
    # As far as the robot itself is not nearer: a teammate at the robot's own place, and one on the other side.
    assert kinds([0.8, 1, 1, 1, 0.0, 1, 1, 1], 4, "sectors") == ["free target", "teammate"]
    assert kinds([0.25, 1, 1, 1, 0.5, 1, 1, 1], 4, "sectors") == ["free target", "teammate"]
    # Teammates that show nothing take nothing.
    assert kinds([0.8, 1, 1, 1, 1, 1, 1, 1], 4, "sectors") == ["free target"]


def test_readings_of_teammates_are_in_awareness_ranges() -> None:
    # The teammate at 0.9 awareness ranges is at 1.8 or at 0.45 sensing ranges.
    assert kinds([0.8, 1, 1, 1, 0.9, 1, 1, 1], 4, "sectors", ratio=2.0) == ["free target", "teammate"]
    assert kinds([0.8, 1, 1, 1, 0.9, 1, 1, 1], 4, "sectors", ratio=0.5) == ["taken target", "teammate"]
    situation = [[1.0, 0.5]]
    found = readings_of(memory_of(situation, [[0.0, 1.0]], 1), 2, "sectors", 2.0, 0.4)
    assert found.moved == pytest.approx([0.5 - 0.4 / 2])


def test_the_robots_own_move_counts_in_full() -> None:
    # Straight ahead, past it, away from it and across, from a target at 0.3.
    action = [[0.0, 1.0], [0.0, 0.5], [math.pi, 1.0], [math.pi / 2, 1.0], [0.0, 0.0]]
    memory = memory_of([[0.3, 1, 1, 1]] * 5, action, 4)
    expected = {tuple(np.float32(a)): abs(0.3 - 0.4 * a[1] * complex(math.cos(a[0]), math.sin(a[0]))) for a in action}
    found = readings_of(memory, 4, "", 1.0, 0.4)
    assert found.moved == pytest.approx([expected[tuple(one)] for one in memory.action], abs=1e-6)


def test_a_bearing_is_a_share_of_a_turn_whatever_the_number_of_turns() -> None:
    one, other = (
        readings_of(memory_of([[1.0, 0.5, bearing]], [[0.0, 1.0]], 1), 3, "offsets", 1.0, 0.4) for bearing in (0.25, -1.75)
    )
    assert one.moved == pytest.approx(other.moved)
    assert one.moved == pytest.approx([math.hypot(0.5, 0.4)])


def test_a_negative_reading_is_a_distance_of_zero() -> None:
    found = readings_of(memory_of([[-0.5, 1.0]], [[0.0, 1.0]], 2), 2, "", 1.0, 0.1)
    assert (found.distance.tolist(), found.moved.tolist()) == ([0.0], pytest.approx([0.1]))
