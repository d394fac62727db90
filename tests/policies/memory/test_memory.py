"""Lazy memories: made, merged, sampled; independent of the order in which their transitions came."""

from __future__ import annotations

import copy
import pickle
import tracemalloc
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.policies.memory import LazyMemory

SETTINGS = {"awareness": "RingAwareness(delta=4)", "degree": "ring", "robots": 5}


def transitions_of(count: int, rng: np.random.Generator, inputs: int = 6) -> dict[str, Any]:
    """Return made-up transitions, many of which are alike."""
    return {
        "situation": rng.integers(0, 3, (count, inputs)) / 2,
        "action": np.stack([rng.integers(-3, 4, count), rng.integers(0, 2, count)], axis=1).astype(float),
        "next_situation": rng.integers(0, 3, (count, inputs)) / 2,
        "facts": {"lost": rng.integers(0, 2, count), "gained": rng.integers(-1, 2, count)},
    }


def some(transitions: dict[str, Any], rows: Any) -> dict[str, Any]:
    return {
        **{name: transitions[name][rows] for name in ("situation", "action", "next_situation")},
        "facts": {name: fact[rows] for name, fact in transitions["facts"].items()},
    }


def memory_of(count: int = 50, seed: int = 1, **changes: Any) -> LazyMemory:
    given = {**transitions_of(count, np.random.default_rng(seed)), "own": 2, "settings": SETTINGS, **changes}
    return LazyMemory.of(**given)


def rows_of(memory: LazyMemory) -> list[tuple[float, ...]]:
    return [tuple(column) for column in memory.table.T.tolist()]


@pytest.mark.short
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 80))
def test_content_decides_alone(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    transitions = transitions_of(count, rng)
    memory = LazyMemory.of(**transitions, own=2)
    shuffled = some(transitions, rng.permutation(count))
    shuffled["facts"] = dict(reversed(shuffled["facts"].items()))
    again = LazyMemory.of(**shuffled, own=2)
    assert again.table.tobytes() == memory.table.tobytes()
    assert again.digest == memory.digest
    assert again == memory
    assert hash(again) == hash(memory)
    rows = [
        (*s, *a, *t, gained, lost)
        for s, a, t, gained, lost in zip(
            transitions["situation"].tolist(), transitions["action"].tolist(), transitions["next_situation"].tolist(),
            transitions["facts"]["gained"].tolist(), transitions["facts"]["lost"].tolist(), strict=True,
        )
    ]  # fmt: skip
    assert rows_of(memory) == sorted(rows)


def test_what_it_shows() -> None:
    memory = LazyMemory.of([[0.5, 1], [0.25, 0]], [[1, 0.5], [-1, 1]], [[0, 0], [1, 1]], {"b": [7, 8], "a": [5, 6]}, 1)
    assert (len(memory), memory.inputs, memory.own, memory.added, memory.facts) == (2, 2, 1, 1, ("a", "b"))
    assert memory.situation.tolist() == [[0.25, 0], [0.5, 1]]
    assert memory.action.tolist() == [[-1, 1], [1, 0.5]]
    assert memory.next_situation.tolist() == [[1, 1], [0, 0]]
    assert memory.fact("a").tolist() == [6, 5]
    assert memory.fact("b").tolist() == [8, 7]
    assert memory.table.dtype == np.float32
    assert memory.situation.base is not None
    with pytest.raises(ValueError, match="read-only"):
        memory.table[0, 0] = 1
    assert repr(memory) == f"LazyMemory(2 transitions, 1 + 1 inputs, {memory.digest[:8]})"


def test_both_zeros_are_one_number() -> None:
    transitions = transitions_of(40, np.random.default_rng(3))
    negative = {**transitions, "situation": np.where(transitions["situation"] == 0, -0.0, transitions["situation"])}
    assert LazyMemory.of(**negative, own=2) == LazyMemory.of(**transitions, own=2)


def test_digest_distinguishes_contents() -> None:
    memory = memory_of()
    action = transitions_of(50, np.random.default_rng(1))["action"].copy()
    action[7, 0] = np.nextafter(np.float32(action[7, 0]), np.float32(9))
    renamed = transitions_of(50, np.random.default_rng(1))["facts"]
    others = [
        memory_of(seed=2), memory_of(49), memory_of(own=3), memory_of(action=action),
        memory_of(facts={"gained": renamed["gained"], "missed": renamed["lost"]}),
    ]  # fmt: skip
    assert len({memory.digest, *(other.digest for other in others)}) == 6
    assert memory not in others
    assert memory == memory_of(settings={"awareness": "elsewhere"})
    assert memory != "a memory"


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda memory: pickle.loads(pickle.dumps(memory))])
def test_copies(duplicate: Any) -> None:
    again = duplicate(memory_of())
    assert again == memory_of()
    assert again.settings == SETTINGS
    assert not again.table.flags.writeable


