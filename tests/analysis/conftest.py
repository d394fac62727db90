"""Two workers for all tests that compare what workers make with what is made without: to start them takes the longest."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from teamsight.analysis.runs.processes import WorkerPool


@pytest.fixture(scope="session")
def two_workers() -> Iterator[WorkerPool]:
    with WorkerPool(2) as pool:
        yield pool
