"""Foraging as three tasks, after Balch and Arkin (1994): robots carry attractors home, consume them, or graze."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body, Robot, Target
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.component import Allowed, NonNegative, Positive
from teamsight.core.kernel import inlined, kernel
from teamsight.policies.schemas import COMMUNICATION, ForageSchemas, GrazeSchemas, Schemas
from teamsight.tasks.task import Objective, Task
from teamsight.world.arena import Arena, Box
from teamsight.world.interaction import Interaction, InteractionState
from teamsight.world.shapes import Circle

#: x, y and radius of a round obstacle, from the middle of the area [length].
Round = tuple[float, float, float]

# Radii of obstacles, and the width of the gaps between them, which bodies can pass.
_RADII = (1.0, 3.0)
_GAP = 1.5
_MOST_TRIES = 100_000


def scattered(side: float, share: float, layout: int, clear: float) -> tuple[Round, ...]:
    """Return obstacles that cover a share of a square area.

    Parameters
    ----------
    side : float
        The side of the area [length].
    share : float
        The share of the area under obstacles, in [0, 0.3].
    layout : int
        The seed of their places.
    clear : float
        The distance from the middle within which there are none [length].

    Raises
    ------
    TypeError, ValueError
        If the share is outside its limits, or the obstacles find no room.
    """
    return _scattered(side, checks.number("obstacles", share, least=0, most=0.3), layout, clear)


@cache
def _scattered(side: float, share: float, layout: int, clear: float) -> tuple[Round, ...]:
    rng, left, found = np.random.default_rng(layout), share * side * side, list[Round]()
    for _ in range(_MOST_TRIES):
        if left <= 0.0:
            return tuple(found)
        # The last one covers what is left; a tiny one is not worth a place.
        radius = min(float(rng.uniform(*_RADII)), math.sqrt(max(left, 0.01) / math.pi))
        x, y = (float(one) for one in rng.uniform(-0.5 * side + radius + _GAP, 0.5 * side - radius - _GAP, 2))
        near = (math.hypot(x - other[0], y - other[1]) - other[2] < radius + _GAP for other in found)
        if math.hypot(x, y) - radius > clear and not any(near):
            found.append((x, y, radius))
            left -= math.pi * radius * radius
    raise ValueError(
        f"obstacles={share:g}: find no room in a square of side {side:g}; take a smaller share or a larger side"
    )


def check_circles(obstacles: tuple[Round, ...]) -> None:
    """Refuse what are no round obstacles.

    Raises
    ------
    TypeError, ValueError
        Naming the first that is none.
    """
    if not isinstance(obstacles, tuple) or not all(isinstance(one, tuple) and len(one) == 3 for one in obstacles):
        shown = checks.shown(obstacles)
        raise TypeError(f"obstacles={shown}: must be a tuple of (x, y, radius), such as ((0.0, 2.0, 1.0),)")
    for x, y, radius in obstacles:
        checks.number("obstacles: x", x)
        checks.number("obstacles: y", y)
        checks.number("obstacles: radius", radius, above=0)


def refuse_torus(name: str, arena: Arena) -> None:
    """Refuse an arena that repeats.

    Raises
    ------
    ValueError
        Naming the interaction and the arena.
    """
    if any(side > 0.0 for side in arena.period):
        raise ValueError(f"{name}: measures distances in a plane, and {arena} repeats; take one that does not: Box")


def area(side: float, obstacles: tuple[Round, ...]) -> Arena:
    """Return the arena of these obstacles."""
    box = Box(side, side)
    return box.with_obstacles(*(Circle((x, y), radius) for x, y, radius in obstacles)) if obstacles else box


#: What interactions keep of robots: whether each is attached, the identity of its attractor (0 for none), its own
#: speed, and the speed that it has with its load.
ROBOT_COLUMNS = (
    ("robots", "attached", 0), ("robots", "attractor", 0), ("robots", "free_speed", 0.0), ("robots", "slow_speed", 0.0),
)  # fmt: skip
#: What they keep of attractors: the mass that is left, and the number of robots that are attached.
ATTRACTOR_COLUMNS = (("attractors", "mass", 5.0), ("attractors", "robots_at_it", 0))


@inlined
def release(robots: Any, i: int) -> None:
    """Let robot `i` go."""
    robots.speed[i] = robots.free_speed[i]
    robots.attached[i] = 0
    robots.attractor[i] = 0


@inlined
def slow_down(robots: Any, i: int, speed: float) -> None:
    """Give robot `i` the speed that it has while it is attached."""
    robots.speed[i] = speed
    robots.slow_speed[i] = speed


@inlined
def is_held(robots: Any, i: int, attractors: Any, j: int) -> bool:
    """Whether robot `i` is attached to attractor `j`."""
    return bool(robots.attractor[i] == attractors.identity[j])


@inlined
def _row_of_held(robots: Any, i: int, attractors: Any) -> int:
    """Return the row of the attractor to which robot `i` is attached; −1 if it cannot hold on to it."""
    for j in range(attractors.position.shape[0]):
        if is_held(robots, i, attractors, j):
            return j if attractors.active[j] and attractors.mass[j] > 0.0 and robots.active[i] else -1
    return -1


@inlined
def _attach(robots: Any, attractors: Any, i: int, reach: float) -> int:
    """Attach robot `i` to the nearest attractor within reach that has mass; return its row, −1 for none."""
    nearest = reach
    found = -1
    for j in range(attractors.position.shape[0]):
        x = attractors.position[j, 0] - robots.position[i, 0]
        y = attractors.position[j, 1] - robots.position[i, 1]
        distance = math.sqrt(x * x + y * y)
        if attractors.active[j] and attractors.mass[j] > 0.0 and distance <= nearest:
            if found >= 0 and distance == nearest:
                continue
            nearest = distance
            found = j
    if found >= 0:
        robots.free_speed[i] = robots.speed[i]
        robots.slow_speed[i] = robots.speed[i]
        robots.attached[i] = 1
        robots.attractor[i] = attractors.identity[found]
    return found


@inlined
def attach_all(robots: Any, attractors: Any, reach: float) -> None:
    """Attach free robots, release those that cannot hold on, and count the robots at each attractor."""
    for j in range(attractors.position.shape[0]):
        attractors.robots_at_it[j] = 0
    for i in range(robots.position.shape[0]):
        held = -1
        if robots.attractor[i] != 0:
            if robots.speed[i] != robots.slow_speed[i]:
                # Somebody has set it since; so it is what the robot has without a load.
                robots.free_speed[i] = robots.speed[i]
            held = _row_of_held(robots, i, attractors)
            if held < 0:
                release(robots, i)
        if held < 0 and robots.active[i]:
            held = _attach(robots, attractors, i, reach)
        if held >= 0:
            attractors.robots_at_it[held] += 1


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
    writes = ("position", "speed", "reward", "ended")
    scores = ("delivered", "delivered_mass")
    columns = (*ROBOT_COLUMNS, *ATTRACTOR_COLUMNS)
    reach: Annotated[Positive, Allowed(unit="length")] = 1.0
    home_radius: Annotated[Positive, Allowed(unit="length")] = 3.0
    strength: Positive = 5.0
    kernel = _carry

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        refuse_torus("Carrying", arena)


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
    writes = ("position", "speed", "reward", "ended")
    scores = ("consumed", "finished")
    columns = (*ROBOT_COLUMNS, *ATTRACTOR_COLUMNS)
    reach: Annotated[Positive, Allowed(unit="length")] = 1.0
    rate: Positive = 0.05
    kernel = _consume

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        refuse_torus("Consuming", arena)


# The largest raster, along a side.
_MOST_CELLS = 4000


@inlined
def _mow(ground: Any, x: float, y: float, reach: float, cell: float) -> int:
    """Graze all cells whose centres are within reach of a place; return how many were fresh."""
    cells = ground.shape[0]
    span = int(reach / cell) + 1
    column, row = int(x / cell), int(y / cell)
    grazed = 0
    for r in range(max(row - span, 0), min(row + span + 1, cells)):
        for c in range(max(column - span, 0), min(column + span + 1, cells)):
            dx = (c + 0.5) * cell - x
            dy = (r + 0.5) * cell - y
            if ground[r, c] == 1 and dx * dx + dy * dy <= reach * reach:
                ground[r, c] = 0
                grazed += 1
    return grazed


@inlined
def _probe(ground: Any, x: float, y: float, reach: float, cell: float) -> tuple[float, float]:
    """Return the offset to the nearest fresh cell within reach; (0, 0) if there is none."""
    cells = ground.shape[0]
    span = int(reach / cell) + 1
    column, row = int(x / cell), int(y / cell)
    nearest = reach * reach
    found_x = 0.0
    found_y = 0.0
    for r in range(max(row - span, 0), min(row + span + 1, cells)):
        for c in range(max(column - span, 0), min(column + span + 1, cells)):
            dx = (c + 0.5) * cell - x
            dy = (r + 0.5) * cell - y
            square = dx * dx + dy * dy
            if ground[r, c] == 1 and square < nearest:
                nearest = square
                found_x = dx
                found_y = dy
    return found_x, found_y


@kernel
def _graze(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots, ground = bodies.robots, state.ints
    half = 0.5 * parameters[0]
    for i in range(robots.position.shape[0]):
        if robots.active[i]:
            x, y = robots.position[i, 0] + half, robots.position[i, 1] + half
            share = _mow(ground, x, y, parameters[2], parameters[1]) / state.floats[0, 0]
            robots.reward[i] += share
            scores[0] += share
    for i in range(robots.position.shape[0]):
        x, y = robots.position[i, 0] + half, robots.position[i, 1] + half
        robots.probe_x[i], robots.probe_y[i] = _probe(ground, x, y, parameters[3], parameters[1])


@dataclass(frozen=True)
class Grazing(Interaction):
    """Robots graze all fresh ground within reach; they probe where the nearest of what is left is.

    Parameters
    ----------
    side : float
        The side of the square area, whose centre is (0, 0) [length].
    cell : float
        The side of a cell of the raster [length].
    reach : float
        Distance within which a robot grazes [length].
    probe : float
        Distance within which it senses fresh ground [length].
    obstacles : tuple of (float, float, float)
        Round obstacles, under which there is no ground: x, y and radius [length].

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits, or no ground is left; in a world whose arena repeats or is larger.
    """

    roles = ("robots",)
    writes = ("reward",)
    scores = ("grazed",)
    columns = (("robots", "probe_x", 0.0), ("robots", "probe_y", 0.0))
    side: Annotated[Positive, Allowed(unit="length")] = 64.0
    cell: Annotated[Positive, Allowed(unit="length")] = 1.0
    reach: Annotated[Positive, Allowed(unit="length")] = 1.5
    probe: Annotated[NonNegative, Allowed(unit="length")] = 4.0
    obstacles: tuple[tuple[float, float, float], ...] = ()
    kernel = _graze

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side > _MOST_CELLS * self.cell:
            raise ValueError(
                f"side={self.side:g}: has more than {_MOST_CELLS} cells of {self.cell:g}; take a smaller side, "
                "or larger cells"
            )
        check_circles(self.obstacles)
        if not self._ground.any():
            raise ValueError(
                f"obstacles={checks.shown(self.obstacles)}: leave no ground in a square of side {self.side:g}; take "
                "fewer, or smaller cells"
            )

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        refuse_torus("Grazing", arena)
        extent = float(np.abs(arena.bounds).max())
        # Rounding decides nothing.
        if extent > 0.5 * self.side * (1.0 + 1e-9):
            raise ValueError(
                f"side={self.side:g}: {arena} reaches {extent:g} from its middle; give Grazing at least the side "
                f"{2.0 * extent:g}"
            )

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.side, self.cell, self.reach, self.probe

    def start(self, sizes: Any) -> InteractionState:
        """Return the raster, with 1 for fresh ground, and the number of its cells with ground."""
        ground = self._ground
        return InteractionState(np.full((1, 1), float(ground.sum())), ground)

    @property
    def _ground(self) -> npt.NDArray[np.int64]:
        cells = math.ceil(self.side / self.cell)
        centre = (np.arange(cells) + 0.5) * self.cell - 0.5 * self.side
        x, y = np.meshgrid(centre, centre)
        ground = np.ones((cells, cells), np.int64)
        for at_x, at_y, radius in self.obstacles:
            ground[(x - at_x) ** 2 + (y - at_y) ** 2 < radius**2] = 0
        return ground


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


def delivery_time(world: Any) -> float:
    """Return the number of steps until all attractors are delivered."""
    return completion(world, "delivered", len(world.attractors))


def delivered(world: Any) -> float:
    """Return the share of attractors that are delivered."""
    return float(world.recording.history["delivered"].sum() / len(world.attractors))


FORAGE = Task(
    name="forage",
    title="Carry attractors home",
    world=Forage,
    scenario={
        "robots": 5, "attractors": 7, "mass": 5.0, "side": 64.0, "obstacles": 0.15, "layout": 1, "speed": 2.0,
        "sensing_range": 20.0, "communication_range": 100.0,
    },
    objective=Objective("completion_time", "less"),
    metrics={"completion_time": delivery_time, "delivered": delivered},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": "schemas", "communication": "goal", "awareness": "pairwise"},
    team="robots",
    steps=8000,
    gathers=True,
    about="Robots search for attractors and carry them home, together if they can. Source: Balch and Arkin (1994).",
)  # fmt: skip


def consumption_time(world: Any) -> float:
    """Return the number of steps until all attractors are consumed."""
    return completion(world, "finished", len(world.attractors))


def finished(world: Any) -> float:
    """Return the share of attractors that are consumed."""
    return float(world.recording.history["finished"].sum() / len(world.attractors))


CONSUME = Task(
    name="consume",
    title="Consume attractors in place",
    world=Consume,
    scenario=FORAGE.scenario,
    objective=Objective("completion_time", "less"),
    metrics={"completion_time": consumption_time, "finished": finished},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": "schemas", "communication": "goal", "awareness": "pairwise"},
    team="robots",
    steps=8000,
    gathers=True,
    about="Robots search for attractors and work on them, for a time proportional to their mass. Source: Balch and "
    "Arkin (1994).",
)


def grazing_time(world: Any) -> float:
    """Return the number of steps until 95 % of the ground are grazed."""
    return completion(world, "grazed", world.DONE)


def grazed(world: Any) -> float:
    """Return the share of the ground that is grazed."""
    return float(world.recording.history["grazed"].sum())


GRAZE = Task(
    name="graze",
    title="Cover the area",
    world=Graze,
    scenario={name: value for name, value in FORAGE.scenario.items() if name not in ("attractors", "mass")},
    objective=Objective("completion_time", "less"),
    metrics={"completion_time": grazing_time, "grazed": grazed},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": "schemas", "communication": "goal", "awareness": "pairwise"},
    team="robots",
    steps=8000,
    gathers=False,
    about="Robots go over 95 % of the ground, each cell of which counts once. Source: Balch and Arkin (1994).",
)
