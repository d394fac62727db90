"""Interactions for tests, with a slow twin of each kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from teamsight import Interaction, Robot, Target, Torus, World
from teamsight.core.kernel import kernel
from teamsight.world import InteractionState
from teamsight.world.motion import BODIES


@kernel
def _capture(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    hunters, prey = bodies.hunters, bodies.prey
    reach, side = parameters[0], parameters[1]
    for i in range(hunters.position.shape[0]):
        hunters.reward[i] = -0.1
    for j in range(prey.position.shape[0]):
        if not prey.active[j]:
            continue
        captured = False
        for i in range(hunters.position.shape[0]):
            x = hunters.position[i, 0] - prey.position[j, 0]
            y = hunters.position[i, 1] - prey.position[j, 1]
            if hunters.active[i] and x * x + y * y <= reach * reach:
                hunters.reward[i] += 1.0
                hunters.ended[i] = True
                captured = True
        if captured:
            scores[0] += 1.0
            state.ints[0, 0] += 1
            prey.caught[j] += 1
            prey.speed[j] = 0.5 * prey.speed[j] + 0.05
            for axis in range(2):
                prey.position[j, axis] = (noise.prey[axis, j] - 0.5) * side


@dataclass(frozen=True)
class Capture(Interaction):
    """A prey within reach of hunters is placed anew; the hunters get 1, and each move costs 0.1."""

    roles = ("hunters", "prey")
    scores = ("captures",)
    draws = 2
    columns = (("prey", "caught", 0),)
    reach: float = 0.4
    side: float = 6.0
    kernel = _capture

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.zeros((1, 1), np.int64))


class CaptureInTurn(Capture):
    """The same after the move of each group."""

    in_turn = True


def hunt(interaction: Any = None, seed: int = 1, *, hunters: int = 6, prey: int = 5, **options: Any) -> World:
    """Return a world of hunters and prey on a torus, with `Capture` unless another interaction is given."""
    world = World(options.pop("arena", Torus(6.0, 6.0)), contact=options.pop("contact", "pass"), rng=seed)
    prey_radius = options.pop("prey_radius", 0.0)
    group = world.add(
        Robot, hunters, policy=options.pop("policy", "centroid"), sensing_range=2.0, speed=0.2, name="hunters", **options
    )
    flock = world.add(Target, prey, policy="random-walk", speed=0.1, radius=prey_radius, name="prey")
    world.senses(group, flock)
    world.interact(interaction or Capture(), hunters=group, prey=flock)
    return world


def fingerprint(world: World) -> list[bytes]:
    """Return all that a run with interactions may change, as bytes."""
    found = [world.recording.history.to_numpy().tobytes(), str(world.tick).encode()]
    for group in world.groups:
        found += [group.bodies[one.name].tobytes() for one in BODIES if one.name not in ("aim", "distance")]
        found += [array.tobytes() for array in group.columns.arrays().values()]
    for placed in world._data.interactions:
        found += [array.tobytes() for array in placed.state]
    return found
