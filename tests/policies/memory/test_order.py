"""The canonical order of transitions is that of Python's tuples, whatever order they come in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.policies.memory.transitions import Table, canonical_order, is_ordered, sort_transitions


def table_of(transitions: int, rows: int, values: int, rng: np.random.Generator) -> Table:
    return (rng.integers(-values, values + 1, (rows, transitions)) / values).astype(np.float32)


@pytest.mark.short
@given(
    seed=st.integers(0, 2**32 - 1), transitions=st.integers(1, 600), rows=st.integers(1, 9), values=st.sampled_from([1, 2, 9, 10_000])
)  # fmt: skip
def test_as_tuples(seed: int, transitions: int, rows: int, values: int) -> None:
    table = table_of(transitions, rows, values, np.random.default_rng(seed))
    expected = sorted(tuple(transition) for transition in table.T.tolist())
    order = canonical_order(table)
    assert sorted(order) == list(range(transitions))
    assert [tuple(transition) for transition in table[:, order].T.tolist()] == expected
    assert is_ordered(table) == ([tuple(transition) for transition in table.T.tolist()] == expected)
    sort_transitions(table)
    assert [tuple(transition) for transition in table.T.tolist()] == expected
    assert is_ordered(table)


@pytest.mark.parametrize("rows", [1, 40])
def test_inputs_that_are_hard_for_quicksort(rows: int) -> None:
    rng = np.random.default_rng(rows)
    table = np.ones((rows, 100_000), np.float32)
    table[-1] = rng.random(100_000, np.float32)
    sort_transitions(table)
    half = np.concatenate([table[:, ::2], table[:, 1::2]], axis=1)
    pipe = np.concatenate([table[:, ::2], table[:, 1::2][:, ::-1]], axis=1)
    few = np.ascontiguousarray(np.roll(table, 1, axis=1))
    for hard in (half, pipe, few, np.ascontiguousarray(table[:, ::-1])):
        sort_transitions(hard)
        assert np.array_equal(hard, table)
