"""How many values of Tan (1993) agree with ours under each reading of what he leaves open: a scan over all.

About the result: docs/tasks/pursuit.md. The best of many is chosen here, so `tan1993` reports it on other seeds.

\b
Examples:
  teamsight reproduce tan1993_readings --out pursuit
  teamsight reproduce tan1993_readings --quick --workers 1
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from teamsight.analysis.papers.reproduction import NAMES, Paper
from teamsight.analysis.papers.tan1993 import CONDITIONS, NEAR, READ_OFF, READINGS, REPORTED, Reading, Trained, runs_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import minus
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict
from teamsight.core.component import Allowed, Count, Seed

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.runs.simulate import Planned

#: What Tan leaves open, by the field of `Reading`: in words, as we read it, the other reading, and its name.
OPEN: Mapping[str, tuple[str, str, str, str]] = {
    "in_turn": ("order where two must capture", "all at once", "hunters, check, prey, check", "in turn"),
    "legal_prey": ("prey at the wall", "lose the move", "make legal moves only", "legal prey"),
    "legal_hunters": ("hunters at the wall", "lose the move", "make legal moves only", "legal hunters"),
    "sides": ("next to a cell", "diagonals too", "sides only", "sides only"),
    "no_value": ("value at a capture", "counts", "is 0", "no end value"),
    "short": ("trials: one captures; two must", "2,000; 10,000", "1,000; 5,000", "half training"),
    "soft": ("choice in tests", "greedy", "Boltzmann", "Boltzmann tests"),
}
# With sides only trials take several times as long; that is read so only beside other orders, prey and tests.
_OURS_BESIDE_SIDES = ("legal_hunters", "no_value", "short")
#: All readings of the scan.
EVERY = tuple(
    one for flags in product((False, True), repeat=len(Reading._fields))
    if not (one := Reading(*flags)).sides or not any(getattr(one, name) for name in _OURS_BESIDE_SIDES)
)  # fmt: skip
# The conditions of Tan's values.
_KNOWN = {value.condition: CONDITIONS[value.condition] for value in REPORTED}
# Those of training; both tests follow it in each run.
_TRAINED = Reading._fields[:-1]
# Readings that are listed, the best first.
_LISTED = 5
_PAGE = """
# Readings of Tan's pursuit

{readings} readings of what Tan leaves open, and how many of his {values} values agree within {near:g} % with ours under
each; those read off a picture may be wrong by {off:g} steps. Runs of each: {plan.runs}; trials of a test: {plan.tests};
root seed {plan.seed}. “Sides only” is combined with the order, prey and tests, and not with the rest.

{spread}

{levers}

“Alone” is the change of the number if only this differs from our reading; “on average” its mean over all readings.

{best}

{claims}
"""


@dataclass(frozen=True)
class Readings(Trained):
    """What to simulate."""

    runs: limits.Runs = 1
    seed: Seed = root("pursuit: readings")
    names: Annotated[tuple[Annotated[str, Allowed(choices=_KNOWN)], ...], NAMES] = ()
    tests: Count = 300
    known: ClassVar[Mapping[str, Any]] = _KNOWN

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: those of `Reading`, condition, replicate, seed, trials."""
        for name in self.names:
            for reading in dict.fromkeys(map(CONDITIONS[name].relevant, EVERY)):
                for columns, run in runs_of(self, name, reading, both=True):
                    yield {**{one: getattr(reading, one) for one in _TRAINED}, **columns}, run


def counts(table: pd.DataFrame) -> pd.DataFrame:
    """Return how many values of Tan agree under each reading.

    Returns
    -------
    DataFrame
        The fields of `Reading`; near (how many agree within `NEAR`), and changes (how much differs from our reading).
        The best is first; of equally good ones, that with the fewest changes.
    """
    import pandas as pd

    phases = ["training", "test", "soft"]
    means: dict[Any, Any] = table.groupby(["condition", *_TRAINED])[phases].mean().to_dict("index")
    have, rows = set(table["condition"]), []
    for reading in EVERY:
        near = 0
        for value in REPORTED:
            if value.condition in have:
                mean = means[value.condition, *CONDITIONS[value.condition].relevant(reading)[:-1]]
                near += value.is_near(mean["soft" if value.phase == "test" and reading.soft else value.phase])
        rows.append((*reading, near, sum(reading)))
    found = pd.DataFrame(rows, columns=[*Reading._fields, "near", "changes"])
    return found.sort_values(["near", "changes"], ascending=[False, True], kind="stable", ignore_index=True)


