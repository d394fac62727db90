"""The k nearest situations are those of eq. 1, to the last bit, with ties broken by content."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive import lazy as naive_lazy

from teamsight.core.kernel import Entry, Record
from teamsight.policies.memory import LazyMemory
from teamsight.policies.memory.nearest import BLOCK, LANES, SearchTable, k_nearest, search_table


class Ask(NamedTuple):
    table: Annotated[npt.NDArray[np.float32], "inputs + 1", "columns"]
    margin: float
    query: Annotated[npt.NDArray[np.float32], "inputs"]
    place: Annotated[npt.NDArray[np.int64], "k"]
    distance: Annotated[npt.NDArray[np.float32], "k"]


ASK = Record(Ask)
ask_at = ASK.at


def memory_of(transitions: int, inputs: int, rng: np.random.Generator, steps: int | None = None) -> LazyMemory:
    """Return made-up transitions; with `steps`, readings are so coarse that many distances are equal."""

    def readings() -> Any:
        sensed = rng.random((transitions, inputs)) if steps is None else rng.integers(0, steps + 1, (transitions, inputs)) / steps
        return np.where(rng.random((transitions, inputs)) < 0.5, 1.0, sensed).astype(np.float32)

    action = np.stack([rng.uniform(-3.0, 3.0, transitions), rng.random(transitions)], axis=1)
    facts = {"gained": rng.integers(0, 2, transitions), "lost": rng.integers(0, 2, transitions)}
    return LazyMemory.of(readings(), action, readings(), facts, own=inputs)


@pytest.mark.short
@given(
    seed=st.integers(0, 2**32 - 1), transitions=st.integers(1, 2 * BLOCK + 70), inputs=st.integers(1, 35),
    k=st.integers(1, 12) | st.integers(60, 140), steps=st.sampled_from([None, 1, 3]),
)  # fmt: skip
def test_as_the_slow_twin(seed: int, transitions: int, inputs: int, k: int, steps: int | None) -> None:
    rng = np.random.default_rng(seed)
    memory, k = memory_of(transitions, inputs, rng, steps), min(k, transitions)
    prefix = int(rng.integers(1, inputs + 1))
    queries = np.concatenate([memory.situation[rng.integers(0, transitions, 2)], memory_of(2, inputs, rng, steps).situation])
    for compared in {prefix, inputs}:
        index, distance = memory.nearest(queries, k, compared)
        assert index.dtype == np.int64
        assert distance.dtype == np.float32
        for i, query in enumerate(queries):
            expected = naive_lazy.nearest(memory.situation[:, :compared], query[:compared], k)
            assert list(zip(distance[i], index[i], strict=True)) == expected


def _ask(address: int) -> int:
    ask = ask_at(address)
    k_nearest(ask.table, ask.margin, ask.query, ask.place.shape[0], ask.place, ask.distance)
    return 0


ENTRY = Entry(_ask)


def in_a_kernel(search: SearchTable, query: Any, k: int) -> tuple[Any, Any]:
    """Return the transitions that a kernel finds, −1 where there is none, and their distances."""
    index, distance = np.full(k, 77), np.full(k, 77, np.float32)
    query = np.ascontiguousarray(query, np.float32)
    ENTRY(ASK.pack(Ask(search.table, search.margin, query, index, distance)))
    return np.where(index < 0, -1, search.kept[index]), distance


@pytest.mark.short
@given(
    seed=st.integers(0, 2**32 - 1), transitions=st.integers(1, 60) | st.integers(1, 2 * BLOCK + 70), inputs=st.integers(1, 35),
    k=st.integers(1, 12) | st.integers(LANES - 4, LANES + 20), steps=st.sampled_from([None, 1, 3]),
    ones=st.sampled_from([0.0, 0.5, 0.9, 0.99]), largest=st.sampled_from([0.3, 1.0, 1.5, 1e30]),
)  # fmt: skip
def test_in_kernels(seed: int, transitions: int, inputs: int, k: int, steps: int | None, ones: float, largest: float) -> None:
    rng = np.random.default_rng(seed)

    def readings(count: int) -> Any:
        sensed = rng.random((count, inputs)) if steps is None else rng.integers(0, steps + 1, (count, inputs)) / steps
        return np.where(rng.random((count, inputs)) < ones, 1.0, largest * sensed).astype(np.float32)

    situation = readings(transitions)
    memory = LazyMemory.of(situation, rng.random((transitions, 2)), situation, {}, own=inputs)
    search = search_table(memory.table, inputs, min(k, transitions))
    assert len(set(search.kept)) == len(search.kept)
    for query in (np.ones(inputs), *readings(2), -readings(1)[0], memory.situation[rng.integers(0, transitions)]):
        index, distance = in_a_kernel(search, query, min(k, transitions))
        expected = naive_lazy.nearest(memory.situation, query, min(k, transitions))
        assert list(zip(distance, index, strict=True)) == expected
    assert search.kept[search.nearest_to_ones].tolist() == [
        place for _, place in naive_lazy.nearest(memory.situation, np.ones(inputs), min(k, transitions))
    ]


@settings(max_examples=6)
@given(seed=st.integers(0, 2**32 - 1), k=st.integers(1, 3))
def test_situations_that_differ_by_rounding_only(seed: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    situation = rng.permuted(np.tile(rng.random(32, np.float32), (3 * BLOCK, 1)), axis=1)
    memory = LazyMemory.of(situation, rng.random((len(situation), 2)), situation, {})
    query = np.full(32, rng.random(), np.float32)
    index, distance = in_a_kernel(search_table(memory.table, 32, k), query, k)
    assert list(zip(distance, index, strict=True)) == naive_lazy.nearest(memory.situation, query, k)


def test_fewer_columns_than_matches() -> None:
    search = search_table(np.float32([[0.25, 0.5, 0.5]]), 1, 2)
    index, distance = in_a_kernel(search, [0.5], 5)
    assert index.tolist() == [1, 2, 0, -1, -1]
    assert distance.tolist() == [0.0, 0.0, 0.25, np.inf, np.inf]


def test_of_equal_situations_no_more_than_k_are_searched() -> None:
    situation = np.float32([[0.5, 0.5, 0.5, 0.5, 1.0], [0.5, 0.5, 0.5, 1.0, 1.0]])
    assert search_table(situation, 2, 2).kept.tolist() == [0, 1, 3, 4]
    assert search_table(situation, 1, 2).kept.tolist() == [0, 1, 4]


def test_equal_distances_are_ordered_by_content() -> None:
    situation = [[0.5, 1.0], [1.0, 0.5], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
    memory = LazyMemory.of(situation, np.zeros((5, 2)), situation, {}, own=1)
    index, distance = memory.nearest([[1.0, 1.0], [0.5, 0.5]], 5)
    assert memory.situation[index[0]].tolist() == [[1.0, 1.0], [0.5, 1.0], [1.0, 0.5], [0.0, 1.0], [1.0, 0.0]]
    assert distance.tolist() == [[0.0, 0.5, 0.5, 1.0, 1.0], [0.5, 0.5, 1.0, 1.0, 1.0]]
    assert index[1].tolist() == [1, 3, 0, 2, 4]


def test_the_largest_numbers_have_distances_too() -> None:
    largest = np.full((3, 35), 1e30)
    facts: dict[str, Any] = {"gained": [0, 0, 0]}
    memory = LazyMemory.of(largest, np.zeros((3, 2)), largest, facts, settings={})
    index, distance = memory.nearest(-largest, 3)
    assert index.tolist() == [[0, 1, 2]] * 3
    assert np.isfinite(distance).all()


def test_sums_are_taken_in_float32_in_the_order_of_the_components() -> None:
    rng = np.random.default_rng(11)
    memory = memory_of(3 * BLOCK, 32, rng)
    query = rng.random(32, np.float32)
    _, distance = memory.nearest(query[None], len(memory))
    total = np.zeros(len(memory), np.float32)
    for component in range(32):
        total += np.abs(memory.table[component] - query[component])
    assert distance[0].tobytes() == np.sort(total).tobytes()
