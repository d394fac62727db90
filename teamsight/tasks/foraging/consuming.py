"""Consuming: robots attach to attractors and work on them in place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.core.component import Allowed, Positive
from teamsight.core.kernel import kernel
from teamsight.tasks.foraging.attaching import ATTRACTOR_COLUMNS, ROBOT_COLUMNS, attach_all, is_held, release, slow_down
from teamsight.tasks.foraging.layout import refuse_torus
from teamsight.world.arena import Arena
from teamsight.world.interaction import Interaction

# Mass that is left by rounding only.
_NOTHING = 1e-9


@kernel
def _consume(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots, attractors = bodies.robots, bodies.attractors
    attach_all(robots, attractors, parameters[0])
    for j in range(attractors.position.shape[0]):
        if attractors.robots_at_it[j] == 0:
            continue
        eaten = min(attractors.mass[j], parameters[1] * attractors.robots_at_it[j])
        attractors.mass[j] -= eaten
        scores[0] += eaten
        is_gone = attractors.mass[j] <= _NOTHING
        if is_gone:
            attractors.mass[j] = 0.0
            scores[1] += 1.0
        for i in range(robots.position.shape[0]):
            if is_held(robots, i, attractors, j):
                if robots.slow_speed[i] == 0.0:
                    # It was attached before this step, and stays, whatever speed it has been given since.
                    for axis in range(2):
                        robots.position[i, axis] = robots.before[i, axis]
                slow_down(robots, i, 0.0)
                robots.reward[i] += eaten / attractors.robots_at_it[j]
                if is_gone:
                    robots.ended[i] = True
                    release(robots, i)


@dataclass(frozen=True)
class Consuming(Interaction):
    """Robots within reach of an attractor stay and consume it; the time is proportional to its mass.

    Parameters
    ----------
    reach : float
        Distance within which a robot is attached [length].
    rate : float
        The mass that one robot consumes in a step; it gets as much reward.

    Raises
    ------
    TypeError, ValueError
        If a value is not a positive number; in a world whose arena repeats.

    Notes
    -----
    A speed that a robot is given while it consumes is the one that it has afterwards.
    """

    roles = ("robots", "attractors")
    scores = ("consumed", "finished")
    columns = (*ROBOT_COLUMNS, *ATTRACTOR_COLUMNS)
    reach: Annotated[Positive, Allowed(unit="length")] = 1.0
    rate: Positive = 0.05
    kernel = _consume

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        refuse_torus("Consuming", arena)
