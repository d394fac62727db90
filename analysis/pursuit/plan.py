"""The plan: which conditions are run how often."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from teamsight.analysis.pursuit.conditions import CONDITIONS
from teamsight.analysis.pursuit.trials import BLOCK, Learning
from teamsight.analysis.runs.planned_runs import Planned
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import root, run_seed
from teamsight.analysis.runs.settings import as_json

# Steps of a trial, roughly, from which the work of a run is estimated.
_STEPS = {False: 40, True: 110}


@dataclass(frozen=True)
class Plan:
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

    runs: int = 10
    share: float = 1.0
    tests: int = 1000
    seed: int = root("pursuit")
    names: tuple[str, ...] = tuple(CONDITIONS)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: condition, replicate, seed and trials."""
        from teamsight.tasks.pursuit.world import Pursuit

        for name in self.names:
            condition = CONDITIONS[name]
            trials = max(int(self.share * condition.trials), BLOCK)
            steps = trials * _STEPS[condition.world["rule"] == "pair"]
            for replicate in range(self.runs):
                seed = run_seed(self.seed, replicate)
                named = {"condition": name, "replicate": replicate, "seed": seed, "trials": trials}
                yield named, Run(condition.parameters, seed, steps, Learning(trials, self.tests), Pursuit)
