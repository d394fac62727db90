"""Where cells become faster than comparing all pairs, which sets MOST_PAIRS in world/search.py.

python benchmarks/crossover.py
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from measure import cpu_seconds, interleave
from rich.console import Console
from rich.table import Table
from scaling import radius_for

from teamsight.core.kernel import Entry, Packed, Record, call
from teamsight.world.arena import Arena, Disc, Torus
from teamsight.world.search import MOST_PAIRS, Search, Searching

SIZES = (15, 20, 30, 45, 60, 80, 120, 200, 400)
ROUNDS = 9


class Repeat(NamedTuple):
    """The record of a search that is made again and again."""

    times: int
    entry: Entry
    search: Packed[Searching]


REPEAT = Record(Repeat)
repeat_at = REPEAT.at


def _repeat(address: int) -> int:
    repeat = repeat_at(address)
    for _ in range(repeat.times):
        call(repeat.entry, repeat.search)
    return 0


# In the compiled loop of a model a search costs no call from Python; so it shall not cost one here.
REPEATED = Entry(_repeat)


def search_time(arena: Arena, robots: int, *, pairs: bool) -> Callable[[], float]:
    """Return what measures the CPU time of one search among so many robots at reach 1."""
    numbers = np.random.default_rng(robots).random((2, robots))
    position = np.ascontiguousarray(arena.place(*numbers))
    look = Search(position, np.ones(robots), robots, 0, arena, pairs=pairs)
    look.x[:], look.y[:] = position.T
    look.run()
    repeats = max(2_000_000 // robots**2, 200)
    record = REPEAT.pack(Repeat(repeats, look.entry, look.record))
    return lambda: cpu_seconds(lambda: REPEATED(record)) / repeats


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
