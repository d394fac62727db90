"""What is measured of a team: the rows it has learned right after some times, and the pucks it then delivers."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.policies.basis import CLEAR_ROWS, CORRECT, share_correct
from teamsight.tasks.collecting import PuckCollecting, delivered, slept_at_home

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.policies.basis import BasisBehaviours
    from teamsight.policies.interface import Floats

#: The clear rows with an intruder.
INTRUDER_ROWS = tuple(row for row in CLEAR_ROWS if row & 1)


@dataclass(frozen=True)
class Learning:
    """Lets a team learn, scores its tables after some times, and tests it in worlds in which it learns no more.

    Parameters
    ----------
    times : tuple of int
        Steps after which tables are scored, in ascending order.
    judged : int
        That of them after which each row is scored, and the team tested; it is tested after the last, too.
    tests : tuple of int
        The seeds of the test worlds.
    steps : int
        Their steps.
    """

    times: tuple[int, ...]
    judged: int
    tests: tuple[int, ...]
    steps: int

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world up to the last of the times; `steps` only says how much work that is."""
        robots: Any = world.robots  # type: ignore[attr-defined]
        policy: BasisBehaviours = robots.policy
        curve, rows, tested = [], np.zeros(0), {}
        for time in self.times:
            world.run(time - world.tick)
            tables = policy.values(robots.policy_state)
            curve.append(share_correct(tables))
            if time == self.judged:
                rows = np.array([share_correct(tables, (row,)) for row in range(len(CORRECT))])
                intruders = share_correct(tables, INTRUDER_ROWS)
                tested["delivered_early"], _ = self._test(policy, tables, len(robots))
        tested["delivered"], tested["slept_at_home"] = self._test(policy, tables, len(robots))
        at = self.times.index(self.judged)
        return {"curve": curve, "rows": rows.tolist(), "correct": curve[at], "correct_intruder": intruders} | tested

    def _test(self, policy: BasisBehaviours, tables: Floats, robots: int) -> Sequence[float]:
        """Return the mean number of delivered pucks, and of nights at home, in the test worlds."""
        frozen = policy.frozen(tables)
        found = []
        for seed in self.tests:
            with contextlib.closing(PuckCollecting(robots, policy=frozen, rng=seed)) as world:
                world.run(self.steps)
                found.append((delivered(world), slept_at_home(world)))
        return [float(one) for one in np.mean(found, axis=0)]
