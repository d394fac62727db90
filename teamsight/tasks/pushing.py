"""Pushing a box as a task: its interaction, its world and its measures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.agents.attributes import AwarenessLike, PolicyLike
from teamsight.agents.body import Body, Robot
from teamsight.agents.group import Group
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.component import Allowed, NonNegative, Positive
from teamsight.core.kernel import inlined, kernel
from teamsight.policies.braitenberg.vehicle import FixedPriority
from teamsight.policies.registry import POLICIES
from teamsight.tasks.square import check_square
from teamsight.tasks.task import Objective, Task
from teamsight.world.arena import Arena
from teamsight.world.arena import Box as Walls
from teamsight.world.interaction import Interaction
from teamsight.world.limits import Length

# Distances that are too short by this share are rounding errors.
_ROUNDING = 1e-9
# How often a robot between two things is put back on their rims in turn.
_REBOUNDS = 16
# Places that are tried for a robot which cannot stay where it is, and the share of a turn between one and the next.
_TRIES = 400
_GOLDEN = 0.6180339887498949


@inlined
def off_rim(x: float, y: float, box_x: float, box_y: float, reach: float) -> tuple[float, float]:
    """Return the place nearest to (x, y) that is at least `reach` from the box."""
    dx = x - box_x
    dy = y - box_y
    square = dx * dx + dy * dy
    if square >= reach * reach:
        return x, y
    length = math.sqrt(square)
    if length < _ROUNDING * reach:
        dx, dy, length = 1.0, 0.0, 1.0
    return box_x + reach * dx / length, box_y + reach * dy / length


@inlined
def is_clear(x: float, y: float, other_x: float, other_y: float, apart: float) -> bool:
    """Return whether two places are at least `apart` from each other, but for rounding."""
    dx = x - other_x
    dy = y - other_y
    least = apart * (1.0 - _ROUNDING)
    return dx * dx + dy * dy >= least * least


@inlined
def overlapped(robots: Any, i: int, x: float, y: float, apart: float) -> int:
    """Return the first robot that robot `i` would overlap at a place; −1 if there is none.

    Robots before it in the group have moved, those after it have not.
    """
    for j in range(robots.position.shape[0]):
        if j == i or not robots.active[j]:
            continue
        other_x, other_y = place_of(robots, j, i)
        if not is_clear(x, y, other_x, other_y, apart):
            return j
    return -1


@inlined
def place_of(robots: Any, j: int, i: int) -> tuple[float, float]:
    """Return where robot `j` is while robot `i` moves."""
    if j < i:
        return robots.position[j, 0], robots.position[j, 1]
    return robots.before[j, 0], robots.before[j, 1]


@inlined
def fits(robots: Any, i: int, x: float, y: float, walls: Any) -> bool:
    """Return whether a place of robot `i` is in the arena, and free; `walls` are box x and y, reach, apart and half."""
    box_x, box_y, reach, apart, half = walls
    is_inside = max(abs(x), abs(y)) <= half
    return is_inside and is_clear(x, y, box_x, box_y, reach) and overlapped(robots, i, x, y, apart) < 0


@inlined
def aside(robots: Any, i: int, walls: Any) -> tuple[float, float]:
    """Return where robot `i` slides to: the rims of the box and of robots push it back in turn until it is free."""
    box_x, box_y, reach, apart, _half = walls
    x = robots.position[i, 0]
    y = robots.position[i, 1]
    for _ in range(_REBOUNDS):
        x, y = off_rim(x, y, box_x, box_y, reach)
        j = overlapped(robots, i, x, y, apart)
        if j < 0:
            break
        other_x, other_y = place_of(robots, j, i)
        x, y = off_rim(x, y, other_x, other_y, apart)
    return x, y


@inlined
def settle(robots: Any, i: int, walls: Any) -> None:
    """Put robot `i` on the rims of what it would overlap.

    If it does not fit there, it stays where it was; and if it cannot stay, since it was placed on something, it gets a
    free place near by. If there is none, its place is no number, which the engine refuses.
    """
    x, y = aside(robots, i, walls)
    is_placed = False
    for k in range(-1, _TRIES + 1):
        is_placed = fits(robots, i, x, y, walls)
        if is_placed:
            break
        # Where it was, and then places along a spiral around it.
        way_x, way_y = direction((max(k, 0) * _GOLDEN) % 1.0)
        x = robots.before[i, 0] + 0.5 * walls[3] * math.sqrt(k + 1) * way_x
        y = robots.before[i, 1] + 0.5 * walls[3] * math.sqrt(k + 1) * way_y
    robots.position[i, 0] = x if is_placed else math.nan
    robots.position[i, 1] = y if is_placed else math.nan


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
    writes = ("position", "reward")
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


#: The policy of worlds by its name: Braitenberg behaviours by fixed priority, for the world's box.
FIXED_PRIORITY = "fixed-priority"

# The gap between two robots within which one is an obstacle for the other [radii].
_OBSTACLE_GAP = 1.0
# The largest share of the ground beside the box that robots may cover: with more, some find no free place.
_MOST_COVERED = 1.0 / 3.0


class Box(Body):
    """A box that is too heavy for one robot, on no team."""


class BoxPushing(World):
    """Robots in a square arena find a box and push it, from whatever side, to wherever it goes.

    Parameters
    ----------
    robots : int
        Number of robots.
    side : float
        The side of the arena [length]. The box begins in the middle.
    distance : float
        How far the box is to be moved in all [length].
    sensing_range : float
        Distance from the centre of the box within which robots sense it [length].
    awareness_range : float
        Distance within which they perceive teammates, as their degree of awareness allows [length].
    speed : float
        Of robots [length per step].
    robot_radius, box_radius : float
        [length].
    threshold : float
        The force that the box withstands, in pushes of one robot.
    policy : Policy, callable or str
        "fixed-priority", or any policy.
    recovery : bool, optional
        Whether robots with "fixed-priority" recover from stagnation; by default they do. Not for other policies.
    awareness : Awareness or str
        What they perceive of teammates.
    rng, seed : int, optional
        Two names for the seed.

    Attributes
    ----------
    robots, box : Group
        The two groups.
    distance : float
        How far the box is to be moved [length].

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, a name is unknown, or the robots cover more than a third
        of the ground beside the box.

    Notes
    -----
    *Source:* Kube and Zhang (1994). *Departs:* the box is round and does not turn; all lengths are ours; see `Pushing`.
    """

    def __init__(
        self, robots: int = 5, side: float = 40.0, *, distance: float = 10.0, sensing_range: float = 12.0,
        awareness_range: float = 6.0, speed: float = 0.5, robot_radius: float = 0.5, box_radius: float = 2.0,
        threshold: float = 1.5, policy: PolicyLike = FIXED_PRIORITY, recovery: bool | None = None,
        awareness: AwarenessLike = "pairwise", rng: int | None = None, seed: int | None = None,
    ) -> None:  # fmt: skip
        checks.count("robots", robots, most=MOST_AGENTS)
        law = Pushing(side, robot_radius, box_radius, threshold)
        _check_room(robots, law)
        checks.number("distance", distance, above=0)
        super().__init__(Walls(side, side), rng=rng, seed=seed)
        obstacle_range = (2.0 + _OBSTACLE_GAP) * robot_radius
        recovers = _checked(policy, recovery)
        if isinstance(policy, str) and policy == FIXED_PRIORITY:
            contact = box_radius + robot_radius + 2.0 * law.contact
            policy = FixedPriority(obstacle_range, recovery=recovers, contact=contact)
        # The box is the first group, so that numbers of robots do not change its noise.
        self._box = self.add(Box, 1, policy="stationary", position=(0.0, 0.0), speed=0.0, name="box")
        self._robots = self.add(
            Robot, robots, policy=policy, awareness=awareness, speed=speed, sensing_range=sensing_range,
            awareness_range=awareness_range,
        )  # fmt: skip
        self._distance = float(distance)
        self.senses(self._robots, self._box)
        self.senses(self._robots, self._robots, as_="obstacles", sensor=Sensor(range=obstacle_range), counts=False)
        self.interact(law, robots=self._robots, box=self._box)

    @property
    def robots(self) -> Group[Robot]:
        """The robots."""
        return self._robots

    @property
    def box(self) -> Group[Any]:
        """The box."""
        return self._box

    @property
    def distance(self) -> float:
        """How far the box is to be moved [length]."""
        return self._distance


def _check_room(robots: int, law: Pushing) -> None:
    """Refuse more robots than find room beside the box. Their centres are in the arena, and their rims may be outside.

    Raises
    ------
    ValueError
        Naming the number of robots and the side.
    """
    ground = (law.side + 2.0 * law.robot_radius) ** 2 - math.pi * law.box_radius**2
    most = int(_MOST_COVERED * ground / (math.pi * law.robot_radius**2))
    if robots > most:
        raise ValueError(
            f"robots={robots}: cover more than a third of the ground beside the box in an arena of side={law.side:g}; "
            f"take at most {most}, or a larger side"
        )


def _checked(policy: PolicyLike, recovery: bool | None) -> bool:
    """Return whether robots recover, after a check of the name of the policy, and that it can be given `recovery`.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, `recovery` is no flag, or it is given with another policy.
    """
    if isinstance(policy, str) and policy not in POLICIES:
        checks.choice("policy", policy, (FIXED_PRIORITY, *POLICIES, *POLICIES.plug_ins()))
    if recovery is None:
        return True
    checks.flag("recovery", recovery)
    if not isinstance(policy, str) or policy != FIXED_PRIORITY:
        raise ValueError(
            f"recovery={recovery}: is an option of policy={FIXED_PRIORITY!r}, and policy={checks.shown(policy)}; leave "
            f"it out, or set it where the policy is made, as in FixedPriority(recovery={recovery})"
        )
    return recovery


def completion_time(world: Any) -> float:
    """Return the steps until the box was moved by the distance of the world; infinite if it was not."""
    moved = np.cumsum(world.recording.history["box_moved"].to_numpy()) >= world.distance - 1e-9
    return float(np.argmax(moved) + 1) if moved.any() else float("inf")


def box_moved(world: Any) -> float:
    """Return how far the box was moved [length]."""
    return float(world.recording.history["box_moved"].sum())


def together(world: Any) -> float:
    """Return the share of the steps in which two robots push, or more."""
    return float(np.mean(world.recording.history["pushing"].to_numpy() >= 2))


def stagnation(world: Any) -> float:
    """Return the share of the steps in which two robots push, or more, and the box does not move."""
    return float(np.mean(world.recording.history["stagnating"].to_numpy() >= 2))


PUSH = Task(
    name="push",
    title="Push a box together",
    world=BoxPushing,
    scenario={
        "robots": 5, "side": 40.0, "distance": 10.0, "sensing_range": 12.0, "awareness_range": 6.0, "speed": 0.5,
        "robot_radius": 0.5, "box_radius": 2.0, "threshold": 1.5,
    },
    objective=Objective("completion_time", "less"),
    metrics={
        "completion_time": completion_time, "box_moved": box_moved, "together": together, "stagnation": stagnation,
    },
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": FIXED_PRIORITY, "awareness": "pairwise"},
    team="robots",
    steps=2000,
    gathers=True,
    about="Robots find a box that is too heavy for one and push it together. They gather around it. Source: Kube and "
    "Zhang (1994).",
)  # fmt: skip
