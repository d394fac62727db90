"""The plan: which teams push the box, and how many robots they have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from teamsight.agents.awareness import NearestAwareness
from teamsight.analysis.pushing.trials import agreement, examples_of, until_moved
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.run import task_run, task_seed
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.runs.simulate import Planned
from teamsight.core.component import Allowed, Component, Count
from teamsight.policies.braitenberg.adaptive_network import AdaptiveNetwork
from teamsight.tasks.pushing import FIXED_PRIORITY, PUSH

# The team sizes and the replicates from which the network learns, and those with which it is tested.
_EXAMPLE_ROBOTS = (3, 6, 12)
_EXAMPLE_RUNS = range(-4, 0)
_TEST_RUNS = range(-8, -4)


@dataclass(frozen=True)
class Plan(Component):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each team of each size. Run r of all teams of a size has the same seed.
    steps : int
        Steps after which a run is censored.
    seed : int
        Root seed.
    robots : tuple of int
        The team sizes.
    """

    runs: limits.Runs = 100
    steps: limits.Steps = 2000
    seed: Annotated[int, Allowed(least=0)] = root("pushing")
    robots: Annotated[tuple[Count, ...], Allowed()] = (1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 20)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def teams(self) -> dict[str, dict[str, Any]]:
        """Return the parameters of each team, by name."""
        fixed = {"policy": FIXED_PRIORITY, "recovery": True, "awareness": "pairwise"}
        return {
            "fixed priority": fixed,
            "no recovery": {**fixed, "recovery": False},
            "network": {"policy": network_of(self.seed), "awareness": "pairwise"},
            "δ = 1": {**fixed, "awareness": NearestAwareness(1)},
            "no awareness": {**fixed, "awareness": "none"},
            "explore": dict(PUSH.explore or {}),
        }

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: team, robots, replicate and seed."""
        teams = self.teams()
        for robots in self.robots:
            cell = {"robots": robots}
            for replicate in range(self.runs):
                seed = task_seed(PUSH, self.seed, replicate, cell)
                for name, team in teams.items():
                    run = task_run(PUSH, PUSH.parameters(team, cell), seed, self.steps, until_moved)
                    yield {"team": name, "robots": robots, "replicate": replicate, "seed": seed}, run


@cache
def network_of(seed: int) -> AdaptiveNetwork:
    """Return the network that has learned from runs with the fixed priority under a root seed."""
    cues, behaviours = examples_of(seed, _EXAMPLE_RUNS, _EXAMPLE_ROBOTS)
    return AdaptiveNetwork.trained(cues, behaviours, rng=seed)


@cache
def agreement_of(seed: int) -> tuple[float, float]:
    """Return the share of decisions in which network and fixed priority agree: in examples, and in other runs."""
    examples = [examples_of(seed, runs, _EXAMPLE_ROBOTS) for runs in (_EXAMPLE_RUNS, _TEST_RUNS)]
    learned, tested = (agreement(network_of(seed), one) for one in examples)
    return learned, tested
