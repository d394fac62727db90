"""The plan: which conditions are run how often."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.analysis.pursuit.conditions import CONDITIONS
from teamsight.analysis.pursuit.trials import BLOCK, Learning
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import root, run_seed
from teamsight.analysis.runs.simulate import Planned
from teamsight.core.component import Allowed, Component, Count, Positive

# Steps of a trial, roughly, from which the work of a run is estimated.
_STEPS = {False: 40, True: 110}


@dataclass(frozen=True)
class Plan(Component):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each condition. Run r of all conditions has the same seed.
    share : float
        Trials of training, as a share of each condition's own.
    tests : int
        Trials of each test.
    seed : int
        Root seed.
    names : tuple of str
        Names in `CONDITIONS`.
    """

    runs: limits.Runs = 10
    share: Positive = 1.0
    tests: Count = 1000
    seed: Annotated[int, Allowed(least=0)] = root("pursuit")
    names: Annotated[tuple[Annotated[str, Allowed(choices=CONDITIONS)], ...], Allowed()] = tuple(CONDITIONS)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: condition, replicate, seed and trials."""
        from teamsight.tasks.pursuit import Pursuit

        for name in self.names:
            condition = CONDITIONS[name]
            trials = max(int(self.share * condition.trials), BLOCK)
            steps = trials * _STEPS[condition.world["rule"] == "pair"]
            for replicate in range(self.runs):
                seed = run_seed(self.seed, replicate)
                named = {"condition": name, "replicate": replicate, "seed": seed, "trials": trials}
                yield named, Run(condition.parameters, seed, steps, Learning(trials, self.tests), Pursuit)
