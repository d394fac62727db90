"""Toward the evolved policy: `LazyRegression` from 600 and 2,400 transitions, with a discount, and with two memories.

Teams are compared on the grid of docs/evolved.md. Nothing was chosen on the root seed "toward the evolved policy".
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from teamsight.analysis.learning.evaluation import BY_HAND
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.papers.touzet2000.experiments import gains_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.runs.experiment import Experiment, Variant, make_tables
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.stats.paired import interval_of
from teamsight.core.kernel import inlined
from teamsight.policies import ACmommt
from teamsight.policies.handmade.target_tracks import AGE, X, Y, first_slot, no_target_tracks, update_target_tracks
from teamsight.policies.interface import Floats, PolicyState
from teamsight.policies.lazy.lazy_regression import LazyRegression, follow_forces
from teamsight.policies.lazy.readings import KINDS, readings_of
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import keep_reward

ROOT = root("toward the evolved policy")
GRID = Grid((5, 10, 15, 20, 25, 30), tuple(float(radius) for radius in range(2, 10)))
EXPLORATIONS, STEPS, WORKERS = 24, 600, 2
DISCOUNTS = (0.5, 0.9)
#: The best of the combinations that `teamsight evolve test` screened.
STRONGEST = ACmommt(idle="wander", weights="shared", turn_probability=0, gain=4)
# Values of distances are linear between these knots.
_KNOTS = np.array([0, 0.3, 0.5, 0.7, 0.85, 0.95, 1.0])
_RIDGE = 5.0
# A lost target is remembered up to this distance [sensing ranges], and for so many steps.
_FARTHEST, _OLDEST = 1.5, 20.0
# By which share older positions count less in a robot's trail, a step.
_FADING = 0.97


def values_of(memory: LazyMemory) -> tuple[Floats, Floats]:
    """Return additive features of situations and next situations: hat functions of each reading's distance, by kind."""
    following = memory.table.copy()
    following[: memory.inputs] = memory.next_situation.T
    later = LazyMemory(following, memory.own, memory.added, memory.facts, memory.settings)
    return _features(memory), _features(later)


def _features(memory: LazyMemory) -> Floats:
    found = readings_of(memory, memory.inputs, "sectors", 1.0, 1e-9)
    sums = np.zeros((len(memory), len(KINDS), len(_KNOTS)))
    for knot, unit in enumerate(np.eye(len(_KNOTS))):
        np.add.at(sums[:, :, knot], (found.transition, found.kind), np.interp(found.distance, _KNOTS, unit))
    return np.hstack([sums.reshape(len(memory), -1), np.ones((len(memory), 1))])


def discounted(memory: LazyMemory, discount: float) -> Floats:
    """Return r + γ V(s′), with V by least squares of the temporal differences of random actions."""
    now, later = values_of(memory)
    reward = keep_reward(memory)
    matrix = now.T @ (now - discount * later) + _RIDGE * np.eye(now.shape[1])
    return np.asarray(reward + discount * (later @ np.linalg.solve(matrix, now.T @ reward)))


@inlined
def _turn_to(x: float, y: float, i: int, action: Any) -> None:
    length = (x * x + y * y) ** 0.5
    if length > 1e-9:
        action.heading[i, 0] = x / length
        action.heading[i, 1] = y / length


@inlined
def _return_to_lost(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """A robot that senses no target heads for the one that it lost last, where it expects it."""
    follow_forces(percept, arrays, noise, action)
    state = arrays.state
    for i in range(percept.heading.shape[0]):
        slots, _ = update_target_tracks(i, percept, state, _FARTHEST * percept.sensing_range[i], _OLDEST)
        if percept.targets.start[i] == percept.targets.start[i + 1] and slots != 0:
            best, slots = first_slot(slots)
            while slots != 0:
                slot, slots = first_slot(slots)
                if state.ints[i, slot, AGE] < state.ints[i, best, AGE]:
                    best = slot
            _turn_to(state.floats[i, best, X], state.floats[i, best, Y], i, action)


@inlined
def _leave_trail(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """A robot that senses neither target nor teammate heads away from the mean of its fading trail."""
    follow_forces(percept, arrays, noise, action)
    for i in range(percept.heading.shape[0]):
        trail = arrays.state.floats[i, 0]
        trail[X] = _FADING * (trail[X] - percept.moved[i, 0])
        trail[Y] = _FADING * (trail[Y] - percept.moved[i, 1])
        sensed = percept.targets.start[i + 1] - percept.targets.start[i]
        if sensed + percept.teammates.start[i + 1] - percept.teammates.start[i] == 0:
            _turn_to(-trail[X], -trail[Y], i, action)


class RemembersLost(LazyRegression):
    """With a memory of lost targets."""

    kernel = _return_to_lost

    def start(self, size: int) -> PolicyState:
        return no_target_tracks(size, 16)


class RemembersGround(LazyRegression):
    """With a memory of the ground covered."""

    kernel = _leave_trail

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 1, 4)), np.zeros((size, 0, 0), np.int64))


def main() -> None:
    """Parse the command line, simulate and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--explorations", type=int, default=EXPLORATIONS)
    few = parser.parse_args().explorations
    memories = {
        runs: [explore(Exploration(seed=model_seed(ROOT, number, 5, 10, 3.0), runs=runs)) for number in range(few)]
        for runs in (1, 4)
    }
    learners: dict[str, tuple[Callable[[LazyMemory], Any], int]] = {
        "regression, 600 transitions": (LazyRegression, 1),
        "regression, 2,400 transitions": (LazyRegression, 4),
        **{f"the same, γ = {one}": (_with_discount(one), 4) for one in DISCOUNTS},
        "the same, with lost targets": (RemembersLost, 4),
        "the same, with ground covered": (RemembersGround, 4),
    }
    experiments = [
        Experiment(name, partial(_variant, [make(memory) for memory in memories[runs]]), GRID.cells, replicates=few)
        for name, (make, runs) in learners.items()
    ]
    others = {"evolved": ("evolved", "ring"), "strongest A-CMOMMT": (STRONGEST, "pairwise")}
    experiments += [
        Experiment(name, {"policy": policy, "awareness": degree}, GRID.cells, replicates=few)
        for name, (policy, degree) in (BY_HAND | others).items()
    ]
    with WorkerPool(WORKERS) as pool:
        (tables,) = make_tables([({}, experiments)], pool, root=ROOT, runs=1, steps=STEPS)
    rows = []
    for name, table in tables.items():
        means = interval_of(100 * table.groupby("replicate")["observed_fraction"].mean().to_numpy())
        cells = [f"{means.mean:.2f} ± {means.high - means.mean:.2f}"]
        for other in others:
            gain = gains_of(table, tables[other]).average()
            cells.append("" if name == other else f"{gain.mean:+.2f} ± {gain.high - gain.mean:.2f}")
        rows.append([name, *cells])
    print(markdown.table(["team", "observed targets [%]", *(f"minus {other} [pp]" for other in others)], rows))


def _with_discount(discount: float) -> Callable[[LazyMemory], LazyRegression]:
    return lambda memory: LazyRegression(memory, partial(discounted, discount=discount))


def _variant(policies: list[Any], setting: object, number: int) -> Variant:
    return Variant({"policy": policies[number], "awareness": "ring"}, {"exploration": number})


if __name__ == "__main__":
    main()
