"""Bad input to lazy memories: every refusal names what is wrong and how to mend it."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from teamsight.policies.memory import LazyMemory

GOOD: dict[str, Any] = {
    "situation": [[0.5, 1.0, 1.0], [1.0, 0.25, 1.0]],
    "action": [[1.0, 0.5], [-3.0, 1.0]],
    "next_situation": [[1.0, 1.0, 1.0], [0.0, 0.5, 1.0]],
    "facts": {"gained": [1, 0]},
    "own": 2,
    "settings": {"awareness": "RingAwareness(delta=1)"},
}
NAN = float("nan")
CASES: list[tuple[dict[str, Any], str]] = [
    ({"situation": np.zeros((0, 3))}, "situation: has 0 transitions; a memory needs at least 1: explore"),
    ({"situation": np.zeros((2, 0))}, "situation: has 0 components; .* give the percept"),
    ({"situation": [0.5, 1.0]}, r"situation: has the shape \(2,\); it must be \(transitions, inputs\)"),
    ({"situation": [[0.5], [1.0, 1.0]]}, "situation: is not an array .* give rows of equal length"),
    ({"situation": [["a"]]}, "situation: has the type <U1; it must be numbers"),
    ({"situation": [[1j]]}, "situation: has the type complex128; it must be numbers"),
    ({"situation": [[0.5, NAN, 1.0], [1.0, 0.25, 1.0]]}, r"situation\[0, 1\] = nan: .* leave such transitions out"),
    ({"next_situation": [[0.5, 1.0, 1.0], [1.0, 0.25, NAN]]}, r"next_situation\[1, 2\] = nan: .* leave such transitions out"),
    ({"next_situation": [[0.5, 1.0], [1.0, 0.25]]}, r"next_situation: has the shape \(2, 2\); it must be \(2, 3\)"),
    ({"situation": [[0.5, 1e39, 1.0], [1.0, 0.25, 1.0]]}, r"situation\[0, 1\] = 1e\+39: must be finite and at most 1e\+30"),
    ({"situation": [[0.5, -2e30, 1.0], [1.0, 0.25, 1.0]]}, r"situation\[0, 1\] = -2e\+30: must be finite and at most 1e\+30"),
    ({"action": [[1.0, 0.5]]}, r"action: has the shape \(1, 2\); it must be \(2, 2\)"),
    ({"action": [[1.0, 0.5], [3.2, 1.0]]}, "action: rotation = 3.2; it must be in radians"),
    ({"action": [[1.0, 0.5], [3.0, 1.1]]}, "action: distance = 1.1; it must be as a share of the robot's speed"),
    ({"action": [[1.0, 0.5], [3.0, -0.1]]}, "action: distance = -0.1"),
    ({"action": [[1.0, 0.5], [np.inf, 0.1]]}, r"action\[1, 0\] = inf"),
    ({"facts": {"gained": [1]}}, r"fact 'gained': has the shape \(1,\); it must be \(2,\)"),
    ({"facts": {"gained": [1, NAN]}}, r"fact 'gained'\[1\] = nan"),
    ({"facts": {"gained": ["x", "y"]}}, "fact 'gained': has the type <U1; it must be numbers"),
    ({"facts": {3: [1, 0]}}, r"names \[3\]; the name of a fact must be a string"),
    ({"own": 4}, "own=4: must be at most 3"),
    ({"own": 0}, "own=0: must be at least 1"),
    ({"settings": {"seed": NAN}}, "settings: cannot be written as JSON .* give numbers, strings and lists"),
    ({"settings": {"policy": object()}}, "settings: cannot be written as JSON"),
]


@pytest.mark.short
@pytest.mark.parametrize(("changes", "message"), CASES, ids=lambda value: value if isinstance(value, str) else "")
def test_what_cannot_be_a_memory(changes: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        LazyMemory.of(**{**GOOD, **changes})
    assert re.search(message, str(caught.value)), caught.value


def test_the_furthest_rotation_is_allowed() -> None:
    action = [[np.float32(np.pi), 0.0], [-np.float32(np.pi), 1.0]]
    assert len(LazyMemory.of(**{**GOOD, "action": action})) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[1.0, 1.0, 1.0]], 3), "k=3: the memory has 2 transitions; give a smaller k, or explore longer"),
        (([[1.0, 1.0, 1.0]], 0), "k=0: must be at least 1"),
        (([[1.0, 1.0, 1.0]], 1.5), "k=1.5: must be a whole number"),
        (([[1.0, 1.0]], 1), "queries: have 2 components; 3 are compared: give 3"),
        (([[1.0, 1.0, 1.0, 1.0]], 1, 2), "queries: have 4 components; 2 are compared: give 2"),
        (([1.0, 1.0, 1.0], 1), r"queries: has the shape \(3,\)"),
        (([[1.0, NAN, 1.0]], 1), r"queries: hold NaN or more than 1e\+30"),
        (([[1.0, -1e31, 1.0]], 1), "the readings of a situation are finite"),
        (([[1.0, 1.0, 1.0]], 1, 4), "inputs=4: must be at most 3"),
        (([[1.0, 1.0, 1.0]], 1, 0), "inputs=0: must be at least 1"),
    ],
)
def test_queries(arguments: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        LazyMemory.of(**GOOD).nearest(*arguments)


def test_components_that_are_not_compared_are_not_asked() -> None:
    memory = LazyMemory.of(**GOOD)
    assert memory.nearest([[1.0, 0.25, NAN]], 1, inputs=2)[1].tolist() == [[0.0]]
    assert memory.nearest(np.zeros((0, 3)), 1)[0].shape == (0, 1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"own": 3},
            r"RingAwareness\(delta=1\) with 2 \+ 1 inputs and .* with 3 \+ 0 inputs; explore both under the same",
        ),
        (
            {"settings": {"awareness": "PairwiseAwareness()"}},
            "one of PairwiseAwareness.*; explore both under the same degree",
        ),
        ({"settings": {}}, "one of None with"),
        ({"facts": {"lost": [0, 1]}}, r"facts \('gained',\) and \('lost',\); explore both with the same facts"),
        ({"situation": [[1.0, 1], [0, 1]], "next_situation": [[1.0, 1], [0, 1]]}, r"with 2 \+ 0 inputs"),
    ],
)
def test_memories_that_do_not_merge(changes: dict[str, Any], message: str) -> None:
    memory = LazyMemory.of(**GOOD)
    with pytest.raises(ValueError, match=message):
        memory.merge(memory, LazyMemory.of(**{**GOOD, **changes}))


def test_samples_and_facts() -> None:
    memory = LazyMemory.of(**GOOD)
    with pytest.raises(ValueError, match="count=3: the memory has 2 transitions; give a smaller count"):
        memory.sample(3, 1)
    with pytest.raises(ValueError, match="count=0: must be at least 1"):
        memory.sample(0, 1)
    with pytest.raises(ValueError, match="seed=-1: must be at least 0"):
        memory.sample(1, -1)
    with pytest.raises(ValueError, match="fact='gaind': unknown; did you mean 'gained'"):
        memory.fact("gaind")


@pytest.mark.parametrize("table", [np.zeros((9, 2)), np.zeros((8, 2), np.float32), np.zeros((2, 9), np.float32).T])
def test_tables_that_kernels_would_misread(table: Any) -> None:
    with pytest.raises(ValueError, match=r"it must be C-contiguous float32 of shape \(9, transitions\); use LazyMemory.of"):
        LazyMemory(table, 2, 1, ("gained",))


def test_a_table_without_transitions() -> None:
    with pytest.raises(ValueError, match="table: has 0 transitions; a memory needs at least 1: explore first"):
        LazyMemory(np.zeros((12, 0), np.float32), 3, 2, ())


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ([LazyMemory.of(**GOOD)], "is not a LazyMemory; give merge(*memories)"),
        ("x", "merge: 'x' is not a LazyMemory; give merge(*memories)"),
        (None, "merge: None is not a LazyMemory"),
    ],
)
def test_only_memories_merge(other: Any, message: str) -> None:
    with pytest.raises(TypeError, match=re.escape(message)):
        LazyMemory.of(**GOOD).merge(other)
