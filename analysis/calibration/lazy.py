"""The search over what the paper leaves open of lazy learning: every constant, and which exploration it was."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.agents.presets import PRESETS
from teamsight.analysis.calibration.lazy_constants import VALUES, Constants
from teamsight.analysis.calibration.search import HERE, Candidate, Phase, Simulator, assess, ranking
from teamsight.analysis.paper.claims import CLAIMS, Tables
from teamsight.analysis.paper.claims.interface import average, part, peak
from teamsight.analysis.paper.experiments import chosen
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE
from teamsight.analysis.runs.experiment import Experiment, Grid, Request
from teamsight.analysis.runs.seeds import ROOTS
from teamsight.analysis.stats.paired import gain, maxima, percent

#: The claims that depend on these constants.
OPEN_CLAIMS = {name: claim for name, claim in CLAIMS.items() if COOPERATIVE in claim.needs}
GRID = Grid((5, 10, 20, 30), (2.0, 3.0, 4.0, 6.0, 8.0))
#: Root seeds of the worlds that choose, that choose again among the best, and that report.
CHOOSE, AGAIN, REPORT = (ROOTS[f"lazy constants: {part}"] for part in ("choose", "choose again", "report"))
#: Name of the setting without parameters, by which constants are chosen. The presets take these constants; an
#: exploration is chosen for each.
DEFAULTS, SETTINGS = "defaults", ("touzet2000",)
#: Another value of a constant is chosen only if it agrees with the paper better by this many standard errors.
CLEARLY = 2.0

# Experiments beside the two learned ones.
_BASELINES = ("a-cmommt", "random-walk")


class Trial(NamedTuple):
    """Constants, the seed of an exploration, and the setting in which it is made and used."""

    constants: Constants
    memory: int
    setting: str = DEFAULTS

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Keyword parameters of CMOMMT."""
        return PRESETS.get(self.setting, {})


class Size(NamedTuple):
    """Size of a search.

    Attributes
    ----------
    drawn : int
        Trials with random constants.
    memories, finalists : int
        Explorations that are tried, and the best of them that are tried again.
    reported, reported_elsewhere : int
        Further explorations that show the spread, under the defaults and under each of `SETTINGS`.
    varied : int
        Explorations with which each single change of a constant is tried.
    steps : int
        Steps of a run; half as many while constants are compared.
    """

    drawn: int = 240
    memories: int = 40
    finalists: int = 6
    reported: int = 60
    reported_elsewhere: int = 30
    varied: int = 8
    steps: int = 600


