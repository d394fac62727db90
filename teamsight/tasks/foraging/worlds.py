"""The worlds of foraging robots, after Balch and Arkin (1994): a square area with obstacles, a home, attractors."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from teamsight.agents.body import Body, Robot, Target
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.policies.schemas import ForageSchemas, GrazeSchemas
from teamsight.policies.schemas.automaton import COMMUNICATION, Schemas
from teamsight.tasks.foraging.carrying import Carrying
from teamsight.tasks.foraging.consuming import Consuming
from teamsight.tasks.foraging.grazing import Grazing
from teamsight.tasks.foraging.layout import area, scattered

#: The policy of worlds by its name: motor schemas with the world's obstacles.
SCHEMAS = "schemas"

# Around home there are no obstacles within this distance [length].
_CLEAR = 5.0


class Attractor(Target):
    """Something that robots look for; its column `mass` is 0 once it is done."""


class Home(Body):
    """The place where robots deliver."""


class ForagingWorld(World):
    """Robots in a square area with obstacles, whose home is in the middle: the base class.

    Parameters
    ----------
    robots : int
        Number of robots.
    side : float
        The side of the area [length].
    obstacles : float
        The share of the area under round obstacles, in [0, 0.3].
    layout : int
        The seed of the places of obstacles, which are the same under all seeds of the world.
    speed, sensing_range, communication_range : float
        Of robots [length per step, length].
    policy : Policy, callable or str
        "schemas", or any policy.
    communication : {"none", "state", "goal"}
        What robots with "schemas" communicate.
    awareness : Awareness or str
        What they perceive of teammates.
    rng : int, optional
        The seed.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or the obstacles find no room.
    """

    def __init__(
        self,
        robots: int = 5,
        *,
        side: float = 64.0,
        obstacles: float = 0.15,
        layout: int = 1,
        speed: float = 2.0,
        sensing_range: float = 20.0,
        communication_range: float = 100.0,
        policy: Any = SCHEMAS,
        communication: str = "goal",
        awareness: Any = "pairwise",
        rng: int | None = None,
    ) -> None:
        checks.count("robots", robots, most=MOST_AGENTS)
        checks.number("side", side, above=0)
        layout = checks.count("layout", layout, least=0)
        checks.choice("communication", communication, COMMUNICATION)
        circles = scattered(side, obstacles, layout, _CLEAR)
        super().__init__(area(side, circles), rng=rng)
        self._data.limits.range("communication_range", communication_range)
        self._circles, self._side = circles, side
        if isinstance(policy, str) and policy == SCHEMAS:
            policy = self._schemas(communication)
        # Home is the first group, so that numbers of robots do not change the noise of others.
        self._home = self.add(Home, 1, policy="stationary", position=(0.0, 0.0), speed=0.0, name="home")
        self.robots = self.add(
            Robot, robots, policy=policy, awareness=awareness, speed=speed, sensing_range=sensing_range,
            awareness_range=communication_range,
        )  # fmt: skip
        self.senses(self.robots, self._home, as_="home", sensor=Sensor(range=2.0 * side, occluded=False), counts=False)
        self.robots.sensors["teammates"] = Sensor(occluded=False)
        self._furnish()

    def _furnish(self) -> None:
        """Add what there is besides robots and home."""

    def _schemas(self, communication: str) -> Schemas:
        """Return the motor schemas of its robots."""
        return ForageSchemas(communication, self._circles)


class AttractorWorld(ForagingWorld):
    """Robots that look for attractors: the base class.

    Parameters
    ----------
    robots : int
        Number of robots.
    attractors : int
        Number of attractors.
    mass : float
        The mass of each.
    side, obstacles, layout, speed, sensing_range, communication_range, policy, communication, awareness, rng
        As for `ForagingWorld`.

    Raises
    ------
    TypeError, ValueError
        As for `ForagingWorld`.
    """

    def __init__(
        self, robots: int = 5, *, attractors: int = 7, mass: float = 5.0, side: float = 64.0, obstacles: float = 0.15,
        layout: int = 1, speed: float = 2.0, sensing_range: float = 20.0, communication_range: float = 100.0,
        policy: Any = SCHEMAS, communication: str = "goal", awareness: Any = "pairwise", rng: int | None = None,
    ) -> None:  # fmt: skip
        checks.count("attractors", attractors, most=MOST_AGENTS)
        self._attractors, self._mass = attractors, checks.number("mass", mass, above=0)
        super().__init__(
            robots, side=side, obstacles=obstacles, layout=layout, speed=speed, sensing_range=sensing_range,
            communication_range=communication_range, policy=policy, communication=communication, awareness=awareness,
            rng=rng,
        )  # fmt: skip

    def _furnish(self) -> None:
        self.attractors = self.add(Attractor, self._attractors, policy="stationary", speed=0.0, name="attractors")
        self.attractors.add_column("mass", self._mass)
        self.senses(self.robots, self.attractors, sensor=Sensor(occluded=False))


class Forage(AttractorWorld):
    """Robots search for attractors and carry them home; see `AttractorWorld` and `Carrying`."""

    def _furnish(self) -> None:
        super()._furnish()
        self.interact(Carrying(), robots=self.robots, attractors=self.attractors, home=self._home)


class Consume(AttractorWorld):
    """Robots search for attractors and consume them in place; see `AttractorWorld` and `Consuming`."""

    def _furnish(self) -> None:
        super()._furnish()
        self.interact(Consuming(), robots=self.robots, attractors=self.attractors)

    def _schemas(self, communication: str) -> Schemas:
        return ForageSchemas(communication, self._circles, delivers=False)


class Graze(ForagingWorld):
    """Robots cover the area; see `ForagingWorld` and `Grazing`."""

    #: The share of the ground with which the task is done.
    DONE: ClassVar[float] = 0.95

    def _furnish(self) -> None:
        self.interact(Grazing(self._side, obstacles=self._circles), robots=self.robots)

    def _schemas(self, communication: str) -> Schemas:
        return GrazeSchemas(communication, self._circles)


def completion(world: World, score: str, whole: float) -> float:
    """Return the first step after which the sum of a score is `whole` [steps]; infinite if there is none."""
    reached = np.cumsum(world.recording.history[score].to_numpy()) >= whole - 1e-9
    return float(np.argmax(reached) + 1) if reached.any() else float("inf")
