"""What recording costs: compiled runs of 30 bodies with and without it, and what the page takes."""

from __future__ import annotations

import gc
import tempfile
from collections.abc import Callable
from pathlib import Path

from measure import Row, cpu_seconds, interleave, median, ratio

from teamsight import CMOMMT

LONG, SHORT = 20_000, 600


def measure_recordings(rounds: int) -> list[Row]:
    """Compare long and short runs of 15 robots and 15 targets, every frame recorded, and save one as a page.

    A round has new worlds. They are closed after their runs, so that all but the first rounds find memory that the
    process has used before: its first use is the larger part of the cost where it is slow, as on virtual machines.
    """
    taken = interleave(
        {
            "long, plain": _run(LONG, is_recorded=False),
            "long, recorded": _run(LONG, is_recorded=True),
            "short, plain": _run(SHORT, is_recorded=False),
            "short, recorded": _run(SHORT, is_recorded=True),
        },
        rounds,
    )
    step = {name: [1e6 * seconds for seconds in values] for name, values in taken.items()}
    saved = [_saved() for _ in range(min(rounds, 5))]
    return [
        ratio(f"recorded run of {LONG:,} steps", taken["long, recorded"], taken["long, plain"], most=1.1),
        ratio(f"recorded run of {SHORT} steps", taken["short, recorded"], taken["short, plain"]),
        median("a step, plain", "µs", step["long, plain"]),
        median("a step, recorded", "µs", step["long, recorded"]),
        median(f"{SHORT} frames: to a page", "ms", [1e3 * seconds for seconds, _ in saved]),
        median(f"{SHORT} frames: the page", "kB", [size / 1e3 for _, size in saved], most=3_000),
    ]


def _run(steps: int, *, is_recorded: bool) -> Callable[[], float]:
    def once() -> float:
        model = CMOMMT(robots=15, targets=15, radius=5.0, policy="a-cmommt", rng=1)
        replay = model.record() if is_recorded else None
        # The kernels are compiled, and the first buffers made.
        model.run(1)
        seconds = cpu_seconds(lambda: model.run(steps))
        if replay is not None:
            replay.stop()
        model.close()
        gc.collect()
        return seconds / steps

    return once


def _saved() -> tuple[float, float]:
    """Return the CPU time to save a recording as a page [s], and the size of the page [bytes]."""
    model = CMOMMT(robots=15, targets=15, radius=5.0, policy="a-cmommt", rng=1)
    replay = model.record(steps=SHORT)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "run.html"
        seconds = cpu_seconds(lambda: replay.save(place))
        return seconds, float(place.stat().st_size)


if __name__ == "__main__":
    for row in measure_recordings(21):
        spread = f" ({row.spread[0]:.3g} to {row.spread[1]:.3g})" if row.spread else ""
        print(f"{row.name}: {row.value:.3g} {row.unit}{spread}, goal {row.goal or 'none'}")
