"""Ceilings of CMOMMT: what a team could observe at most if it knew more than a robot can.

`most_covered` is proven: no policy can pass it. The others are teams of a central planner, which move as robots do, so
each shows what is possible at least. `Clairvoyant` knows all ways of all targets in advance, `Informed` where all
targets are now, `Sharing` only what some robot senses or has sensed.

A plan is improved robot by robot: each gets the way on which it observes most of what the others do not, by dynamic
programming over places and instants, until no robot finds a better one. That is a local optimum.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations, product
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.cmommt import CMOMMT
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.core import checks
from teamsight.core.kernel import Entry, Record
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.interface import Action, Percept, Policy
from teamsight.world.arena import Arena
from teamsight.world.motion import advance_entry, bodies_at, pack_move

if TYPE_CHECKING:
    from teamsight.analysis.runs.executor import Executor
    from teamsight.analysis.runs.simulate import Progress

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

# A leg of a way lasts so many ticks, and places lie so far apart that a robot passes as many in it.
_LEG = 3
# An informed team looks so many ticks ahead, and a target that walks at random has turned by then more often than not.
_HORIZON = 30
# A plan is improved so often at first, and so often when it is made anew.
_ROUNDS, _AGAIN = 8, 2
_LEAST_GAIN = 2e-4
# A sharing team looks for a target where it would have gone for so many ticks.
_PATIENCE = 20
# Places of targets that nobody has seen for long are mapped on a grid of this spacing, in sensing ranges.
_COARSE = 0.25
_MOST_PLACES = 2_000_000
_NOWHERE = -1.0
#: What `planned` takes of the settings of a CMOMMT.
SETTINGS = ("robots", "targets", "radius", "sensing_range", "robot_speed", "target_speed", "uniform_target_speed")


class WayArrays(NamedTuple):
    """The record of the search for a robot's best way.

    Attributes
    ----------
    start : ndarray, shape (2,), float64
        Where it is.
    paths : ndarray, shape (ticks, targets, 2), float64
        Where targets will be, from now on.
    worth : ndarray, shape (ticks, targets), float64
        What it is worth to observe them; 0 if others do.
    ground : ndarray, shape (x, y), float64
        What it is worth to be at a place for one leg.
    discount : ndarray, shape (legs,), float64
        By what the worth of ground shrinks.
    prospect : ndarray, shape (x, y), float64
        What it is worth to be at a place at the end.
    inside : ndarray, shape (x, y), bool
        The places in the arena.
    moves : ndarray, shape (moves, 2), int64
        The ways of one leg, in places; the shortest first.
    low : ndarray, shape (2,), float64
        The place with the indices (0, 0).
    lengths : ndarray, shape (3,), float64
        Spacing, sensing range, and the way of one leg.
    best, following, worths : ndarray, shape (x, y), float64
        Room to work in.
    came : ndarray, shape (legs, x, y), int16
        Room to work in: the move by which the best way comes to a place.
    way : ndarray, shape (legs, 2), int64
        Written: the indices of the places at the end of each leg.
    """

    start: Annotated[Floats, 2]
    paths: Annotated[Floats, "ticks", "targets", 2]
    worth: Annotated[Floats, "ticks", "targets"]
    ground: Annotated[Floats, "x", "y"]
    discount: Annotated[Floats, "legs"]
    prospect: Annotated[Floats, "x", "y"]
    inside: Annotated[Flags, "x", "y"]
    moves: Annotated[Integers, "moves", 2]
    low: Annotated[Floats, 2]
    lengths: Annotated[Floats, 3]
    best: Annotated[Floats, "x", "y"]
    following: Annotated[Floats, "x", "y"]
    worths: Annotated[Floats, "x", "y"]
    came: Annotated[npt.NDArray[np.int16], "legs", "x", "y"]
    way: Annotated[Integers, "legs", 2]


WAY = Record(WayArrays)
way_at = WAY.at


def _find_way(address: int) -> int:
    here = way_at(address)
    legs, wide, high = here.came.shape
    spacing, reach, stride = here.lengths[0], here.lengths[1], here.lengths[2]
    ticks, targets = here.worth.shape
    span = int(reach / spacing) + 2
    # It cannot leave the box around its start.
    column = int(np.rint((here.start[0] - here.low[0]) / spacing))
    row = int(np.rint((here.start[1] - here.low[1]) / spacing))
    most = int(legs * stride / spacing) + 2
    left, right = max(column - most, 0), min(column + most + 1, wide)
    lower, upper = max(row - most, 0), min(row + most + 1, high)
    for leg in range(legs):
        for i in range(left, right):
            for j in range(lower, upper):
                here.worths[i, j] = here.ground[i, j] * here.discount[leg]
                if leg == legs - 1:
                    here.worths[i, j] += here.prospect[i, j]
        middle = (leg + 1) * _LEG
        for tick in range(middle - (_LEG - 1) // 2, min(middle + _LEG // 2 + 1, ticks)):
            for m in range(targets):
                worth = here.worth[tick, m]
                if worth <= 0.0:
                    continue
                x, y = here.paths[tick, m, 0] - here.low[0], here.paths[tick, m, 1] - here.low[1]
                near_x, near_y = int(x / spacing), int(y / spacing)
                for i in range(max(left, near_x - span), min(right, near_x + span + 1)):
                    for j in range(max(lower, near_y - span), min(upper, near_y + span + 1)):
                        if (i * spacing - x) ** 2 + (j * spacing - y) ** 2 <= reach * reach:
                            here.worths[i, j] += worth
        for i in range(left, right):
            for j in range(lower, upper):
                best, by = _NOWHERE, 0
                if here.inside[i, j] and leg == 0:
                    away_x = i * spacing + here.low[0] - here.start[0]
                    away_y = j * spacing + here.low[1] - here.start[1]
                    if away_x * away_x + away_y * away_y <= stride * stride:
                        best = 0.0
                elif here.inside[i, j]:
                    for k in range(here.moves.shape[0]):
                        a, b = i - here.moves[k, 0], j - here.moves[k, 1]
                        if left <= a < right and lower <= b < upper and here.best[a, b] > best:
                            best, by = here.best[a, b], k
                here.following[i, j] = best + here.worths[i, j] if best >= 0.0 else _NOWHERE
                here.came[leg, i, j] = by
        for i in range(left, right):
            for j in range(lower, upper):
                here.best[i, j] = here.following[i, j]
    best, at_x, at_y = _NOWHERE, column, row
    for i in range(left, right):
        for j in range(lower, upper):
            if here.best[i, j] > best:
                best, at_x, at_y = here.best[i, j], i, j
    for leg in range(legs - 1, -1, -1):
        here.way[leg, 0] = at_x
        here.way[leg, 1] = at_y
        k = here.came[leg, at_x, at_y]
        at_x -= here.moves[k, 0]
        at_y -= here.moves[k, 1]
    # A robot that no place is near enough to stays where it is.
    return 1 if best < 0.0 else 0


FIND_WAY = Entry(_find_way)


class Land(NamedTuple):
    """What places are worth, shape (x, y) each: for each leg there, and at the end; see `WayArrays`."""

    ground: Floats
    prospect: Floats


class Plans:
    """Plans for a team in a convex arena without obstacles.

    Parameters
    ----------
    arena : Arena
        The arena.
    speed, reach : float
        The robots' speed and sensing range [length].
    ticks : int
        How far plans look ahead.
    """

    def __init__(self, arena: Arena, speed: float, reach: float, ticks: int) -> None:
        self.arena, self.reach, self.speed = arena, reach, speed
        self.legs = max(ticks // _LEG, 1)
        self.ticks = self.legs * _LEG
        self._low, high = np.array(arena.bounds, float)
        shape = tuple(int(side / speed) + 1 for side in high - self._low)
        if math.prod(shape) * self.legs > 400 * _MOST_PLACES or math.prod(shape) > _MOST_PLACES:
            raise ValueError(
                f"robot_speed={speed:g}: in {arena} the planner has {math.prod(shape):,} places, which is too many; "
                "give a higher speed, a smaller arena or fewer steps"
            )
        self.axes = [low + speed * np.arange(size) for low, size in zip(self._low, shape, strict=True)]
        self.places = np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1)
        self._inside = np.ascontiguousarray(arena.contains(self.places))
        around = np.array([
            (i, j) for i in range(-_LEG, _LEG + 1) for j in range(-_LEG, _LEG + 1) if i * i + j * j <= _LEG**2
        ])  # fmt: skip
        self._moves = around[np.argsort((around**2).sum(axis=1), kind="stable")].astype(np.int64)
        self._lengths = np.array([speed, reach, speed * _LEG * (1.0 + 1e-12)])
        self._room = [np.zeros(shape) for _ in range(3)]
        self._came = np.zeros((self.legs, *shape), np.int16)
        self._way = np.zeros((self.legs, 2), np.int64)
        self._bare = np.zeros(shape)

    def way(
        self, start: Floats, paths: Floats, worth: Floats, land: Land | None = None, decay: float = 1.0
    ) -> Floats:
        """Return the best way of one robot, shape (ticks + 1, 2); parameters are as in `WayArrays`."""
        best, following, worths = self._room
        ground, prospect = land or (self._bare, self._bare)
        discount = decay ** (_LEG * np.arange(self.legs, dtype=float))
        found = FIND_WAY(WAY.pack(WayArrays(
            np.ascontiguousarray(start), paths, worth, ground, discount, prospect, self._inside, self._moves,
            self._low, self._lengths, best, following, worths, self._came, self._way,
        )))  # fmt: skip
        ends = np.concatenate([start[np.newaxis], np.tile(start, (self.legs, 1)) if found else self._points()])
        at = np.arange(self.ticks + 1) / _LEG
        return np.stack([np.interp(at, np.arange(self.legs + 1), part) for part in ends.T], axis=-1)

    def _points(self) -> Floats:
        return self.places[self._way[:, 0], self._way[:, 1]]

    def observes(self, way: Floats, paths: Floats) -> Flags:
        """Return which targets are observed on a way at each tick, shape (ticks + 1, targets)."""
        return np.asarray(((way[:, np.newaxis] - paths) ** 2).sum(axis=-1) <= self.reach**2)

    def improved(
        self,
        start: Floats,
        paths: Floats,
        worth: Floats,
        ways: Floats | None,
        rounds: int,
        rng: np.random.Generator,
        land: Callable[[int, Floats, Flags], Land] | None = None,
        decay: float = 1.0,
    ) -> Floats:
        """Return ways for all robots, shape (robots, ticks + 1, 2).

        Parameters
        ----------
        start : ndarray, shape (robots, 2), float64
            Where the robots are.
        paths, worth, decay
            As in `WayArrays`.
        ways : ndarray, shape (robots, ticks + 1, 2), float64, optional
            Ways to improve; robots without one stay where they are, and observe nothing yet.
        rounds : int
            How often each robot is asked for a better way, at most.
        rng : numpy.random.Generator
            For the order of robots.
        land : callable, optional
            ``land(robot, ways, others)`` returns what places are worth, given which targets other robots observe at
            each tick.
        """
        robots, paths = len(start), np.ascontiguousarray(paths)
        is_new = ways is None
        planned = np.repeat(start[:, np.newaxis], self.ticks + 1, axis=1) if ways is None else ways.copy()
        seen = np.array([self.observes(way, paths) for way in planned])
        has_way = np.full(robots, not is_new)
        seen[~has_way] = False
        last = -math.inf
        for number in range(rounds):
            for robot in rng.permutation(robots).tolist():
                others = np.asarray(seen[np.arange(robots) != robot].any(axis=0))
                left = np.where(others, 0.0, worth)
                places = None if land is None else land(robot, planned, others)
                way = self.way(start[robot], paths, left, places, decay)
                now = self.observes(way, paths)
                # Between its ends a way observes less or more than was counted.
                if not has_way[robot] or places is not None or (left * now).sum() >= (left * seen[robot]).sum():
                    planned[robot], seen[robot], has_way[robot] = way, now, True
            total = float((worth * seen.any(axis=0)).sum() / max(worth.sum(), 1e-300))
            if number and total - last < _LEAST_GAIN:
                break
            last = total
        return planned


class Planner(Policy):
    """A team that is steered by a central planner: the base class."""

    def __init__(self) -> None:
        self._world: Any = None

    def attend(self, world: CMOMMT, steps: int) -> None:
        """Plan for a world that has just begun, and in which so many steps will be made."""
        self._world, self._ways = world, np.zeros((0, 0, 2))
        self._tick = self._since = 0
        self._rng = np.random.default_rng(world.seed_used)
        robots = world.robots
        self._plans = Plans(world.arena, float(robots.speed[0]), float(robots.sensing_range[0]), self.looks(steps))

    def looks(self, steps: int) -> int:
        """Return how many ticks a plan looks ahead."""
        return _HORIZON

    def plan(self) -> None:
        """Make or renew the plan, at every few ticks."""
        raise NotImplementedError

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        """Go along the way that is planned."""
        position = np.array(self._world.robots.position)
        if self._tick % _LEG == 0:
            self.plan()
        self._tick += 1
        at = min(self._tick - self._since, self._ways.shape[1] - 1)
        way = self._ways[:, at] - position
        length = np.hypot(*way.T)
        is_still = length < 1e-12
        heading = np.where(is_still[:, np.newaxis], 0.0, way / np.where(is_still, 1.0, length)[:, np.newaxis])
        return Action(heading, length), state

    def _prospects(self, position: Floats, worth: Floats) -> Floats:
        """Return what targets at the end of a plan are worth to a robot at each place, shape (targets, x, y).

        It is observed from the tick at which the robot gets there, and worth less with each tick, as `_certainty` is.
        """
        plans, stays = self._plans, float(_certainty(self._world, np.ones(1))[0])
        away = np.hypot(*np.moveaxis(plans.places - position[:, np.newaxis, np.newaxis], -1, 0))
        found: Floats = np.maximum(away - plans.reach, 0.0)
        found = stays ** (found / plans.speed) * (worth / max(1.0 - stays, 1.0 / _HORIZON))[:, np.newaxis, np.newaxis]
        return found

    def _again(self, paths: Floats, worth: Floats, **more: Any) -> None:
        """Plan anew from the present, beginning with what is left of the last plan."""
        ways = None
        if self._ways.size:
            rest = self._ways[:, self._tick - self._since :]
            ways = np.concatenate([rest, np.repeat(rest[:, -1:], self._tick - self._since, axis=1)], axis=1)
        start = np.array(self._world.robots.position)
        self._ways = self._plans.improved(
            start, paths, worth, ways, _ROUNDS if ways is None else _AGAIN, self._rng, **more
        )
        self._since = self._tick


class Clairvoyant(Planner):
    """A team that knows where all targets will be at all times.

    Attributes
    ----------
    paths : ndarray, shape (steps + 1, targets, 2), float64
        Where the targets are at each tick.
    """

    def looks(self, steps: int) -> int:
        return -(-steps // _LEG) * _LEG

    def attend(self, world: CMOMMT, steps: int) -> None:
        super().attend(world, steps)
        # Targets that walk at random do not depend on robots.
        alone = CMOMMT(**{**world.settings, "policy": "random-walk", "awareness": "none"}, rng=world.seed_used)
        paths = [np.array(alone.targets.position)]
        for _ in range(self._plans.ticks):
            alone.run(1)
            paths.append(np.array(alone.targets.position))
        self.paths = np.array(paths)

    def plan(self) -> None:
        if self._tick == 0:
            worth = np.ones(self.paths.shape[:2])
            # The start is not counted.
            worth[0] = 0.0
            self._again(self.paths, worth)


def _straight_on(arena: Arena, position: Floats, heading: Floats, speed: Floats, ticks: int) -> Floats:
    """Return where bodies will be that go straight on, and off walls, shape (ticks + 1, n, 2)."""
    bodies = bodies_at(np.array(position), np.array(heading))
    bodies.speed[:], bodies.turn_cosine[:] = speed, -2.0
    move, entry = pack_move(arena, bodies, np.zeros((len(position), 2)), np.array(speed)), advance_entry(arena)
    found = [bodies.position.copy()]
    for _ in range(ticks):
        entry(move)
        found.append(bodies.position.copy())
    return np.array(found)


class Informed(Planner):
    """A team that knows where all targets are, and takes them to go straight on."""

    def plan(self) -> None:
        targets, arena = self._world.targets, self._world.arena
        paths = _straight_on(arena, targets.position, targets.heading, targets.speed, self._plans.ticks)
        certainty = _certainty(self._world, np.arange(self._plans.ticks + 1))
        worth, bare = np.repeat(certainty[:, np.newaxis], len(targets), axis=1), np.zeros(self._plans.places.shape[:2])
        prospects = self._prospects(paths[-1], worth[-1])

        def land(robot: int, ways: Floats, others: Flags) -> Land:
            return Land(bare, prospects[~others[-1]].sum(axis=0))

        self._again(paths, worth, land=land)


def _certainty(world: CMOMMT, ticks: npt.NDArray[Any]) -> Floats:
    """Return the probability that a target has not turned after so many ticks."""
    policy = world.targets.policy
    turns = policy.turn_probability if isinstance(policy, RandomWalk) else 0.0
    found: Floats = (1.0 - turns) ** np.asarray(ticks, float)
    return found


class Sharing(Planner):
    """A team that knows only what some robot senses or has sensed, and how many targets there are.

    Targets that are out of sight are taken to go straight on for a while. Then they may be anywhere that has not been
    seen since: a map of where they may be spreads, and is empty where robots sense.
    """

    def attend(self, world: CMOMMT, steps: int) -> None:
        super().attend(world, steps)
        targets, reach = world.targets, self._plans.reach
        self._place, self._heading = np.array(targets.position), np.array(targets.heading)
        # How many ticks ago each was seen; at first nothing is known.
        self._age = np.full(len(targets), _PATIENCE + 1)
        low, high = np.array(world.arena.bounds, float)
        axes = [np.arange(a, b + _COARSE * reach, _COARSE * reach) for a, b in zip(low, high, strict=True)]
        self._map = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        self._is_land = np.asarray(world.arena.contains(self._map), float)
        self._belief = self._is_land / self._is_land.sum()
        # How far places of the map are from each other; and the place of the map next to each place of plans.
        far = [len(axis) - 1 for axis in axes]
        self._away = _COARSE * reach * np.hypot(*np.mgrid[-far[0] : far[0] + 1, -far[1] : far[1] + 1])
        self._nearest = np.ix_(*(
            np.minimum(np.rint((part - axis[0]) / (_COARSE * reach)).astype(int), len(axis) - 1)
            for part, axis in zip(self._plans.axes, axes, strict=True)
        ))  # fmt: skip

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        self._look()
        return super().decide(percept, state, noise)

    def _look(self) -> None:
        """Note what some robot senses now."""
        world, reach = self._world, self._plans.reach
        robots, targets = np.array(world.robots.position), world.targets
        seen = self._sees(robots, np.array(targets.position))
        if self._tick:
            self._place = _straight_on(world.arena, self._place, self._heading, targets.speed, 1)[-1]
        self._age += 1
        # One that is not where it would have gone has turned.
        self._age[self._sees(robots, self._place) & ~seen] = _PATIENCE + 1
        self._age[seen] = 0
        self._place[seen], self._heading[seen] = targets.position[seen], targets.heading[seen]
        around = np.pad(self._belief, 1)
        spread = around[2:, 1:-1] + around[:-2, 1:-1] + around[1:-1, 2:] + around[1:-1, :-2]
        share = min(float(np.max(targets.speed)) / (_COARSE * reach), 0.5) / 6.0
        belief = (self._belief * (1.0 - 4.0 * share) + share * spread) * self._is_land
        belief[self._sees(robots, self._map.reshape(-1, 2)).reshape(belief.shape)] = 0.0
        self._belief = belief / max(belief.sum(), 1e-300)

    def _sees(self, robots: Floats, places: Floats) -> Flags:
        away = ((places[:, np.newaxis] - robots) ** 2).sum(axis=-1)
        return np.asarray((away <= self._plans.reach**2).any(axis=1))

    def plan(self) -> None:
        from scipy.signal import fftconvolve

        world, ticks = self._world, np.arange(self._plans.ticks + 1)
        known = self._age <= _PATIENCE
        paths = _straight_on(
            world.arena, self._place[known], self._heading[known], world.targets.speed[known], self._plans.ticks
        )
        worth = _certainty(world, ticks[:, np.newaxis] + self._age[known])
        hidden, plans = int((~known).sum()), self._plans
        turned = float(_certainty(world, np.ones(1))[0])
        # What may be at a distance is worth less, by the time that it takes to get there.
        later = turned ** (np.maximum(self._away - plans.reach, 0.0) / plans.speed) / max(1.0 - turned, 1.0 / _HORIZON)
        ground, beyond = (
            hidden * np.maximum(fftconvolve(self._belief, kernel, "same"), 0.0)
            for kernel in (_LEG * (self._away <= plans.reach), later)
        )
        prospects, apart = self._prospects(paths[-1], worth[-1]), (1.6 * plans.reach) ** 2
        beyond *= float(turned ** plans.ticks)

        def land(robot: int, ways: Floats, others: Flags) -> Land:
            # Ground to which others go is worth half.
            there = np.delete(ways, robot, axis=0)[:, [len(ticks) // 3, 2 * len(ticks) // 3, -1]].reshape(-1, 2)
            away = ((self._map[..., np.newaxis, :] - there) ** 2).sum(axis=-1)
            share = 0.5 ** (away < apart).sum(axis=-1)
            prospect = (beyond * share)[self._nearest] + prospects[~others[-1]].sum(axis=0)
            return Land((ground * share)[self._nearest], prospect)

        self._again(paths, np.ascontiguousarray(worth), land=land, decay=turned)


#: The team that knows most, to which others are compared.
CEILING = "clairvoyant"
PLANNERS: Mapping[str, type[Planner]] = {"sharing": Sharing, "informed": Informed, "clairvoyant": Clairvoyant}


def planned(policy: str, horizon: int, rng: int | None = None, **settings: Any) -> CMOMMT:
    """Return a world whose robots a central planner steers, or that have a policy of their own.

    Parameters
    ----------
    policy : str
        "clairvoyant", "informed", "sharing", or the name of a policy.
    horizon : int
        The number of steps that will be made.
    rng : int, optional
        The seed.
    **settings
        Settings of a CMOMMT: those in `SETTINGS`, and with a policy of their own all.

    Raises
    ------
    ValueError
        If the planner does not know a setting.
    """
    if policy not in PLANNERS:
        return CMOMMT(policy=policy, rng=rng, **settings)
    for name in settings.keys() - {*SETTINGS}:
        raise ValueError(
            f"{name}={checks.shown(settings[name])}: the planner of {policy!r} does not know it; it takes "
            f"{', '.join(SETTINGS)}"
        )
    planner = PLANNERS[policy]()
    world = CMOMMT(policy=planner, awareness="none", rng=rng, **settings)
    planner.attend(world, horizon)
    return world


def most_covered(targets: Floats, robots: int, reach: float) -> int:
    """Return the largest number of targets that so many discs can cover, wherever they are placed: an exact optimum.

    Parameters
    ----------
    targets : ndarray, shape (n, 2), float64
        Where the targets are [length].
    robots : int
        The number of discs.
    reach : float
        Their radius [length].

    Notes
    -----
    A disc can be moved until two of the targets that it covers lie on its edge, or it covers one. So the centres of
    these discs are enough: which of them to take is a maximum coverage problem, solved as an integer programme.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    if len(targets) <= robots:
        return len(targets)
    centres = [*targets]
    for one, other in combinations(targets, 2):
        way = other - one
        square = float(way @ way)
        if 0.0 < square <= 4.0 * reach**2:
            aside = math.sqrt(max(reach**2 / square - 0.25, 0.0)) * np.array([-way[1], way[0]])
            centres += [one + 0.5 * way + aside, one + 0.5 * way - aside]
    away = ((np.array(centres)[:, np.newaxis] - targets) ** 2).sum(axis=-1)
    # Rounding must not make it less than what is possible.
    covered = np.unique(away <= reach**2 * (1.0 + 1e-9), axis=0)
    inside = covered[:, np.newaxis] <= covered[np.newaxis]
    covered = covered[inside.all(axis=-1).sum(axis=1) == 1]
    discs, n = covered.shape
    # First which discs are taken, then which targets are covered.
    goal = np.concatenate([np.zeros(discs), -np.ones(n)])
    limits = np.block([[covered.T.astype(float), -np.eye(n)], [-np.ones((1, discs)), np.zeros((1, n))]])
    least = np.concatenate([np.zeros(n), [-float(robots)]])
    found = milp(goal, constraints=LinearConstraint(limits, least), integrality=np.ones(discs + n), bounds=Bounds(0, 1))
    if not found.success:
        raise RuntimeError(f"most_covered: the solver stopped: {found.message}")
    return round(-float(found.fun))


