"""Carrying: robots attach to attractors, carry them, together if they can, and deliver them at home."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.core.component import Allowed, Positive
from teamsight.core.kernel import inlined, kernel
from teamsight.tasks.foraging.attaching import ATTRACTOR_COLUMNS, ROBOT_COLUMNS, attach_all, is_held, release, slow_down
from teamsight.tasks.foraging.layout import refuse_torus
from teamsight.world.arena import Arena
from teamsight.world.interaction import Interaction


@inlined
def _is_at_home(attractors: Any, j: int, home: Any, radius: float) -> bool:
    """Whether an attractor is within a radius of a home that is active."""
    for h in range(home.position.shape[0]):
        x = attractors.position[j, 0] - home.position[h, 0]
        y = attractors.position[j, 1] - home.position[h, 1]
        if home.active[h] and x * x + y * y <= radius * radius:
            return True
    return False


@kernel
def _carry(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots, attractors, home = bodies.robots, bodies.attractors, bodies.home
    attach_all(robots, attractors, parameters[0])
    for j in range(attractors.position.shape[0]):
        carriers = attractors.robots_at_it[j]
        if carriers == 0:
            continue
        leader = -1
        for i in range(robots.position.shape[0]):
            if not is_held(robots, i, attractors, j):
                continue
            leader = i if leader < 0 else leader
            for axis in range(2):
                robots.position[i, axis] = robots.position[leader, axis]
            slow_down(robots, i, robots.free_speed[i] / (1.0 + attractors.mass[j] / (parameters[2] * carriers)))
        for axis in range(2):
            attractors.position[j, axis] = robots.position[leader, axis]
        if not _is_at_home(attractors, j, home, parameters[1]):
            continue
        scores[0] += 1.0
        scores[1] += attractors.mass[j]
        attractors.mass[j] = 0.0
        for i in range(robots.position.shape[0]):
            if is_held(robots, i, attractors, j):
                robots.reward[i] += 1.0
                robots.ended[i] = True
                release(robots, i)


@dataclass(frozen=True)
class Carrying(Interaction):
    """Robots within reach of an attractor carry it, at a speed that falls with its mass, until it is at home.

    Several robots carry faster: the speed of k carriers of a mass m is v / (1 + m / (k · strength)). The one with the
    lowest row leads, and the others are where it is. Each carrier gets 1 for a delivery.

    Parameters
    ----------
    reach : float
        Distance within which a robot is attached [length].
    home_radius : float
        Distance from home, or from one of several, within which an attractor is delivered [length].
    strength : float
        The mass that halves the speed of a single carrier.

    Raises
    ------
    TypeError, ValueError
        If a value is not a positive number; in a world whose arena repeats.

    Notes
    -----
    A speed that a robot is given while it carries is that without the load, to which it returns.

    *Source:* Balch and Arkin (1994) for carrying together; how speed depends on mass is unknown.
    """

    roles = ("robots", "attractors", "home")
    scores = ("delivered", "delivered_mass")
    columns = (*ROBOT_COLUMNS, *ATTRACTOR_COLUMNS)
    reach: Annotated[Positive, Allowed(unit="length")] = 1.0
    home_radius: Annotated[Positive, Allowed(unit="length")] = 3.0
    strength: Positive = 5.0
    kernel = _carry

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        refuse_torus("Carrying", arena)
