"""Compare the search for nearest situations with faiss's flat L1 index and scikit-learn's brute force, on one thread.

pip install -e '.[benchmark]' && python benchmarks/nearest.py [--quick] [--out FILE.json]
"""

from __future__ import annotations

import os

# Before anything that starts threads is imported.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import faiss
import numpy as np
import numpy.typing as npt
from measure import Row, cpu_seconds, interleave, median, ratio
from rich.console import Console
from run import as_dict, machine, table_of, version_of
from sklearn.neighbors import NearestNeighbors

from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.core.kernel import Entry, Record
from teamsight.policies.memory import LazyMemory
from teamsight.policies.memory.nearest import k_nearest, search_table

INPUTS = 32
TRANSITIONS = (600, 10_000, 1_000_000)
# For each number of transitions, how many queries make up a round; fewer where a query is slow.
QUERIES = {600: 10_000, 10_000: 1_000, 1_000_000: 100}
GOALS = {600: (2.0, 10.0), 10_000: (1.0, None), 1_000_000: (1.0, None)}


class Case(NamedTuple):
    """A memory, and what it is asked."""

    name: str
    memory: LazyMemory
    queries: Any
    k: int


def main() -> int:
    """Measure all cases; the exit status is 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds, and no million transitions")
    parser.add_argument("--out", type=Path, help="write all numbers to this JSON file")
    options = parser.parse_args()
    faiss.omp_set_num_threads(1)
    console = Console(width=None if sys.stdout.isatty() else 130)
    rounds = 5 if options.quick else 9
    rows: list[Row] = []
    with console.status("measuring …"):
        for transitions in TRANSITIONS[:-1] if options.quick else TRANSITIONS:
            for kind, (memory, queries) in {"explored": explored(transitions), "uniform": uniform(transitions)}.items():
                for k in (10, 1):
                    rows += compare(Case(f"{transitions:,} × {INPUTS} {kind}, k = {k}", memory, queries, k), rounds)
        for inputs in (INPUTS, INPUTS // 2):
            rows.append(in_a_kernel(inputs, rounds))
    console.print(table_of(rows))
    if options.out:
        packages = {name: version_of(name) for name in ("faiss-cpu", "scikit-learn")}
        results = {"machine": machine() | packages, "rows": [as_dict(row) for row in rows]}
        options.out.write_text(json.dumps(results, indent=2, ensure_ascii=False) + "\n")
    return 0 if all(row.is_met is not False for row in rows) else 1


def explored(transitions: int) -> tuple[LazyMemory, Any]:
    """Return a memory that robots explored, and what a larger team would ask it: readings most of which are 1."""
    plan = Exploration(runs=-(-transitions // 600))
    asking = Exploration(
        world={"robots": 15, "targets": 15, "radius": 4.0}, runs=-(-QUERIES[transitions] // 1_800), seed=1
    )
    memory = explore(plan)
    memory = memory.sample(transitions, seed=0) if len(memory) > transitions else memory
    asked = explore(asking).situation
    return memory, np.ascontiguousarray(np.random.default_rng(0).permutation(asked)[: QUERIES[transitions]])


def uniform(transitions: int) -> tuple[LazyMemory, Any]:
    """Return a memory of uniform random situations and queries alike, where nothing can be left out."""
    rng = np.random.default_rng(0)
    situation = rng.random((transitions, INPUTS), np.float32)
    memory = LazyMemory.of(situation, np.zeros((transitions, 2), np.float32), situation, {})
    return memory, rng.random((QUERIES[transitions], INPUTS), np.float32)


def compare(case: Case, rounds: int) -> list[Row]:
    """Return how much faster teamsight is than the others, and how fast; all must find the same distances."""
    searches = searches_of(case)
    distances = {name: search() for name, search in searches.items()}
    for name, found in distances.items():
        # Sums of 32 float32 in another order differ in the last digits.
        np.testing.assert_allclose(found, distances["teamsight"], rtol=1e-5, atol=1e-6, err_msg=f"{name}, {case.name}")
    work = {name: cost_of(search, len(case.queries)) for name, search in searches.items()}
    taken = interleave(work, rounds)
    transitions = len(case.memory)
    rows = [median(f"{case.name}: queries a second", "/s", [1 / seconds for seconds in taken["teamsight"]])]
    for name, goal in zip(("faiss", "scikit-learn"), GOALS[transitions], strict=True):
        goals = {} if goal is None else {"least": goal}
        rows.append(ratio(f"{case.name}: as fast as {name}", taken[name], taken["teamsight"], **goals))
    return rows


def searches_of(case: Case) -> dict[str, Callable[[], Any]]:
    """Return what finds the distances of the k nearest of all queries, by each program."""
    memory, queries, k = case.memory, case.queries, case.k
    situation = np.ascontiguousarray(memory.situation)
    index = faiss.IndexFlat(INPUTS, faiss.METRIC_L1)
    index.add(situation)
    brute = NearestNeighbors(algorithm="brute", metric="manhattan", n_jobs=1).fit(situation)
    return {
        "teamsight": lambda: memory.nearest(queries, k)[1],
        "faiss": lambda: index.search(queries, k)[0],
        "scikit-learn": lambda: brute.kneighbors(queries, k)[0],
    }


def cost_of(search: Callable[[], Any], queries: int) -> Callable[[], float]:
    """Return what measures the CPU time of one query."""
    return lambda: cpu_seconds(search) / queries


class Ask(NamedTuple):
    """The record of a search for each of some queries."""

    table: Annotated[npt.NDArray[np.float32], "inputs + 1", "columns"]
    margin: float
    query: Annotated[npt.NDArray[np.float32], "queries", "inputs"]
    place: Annotated[npt.NDArray[np.int64], "k"]
    distance: Annotated[npt.NDArray[np.float32], "k"]


ASK = Record(Ask)
ask_at = ASK.at


def _one_by_one(address: int) -> int:
    ask = ask_at(address)
    for i in range(ask.query.shape[0]):
        k_nearest(ask.table, ask.margin, ask.query[i], ask.place.shape[0], ask.place, ask.distance)
    return 0


ONE_BY_ONE = Entry(_one_by_one)


def in_a_kernel(inputs: int, rounds: int) -> Row:
    """Return how many situations a second a policy's kernel can look up, one at a time, among 600 transitions."""
    memory, asked = explored(600)
    queries = np.ascontiguousarray(asked[:, :inputs])
    k = 10
    search = search_table(memory.table, inputs, k)
    place, far = np.zeros(k, np.int64), np.zeros(k, np.float32)
    record = ASK.pack(Ask(search.table, search.margin, queries, place, far))
    ONE_BY_ONE(record)
    assert far.tolist() == memory.nearest(queries[-1:], k, inputs)[1][0].tolist()
    taken = interleave({"": cost_of(lambda: ONE_BY_ONE(record), len(queries))}, rounds)[""]
    return median(
        f"600 × {inputs} explored, k = {k}: one at a time, in a kernel", "/s", [1 / s for s in taken],
        least=400_000,
    )  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
