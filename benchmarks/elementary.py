"""Elementary functions beside those of the mathematics library: time in a compiled loop, and equal results.

``python benchmarks/elementary.py`` prints a line for each function.
"""

from __future__ import annotations

import math
import statistics
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from measure import cpu_seconds, interleave

from teamsight.core import elementary
from teamsight.core.kernel import Record, specialise

Floats = npt.NDArray[np.float64]
SIZE, ROUNDS, REPEATS = 100_000, 9, 5
function: Any = None


class Call(NamedTuple):
    one: Annotated[Floats, "n"]
    two: Annotated[Floats, "n"]
    out: Annotated[Floats, "n"]


CALL = Record(Call)
call_at = CALL.at


def _map_one(address: int) -> int:
    call = call_at(address)
    for i in range(call.out.shape[0]):
        call.out[i] = function(call.one[i])
    return 0


def _map_two(address: int) -> int:
    call = call_at(address)
    for i in range(call.out.shape[0]):
        call.out[i] = function(call.one[i], call.two[i])
    return 0


def main() -> None:
    """Compare all."""
    rng = np.random.default_rng(1)
    numbers, others = rng.uniform(-10, 10, (2, SIZE))
    for name, other, one in (
        ("exp", math.exp, numbers), ("log", math.log, abs(numbers)), ("power", math.pow, abs(numbers)),
        ("atan2", math.atan2, numbers),
    ):  # fmt: skip
        template = _map_one if name in ("exp", "log") else _map_two
        entries = {"ours": getattr(elementary, name), "the library's": other}
        works, results = {}, []
        for whose, kernel in entries.items():
            call = Call(one, others, np.empty(SIZE))
            entry, record = specialise(template, f"{name} {whose}", function=kernel), CALL.pack(call)
            entry(record)
            works[whose] = lambda entry=entry, record=record: cpu_seconds(
                lambda: [entry(record) for _ in range(REPEATS)]
            )
            results.append(call.out)
        taken = [statistics.median(times) * 1e9 / SIZE / REPEATS for times in interleave(works, ROUNDS).values()]
        equal = 100 * np.mean(results[0] == results[1])
        print(f"{name}: {taken[0]:.1f} ns, the library's {taken[1]:.1f} ns; {equal:.2f} % of the results are equal")


if __name__ == "__main__":
    main()
