"""The experiments behind the paper's figures and claims. Each is built only when a figure or a claim reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from teamsight.analysis.paper.lazy_teams import EXPLORATIONS, LITERAL, SLOPES, learned
from teamsight.analysis.runs.experiment import Experiment, Grid, Request, Variant, make_tables
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Progress
from teamsight.analysis.stats.paired import gain

#: Keyword parameters of CMOMMT.
Parameters: TypeAlias = Mapping[str, Any]
Cells: TypeAlias = tuple[tuple[int, float], ...]

#: Numbers of sectors δ of the figure "delta".
DELTAS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
#: Its worlds (robots, radius), from crowded to empty.
DELTA_CELLS: Cells = ((10, 2.0), (20, 3.0), (30, 2.0), (10, 4.0), (20, 5.0), (30, 4.0))

_ALONE: Parameters = MappingProxyType({"awareness": "none"})
_A_CMOMMT: Parameters = MappingProxyType({"policy": "a-cmommt", "awareness": "pairwise"})
_HALF: Parameters = MappingProxyType({"awareness_range": 0.5})
_WALK: Parameters = MappingProxyType({"policy": "random-walk", **_ALONE})
_CENTROID: Parameters = MappingProxyType({"policy": "centroid", **_ALONE})
# Few targets pass few stationary robots in a run: with five runs the mean would be uncertain by 5 points.
_MORE = 10
# At least 40 runs where the noise of five would enter the statistic: a range, or a maximum over many cells.
_MANY = 8
# A probability of a few per cent.
_RARE = 80


def _crowded(grid: Grid) -> Cells:
    return tuple((max(grid.robots), radius) for radius in (3.0, 5.0))


def _largest(grid: Grid) -> Cells:
    return ((max(grid.robots), 10.0),)


def _small_arenas(grid: Grid) -> Cells:
    return tuple((robots, radius) for robots, radius in grid.cells if robots >= 10 and radius <= 2)


def _larger_teams(grid: Grid) -> Cells:
    return tuple((robots, radius) for robots, radius in grid.cells if robots >= 10 and 3 <= radius <= 9)


def _largest_gain(acmommt: pd.DataFrame, centroid: pd.DataFrame) -> Cells:
    grid = gain(acmommt, centroid)
    row, column = divmod(int(np.argmax(grid.to_numpy())), grid.shape[1])
    return ((int(grid.index.to_numpy()[row]), float(grid.columns.to_numpy()[column])),)


def _scaled(setting: Parameters) -> Parameters:
    """Return A-CMOMMT with half the awareness range and a repulsion that scales with it."""
    from teamsight.agents.resolve import shared_options
    from teamsight.policies import ACmommt

    options = shared_options("a-cmommt", setting.get("policy_options", {}))
    return {**_A_CMOMMT, **_HALF, "policy": ACmommt(repulsion_scale="awareness", **options)}


class Design(NamedTuple):
    """An `Experiment` before its grid and its setting are known; see there for what is not explained here.

    Attributes
    ----------
    treatment : mapping or callable
        Keyword parameters of CMOMMT, or a function that returns for a setting these, or the treatment of a replicate.
    cells : callable
        Takes the grid and returns the cells (robots, radius); or, of an experiment that `follows` others, their tables.
    follows : tuple of str
        Names of experiments whose results choose the cells.
    """

    treatment: Parameters | Callable[[Parameters], Parameters | Callable[[int], Variant]]
    cells: Callable[..., Cells] = lambda grid: grid.cells
    targets: int = 15
    sweep: Mapping[str, tuple[Any, ...]] = MappingProxyType({})
    replicates: int = 1
    fresh: bool = False
    follows: tuple[str, ...] = ()

    def treatment_under(self, setting: Parameters) -> Parameters | Callable[[int], Variant]:
        """Return the treatment under a setting."""
        return self.treatment(setting) if callable(self.treatment) else self.treatment

    def experiment(self, name: str, setting: Parameters, *given: Any) -> Experiment:
        """Return the experiment under a setting; `given` is what `cells` takes."""
        treatment, cells = self.treatment_under(setting), self.cells(*given)
        return Experiment(name, treatment, cells, self.targets, self.sweep, self.replicates, self.fresh)


#: Every experiment by name.
EXPERIMENTS: Mapping[str, Design] = MappingProxyType(
    {
        "random-walk": Design(_WALK),
        "centroid": Design(_CENTROID),
        "a-cmommt": Design(_A_CMOMMT),
        "a-cmommt-small-arenas": Design(_A_CMOMMT, _small_arenas),
        "random-walk-small-arenas": Design(_WALK, _small_arenas),
        "random-walk-crowded": Design(_WALK, lambda grid: ((30, 2.0),), replicates=_RARE),
        "random-walk-half-range": Design({**_WALK, **_HALF}),
        "centroid-larger-teams": Design(_CENTROID, _larger_teams, replicates=_MANY),
        "random-walk-larger-teams": Design(_WALK, _larger_teams, replicates=_MANY),
        "a-cmommt-largest-gain": Design(
            _A_CMOMMT, _largest_gain, replicates=_MANY, fresh=True, follows=("a-cmommt", "centroid")
        ),
        "centroid-largest-gain": Design(
            _CENTROID, _largest_gain, replicates=_MANY, fresh=True, follows=("a-cmommt", "centroid")
        ),
        "half-range": Design({**_A_CMOMMT, **_HALF}),
        "half-range-scaled": Design(_scaled),
        "ring-16": Design({**_A_CMOMMT, "awareness": "ring", "delta": 16}),
        "evasive": Design(
            {**_A_CMOMMT, "target_policy": "evasive"}, lambda grid: tuple(cell for cell in grid.cells if cell[1] >= 2)
        ),
        "targets-5": Design(_A_CMOMMT, _crowded, targets=5),
        "targets-15": Design(_A_CMOMMT, _crowded),
        "targets-30": Design(_A_CMOMMT, _crowded, targets=30),
        "random-walk-targets-5": Design(_WALK, _crowded, targets=5),
        "random-walk-targets-15": Design(_WALK, _crowded),
        "random-walk-targets-30": Design(_WALK, _crowded, targets=30),
        "a-cmommt-r10": Design(_A_CMOMMT, _largest, replicates=_MORE),
        "random-walk-r10": Design(_WALK, _largest, replicates=_MORE),
        "stationary-r10": Design({"policy": "stationary", **_ALONE}, _largest, replicates=_MORE),
        "delta-ring": Design(
            {**_A_CMOMMT, "awareness": "ring"}, lambda grid: DELTA_CELLS, sweep={"delta": DELTAS}, replicates=4
        ),
        "delta-none": Design({**_A_CMOMMT, **_ALONE}, lambda grid: DELTA_CELLS, replicates=4),
        "delta-pairwise": Design(_A_CMOMMT, lambda grid: DELTA_CELLS, replicates=4),
        LITERAL.cooperative: Design(learned(LITERAL, cooperative=True), replicates=EXPLORATIONS),
        LITERAL.collective: Design(learned(LITERAL, cooperative=False), replicates=EXPLORATIONS),
        SLOPES.cooperative: Design(learned(SLOPES, cooperative=True), replicates=EXPLORATIONS),
        SLOPES.collective: Design(learned(SLOPES, cooperative=False), replicates=EXPLORATIONS),
        # On the same worlds as the learned teams.
        "a-cmommt-more": Design(_A_CMOMMT, replicates=EXPLORATIONS),
        "random-walk-more": Design(_WALK, replicates=EXPLORATIONS),
    }
)


def chosen(names: Iterable[str], grid: Grid, setting: Parameters) -> list[Experiment]:
    """Return the named experiments and those that they follow, each once, without those that follow others.

    Parameters
    ----------
    names : iterable of str
        Names of experiments.
    grid : Grid
        Team sizes and radii of the surfaces.
    setting : mapping
        Keyword parameters of CMOMMT that hold in all experiments.
    """
    return [design.experiment(name, setting, grid) for name, design in _designs(names).items() if not design.follows]


def make_chosen(
    requests: Sequence[Request],
    names: Iterable[str],
    pool: WorkerPool | None = None,
    *,
    progress: Progress = lambda done, total: None,
    later: Progress = lambda done, total: None,
    **how: Any,
) -> list[dict[str, pd.DataFrame]]:
    """Run the experiments of each request, then those of the named ones that follow them, and return all tables.

    Parameters
    ----------
    requests : sequence of Request
        The experiments that do not follow others.
    names : iterable of str
        Names of experiments. Those that follow others are made under the setting of each request.
    pool, progress, **how
        See `make_tables`.
    later : callable
        As `progress`, for the experiments that follow others.
    """
    made = make_tables(requests, pool, progress=progress, **how)
    follow = [
        Request(
            request.setting,
            [
                design.experiment(name, request.setting, *(tables[need] for need in design.follows))
                for name, design in _designs(names).items()
                if design.follows
            ],
        )
        for request, tables in zip(requests, made, strict=True)
    ]
    after = make_tables(follow, pool, progress=later, **how)
    return [tables | more for tables, more in zip(made, after, strict=True)]


def _designs(names: Iterable[str]) -> dict[str, Design]:
    wanted = set(names)
    wanted |= {need for name in wanted for need in EXPERIMENTS[name].follows}
    return {name: design for name, design in EXPERIMENTS.items() if name in wanted}
