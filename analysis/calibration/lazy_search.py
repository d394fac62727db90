"""The search over what the paper leaves open of lazy learning: every constant, and the luck of one short exploration.

Worlds have root seeds below 0, which no command accepts, so that the ledger never judges constants on noise that helped
to choose them. What chooses and what reports share neither worlds nor memories.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.agents.presets import PRESETS
from teamsight.analysis.calibration.lazy_constants import VALUES, Constants
from teamsight.analysis.paper.claims import CLAIMS, judge
from teamsight.analysis.paper.claims.interface import average, gain, maxima, part, peak, percent
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE
from teamsight.analysis.runs.experiment import Experiment, Grid
from teamsight.analysis.runs.seeds import ROOTS
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.runs.workers import WorkerPool

#: The claims that depend on what is searched.
OPEN_CLAIMS = tuple(claim for claim in CLAIMS if COOPERATIVE in claim.needs)
GRID = Grid((5, 10, 20, 30), (2.0, 3.0, 4.0, 6.0, 8.0))
#: Root seeds of the worlds that choose, of those that choose again among the best, and of those that report.
CHOOSE, AGAIN, REPORT = (ROOTS[f"lazy constants: {part}"] for part in ("choose", "choose again", "report"))
#: In which settings: that of no parameter set, by which constants are chosen, and the presets of other speeds, which
#: take these constants and have an exploration chosen for themselves.
DEFAULTS, SETTINGS = "defaults", ("touzet2000",)
#: A value replaces the one that was given when it agrees with the paper better by more than so many standard errors.
CLEARLY = 2.0

# One claim that is far off shall not outweigh all others.
_FARTHEST = 5.0
_BESIDE: Mapping[str, Mapping[str, Any]] = {
    "a-cmommt": {"policy": "a-cmommt", "awareness": "pairwise"},
    "random-walk": {"policy": "random-walk", "awareness": "none"},
}


class Trial(NamedTuple):
    """One exploration, what is learned from it, and the worlds in which that is tried."""

    stage: str
    constants: Constants
    #: Seed of the exploration.
    memory: int
    root: int
    steps: int = 600
    setting: str = DEFAULTS
    grid: Grid = GRID

    @property
    def given(self) -> Mapping[str, Any]:
        """What the setting sets: keyword parameters of CMOMMT."""
        return {} if self.setting == DEFAULTS else PRESETS[self.setting]


def assess(trial: Trial) -> dict[str, Any]:
    """Return what a trial shows: a row of the table.

    Returns
    -------
    dict
        The trial and its constants; the mean over the grid of what is observed [%] by cooperative and collective
        learners, by A-CMOMMT and by robots that walk at random; mean and largest gain [pp], and that of few robots in
        large arenas; by how much the largest number of neighbours is greater under the cooperative learner, on the
        mean; in how many of the pairs a robot gained a target, and in which share of them it had a teammate in sight;
        how many of the claims hold, their mean distance from the paper in tolerances; and each claim.
    """
    memory = trial.constants.memory(trial.memory, trial.given)
    treatments = {**trial.constants.treatments(memory), **_BESIDE}
    tables = {}
    for name, treatment in treatments.items():
        rows = list(Experiment(name, treatment, trial.grid.cells).rows(trial.given, trial.root, 1, trial.steps))
        outcomes = run_all([run for _, run in rows])
        tables[name] = pd.DataFrame(
            [columns | found._asdict() for (columns, _), found in zip(rows, outcomes, strict=True)]
        )
    surface = gain(tables[COOPERATIVE], tables[COLLECTIVE])
    verdicts = judge(tables, OPEN_CLAIMS)
    return {
        "setting": trial.setting, "stage": trial.stage, **asdict(trial.constants),
        "memory": trial.memory, "root": trial.root,
        **{name: average(percent(table)) for name, table in tables.items()},
        "gain": average(surface), "largest": peak(surface).value, "few": average(part(surface, (1, 8), (7, 9))),
        "crowding": average(maxima(tables[COOPERATIVE]) - maxima(tables[COLLECTIVE])),
        "gained": int((memory.fact("gained") > 0).sum()),
        "met": float((memory.situation[:, memory.own :] < 1).any(axis=1).mean()),
        "holding": sum(found.holds for found in verdicts.values()),
        "distance_from_paper": float(np.mean([min(found.distance, _FARTHEST) for found in verdicts.values()])),
        **{name: found.holds for name, found in verdicts.items()},
    }  # fmt: skip


class Size(NamedTuple):
    """How much is tried."""

    drawn: int = 240
    memories: int = 40
    finalists: int = 6
    reported: int = 60
    reported_elsewhere: int = 30
    varied: int = 8
    steps: int = 600


def trials(size: Size) -> int:
    """Return how many trials a search of this size makes, whatever it chooses."""
    changed = sum(len(values) - 1 for values in VALUES.values())
    memory = size.memories + size.finalists * len(AGAIN) + len(REPORT)
    elsewhere = len(SETTINGS) * (memory + size.reported_elsewhere)
    return size.drawn + memory + size.reported + (changed + 1) * size.varied + elsewhere


def search(
    pool: WorkerPool, size: Size | None = None, progress: Callable[[int], None] = lambda done: None, grid: Grid = GRID
) -> pd.DataFrame:
    """Return every trial of the search, a row each; see `assess`.

    The stages, in the order in which they are made: "draw", constants and memory at random; "memory", the chosen
    constants with many memories; "again", the best of these on other worlds; then, on worlds that nothing was chosen
    by, "chosen", the winner; "luck", other memories; and "vary", one constant changed at a time, on these memories. The
    stages "memory" to "luck" are then made once more in each of the other `SETTINGS`, with the constants chosen.

    Parameters
    ----------
    pool : WorkerPool
        Who does the work; the table does not depend on it.
    size : Size, optional
        How much is tried.
    progress : callable
        Called with the number of trials done.
    grid : Grid
        Where.
    """
    much = Size() if size is None else size
    rows: list[dict[str, Any]] = []

    def make(trials: Sequence[Trial]) -> pd.DataFrame:
        done = len(rows)
        finished = 0

        def count(index: int) -> None:
            nonlocal finished
            finished += 1
            progress(done + finished)

        rows.extend(pool.map(assess, [trial._replace(grid=grid) for trial in trials], count, _told))
        return pd.DataFrame(rows)

    constants = chosen_constants(make(_drawn(much)))
    find_memory(make, constants, much)
    make(_varied(constants, much))
    for setting in SETTINGS:
        find_memory(make, constants, much, setting)
    return pd.DataFrame(rows)


def find_memory(
    make: Callable[[Sequence[Trial]], pd.DataFrame], constants: Constants, size: Size, setting: str = DEFAULTS
) -> None:
    """Make the trials that choose an exploration for a setting, and those that report it and its luck.

    Parameters
    ----------
    make : callable
        Makes trials and returns the table of all that were made so far.
    constants : Constants
        Of all of them.
    size : Size
        How many.
    setting : str
        In which setting.
    """

    def trial(stage: str, memory: int, root: int) -> Trial:
        return Trial(stage, constants, memory, root, size.steps, setting)

    found = make([trial("memory", seed, CHOOSE[0]) for seed in range(size.memories)])
    tried = found[(found["stage"] == "memory") & (found["setting"] == setting)]
    best = ranking(tried)["memory"].head(size.finalists)
    winner = chosen_memory(make([trial("again", int(seed), root) for seed in best for root in AGAIN]), setting)
    make([trial("chosen", winner, root) for root in REPORT])
    others = size.reported if setting == DEFAULTS else size.reported_elsewhere
    make([trial("luck", seed, REPORT[0]) for seed in range(1000, 1000 + others)])


def _told(trial: Trial) -> str:
    return f"{trial.setting}: {trial.stage}, memory {trial.memory}"


def _drawn(size: Size) -> list[Trial]:
    """Return trials whose constants and memories are drawn at random, each value of a constant equally often."""
    rng = np.random.default_rng(-CHOOSE[0])
    columns = {name: rng.permutation(np.resize(np.arange(len(values)), size.drawn)) for name, values in VALUES.items()}
    return [
        Trial(
            "draw",
            Constants(**{name: VALUES[name][column[number]] for name, column in columns.items()}),
            100_000 + number,
            CHOOSE[0],
            size.steps // 2,
        )
        for number in range(size.drawn)
    ]


def _varied(constants: Constants, size: Size) -> list[Trial]:
    """Return trials of the chosen constants, and of all that differ from them in one, on the same memories."""
    changed = [
        replace(constants, **{name: value})
        for name, values in VALUES.items()
        for value in values
        if value != getattr(constants, name)
    ]
    return [
        Trial("vary", one, 2000 + number, REPORT[-1], size.steps // 2)
        for one in (constants, *changed)
        for number in range(size.varied)
    ]


def effects(drawn: pd.DataFrame, of: str = "distance_from_paper") -> pd.DataFrame:
    """Return mean and standard error of a column for each value of each constant, over all others.

    Returns
    -------
    DataFrame
        Columns constant, value, mean, se, count.
    """
    rows = [
        {"constant": name, "value": value, "mean": part.mean(), "se": part.sem(), "count": len(part)}
        for name in VALUES
        for value, part in drawn.groupby(name, sort=True)[of]
    ]
    return pd.DataFrame(rows)


def chosen_constants(found: pd.DataFrame) -> Constants:
    """Return the constants given, with each value that agrees with the paper clearly better in its place."""
    table = effects(found[found["stage"] == "draw"])
    chosen: dict[str, Any] = {}
    for name in VALUES:
        of = table[table["constant"] == name]
        means, errors = (dict(zip(of["value"], of[column], strict=True)) for column in ("mean", "se"))
        given = getattr(Constants(), name)
        best = min(means, key=lambda value: means[value])
        ahead = means[given] - means[best]
        chosen[name] = best if ahead > CLEARLY * np.hypot(errors[given], errors[best]) else given
    return Constants(**chosen)


def chosen_memory(found: pd.DataFrame, setting: str = DEFAULTS) -> int:
    """Return the seed of the exploration that agrees best with the paper in worlds that did not select it."""
    again = found[(found["stage"] == "again") & (found["setting"] == setting)]
    return int(ranking(again)["memory"].iloc[0])


def ranking(found: pd.DataFrame) -> pd.DataFrame:
    """Return one row a memory, best first: most claims holding, then the least distance from the paper."""
    means = found.groupby("memory", sort=True)[["holding", "distance_from_paper"]].mean().reset_index()
    return means.sort_values(
        ["holding", "distance_from_paper"], ascending=[False, True], kind="stable", ignore_index=True
    )
