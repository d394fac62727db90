"""Two worker processes against one, by wall time: start them when nothing else uses the machine.

python benchmarks/workers.py WORKERS RUNS prints the times of a process's first call and of a later one.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import NamedTuple

from measure import Row, median, ratio

from teamsight import run_many

SIZES, STEPS = (20_000, 100_000), 60


class Call(NamedTuple):
    """The times of one call of `run_many`.

    Attributes
    ----------
    total, start : float
        Until its end, and until its first results [s].
    rate : float
        Runs per second from then on.
    """

    total: float
    start: float
    rate: float


def measure_workers(rounds: int) -> list[Row]:
    """Measure runs of 60 steps, 5 robots and 5 targets: the whole, the start, and what follows it."""
    rows = []
    for runs in SIZES:
        taken = [(_calls_of_a_process(1, runs), _calls_of_a_process(2, runs)) for _ in range(rounds)]
        for number, name in enumerate(("first call", "later call")):
            one, two = ([pair[workers][number] for pair in taken] for workers in (0, 1))
            what = f"{runs:,} runs of {STEPS} steps, {name}"
            rows += [
                median(f"{what}: one worker", "s", [call.total for call in one]),
                median("until its first results", "s", [call.start for call in one]),
                median("two workers, until their first results", "s", [call.start for call in two]),
                ratio("two workers / one, from then on", [call.rate for call in two], [call.rate for call in one]),
                ratio(
                    "one worker / two, the whole", [call.total for call in one], [call.total for call in two], least=1.9
                ),
            ]
    return rows


def _calls_of_a_process(workers: int, runs: int) -> list[Call]:
    command = [sys.executable, __file__, str(workers), str(runs)]
    found = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [Call(*call) for call in json.loads(found)]


def _call(workers: int, runs: int) -> Call:
    begin, seen = time.perf_counter(), list[tuple[float, float]]()
    run_many(
        {"robots": 5, "targets": 5}, steps=STEPS, replicates=runs, rng=1, workers=workers,
        progress=lambda done, total: seen.append((time.perf_counter() - begin, done / total)),
    )  # fmt: skip
    total = time.perf_counter() - begin
    start, share = next(progress for progress in seen if progress[1] > 0)
    return Call(total, start, runs * (1 - share) / (seen[-1][0] - start))


if __name__ == "__main__":
    _workers, _runs = map(int, sys.argv[1:])
    print(json.dumps([_call(_workers, _runs) for _ in range(2)]))
