"""Worlds a second of plain mesa through `mesa.batch_run`; the start of its processes is not counted.

python benchmarks/study_mesa.py WORLDS PROCESSES STEPS ROBOTS TARGETS RADIUS
"""

from __future__ import annotations

import json
import sys
import time

import mesa
from plain_mesa import PlainCMOMMT


def batch(worlds: int, processes: int, steps: int, robots: int, targets: int, radius: float) -> float:
    """Return the wall time of so many worlds."""
    parameters = {"robots": robots, "targets": targets, "radius": radius, "rng": range(worlds)}
    begin = time.perf_counter()
    mesa.batch_run(PlainCMOMMT, parameters, number_processes=processes, max_steps=steps, display_progress=False)
    return time.perf_counter() - begin


def main(worlds: int, processes: int, *size: float) -> None:
    """Print the rate."""
    start, both = (batch(count, processes, *map(int, size[:3]), size[3]) for count in (processes, processes + worlds))
    print(json.dumps({"rate": worlds / (both - start)}))


# mesa's processes import this file.
if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *map(float, sys.argv[3:]))
