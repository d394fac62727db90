"""Where cells become faster than comparing all pairs, which sets MOST_PAIRS in world/proximity/search.py.

python benchmarks/crossover.py
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from measure import cpu_seconds, interleave
from rich.console import Console
from rich.table import Table
from scaling import radius_for

from teamsight.core.kernel import Entry, array_at
from teamsight.world.arena import Arena, Disc, Torus
from teamsight.world.proximity.search import MOST_PAIRS, Search, search

SIZES = (15, 20, 30, 45, 60, 80, 120, 200, 400)
ROUNDS = 9


def _repeat(address: int) -> int:
    ask = array_at(address, 2, np.int64)
    for _ in range(ask[0]):
        search(ask[1])
    return 0


# The compiled loop of a model calls the search without Python, so this does too.
REPEAT = Entry(_repeat)


def search_time(arena: Arena, robots: int, *, pairs: bool) -> Callable[[], float]:
    """Return what measures the CPU time of one search among so many robots at reach 1."""
    numbers = np.random.default_rng(robots).random((2, robots))
    position = np.ascontiguousarray(arena.place(*numbers))
    look = Search(position, np.ones(robots), robots, 0, arena, pairs=pairs)
    look.x[:], look.y[:] = position.T
    look.run()
    repeats = max(2_000_000 // robots**2, 200)
    ask = np.array([repeats, look.record.address], np.int64)
    # The lambda refers to `look`, so that the arrays of its record stay alive.
    return lambda: cpu_seconds(lambda: (REPEAT(ask.ctypes.data), look)) / repeats


def main() -> None:
    """Print the time of one search, both ways, for worlds of the paper's density and for denser ones."""
    table = Table(title=f"One search among n robots [µs]; MOST_PAIRS = {MOST_PAIRS:,}", title_justify="left")
    for name in ("arena", "n", "n²", "degree", "all pairs", "cells", "cells / pairs"):
        table.add_column(name, justify="left" if name == "arena" else "right")
    for crowd in (1, 4):
        for robots in SIZES:
            side = radius_for(robots) / np.sqrt(crowd)
            for arena in (Disc(side), Torus(2 * side, 2 * side)):
                if isinstance(arena, Torus) and side < 2:
                    continue
                ways = {str(pairs): search_time(arena, robots, pairs=pairs) for pairs in (True, False)}
                taken = interleave(ways, ROUNDS)
                both, cells = (1e6 * float(np.median(taken[str(pairs)])) for pairs in (True, False))
                degree = robots * np.pi / arena.area
                numbers = (str(robots), f"{robots**2:,}", f"{degree:.1f}", f"{both:.2f}", f"{cells:.2f}")
                table.add_row(type(arena).__name__, *numbers, f"{cells / both:.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()