def levers(found: pd.DataFrame) -> dict[str, tuple[int, float]]:
    """Return by how much the number of values that agree changes with each open point: alone, and on average."""
    near = dict(zip(_readings(found), found["near"].tolist(), strict=True))

    def change(name: str, reading: Reading) -> int:
        return int(near[reading._replace(**{name: True})] - near[reading])

    found_by = {}
    for name in Reading._fields:
        pairs = [one for one in EVERY if not getattr(one, name) and one._replace(**{name: True}) in near]
        found_by[name] = change(name, Reading()), sum(change(name, one) for one in pairs) / len(pairs)
    return found_by


def _readings(found: pd.DataFrame) -> list[Reading]:
    return [Reading(*flags) for flags in found[list(Reading._fields)].to_numpy(bool).tolist()]


def in_words(reading: Reading) -> str:
    """Return how a reading differs from ours."""
    return ", ".join(OPEN[name][3] for name, on in reading._asdict().items() if on) or "nothing"


def verdicts(table: pd.DataFrame, plan: Readings) -> list[Verdict]:
    """Return the verdicts on what another simulator found."""
    found, values = counts(table), _values(table)
    most, changes = int(found["near"].max()), levers(found)
    largest = max(changes, key=lambda name: abs(changes[name][1]))
    said = f"at most {most} of {values}, under {(found['near'] == most).sum()} of {len(found)} readings"
    lever = f"{OPEN[largest][0]}: {minus(f'{changes[largest][1]:+.1f}')} values on average"
    return [
        Verdict("Under no reading do more than half agree", "ours", said, at_most_half(most, values)),
        Verdict("The order of moves changes the number most", "ours", lever, HOLDS if largest == "in_turn" else FAILS),
    ]


def at_most_half(most: int, values: int) -> str:
    """Decide on the largest of many numbers of one run each: undecided within two standard deviations of a count."""
    spread = math.sqrt(values)
    return HOLDS if most + spread <= values / 2 else FAILS if most - spread > values / 2 else UNDECIDED


def _values(table: pd.DataFrame) -> int:
    have = set(table["condition"])
    return sum(value.condition in have for value in REPORTED)


def sentences(table: pd.DataFrame, plan: Readings) -> tuple[str]:
    """Return how the number of values that agree is spread over the readings."""
    found, values = counts(table), _values(table)
    near = found["near"]
    return (
        f"Between {near.min()} and {near.max()} of {values} values agree, {near.median():g} in the median of "
        f"{len(found)} readings; more than half under {(2 * near > values).sum()}. The best differs from ours in: "
        f"{in_words(_readings(found)[0])}.",
    )


def page_values(table: pd.DataFrame, plan: Readings) -> dict[str, Any]:
    """Return the values of the page."""
    found = counts(table)
    return {
        "readings": len(found), "values": _values(table), "near": 100 * NEAR, "off": READ_OFF,
        "spread": sentences(table, plan)[0], "levers": lever_table(found), "best": best_table(found),
    }  # fmt: skip


def lever_table(found: pd.DataFrame) -> str:
    """Return what is open, and what it changes, as a table of Markdown."""
    rows = [
        [*OPEN[name][:3], minus(f"{alone:+d}"), minus(f"{average:+.1f}"), *(
            str(found.loc[found[name] == on, "near"].max()) for on in (False, True)
        )]
        for name, (alone, average) in levers(found).items()
    ]  # fmt: skip
    columns = ["open", "ours", "other", "alone", "on average", "best with ours", "best with other"]
    return markdown.table(columns, rows, align="lllrrrr")


def best_table(found: pd.DataFrame) -> str:
    """Return the best readings, and those of `READINGS`, as a table of Markdown."""
    names = {reading: f" (“{name}”)" for name, reading in READINGS.items()}
    rows = []
    for place, (reading, near) in enumerate(zip(_readings(found), found["near"], strict=True), 1):
        if place <= _LISTED or reading in names:
            rows.append([str(place), in_words(reading) + names.get(reading, ""), str(near)])
    return markdown.table(["place", "how it differs from ours", "values that agree"], rows, align="rlr")


PAPER = Paper(
    plan=Readings, name="pursuit-readings", page="tasks/pursuit", template=_PAGE, figures={}, values=page_values,
    verdicts=verdicts, sentences=sentences, quick={"runs": 1, "share": 0.1, "tests": 50},
    small={"runs": 1, "share": 0.001, "tests": 2, "names": ("1/1 random", "1/1 depth 2")},
)  # fmt: skip
