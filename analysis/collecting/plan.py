"""The plan: schemes of reinforcement, and codings of intruders, each learned anew in every run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.analysis.collecting.learning import Learning
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.run import Run, task_run, task_seed
from teamsight.analysis.runs.seeds import root
from teamsight.core.component import Allowed, Component, Count
from teamsight.policies.basis import BasisBehaviours
from teamsight.tasks.registry import TASKS

#: δ of counts and sectors.
DELTA = 3
#: The schemes of reinforcement by name; "events + H" and "events + I" leave one estimator out, with the weights of the
#: others in their ratio.
SCHEMES: dict[str, BasisBehaviours] = {
    "delayed": BasisBehaviours(scheme="delayed"),
    "events": BasisBehaviours(scheme="events"),
    "events + H": BasisBehaviours(weights=(2 / 3, 0.0, 1 / 3)),
    "events + I": BasisBehaviours(weights=(2 / 3, 1 / 3, 0.0)),
    "progress": BasisBehaviours(),
}
#: What the table knows of intruders, with all estimators; a bit is "progress".
CODINGS: dict[str, BasisBehaviours] = {
    "bit": SCHEMES["progress"],
    "count": BasisBehaviours(intruders="count", delta=DELTA),
    "ring": BasisBehaviours(intruders="ring", delta=DELTA),
}
#: What learns nothing: random behaviours, and the policy made by hand.
FIXED: dict[str, BasisBehaviours] = {
    "random": BasisBehaviours(scheme="none"),
    "by hand": BasisBehaviours.correct(),
}


@dataclass(frozen=True)
class Plan(Component):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Learning runs of each condition. Run r of all conditions has the same seed.
    times : tuple of int
        Steps after which tables are scored, in ascending order.
    judged : int
        That of them after which the schemes are compared.
    tests : int
        Test worlds of each run, in which the team does not learn.
    steps : int
        Steps of each test world.
    sizes : tuple of int
        N; the schemes are compared with the first.
    seed : int
        Root seed.
    """

    runs: limits.Runs = 40
    times: Annotated[tuple[Count, ...], Allowed(unit="ticks")] = (1250, 2500, 5000, 10_000, 20_000, 40_000, 80_000)
    judged: Annotated[Count, Allowed(unit="ticks")] = 20_000
    tests: Count = 10
    steps: limits.Steps = 1200
    sizes: Annotated[tuple[Count, ...], Allowed()] = (4, 12)
    seed: Annotated[int, Allowed(least=0)] = root("collecting")

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def policies(self, size: int) -> dict[str, BasisBehaviours]:
        """Return the policies that are run with a team of this size, by name."""
        codings = {name: policy for name, policy in CODINGS.items() if name != "bit"}
        first = SCHEMES if size == self.sizes[0] else {"progress": SCHEMES["progress"]}
        return {**first, **codings, **FIXED}

    def planned(self) -> Iterator[tuple[dict[str, Any], Run]]:
        """Yield each run with the columns of the table that identify it."""
        task = TASKS["collect"]
        for size in self.sizes:
            cell = {"robots": size}
            for replicate in range(self.runs):
                seed = task_seed(task, self.seed, -1 - replicate, cell)
                tests = range(self.tests * replicate, self.tests * (replicate + 1))
                seeds = tuple(task_seed(task, self.seed, number, cell) for number in tests)
                for name, policy in self.policies(size).items():
                    world = task.parameters({"policy": policy, "awareness": "pairwise"}, cell)
                    # The work of a run is that of all its worlds.
                    steps = self.times[-1] + 2 * self.tests * self.steps
                    measure = Learning(self.times, self.judged, seeds, self.steps)
                    named = {"condition": name, "robots": size, "replicate": replicate, "seed": seed}
                    yield named, task_run(task, world, seed, steps, measure)
