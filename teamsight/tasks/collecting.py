"""Collecting pucks as a task: its interaction, its world and its measures."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.agents.attributes import AwarenessLike, PolicyLike
from teamsight.agents.awareness import Awareness, PairwiseAwareness
from teamsight.agents.body import Body, Robot
from teamsight.agents.group import Group
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.component import Allowed, Count, Flag, Index, Positive
from teamsight.core.kernel import inlined, kernel
from teamsight.policies.basis import BasisBehaviours, share_correct
from teamsight.tasks.square import check_square
from teamsight.tasks.task import Objective, Task
from teamsight.world.arena import Arena, Box
from teamsight.world.interaction import Interaction, InteractionState

_SIDE, _HOME_RADIUS, _REACH, _PERIOD, _NIGHT, _RENEWED = range(6)
_DELIVERED, _GRABBED, _DROPPED_AWAY, _WOKEN_HOME, _WOKEN_AWAY = range(5)


@inlined
def _is_home(place: Any, i: int, home: Any, radius: float) -> bool:
    """Whether a body is in the home region: that of the first home, active or not; nobody is where there is none."""
    if home.position.shape[0] == 0:
        return False
    x = place[i, 0] - home.position[0, 0]
    y = place[i, 1] - home.position[0, 1]
    return bool(x * x + y * y <= radius * radius)


@inlined
def _row_of(pucks: Any, identity: int) -> int:
    """Return the row of a puck; −1 if there is none of this identity, or it is inactive."""
    for j in range(pucks.position.shape[0]):
        if pucks.identity[j] == identity:
            return j if pucks.active[j] else -1
    return -1


@inlined
def _hold(robots: Any, pucks: Any) -> None:
    """Find out which pucks are held: robots and pucks may have left the world, and one holds a puck at most."""
    for j in range(pucks.position.shape[0]):
        pucks.holder[j] = 0
    for i in range(robots.position.shape[0]):
        if robots.puck[i] > 0:
            j = _row_of(pucks, robots.puck[i])
            if j < 0 or pucks.holder[j] > 0 or pucks.delivered[j] > 0:
                robots.puck[i] = 0
            else:
                pucks.holder[j] = robots.identity[i]


@inlined
def _leave_home(pucks: Any, j: int, home: Any, parameters: Any) -> None:
    """Move a puck that lies in the home region by half the side, so that none is found there."""
    if _is_home(pucks.position, j, home, parameters[_HOME_RADIUS]):
        half = 0.5 * parameters[_SIDE]
        pucks.position[j, 0] += half if pucks.position[j, 0] < 0.0 else -half


@inlined
def _deliver(robots: Any, i: int, pucks: Any, j: int, parameters: Any, noise: Any) -> None:
    """Robot `i` drops puck `j` at home; another one appears at a random place, if pucks are renewed."""
    robots.puck[i] = 0
    robots.dropped_home[i] += 1
    robots.reward[i] += 1.0
    pucks.holder[j] = 0
    if parameters[_RENEWED] > 0.0:
        for axis in range(2):
            pucks.position[j, axis] = parameters[_SIDE] * (noise[axis, j] - 0.5)
    else:
        pucks.delivered[j] = 1


@inlined
def _grasp(robots: Any, i: int, pucks: Any, reach: float) -> bool:
    """Robot `i` takes the nearest free puck within reach; return whether there is one."""
    nearest = reach * reach
    found = -1
    for j in range(pucks.position.shape[0]):
        x = pucks.position[j, 0] - robots.position[i, 0]
        y = pucks.position[j, 1] - robots.position[i, 1]
        square = x * x + y * y
        is_free = pucks.active[j] and pucks.holder[j] == 0 and pucks.delivered[j] == 0
        if is_free and (square < nearest or (found < 0 and square == nearest)):
            nearest = square
            found = j
    if found < 0:
        return False
    robots.puck[i] = pucks.identity[found]
    robots.grabbed[i] += 1
    pucks.holder[found] = robots.identity[i]
    return True


@inlined
def _wake(robots: Any, i: int, is_still: bool, scores: Any) -> None:
    """The night ends for robot `i`."""
    if not robots.at_home[i]:
        robots.woken_away[i] += 1
        scores[_WOKEN_AWAY] += 1.0
    elif is_still:
        robots.woken_home[i] += 1
        scores[_WOKEN_HOME] += 1.0


@kernel
def _collect(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots, pucks, home = bodies.robots, bodies.pucks, bodies.home
    now = state.ints[0, 0] + 1
    state.ints[0, 0] = now
    hour = now % int(parameters[_PERIOD])
    is_night = hour >= parameters[_PERIOD] - parameters[_NIGHT]
    _hold(robots, pucks)
    for i in range(robots.position.shape[0]):
        robots.night[i] = is_night
        if not robots.active[i]:
            continue
        robots.at_home[i] = _is_home(robots.position, i, home, parameters[_HOME_RADIUS])
        is_still = robots.moved[i, 0] == 0.0 and robots.moved[i, 1] == 0.0
        if robots.puck[i] > 0:
            j = _row_of(pucks, robots.puck[i])
            for axis in range(2):
                pucks.position[j, axis] = robots.position[i, axis]
            if robots.at_home[i]:
                _deliver(robots, i, pucks, j, parameters, noise.pucks)
                scores[_DELIVERED] += 1.0
            elif is_still:
                robots.puck[i] = 0
                robots.dropped_away[i] += 1
                pucks.holder[j] = 0
                scores[_DROPPED_AWAY] += 1.0
        elif not (is_still or is_night or robots.at_home[i]):
            scores[_GRABBED] += _grasp(robots, i, pucks, parameters[_REACH])
        if hour == 0 and parameters[_NIGHT] > 0.0:
            _wake(robots, i, is_still, scores)
    for j in range(pucks.position.shape[0]):
        if pucks.active[j] and pucks.holder[j] == 0 and pucks.delivered[j] == 0:
            _leave_home(pucks, j, home, parameters)


@dataclass(frozen=True)
class Collecting(Interaction):
    """Robots grasp and drop pucks by reflex, and wake up when the night ends.

    By day a robot without a puck that moves and has one within reach takes it. At home it drops it: the puck is
    delivered, and the robot gets 1. A robot with a puck that stands still away from home drops it there. Nothing is
    grasped in the home region or by night. When the night ends, all robots that are away from home wake there; those
    that stand still at home wake at home; those that move there have not slept.

    The roles are "robots", "pucks" and "home". The first body of the role "home" is the middle of the home region,
    whether it is active or not; further ones are left alone. Robots have the columns `puck` (the identity of
    theirs, or 0), `at_home` and `night`, and count what happened to them in `grabbed`, `dropped_home`, `dropped_away`,
    `woken_home` and `woken_away`. Pucks have `holder` (the identity of a robot, or 0) and `delivered`.

    Parameters
    ----------
    side : float
        The side of the square area, whose centre is (0, 0) [length].
    home_radius : float
        Distance from home within which a robot is at home [length].
    reach : float
        Distance within which a robot grasps a puck [length].
    period : int
        Steps of a day and its night. It begins with the day.
    night : int
        Steps of the night, at the end of the period; 0 for none.
    renewed : bool
        Whether another puck appears at a random place for each that is delivered.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits; in a world whose arena is not the square of this side
        around the origin.

    Notes
    -----
    *Source:* Mataric (1994, 1997) for grasping and dropping as reflexes, and for the five events. *Departs:* all
    numbers are ours, and so is what makes a robot drop a puck away from home, and who wakes where: hers are not known
    to us.
    """

    side: Annotated[Positive, Allowed(unit="length")] = 30.0
    home_radius: Annotated[Positive, Allowed(unit="length")] = 3.0
    reach: Annotated[Positive, Allowed(unit="length")] = 0.4
    period: Annotated[Count, Allowed(unit="ticks")] = 400
    night: Annotated[Index, Allowed(unit="ticks")] = 100
    renewed: Flag = True

    roles = ("robots", "pucks", "home")
    writes = ("position", "reward")
    scores = ("delivered", "grabbed", "dropped_away", "woken_home", "woken_away")
    draws = 2
    columns = (
        ("robots", "puck", 0), ("robots", "at_home", False), ("robots", "night", False), ("robots", "grabbed", 0),
        ("robots", "dropped_home", 0), ("robots", "dropped_away", 0), ("robots", "woken_home", 0),
        ("robots", "woken_away", 0), ("pucks", "holder", 0), ("pucks", "delivered", 0),
    )  # fmt: skip
    kernel = _collect

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.home_radius > 0.25 * self.side:
            raise ValueError(
                f"home_radius={self.home_radius:g}: must be at most a quarter of the side, {0.25 * self.side:g}, so "
                "that pucks have room around home"
            )
        if self.night >= self.period:
            raise ValueError(f"night={self.night}: must be less than period={self.period}, which leaves a day")

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        check_square(self, arena)

    def start(self, sizes: Any) -> InteractionState:
        """Return the number of steps since the first morning."""
        return InteractionState(np.zeros((0, 0)), np.zeros((1, 1), np.int64))


class Puck(Body):
    """Something that robots collect. They do not see it: they find it by running onto it."""


class HomeRegion(Body):
    """The middle of the region where robots deliver and rest."""


class PuckCollecting(World):
    """Robots that find pucks by chance, carry them home, and should be at home by night.

    Parameters
    ----------
    robots : int
        Number of robots.
    pucks : int
        Number of pucks.
    side : float
        The side of the square area [length].
    home_radius : float
        The radius of the home region, in the middle [length].
    reach : float
        Distance within which a robot grasps a puck [length].
    speed : float
        The largest distance that a robot moves in a step [length].
    awareness_range : float
        Distance within which teammates are perceived [length].
    period : int
        Steps of a day with its night.
    night : int
        Steps of the night.
    renewed : bool
        Whether another puck appears for each that is delivered.
    policy : str or Policy
        The policy of the robots.
    awareness : str or Awareness
        What they perceive of teammates.
    rng, seed : int, optional
        Two names for the seed.

    Attributes
    ----------
    robots, pucks : Group
        The two groups.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits.

    Notes
    -----
    *Source:* Mataric (1994, 1997): four robots, pucks, a home region, a night. *Departs:* see `Collecting`. Arena,
    ranges, speeds and the length of the night are not known to us; ours are free choices.
    """

    def __init__(
        self,
        robots: int = 4,
        pucks: int = 20,
        side: float = 30.0,
        *,
        home_radius: float = 3.0,
        reach: float = 0.4,
        speed: float = 0.3,
        awareness_range: float = 6.0,
        period: int = 400,
        night: int = 100,
        renewed: bool = True,
        policy: PolicyLike = "random-walk",
        awareness: AwarenessLike = "pairwise",
        rng: int | None = None,
        seed: int | None = None,
    ) -> None:
        checks.count("robots", robots, most=MOST_AGENTS)
        checks.count("pucks", pucks, most=MOST_AGENTS)
        collecting = Collecting(side, home_radius, reach, period, night, renewed)
        super().__init__(Box(side, side), rng=rng, seed=seed)
        # Home and pucks come first, so that numbers of robots do not change their noise.
        home = self.add(HomeRegion, 1, policy="stationary", position=(0.0, 0.0), speed=0.0, name="home")
        self._pucks = self.add(Puck, pucks, policy="stationary", speed=0.0, name="pucks")
        self._robots = self.add(
            Robot, robots, policy=policy, awareness=awareness, speed=speed, awareness_range=awareness_range
        )
        self.senses(self._robots, home, as_="home", sensor=Sensor(range=2.0 * side), counts=False)
        self.interact(collecting, robots=self._robots, pucks=self._pucks, home=home)

    @property
    def robots(self) -> Group[Robot]:
        """The robots."""
        return self._robots

    @property
    def pucks(self) -> Group[Puck]:
        """The pucks."""
        return self._pucks


#: Steps for which a team learns before it counts as skilled.
LEARNING = 100_000


def delivered(world: World) -> float:
    """Return the number of pucks that were delivered."""
    return float(world.recording.history["delivered"].sum())


def slept_at_home(world: World) -> float:
    """Return the share of nights after which a robot woke at home, of those after which it woke at all; 0 for none."""
    history = world.recording.history
    home, away = float(history["woken_home"].sum()), float(history["woken_away"].sum())
    return home / (home + away) if home + away else 0.0


def rows_correct(world: World) -> float:
    """Return the share of clear rows whose behaviour is right; 0 for a team without a table of behaviours."""
    robots: Any = world.robots  # type: ignore[attr-defined]
    if not isinstance(robots.policy, BasisBehaviours):
        return 0.0
    return share_correct(robots.policy.values(robots.policy_state))


def learned(
    scenario: Mapping[str, Any], awareness: Awareness | None, rng: int, steps: int = LEARNING
) -> dict[str, Any]:
    """Let a team learn from events and progress, and return its parameters: its degree, and the policy it learned.

    Parameters
    ----------
    scenario : mapping
        All parameters of the scenario.
    awareness : Awareness or None
        What the robots perceive of teammates; None for pairwise awareness.
    rng : int
        The seed.
    steps : int
        Steps for which they learn.
    """
    degree = PairwiseAwareness() if awareness is None else awareness
    policy = BasisBehaviours()
    with contextlib.closing(PuckCollecting(**scenario, policy=policy, awareness=degree, rng=rng)) as world:
        world.run(steps, progress=False)
        return {"policy": policy.frozen(policy.values(world.robots.policy_state)), "awareness": degree}


COLLECT = Task(
    name="collect",
    title="Collect pucks, and rest at home by night",
    world=PuckCollecting,
    scenario={
        "robots": 4, "pucks": 20, "side": 30.0, "home_radius": 3.0, "reach": 0.4, "speed": 0.3, "awareness_range": 6.0,
        "period": 400, "night": 100, "renewed": True,
    },
    objective=Objective("delivered", "more"),
    metrics={"delivered": delivered, "slept_at_home": slept_at_home, "rows_correct": rows_correct},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled=learned,
    team="robots",
    steps=1200,
    gathers=True,
    about="Robots find pucks, carry them home, and gather there by night. Source: Mataric (1994, 1997).",
)  # fmt: skip