def test_what_never_changes_is_not_copied_with_what_holds_it() -> None:
    memory = memory_of()
    assert np.shares_memory(copy.deepcopy([memory])[0].table, memory.table)


@pytest.mark.short
@given(seed=st.integers(0, 2**32 - 1), cut=st.integers(1, 39))
def test_merging_is_as_exploring_at_once(seed: int, cut: int) -> None:
    transitions = transitions_of(40, np.random.default_rng(seed))
    whole = LazyMemory.of(**transitions, own=2, settings=SETTINGS)
    one = LazyMemory.of(**some(transitions, slice(cut)), own=2, settings=SETTINGS)
    other = LazyMemory.of(**some(transitions, slice(cut, None)), own=2, settings=SETTINGS)
    assert one.merge(other) == other.merge(one) == whole
    assert one.append(**some(transitions, slice(cut, None))) == whole
    assert one.merge(other).settings == SETTINGS
    assert one.merge() == one
    assert len(one.merge(one, other)) == 40 + cut


def test_merged_settings_keep_what_made_each() -> None:
    one, two, three = (memory_of(seed=seed, settings={**SETTINGS, "seed": seed}) for seed in (1, 2, 3))
    merged = one.merge(two).merge(three, one)
    assert merged.settings == {**SETTINGS, "merged": [{**SETTINGS, "seed": seed} for seed in (1, 2, 3)]}
    part = merged.sample(5, seed=1)
    assert part.settings["sample"] == {"count": 5, "seed": 1, "of": merged.digest}
    assert part.merge(one).settings["merged"][0] == part.settings


@given(seed=st.integers(0, 2**32 - 1), fewer=st.integers(1, 60), more=st.integers(1, 60))
def test_samples(seed: int, fewer: int, more: int) -> None:
    fewer, more = sorted((fewer, more))
    rng = np.random.default_rng(seed)
    transitions = transitions_of(60, rng)
    memory = LazyMemory.of(**transitions, own=2, settings=SETTINGS)
    shuffled = LazyMemory.of(**some(transitions, rng.permutation(60)), own=2, settings=SETTINGS)
    small, large = memory.sample(fewer, seed), memory.sample(more, seed)
    assert small == shuffled.sample(fewer, seed)
    assert rows_of(small) == sorted(rows_of(small))
    for part, whole in ((small, large), (large, memory)):
        left = rows_of(whole)
        for row in rows_of(part):
            left.remove(row)
    assert memory.sample(60, seed) == memory


def test_every_pair_may_be_drawn() -> None:
    memory = LazyMemory.of(np.arange(10)[:, None], np.zeros((10, 2)), np.zeros((10, 1)), {}, own=1)
    drawn = [int(memory.sample(1, seed).situation[0, 0]) for seed in range(1_000)]
    # A fair draw has 100 of each, ± 9.5; six deviations fail once in 10⁸ and no more, whichever seeds are taken.
    assert np.bincount(drawn, minlength=10).min() > 43


def test_a_million_pairs_are_sorted_in_place() -> None:
    count, inputs = 1_000_000, 32
    rng = np.random.default_rng(5)
    situation = np.ones((count, inputs), np.float32)
    situation[np.arange(count), rng.integers(0, inputs, count)] = rng.random(count, np.float32)
    action = np.zeros((count, 2), np.float32)
    tracemalloc.start()
    memory = LazyMemory.of(situation, action, situation, {"gained": np.arange(count)})
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.5 * memory.table.nbytes
    order = np.lexsort((np.arange(count), *situation.T[::-1]))
    assert np.array_equal(memory.fact("gained"), order.astype(np.float32))
    index, distance = memory.nearest(memory.situation[[0, 500_000, 999_999]], 1)
    assert distance.tolist() == [[0], [0], [0]]
    assert index[0, 0] == 0
