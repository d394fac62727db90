"""The world of box pushing: robots, and a box that is too heavy for one of them."""

from __future__ import annotations

import math
from typing import Any

from teamsight.agents.attributes import AwarenessLike, PolicyLike
from teamsight.agents.body import Body, Robot
from teamsight.agents.group import Group
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.policies.braitenberg.vehicle import FixedPriority
from teamsight.policies.registry import POLICIES
from teamsight.tasks.pushing.box_law import Pushing
from teamsight.world.arena import Box as Walls

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