def search(simulator: Simulator = HERE, *, size: Size | None = None, grid: Grid = GRID) -> pd.DataFrame:
    """Choose the constants, then the exploration, and report both on other worlds.

    Parameters
    ----------
    simulator : Simulator
        How the runs are made.
    size : Size, optional
        How much is tried.
    grid : Grid
        Team sizes and radii.

    Returns
    -------
    DataFrame
        One row for each trial and root seed; see `assess` and `measures`. The phases are "draw", random constants and
        explorations; "memory", the chosen constants with many explorations; "again", the best of these on other worlds;
        then, on worlds that chose nothing, "chosen", the winner; "luck", other explorations; and "vary", single changes
        of a constant on the same explorations. All but the first and the last are repeated in each of `SETTINGS`.
    """
    much = size or Size()
    rows: list[dict[str, Any]] = []

    def make(name: str, trials: Sequence[Trial], roots: tuple[int, ...], steps: int = much.steps) -> pd.DataFrame:
        phase = Phase(name, grid, roots, OPEN_CLAIMS, runs=1, steps=steps)
        made = assess(phase, trials, candidate_of, simulator, measure=measures)
        rows.extend(made)
        return pd.DataFrame(made)

    def find_memory(constants: Constants, reported: int, setting: str = DEFAULTS) -> None:
        """Choose an exploration for a setting, then report it and others on worlds that chose nothing."""

        def trials(seeds: Iterable[int]) -> list[Trial]:
            return [Trial(constants, int(seed), setting) for seed in seeds]

        tried = make("memory", trials(range(much.memories)), CHOOSE)
        best = ranking(tried, ["memory"])["memory"].head(much.finalists)
        winner = chosen_memory(make("again", trials(best), AGAIN), setting)
        make("chosen", trials([winner]), REPORT)
        make("luck", trials(range(1000, 1000 + reported)), REPORT[:1])

    constants = chosen_constants(make("draw", _drawn(much.drawn), CHOOSE, much.steps // 2))
    find_memory(constants, much.reported)
    make("vary", _varied(constants, much.varied), REPORT[-1:], much.steps // 2)
    for setting in SETTINGS:
        find_memory(constants, much.reported_elsewhere, setting)
    return pd.DataFrame(rows)


def candidate_of(trial: Trial, phase: Phase) -> Candidate:
    """Explore, learn, and return the two learners beside A-CMOMMT and the random walk.

    Returns
    -------
    Candidate
        Columns setting, memory and the constants; gained, the number of transitions in which a robot gained a target;
        and met, the fraction of transitions in which it sensed a teammate.
    """
    memory = trial.constants.memory(trial.memory, trial.parameters)
    learned = trial.constants.treatments(memory)
    experiments = [Experiment(name, treatment, phase.grid.cells) for name, treatment in learned.items()]
    experiments += chosen(_BASELINES, phase.grid, trial.parameters)
    columns = {
        "setting": trial.setting,
        **asdict(trial.constants),
        "memory": trial.memory,
        "gained": int((memory.fact("gained") > 0).sum()),
        "met": float((memory.situation[:, memory.own :] < 1).any(axis=1).mean()),
    }
    return Candidate(columns, Request(trial.parameters, experiments))


def measures(tables: Tables) -> dict[str, float]:
    """Return what the tables of a trial show.

    Returns
    -------
    dict of str to float
        The mean over the grid of the observed targets [%], by name of the experiment; mean and largest gain [pp] in
        gain and largest, and the gain of small teams in large arenas in few; and in crowding, how much larger the
        largest number of neighbours is under the cooperative learner.
    """
    surface = gain(tables[COOPERATIVE], tables[COLLECTIVE])
    return {
        **{name: average(percent(table)) for name, table in tables.items()},
        "gain": average(surface),
        "largest": peak(surface).value,
        "few": average(part(surface, (1, 8), (7, 9))),
        "crowding": average(maxima(tables[COOPERATIVE]) - maxima(tables[COLLECTIVE])),
    }


def _drawn(count: int) -> list[Trial]:
    """Return trials with random constants and explorations, in which each value of a constant is equally frequent."""
    rng = np.random.default_rng(-CHOOSE[0])
    columns = {name: rng.permutation(np.resize(np.arange(len(values)), count)) for name, values in VALUES.items()}
    return [
        Trial(Constants(**{name: VALUES[name][column[number]] for name, column in columns.items()}), 100_000 + number)
        for number in range(count)
    ]


def _varied(constants: Constants, count: int) -> list[Trial]:
    """Return trials of the chosen constants, and of all that differ from them in one, with the same explorations."""
    changed = [
        replace(constants, **{name: value})
        for name, values in VALUES.items()
        for value in values
        if value != getattr(constants, name)
    ]
    return [Trial(one, 2000 + number) for one in (constants, *changed) for number in range(count)]


def chosen_constants(table: pd.DataFrame) -> Constants:
    """Return the default constants, except those for which another value agrees clearly better with the paper."""
    drawn = table[table["phase"] == "draw"]
    values: dict[str, Any] = {}
    for name in VALUES:
        distances: dict[Any, Any] = dict(list(drawn.groupby(name)["distance_from_paper"]))
        best = min(distances, key=lambda value: distances[value].mean())
        given, least = distances[getattr(Constants(), name)], distances[best]
        if given.mean() - least.mean() > CLEARLY * np.hypot(given.sem(), least.sem()):
            values[name] = best
    return Constants(**values)


def chosen_memory(table: pd.DataFrame, setting: str = DEFAULTS) -> int:
    """Return the seed of the exploration that agrees best with the paper on the worlds that choose again."""
    again = table[(table["phase"] == "again") & (table["setting"] == setting)]
    return int(ranking(again, ["memory"])["memory"].iloc[0])
