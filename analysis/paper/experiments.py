"""The experiments behind the paper's figures and claims; each figure and each claim names those that it reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE, treatments
from teamsight.analysis.runs.experiment import Experiment, Grid

#: Numbers of sectors at which observed fraction is drawn against δ.
DELTAS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
#: Worlds (robots, radius) of that figure: from crowded to empty.
DELTA_CELLS = ((10, 2.0), (20, 3.0), (30, 2.0), (10, 4.0), (20, 5.0), (30, 4.0))
#: Experiments in which robots learned what they do.
LEARNED = frozenset({COOPERATIVE, COLLECTIVE})
_HALF = 0.5
_MORE = 10


def catalogue(grid: Grid, setting: Mapping[str, Any]) -> dict[str, Experiment]:
    """Return every experiment by name, its surfaces over `grid`.

    Parameters
    ----------
    grid : Grid
        Team sizes and radii of the surfaces.
    setting : mapping
        Keyword parameters of CMOMMT that hold throughout; its `policy_options` also reach the policy that has to be
        given as an object.
    """
    cooperative = {"policy": "a-cmommt", "awareness": "pairwise"}
    largest = ((max(grid.robots), 10.0),)
    crowded = tuple((max(grid.robots), radius) for radius in (3.0, 5.0))
    learned = treatments(setting)
    found = [
        Experiment("random-walk", {"policy": "random-walk", "awareness": "none"}, grid.cells),
        Experiment("centroid", {"policy": "centroid", "awareness": "none"}, grid.cells),
        Experiment("a-cmommt", cooperative, grid.cells),
        Experiment("half-range", cooperative | {"awareness_range": _HALF}, grid.cells),
        Experiment("half-range-scaled", _scaled(setting) | {"awareness_range": _HALF}, grid.cells),
        Experiment("ring-16", cooperative | {"awareness": "ring", "delta": 16}, grid.cells),
        Experiment("evasive", cooperative | {"target_policy": "evasive"}, _roomy(grid)),
        Experiment("targets-5", cooperative, crowded, targets=5),
        Experiment("targets-15", cooperative, crowded),
        Experiment("targets-30", cooperative, crowded, targets=30),
        # Few targets pass few still robots in a run: five runs would leave their mean uncertain by 5 points.
        Experiment("a-cmommt-r10", cooperative, largest, replicates=_MORE),
        Experiment("stationary-r10", {"policy": "stationary", "awareness": "none"}, largest, replicates=_MORE),
        Experiment(
            "delta-ring", cooperative | {"awareness": "ring"}, DELTA_CELLS, sweep={"delta": DELTAS}, replicates=4
        ),
        Experiment("delta-none", cooperative | {"awareness": "none"}, DELTA_CELLS, replicates=4),
        Experiment("delta-pairwise", cooperative, DELTA_CELLS, replicates=4),
        *(Experiment(name, treatment, grid.cells) for name, treatment in learned.items()),
    ]
    return {experiment.name: experiment for experiment in found}


def chosen(names: Iterable[str], grid: Grid, setting: Mapping[str, Any]) -> list[Experiment]:
    """Return the named experiments, each once, in the order of the catalogue."""
    wanted = set(names)
    return [experiment for name, experiment in catalogue(grid, setting).items() if name in wanted]


def _roomy(grid: Grid) -> tuple[tuple[int, float], ...]:
    return tuple((robots, radius) for robots, radius in grid.cells if radius >= 2)


def _scaled(setting: Mapping[str, Any]) -> dict[str, Any]:
    """A-CMOMMT with a repulsion that shrinks with the awareness range; only the policy object can say so."""
    from teamsight.agents.resolve import shared_options
    from teamsight.policies import ACmommt

    options = shared_options("a-cmommt", setting.get("policy_options", {}))
    return {"policy": ACmommt(repulsion_scale="awareness", **options), "awareness": "pairwise"}