class Observed(NamedTuple):
    """What is measured of a run: the observed fraction, and of a clairvoyant team what is possible at most."""

    observed_fraction: float
    teleport: float


# Every so many ticks.
_SAMPLED = 20


def measure(world: Any, steps: int) -> Observed:
    """Run a world, and measure it."""
    with warnings.catch_warnings():
        # That a planner is Python is no news.
        warnings.simplefilter("ignore", UserWarning)
        world.run(steps)
    planner, most = world.robots.policy, math.nan
    if isinstance(planner, Clairvoyant):
        instants = planner.paths[_SAMPLED : steps + 1 : _SAMPLED]
        reach, robots = planner._plans.reach, len(world.robots)
        covered = [most_covered(one, robots, reach) for one in instants]
        most = sum(covered) / len(world.targets) / len(covered) if covered else math.nan
    return Observed(world.observed_fraction, most)


#: The degree of awareness of policies that are not made for "pairwise".
_DEGREES = {"evolved": "ring"}


def compare(
    cells: Iterable[tuple[int, int, float]],
    teams: Sequence[str],
    *,
    runs: int,
    steps: int,
    seed: int,
    pool: Executor | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Run teams and ceilings on the same worlds.

    Parameters
    ----------
    cells : iterable of (int, int, float)
        Numbers of robots and targets, and the radius of the arena.
    teams : sequence of str
        Names of policies, and of `PLANNERS`.
    runs, steps : int
        The runs of each cell and team, and their steps.
    seed : int
        The root of the seeds.
    pool, progress
        As for `run_all`.

    Returns
    -------
    DataFrame
        One row for each run: robots, targets, radius, team, replicate, seed, observed_fraction and, of a clairvoyant
        team, teleport.
    """
    planned_runs = []
    for (robots, targets, radius), team, replicate in product(cells, teams, range(runs)):
        cell = {"robots": robots, "targets": targets, "radius": radius}
        of_policy = {"awareness": _DEGREES[team]} if team in _DEGREES else {}
        run_seed = model_seed(seed, replicate, robots, targets, radius)
        run = Run({**cell, **of_policy, "policy": team, "horizon": steps}, run_seed, steps, measure, planned)
        planned_runs.append(({**cell, "team": team, "replicate": replicate, "seed": run_seed}, run))
    return run_rows(planned_runs, pool, progress=progress)


class Standing(NamedTuple):
    """What a team observes in a cell [%].

    Attributes
    ----------
    robots, radius, team
        The cell and the team; "teleport" for what no team can pass.
    observed : Interval
        Mean with its 95 % interval.
    more : Interval
        The paired difference to the first team.
    share : float
        The share of the way from the first team to a clairvoyant one; NaN without a clairvoyant team.
    """

    robots: int
    radius: float
    team: str
    observed: Interval
    more: Interval
    share: float


def standings(table: pd.DataFrame) -> list[Standing]:
    """Return what each team observes in each cell; the first team is the reference."""
    found = []
    of_cell: Any
    for of_cell, cell in table.groupby(["robots", "radius"], sort=False):
        of_team = cell.groupby("team", sort=False)["observed_fraction"]
        fractions = {str(team): 100.0 * runs.to_numpy() for team, runs in of_team}
        if CEILING in fractions:
            fractions["teleport"] = 100.0 * cell.loc[cell["team"] == CEILING, "teleport"].to_numpy()
        first = next(iter(fractions.values()))
        way = float((fractions[CEILING] - first).mean()) if CEILING in fractions else math.nan
        for team, observed in fractions.items():
            more = interval_of(observed - first)
            share = more.mean / way if way > 0.0 else math.nan
            found.append(Standing(of_cell[0], of_cell[1], team, interval_of(observed), more, share))
    return found
