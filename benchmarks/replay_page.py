"""The page of a recording in headless Chromium: frames a second with 30, 200 and 5,000 bodies.

Run it with ``python benchmarks/replay_page.py``; it takes half a minute. It needs playwright and a Chromium, which
draws without a graphics card here.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path
from typing import Any

from measure import Row
from new_pages import with_new_pages

from teamsight import CMOMMT

# Bodies, half of them robots; frames; the goal [frames/s], if there is one.
CASES = ((30, 600, 30.0), (200, 200, 30.0), (5_000, 40, None))
SECONDS = 5.0

_DRAWN = """async seconds => {
  const { view } = teamsight, began = performance.now(), before = view.drawings;
  view.setLoop(true);
  view.play();
  await new Promise(done => setTimeout(done, 1000 * seconds));
  return (view.drawings - before) / (performance.now() - began) * 1000;
}"""


def measure_replay_page(quick: bool) -> list[Row]:
    """Play recordings of crowds of one density; none without a browser.

    Parameters
    ----------
    quick : bool
        Whether to measure for a shorter time.
    """
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for (bodies, frames, goal), page in with_new_pages("page of a recording", CASES):
            file = _saved(Path(folder) / f"{bodies}.html", bodies, frames)
            drawn = _drawn(page, file, SECONDS / 2 if quick else SECONDS)
            name = f"page of a recording, {bodies:,} bodies"
            rows.append(Row(name, "frames/s", drawn, least=goal))
            rows.append(Row(f"{name}, {frames} frames", "kB", file.stat().st_size / 1e3))
    return rows


def _saved(file: Path, bodies: int, frames: int) -> Path:
    half = bodies // 2
    model = CMOMMT(robots=half, targets=half, radius=5.0 * math.sqrt(half / 15), awareness="ring", rng=1)
    model.record(steps=frames).save(file)
    return file


def _drawn(page: Any, file: Path, seconds: float) -> float:
    """Return how many pictures a second a page draws while it plays."""
    page.goto(file.as_uri())
    page.wait_for_selector("#teamsight[data-state=ready]", timeout=60_000)
    rate: float = page.evaluate(_DRAWN, seconds)
    return rate


if __name__ == "__main__":
    for row in measure_replay_page("--quick" in sys.argv):
        goal = f", goal at least {row.least:g}" if getattr(row, "least", None) else ""
        print(f"{row.name}: {row.value:.3g} {row.unit}{goal}")
