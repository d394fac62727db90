"""The k nearest situations are those of eq. 1, to the last bit, with ties broken by content."""

from __future__ import annotations

from typing import Any

import naive_lazy
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.policies.lazy_memory import LazyMemory
from teamsight.policies.lazy_memory.nearest import BLOCK


def memory_of(pairs: int, inputs: int, rng: np.random.Generator, steps: int | None = None) -> LazyMemory:
    """Return made-up pairs; with `steps`, readings are so coarse that many distances are equal."""

    def readings() -> Any:
        sensed = rng.random((pairs, inputs)) if steps is None else rng.integers(0, steps + 1, (pairs, inputs)) / steps
        return np.where(rng.random((pairs, inputs)) < 0.5, 1.0, sensed).astype(np.float32)

    action = np.stack([rng.uniform(-3.0, 3.0, pairs), rng.random(pairs)], axis=1)
    facts = {"gained": rng.integers(0, 2, pairs), "lost": rng.integers(0, 2, pairs)}
    return LazyMemory.of(readings(), action, readings(), facts, own=inputs)


@pytest.mark.short
@given(
    seed=st.integers(0, 2**32 - 1), pairs=st.integers(1, 2 * BLOCK + 70), inputs=st.integers(1, 35),
    k=st.integers(1, 12), steps=st.sampled_from([None, 1, 3]),
)  # fmt: skip
def test_as_the_slow_twin(seed: int, pairs: int, inputs: int, k: int, steps: int | None) -> None:
    rng = np.random.default_rng(seed)
    memory, k = memory_of(pairs, inputs, rng, steps), min(k, pairs)
    prefix = int(rng.integers(1, inputs + 1))
    queries = np.concatenate([memory.situation[rng.integers(0, pairs, 2)], memory_of(2, inputs, rng, steps).situation])
    for compared in {prefix, inputs}:
        index, distance = memory.nearest(queries, k, compared)
        assert index.dtype == np.int64
        assert distance.dtype == np.float32
        for i, query in enumerate(queries):
            expected = naive_lazy.nearest(memory.situation[:, :compared], query[:compared], k)
            assert list(zip(distance[i], index[i], strict=True)) == expected
