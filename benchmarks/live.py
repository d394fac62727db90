"""The live page in headless Chromium: frames a second and processor time, with 30, 500 and 5,000 bodies.

Run it with ``python benchmarks/live.py``; it takes a minute. It needs the extra ``live``, playwright and a Chromium,
which draws without a graphics card here, and so takes more time than with one.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any, NamedTuple

from measure import Row
from new_pages import with_new_pages

from teamsight.live import watch

# Bodies, half of them robots; the radius of the arena; the goal [frames/s], if there is one.
CASES = ((30, 5.0, 60.0), (500, 20.0, 30.0), (5_000, 65.0, None))
# Steps a second that are asked for: more than the goal, since a browser draws 60 times a second at most.
_ASKED = {60.0: 72.0, 30.0: 36.0, None: 30.0}
# What the page may take, server and simulation together [cores].
_MOST_CORES = 0.5
SECONDS = 6.0
_TICKS = os.sysconf("SC_CLK_TCK")


class Result(NamedTuple):
    """What was measured.

    Attributes
    ----------
    bodies, wanted : int, float
        The number of bodies, and the frames a second that were asked for.
    frames : float
        Frames a second that the page drew.
    server, browser : float
        Processor time of both [cores].
    """

    bodies: int
    wanted: float
    frames: float
    server: float
    browser: float


def measure(page: Any, bodies: int, radius: float, rate: float, seconds: float = SECONDS) -> Result:
    """Return what a page of so many bodies takes.

    Parameters
    ----------
    page : playwright.sync_api.Page
        A new page.
    bodies : int
        Half of them robots.
    radius : float
        Of the arena.
    rate : float
        Steps a second, each of which is a frame.
    seconds : float
        How long to measure.
    """
    parameters = {"robots": bodies // 2, "targets": bodies - bodies // 2, "radius": radius, "seed": 1}
    with watch(parameters=parameters, rate=rate, port=0, browser=False, wait=False) as served:
        page.goto(served.url)
        page.wait_for_function("() => teamsight.view?.tracks[0]?.frames.length > 30", timeout=60_000)
        drawn = page.evaluate("() => teamsight.view.drawings")
        server, browser, began = _own(), _others(), time.monotonic()
        page.wait_for_timeout(1000 * seconds)
        drawn = page.evaluate("() => teamsight.view.drawings") - drawn
        taken = time.monotonic() - began
        return Result(bodies, rate, drawn / taken, (_own() - server) / taken, (_others() - browser) / taken)


def measure_live(quick: bool) -> list[Row]:
    """Measure all cases; none without a browser.

    Parameters
    ----------
    quick : bool
        Whether to measure for a shorter time.
    """
    rows: list[Row] = []
    for (bodies, radius, goal), page in with_new_pages("live page", CASES):
        one = measure(page, bodies, radius, _ASKED[goal], SECONDS / 2 if quick else SECONDS)
        name, most = f"live page, {bodies:,} bodies", None if goal is None else _MOST_CORES
        # A clock that is late by a thousandth is no slower page.
        rows.append(Row(name, "frames/s", one.frames, least=None if goal is None else goal - 0.5))
        rows.append(Row(f"{name}: server", "cores", one.server, most=most))
        rows.append(Row(f"{name}: browser without graphics card", "cores", one.browser))
    return rows


def _own() -> float:
    """Return the processor time of this process [s]."""
    return time.process_time()


def _others() -> float:
    """Return the processor time of all processes that this one has started, directly or not [s]."""
    parents: dict[int, int] = {}
    spent: dict[int, float] = {}
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = place.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(place.parent.name)] = int(fields[1])
        spent[int(place.parent.name)] = (int(fields[11]) + int(fields[12])) / _TICKS
    return sum(time for process, time in spent.items() if process != os.getpid() and _is_ours(process, parents))


def _is_ours(process: int, parents: dict[int, int]) -> bool:
    while process in parents:
        process = parents[process]
        if process == os.getpid():
            return True
    return False


def main() -> None:
    """Measure all cases and print them."""
    for row in measure_live(quick=False):
        print(f"{row.name:55}  {row.value:6.2f} {row.unit:9} {row.goal}")


if __name__ == "__main__":
    main()
