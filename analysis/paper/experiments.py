"""The experiments behind the paper's figures and claims. Each is built only when a figure or a claim reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

from teamsight.analysis.paper.lazy_teams import EXPLORATIONS, LITERAL, SLOPES, learned
from teamsight.analysis.runs.experiment import Experiment, Grid, Variant

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
_RANDOM: Parameters = MappingProxyType({"policy": "random-walk", **_ALONE})
# Few targets pass few stationary robots in a run: with five runs the mean would be uncertain by 5 points.
_MORE = 10


def _crowded(grid: Grid) -> Cells:
    return tuple((max(grid.robots), radius) for radius in (3.0, 5.0))


def _largest(grid: Grid) -> Cells:
    return ((max(grid.robots), 10.0),)


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
        Takes the grid and returns the cells (robots, radius).
    """

    treatment: Parameters | Callable[[Parameters], Parameters | Callable[[int], Variant]]
    cells: Callable[[Grid], Cells] = lambda grid: grid.cells
    targets: int = 15
    sweep: Mapping[str, tuple[Any, ...]] = MappingProxyType({})
    replicates: int = 1

    def experiment(self, name: str, grid: Grid, setting: Parameters) -> Experiment:
        """Return the experiment on a grid, under a setting."""
        treatment = self.treatment(setting) if callable(self.treatment) else self.treatment
        return Experiment(name, treatment, self.cells(grid), self.targets, self.sweep, self.replicates)


#: Every experiment by name.
EXPERIMENTS: Mapping[str, Design] = MappingProxyType(
    {
        "random-walk": Design(_RANDOM),
        "centroid": Design({"policy": "centroid", **_ALONE}),
        "a-cmommt": Design(_A_CMOMMT),
        "half-range": Design({**_A_CMOMMT, **_HALF}),
        "half-range-scaled": Design(_scaled),
        "ring-16": Design({**_A_CMOMMT, "awareness": "ring", "delta": 16}),
        "evasive": Design(
            {**_A_CMOMMT, "target_policy": "evasive"}, lambda grid: tuple(cell for cell in grid.cells if cell[1] >= 2)
        ),
        "targets-5": Design(_A_CMOMMT, _crowded, targets=5),
        "targets-15": Design(_A_CMOMMT, _crowded),
        "targets-30": Design(_A_CMOMMT, _crowded, targets=30),
        "a-cmommt-r10": Design(_A_CMOMMT, _largest, replicates=_MORE),
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
        "random-walk-more": Design(_RANDOM, replicates=EXPLORATIONS),
    }
)


def chosen(names: Iterable[str], grid: Grid, setting: Parameters) -> list[Experiment]:
    """Return the named experiments, each once, in the order of `EXPERIMENTS`.

    Parameters
    ----------
    names : iterable of str
        Names of experiments.
    grid : Grid
        Team sizes and radii of the surfaces.
    setting : mapping
        Keyword parameters of CMOMMT that hold in all experiments.
    """
    wanted = set(names)
    return [design.experiment(name, grid, setting) for name, design in EXPERIMENTS.items() if name in wanted]
