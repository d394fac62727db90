"""The plan: which conditions are run how often."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.analysis.pursuit.ono.conditions import CONDITIONS
from teamsight.analysis.pursuit.ono.measure import PARTS, Surrounding
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import root, run_seed
from teamsight.analysis.runs.simulate import Planned
from teamsight.core.component import Allowed, Component, Positive


@dataclass(frozen=True)
class Plan(Component):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each condition. Run r of all conditions has the same seed.
    share : float
        Steps of a run, as a share of each condition's own.
    seed : int
        Root seed.
    names : tuple of str
        Names in `CONDITIONS`.
    """

    runs: limits.Runs = 6
    share: Positive = 1.0
    seed: Annotated[int, Allowed(least=0)] = root("surround")
    names: Annotated[tuple[Annotated[str, Allowed(choices=CONDITIONS)], ...], Allowed()] = tuple(CONDITIONS)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: condition, replicate, seed and steps."""
        from teamsight.tasks.pursuit import Pursuit

        for name in self.names:
            condition = CONDITIONS[name]
            # A whole number of steps in each part.
            steps = max(int(self.share * condition.steps) // PARTS, 1) * PARTS
            for replicate in range(self.runs):
                seed = run_seed(self.seed, replicate)
                named = {"condition": name, "replicate": replicate, "seed": seed, "steps": steps}
                yield named, Run(condition.parameters, seed, steps, Surrounding(condition.side), Pursuit)
