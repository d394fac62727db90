"""Pushing: a box that is too heavy for one robot moves when enough of them push the same way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.core.component import Allowed, NonNegative, Positive
from teamsight.core.kernel import inlined, kernel
from teamsight.tasks.pushing.touching import is_clear, off_rim, settle
from teamsight.tasks.square import check_square
from teamsight.world.arena import Arena
from teamsight.world.interaction import Interaction
from teamsight.world.limits import Length

_SIDE, _ROBOT_RADIUS, _BOX_RADIUS, _THRESHOLD, _BOX_SPEED, _CONTACT = range(6)
# The share of the side by which the rim stays inside the arena, above all rounding.
_MARGIN = 1e-9


@inlined
def pushes(robots: Any, i: int, box_x: float, box_y: float, near: float) -> bool:
    """Return whether robot `i` pushes: it is in contact with the box, wanted to move, and heads into the box."""
    dx = box_x - robots.position[i, 0]
    dy = box_y - robots.position[i, 1]
    if not robots.active[i] or dx * dx + dy * dy > near * near:
        return False
    wants = robots.moved[i, 0] != 0.0 or robots.moved[i, 1] != 0.0
    heads_in = robots.heading[i, 0] * dx + robots.heading[i, 1] * dy > 0.0
    return wants and heads_in  # type: ignore[no-any-return]


@inlined
def step_of(force: float, threshold: float, box_speed: float) -> float:
    """Return how far the box moves under a force: nothing up to the threshold, then in proportion [length]."""
    return box_speed * max(force - threshold, 0.0)


@inlined
def has_room(robots: Any, box_x: float, box_y: float, reach: float, apart: float) -> bool:
    """Return whether the robots fit around the box at a place, those in its way being put on its rim."""
    for i in range(robots.position.shape[0]):
        x, y = off_rim(robots.position[i, 0], robots.position[i, 1], box_x, box_y, reach)
        if not robots.active[i] or (x == robots.position[i, 0] and y == robots.position[i, 1]):
            continue
        for j in range(robots.position.shape[0]):
            if j == i or not robots.active[j]:
                continue
            other_x, other_y = off_rim(robots.position[j, 0], robots.position[j, 1], box_x, box_y, reach)
            if not is_clear(x, y, other_x, other_y, apart):
                return False
    return True


@inlined
def within(value: float, limit: float) -> float:
    """Return the value, at most `limit` away from 0."""
    return min(max(value, -limit), limit)


@inlined
def _reward(robots: Any, box_x: float, box_y: float, near: float, moved: float) -> None:
    """Give each robot that pushes the distance by which the box moves."""
    for i in range(robots.position.shape[0]):
        if pushes(robots, i, box_x, box_y, near):
            robots.reward[i] += moved


@kernel
def _push(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots, box = bodies.robots, bodies.box
    if box.position.shape[0] == 0:
        return
    half = 0.5 * parameters[_SIDE]
    reach = parameters[_BOX_RADIUS] + parameters[_ROBOT_RADIUS]
    apart = 2.0 * parameters[_ROBOT_RADIUS]
    near = reach + parameters[_CONTACT]
    limit = half * (1.0 - _MARGIN) - reach
    box_x = within(box.position[0, 0], limit)
    box_y = within(box.position[0, 1], limit)
    for i in range(robots.position.shape[0]):
        if robots.active[i]:
            settle(robots, i, (box_x, box_y, reach, apart, half))
    force_x = 0.0
    force_y = 0.0
    for i in range(robots.position.shape[0]):
        if pushes(robots, i, box_x, box_y, near):
            scores[1] += 1.0
            force_x += robots.heading[i, 0]
            force_y += robots.heading[i, 1]
    force = math.sqrt(force_x * force_x + force_y * force_y)
    step = step_of(force, parameters[_THRESHOLD], parameters[_BOX_SPEED])
    moved = 0.0
    if step > 0.0 and box.active[0]:
        to_x = within(box_x + step * force_x / force, limit)
        to_y = within(box_y + step * force_y / force, limit)
        if has_room(robots, to_x, to_y, reach, apart):
            moved = math.sqrt((to_x - box_x) ** 2 + (to_y - box_y) ** 2)
            _reward(robots, box_x, box_y, near, moved)
            box_x, box_y = to_x, to_y
            for i in range(robots.position.shape[0]):
                if robots.active[i]:
                    x, y = off_rim(robots.position[i, 0], robots.position[i, 1], box_x, box_y, reach)
                    robots.position[i, 0], robots.position[i, 1] = x, y
    box.position[0, 0], box.position[0, 1] = box_x, box_y
    scores[0] += moved
    scores[2] += scores[1] if moved == 0.0 else 0.0


@dataclass(frozen=True)
class Pushing(Interaction):
    """Robots push a round box, which moves when the sum of their pushes exceeds a threshold.

    A robot pushes if it is in contact with the box, wanted to move, and heads into the box: it contributes a unit
    vector along its heading. F is the sum of these vectors. If it is longer than the threshold, the box moves along it
    by ``box_speed * (|F| - threshold)``, and otherwise not at all. It does not turn and has no inertia. Where it meets
    a wall it stops, a robot's radius away from it, so that its rim stays inside the arena.

    Robots are discs. One that would overlap the box, or another robot, is put back on its rim; if it does not fit
    there, it stays where it was. One that was placed on something gets a free place near by; if there is none, the step
    ends with an error, whose cure is fewer robots, a larger side, or other places to begin. Robots in the
    way of the box are moved aside, or, if they have no room, the box stays. Walls hold the centres of robots.

    Parameters
    ----------
    side : float
        The side of the square arena, a `Box` [length].
    robot_radius, box_radius : float
        [length].
    threshold : float
        The force that the box withstands, in pushes of one robot: above 1, so that one robot never moves it, and
        below 2, so that two can.
    box_speed : float
        Distance in a step for each push above the threshold [length].
    contact : float
        Largest gap across which a robot touches the box [length].

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or the box does not fit into the arena; in a world whose
        arena is not the square of this side around the origin.

    Notes
    -----
    The first body of the role "box" is pushed; further ones are left alone. Each robot that pushes is rewarded with the
    distance by which the box moves. Scores of a step: the distance by which the box moved, the number of robots that
    push, and that of robots that push while the box does not move.

    *Source:* C. R. Kube and H. Zhang, "Collective robotics: from social insects to robots" (Adaptive Behavior 2(2),
    1994) for a box that needs at least two. *Departs:* their law is unknown to us, and this one is ours.
    """

    roles = ("robots", "box")
    scores = ("box_moved", "pushing", "stagnating")
    side: Length = 40.0
    robot_radius: Length = 0.5
    box_radius: Length = 2.0
    threshold: Annotated[float, Allowed(above=1)] = 1.5
    box_speed: Annotated[Positive, Allowed(unit="length")] = 0.2
    contact: Annotated[NonNegative, Allowed(unit="length")] = 0.05
    kernel = _push

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.threshold >= 2:
            raise ValueError(
                f"threshold={self.threshold:g}: must be below 2, the force of two robots that push the same way, so "
                "that two can move the box"
            )
        least = 2.0 * self.box_radius + 4.0 * self.robot_radius
        if self.side <= least:
            raise ValueError(
                f"side={self.side:g}: must be above {least:g}, so that the box and a robot on each side of it fit into "
                "the arena; take a larger side or a smaller box_radius"
            )

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        check_square(self, arena)
