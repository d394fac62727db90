"""Compare teamsight with plain mesa and plain C, on one model and machine and in one run.

python benchmarks/run.py [--quick] [--only speed scaling …] [--out FILE.json]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from components import measure_components
from conditions import measure_conditions
from controller import measure_controller
from cycles import measure_cycles
from events import measure_events
from foraging import measure_foraging
from interactions import measure_interactions
from learning import measure_learning
from measure import Row
from memory import POLICIES, measure_memory
from plain_c import PlainC
from processes import measure_processes
from pursuit import measure_pursuit
from regression import measure_regression
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from scaling import measure_scaling
from sensors import measure_sensors
from short_runs import measure_short_runs
from speed import measure_speed
from start import measure_start
from studies import measure_engines
from study_speed import measure_study_speed
from tasks import measure_tasks
from view import measure_view
from workers import measure_workers

PARTS = (
    "speed", "short", "scaling", "memory", "start", "controller", "learning", "regression", "sensors", "cycles",
    "conditions", "events", "interactions", "components", "processes", "foraging", "pursuit", "studies", "tasks",
    "view", "workers",
)  # fmt: skip
CHECKS = ((15, 15, 5.0), (30, 15, 2.0), (5, 20, 1.5))


def main() -> int:
    """Run what is asked for; the exit status is 1 when a goal is missed or C and teamsight differ."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds, and memory under A-CMOMMT only")
    parser.add_argument("--only", nargs="+", choices=PARTS, help="these parts only")
    parser.add_argument("--out", type=Path, help="write all numbers to this JSON file")
    options = parser.parse_args()
    # A file or a pipe has no width; the table needs this much.
    console = Console(width=None if sys.stdout.isatty() else 130)
    c = PlainC()
    rounds = 5 if options.quick else 15
    parts: dict[str, Callable[[], list[Row]]] = {
        "speed": lambda: measure_speed(c, rounds),
        "short": lambda: measure_short_runs(rounds),
        "scaling": lambda: measure_scaling(c, min(rounds, 7)),
        "memory": lambda: measure_memory(POLICIES[-1:] if options.quick else POLICIES),
        "start": lambda: measure_start(min(rounds, 7)),
        "controller": lambda: measure_controller(min(rounds, 7)),
        "learning": lambda: measure_learning(options.quick),
        "regression": lambda: measure_regression(rounds, options.quick),
        "sensors": lambda: measure_sensors(rounds),
        "events": lambda: measure_events(rounds),
        "cycles": lambda: measure_cycles(rounds),
        "processes": lambda: measure_processes(rounds),
        "pursuit": lambda: measure_pursuit(min(rounds, 7)),
        "conditions": lambda: measure_conditions(rounds),
        "interactions": lambda: measure_interactions(rounds),
        "components": lambda: measure_components(min(rounds, 7)),
        "foraging": lambda: measure_foraging(min(rounds, 7)),
        "studies": lambda: [
            *measure_study_speed(rounds, options.quick), *measure_engines(min(rounds, 5), options.quick)
        ],
        "tasks": lambda: measure_tasks(min(rounds, 7)),
        "view": lambda: measure_view(rounds, options.quick),
        "workers": lambda: measure_workers(min(rounds, 3)),
    }
    agrees = check(c, console)
    rows: list[Row] = []
    for name in options.only or parts:
        with console.status(f"measuring {name} …"):
            rows += parts[name]()
    console.print(table_of(rows))
    if options.out:
        facts = {"machine": machine(), "agrees_with_c": agrees, "rows": [as_dict(row) for row in rows]}
        options.out.write_text(json.dumps(facts, indent=2, ensure_ascii=False) + "\n")
    return 0 if agrees is not False and all(row.is_met is not False for row in rows) else 1


def check(c: PlainC, console: Console) -> bool | None:
    """Say whether teamsight and C count the same, step by step."""
    if not c.is_there:
        console.print("gcc was not found: no comparison with C")
        return None
    found = {case: c.first_difference(*case, steps=2_000, seed=1) for case in CHECKS}
    for case, step in found.items():
        if step is not None:
            console.print(f"C and teamsight differ from step {step} on: robots, targets, radius = {case}")
    if not any(found.values()):
        console.print(f"C and teamsight count the same in all 2,000 steps of {len(CHECKS)} worlds")
    return not any(found.values())


def table_of(rows: list[Row]) -> Table:
    """Return what is shown."""
    table = Table(box=SIMPLE_HEAD)
    for name in ("", "goal", "measured", "rounds from … to", ""):
        table.add_column(name, justify="right" if name in ("measured", "rounds from … to") else "left")
    verdicts = {True: "[green]met", False: "[red]missed", None: ""}
    for row in rows:
        spread = " … ".join(map(rounded, row.spread)) if row.spread else ""
        table.add_row(row.name, row.goal, f"{rounded(row.value)} {row.unit}", spread, verdicts[row.is_met])
    return table


def rounded(value: float) -> str:
    """Return three digits of a number, or all that stand before the point."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def as_dict(row: Row) -> dict[str, Any]:
    """Return a row as JSON has it."""
    return {**vars(row), "is_met": row.is_met}


def machine() -> dict[str, Any]:
    """Say what the numbers were measured on."""
    packages = ("teamsight", "mesa", "numba", "numpy")
    return {
        "time": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "python": platform.python_version(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        **{name: version_of(name) for name in packages},
    }


def version_of(name: str) -> str | None:
    """Return the installed version of a package."""
    try:
        return version(name)
    except ImportError:
        return None


if __name__ == "__main__":
    raise SystemExit(main())
