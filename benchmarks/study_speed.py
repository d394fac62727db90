"""What studies cost: the sweep over `run_many`, a million runs of bookkeeping, and 100,000 worlds beside plain mesa."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from measure import Row, median, ratio

from teamsight import run_many
from teamsight.analysis.studies.study import Study

STEPS, WORKERS = 600, 2
SIZE = {"robots": 15, "targets": 15, "radius": 5.0, "policy": "a-cmommt"}
RANGES = tuple(round(0.5 + 0.1 * number, 1) for number in range(10))
Times = tuple[float, float]

# Worlds of plain mesa; one takes about a second.
MESA_WORLDS = 16


def measure_study_speed(rounds: int, quick: bool) -> list[Row]:
    """Measure all of it; `quick` makes a tenth of the bookkeeping, and a twentieth of the worlds."""
    return [
        *measure_overhead(min(rounds, 9), 50 if quick else 200),
        *measure_bookkeeping(100_000 if quick else 1_000_000),
        *measure_worlds(5_000 if quick else 100_000),
    ]


def measure_overhead(rounds: int, replicates: int) -> list[Row]:
    """Compare a sweep in this process, parts on disk included, with `run_many` on the same runs: ten settings."""
    study = Study(fixed=SIZE, axes={"awareness_range": RANGES}, replicates=replicates, steps=STEPS)

    def swept(folder: str) -> None:
        study.run(Path(folder) / "study")

    def looped(folder: str) -> None:
        for value in RANGES:
            run_many(SIZE | {"awareness_range": value}, replicates=replicates, steps=STEPS, rng=0)

    def many(folder: str) -> None:
        run_many(SIZE | {"awareness_range": RANGES}, replicates=replicates, steps=STEPS, rng=0)

    taken: dict[str, list[Times]] = {"sweep": [], "loop": [], "once": []}
    for _ in range(rounds):
        for name, work in (("sweep", swept), ("loop", looped), ("once", many)):
            taken[name].append(_timed(work))
    cpu, wall = ({name: [one[place] for one in values] for name, values in taken.items()} for place in (0, 1))
    runs = replicates * len(RANGES)
    return [
        ratio(f"a sweep of {runs:,} runs, against run_many in a loop", cpu["sweep"], cpu["loop"], most=1.03),
        ratio("the same, wall time with the disk", wall["sweep"], wall["loop"]),
        ratio(f"a sweep of {runs:,} runs, against one call of run_many", cpu["sweep"], cpu["once"]),
        median("a sweep in one process", "worlds/s", [runs / seconds for seconds in wall["sweep"]]),
    ]


def _timed(work: Callable[[str], None]) -> Times:
    """Return the CPU and the wall time of work in a new folder."""
    with tempfile.TemporaryDirectory() as folder:
        begin, cpu = time.perf_counter(), time.process_time()
        work(folder)
        return time.process_time() - cpu, time.perf_counter() - begin


def measure_bookkeeping(runs: int) -> list[Row]:
    """Plan, status and resume of a study of so many runs, all but the last part of which are done, in new processes."""
    with tempfile.TemporaryDirectory() as folder:
        found = [_bookkeeping(kind, runs, folder) for kind in ("write", "plan", "status", "resume")]
    rows = [Row(f"{found[0]['parts']:,} parts of {runs:,} runs: written", "s", found[0]["seconds"])]
    for one in found[1:]:
        rows.append(Row(f"{one['kind']} of {runs:,} runs", "s", one["seconds"]))
    total = sum(one["seconds"] for one in found[1:])
    rows.append(Row("plan, status and resume together", "s", total, most=10))
    rows.append(Row("the most memory of one of them", "MiB", max(one["mebibytes"] for one in found[1:]), most=1024))
    return rows


def _bookkeeping(kind: str, runs: int, folder: str) -> dict[str, Any]:
    program = Path(__file__).with_name("study_books.py")
    done = subprocess.run(
        [sys.executable, program, kind, str(runs), folder], capture_output=True, text=True, check=True, timeout=1800
    )
    return json.loads(done.stdout)


def measure_worlds(worlds: int) -> list[Row]:
    """Compare a sweep on two cores with plain mesa through `mesa.batch_run` on two processes: worlds per second."""
    ours = worlds / _sweep_seconds(worlds)
    size = (SIZE["robots"], SIZE["targets"], SIZE["radius"])
    command = [sys.executable, Path(__file__).with_name("study_mesa.py"), MESA_WORLDS, WORKERS, STEPS, *size]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=True, timeout=1800)
    plain = json.loads(done.stdout)["rate"]
    return [
        Row(f"a sweep of {worlds:,} worlds on {WORKERS} cores", "worlds/s", ours),
        Row(f"plain mesa by mesa.batch_run on {WORKERS} processes", "worlds/s", plain),
        Row("the sweep against mesa.batch_run", "times", ours / plain, least=300),
    ]


def _sweep_seconds(worlds: int) -> float:
    """Return the time of the command, start of Python and workers included."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        values = "\n".join(f"{name} = {json.dumps(value)}" for name, value in SIZE.items())
        file.write_text(f"replicates = {worlds}\nsteps = {STEPS}\n\n[fixed]\n{values}\n", encoding="utf-8")
        command = [sys.executable, "-m", "teamsight", "sweep", str(file), "--out", str(Path(folder) / "out")]
        begin = time.perf_counter()
        subprocess.run([*command, "--workers", str(WORKERS)], check=True, env=os.environ, stdout=subprocess.DEVNULL)
        return time.perf_counter() - begin
