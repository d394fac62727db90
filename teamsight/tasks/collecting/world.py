"""The world of robots that collect pucks: a square with a home region in its middle, and day and night."""

from __future__ import annotations

from teamsight.agents.attributes import AwarenessLike, PolicyLike
from teamsight.agents.body import Body, Robot
from teamsight.agents.group import Group
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.tasks.collecting.pucks import Collecting
from teamsight.world.arena import Box


class Puck(Body):
    """Something that robots collect. They do not see it: they find it by running onto it."""


class HomeRegion(Body):
    """The middle of the region where robots deliver and rest."""


class PuckCollecting(World):
    """Robots that find pucks by chance, carry them home, and should be at home by night.

    Parameters
    ----------
    robots, pucks : int
        Their numbers; by default 4 and 20.
    side : float
        The side of the square area [length]; by default 30.
    home_radius : float
        The radius of the home region, in the middle [length]; by default 3.
    reach : float
        Distance within which a robot grasps a puck [length]; by default 0.4.
    speed : float
        The largest distance that a robot moves in a step [length]; by default 0.3.
    awareness_range : float
        Distance within which teammates are perceived [length]; by default 6.
    period, night : int
        Steps of a day with its night, and those of the night; by default 400 and 100.
    renewed : bool
        Whether another puck appears for each that is delivered; by default it does.
    policy : str or Policy
        The policy of the robots; by default "random-walk".
    awareness : str or Awareness
        What they perceive of teammates; by default "pairwise".
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
