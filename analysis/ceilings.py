"""Ceilings of CMOMMT: what a team could observe at most if it knew more than a robot can.

`most_covered` is proven: no policy can pass it. The others are teams of a central planner, which move as robots do, so
each shows what is possible at least. `Clairvoyant` knows all ways of all targets in advance, `Informed` where all
targets are now, `Sharing` only what some robot senses or has sensed.

A plan is improved robot by robot: each gets the way on which it observes most of what the others do not, by dynamic
programming over places and instants, until no robot finds a better one. That is a local optimum.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.resolve import policy_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import minus
from teamsight.analysis.runs.checkpoint import JSON, Checkpoint, Codec
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats.paired import Interval, half_width, interval_of
from teamsight.core import checks
from teamsight.core.component import assignments
from teamsight.core.kernel import Entry, Record, inlined
from teamsight.core.references import from_file
from teamsight.core.table import Table
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.interface import Action, Percept, Policy
from teamsight.policies.registry import POLICIES, policy_named
from teamsight.world.arena import Arena
from teamsight.world.motion import advance_entry, bodies_at, pack_move

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

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
# By what the worth of going to a target shrinks with each tick that it takes after a plan: to one whose place is known,
# and to a lost one. These and the next were chosen on worlds with the root seed 77.
_FADES = 0.97, 0.99
# So many points stand for a lost target, and every so many of them where a plan ends, when it is worth so much to be
# where it is.
_POINTS, _EVERY, _PULL = 100, 5, 8.0
# So many points show where a target that is known may be once it has turned; they count less, since a robot sees the
# turn when it comes.
_FEW, _TURNED, _TURNED_PULL = 20, 0.5, 4.0
_MOST_PLACES = 2_000_000
#: What `planned` takes of the settings of a CMOMMT.
SETTINGS = ("robots", "targets", "radius", "sensing_range", "robot_speed", "target_speed", "uniform_target_speed")


class WayArrays(NamedTuple):
    """The record of the search for a robot's best way.

    Arrays over places have a margin of `_LEG` places that are not in the arena.

    Attributes
    ----------
    start : ndarray, shape (2,), float64
        Where it is.
    paths : ndarray, shape (ticks, targets, 2), float64
        Where targets will be, from now on.
    worth : ndarray, shape (ticks, targets), float64
        What it is worth to observe them; 0 if others do.
    cloud : ndarray, shape (legs, points, 2), float64
        Where lost targets may be at the end of each leg.
    chance : ndarray, shape (legs, points), float64
        What it is worth to sense these points.
    far : ndarray, shape (goals, 2), float64
        What is there to go to when the plan ends.
    pull : ndarray, shape (goals,), float64
        What it is worth to be there.
    rest : ndarray, shape (goals,), float64
        Which share of that another robot gets.
    kind : ndarray, shape (goals,), int64
        The row of `fade` that holds for it.
    fade : ndarray, shape (kinds, distances), float64
        The share of the worth that is left at each distance, in places.
    wall : ndarray, shape (x, y), float64
        0 for the places in the arena, −∞ for others.
    moves : ndarray, shape (moves, 2), int64
        The ways of one leg, in places; the shortest first.
    low : ndarray, shape (2,), float64
        The place with the indices (0, 0).
    lengths : ndarray, shape (3,), float64
        Spacing, sensing range, and the way of one leg.
    worths : ndarray, shape (x, y), float64
        Room to work in.
    best : ndarray, shape (legs, x, y), float64
        Room to work in: what the best way to a place is worth.
    way : ndarray, shape (legs, 2), int64
        Written: the indices of the places at the end of each leg.
    """

    start: Annotated[Floats, 2]
    paths: Annotated[Floats, "ticks", "targets", 2]
    worth: Annotated[Floats, "ticks", "targets"]
    cloud: Annotated[Floats, "legs", "points", 2]
    chance: Annotated[Floats, "legs", "points"]
    far: Annotated[Floats, "goals", 2]
    pull: Annotated[Floats, "goals"]
    rest: Annotated[Floats, "goals"]
    kind: Annotated[Integers, "goals"]
    fade: Annotated[Floats, "kinds", "distances"]
    wall: Annotated[Floats, "x", "y"]
    moves: Annotated[Integers, "moves", 2]
    low: Annotated[Floats, 2]
    lengths: Annotated[Floats, 3]
    worths: Annotated[Floats, "x", "y"]
    best: Annotated[Floats, "legs", "x", "y"]
    way: Annotated[Integers, "legs", 2]


WAY = Record(WayArrays)
way_at = WAY.at


@inlined
def _add_disc(here: Any, x: float, y: float, worth: float, left: int, right: int, lower: int, upper: int) -> None:
    """Add a worth to all places of a box from which a point is sensed; at the ends of each row alone, to be summed."""
    spacing, reach = here.lengths[0], here.lengths[1]
    x = (x - here.low[0]) / spacing
    y = (y - here.low[1]) / spacing
    square = reach / spacing * (reach / spacing)
    for i in range(max(left, int(x - reach / spacing)), min(right, int(x + reach / spacing) + 2)):
        rest = square - (i - x) * (i - x)
        if rest >= 0.0:
            half = math.sqrt(rest)
            first = max(lower, math.ceil(y - half))
            last = min(upper - 1, math.floor(y + half))
            if first <= last:
                here.worths[i, first] += worth
                here.worths[i, last + 1] -= worth


@inlined
def _add_prospects(here: Any, left: int, right: int, lower: int, upper: int) -> None:
    """Add what the places of a box are worth at the end, to blocks of as many places as a leg is long."""
    spacing, most = here.lengths[0], here.fade.shape[1] - 1
    for i in range(left, right, _LEG):
        for j in range(lower, upper, _LEG):
            worth = 0.0
            for goal in range(here.far.shape[0]):
                x = here.far[goal, 0] - here.low[0] - (i + _LEG // 2) * spacing
                y = here.far[goal, 1] - here.low[1] - (j + _LEG // 2) * spacing
                share = here.fade[here.kind[goal], min(int(math.sqrt(x * x + y * y) / spacing), most)]
                worth += here.pull[goal] * max(share - here.rest[goal], 0.0)
            for a in range(i, min(i + _LEG, right)):
                for b in range(j, min(j + _LEG, upper)):
                    here.worths[a, b] += worth


@inlined
def _box(here: Any, leg: int) -> tuple[int, int, int, int]:
    """Return the indices of the box of places, from left to right and from lower to upper, that a leg can end in."""
    _, wide, high = here.best.shape
    spacing, stride = here.lengths[0], here.lengths[2]
    column = int(np.rint((here.start[0] - here.low[0]) / spacing))
    row = int(np.rint((here.start[1] - here.low[1]) / spacing))
    most = int((leg + 1) * stride / spacing) + 1
    left, right = max(column - most, _LEG), min(column + most + 1, wide - _LEG)
    lower, upper = max(row - most, _LEG), min(row + most + 1, high - _LEG)
    return left, right, lower, upper


@inlined
def _add_worths(here: Any, leg: int, left: int, right: int, lower: int, upper: int) -> None:
    """Write what it is worth to be at each place of a box at the end of a leg."""
    ticks, targets = here.worth.shape
    for i in range(left, right):
        for j in range(lower, upper + 1):
            here.worths[i, j] = 0.0
    middle = (leg + 1) * _LEG
    for tick in range(middle - (_LEG - 1) // 2, min(middle + _LEG // 2 + 1, ticks)):
        for m in range(targets):
            if here.worth[tick, m] > 0.0:
                x, y = here.paths[tick, m, 0], here.paths[tick, m, 1]
                _add_disc(here, x, y, here.worth[tick, m], left, right, lower, upper)
    for m in range(here.cloud.shape[1]):
        if here.chance[leg, m] > 0.0:
            x, y = here.cloud[leg, m, 0], here.cloud[leg, m, 1]
            _add_disc(here, x, y, here.chance[leg, m], left, right, lower, upper)
    for i in range(left, right):
        total = 0.0
        for j in range(lower, upper):
            total += here.worths[i, j]
            here.worths[i, j] = total
    if leg == here.best.shape[0] - 1 and here.far.shape[0] > 0:
        _add_prospects(here, left, right, lower, upper)


@inlined
def _go_on(here: Any, leg: int, left: int, right: int, lower: int, upper: int) -> None:
    """Write what the best way to each place of a box is worth, from those of the leg before."""
    _, wide, high = here.best.shape
    spacing, stride = here.lengths[0], here.lengths[2]
    # Of the next leg a place may begin beyond the box.
    for i in range(max(left - 2 * _LEG, 0), min(right + 2 * _LEG, wide)):
        for j in range(max(lower - 2 * _LEG, 0), min(upper + 2 * _LEG, high)):
            here.best[leg, i, j] = -np.inf
    if leg == 0:
        for i in range(left, right):
            for j in range(lower, upper):
                x = i * spacing + here.low[0] - here.start[0]
                y = j * spacing + here.low[1] - here.start[1]
                if x * x + y * y <= stride * stride:
                    here.best[0, i, j] = here.worths[i, j] + here.wall[i, j]
        return
    for i in range(left, right):
        into = here.best[leg, i]
        for k in range(here.moves.shape[0]):
            came = here.best[leg - 1, i - here.moves[k, 0]]
            by = here.moves[k, 1]
            for j in range(lower, upper):
                into[j] = max(into[j], came[j - by])
        for j in range(lower, upper):
            into[j] += here.worths[i, j] + here.wall[i, j]


@inlined
def _trace(here: Any, at_x: int, at_y: int) -> None:
    """Write the best way to a place, from its end to its start."""
    for leg in range(here.best.shape[0] - 1, -1, -1):
        here.way[leg, 0] = at_x
        here.way[leg, 1] = at_y
        if leg > 0:
            by, best = 0, -np.inf
            for k in range(here.moves.shape[0]):
                worth = here.best[leg - 1, at_x - here.moves[k, 0], at_y - here.moves[k, 1]]
                if worth > best:
                    by, best = k, worth
            at_x -= here.moves[by, 0]
            at_y -= here.moves[by, 1]


def _find_way(address: int) -> int:
    here = way_at(address)
    legs = here.best.shape[0]
    for leg in range(legs):
        left, right, lower, upper = _box(here, leg)
        _add_worths(here, leg, left, right, lower, upper)
        _go_on(here, leg, left, right, lower, upper)
    left, right, lower, upper = _box(here, legs - 1)
    best, at_x, at_y = -np.inf, left, lower
    for i in range(left, right):
        for j in range(lower, upper):
            if here.best[legs - 1, i, j] > best:
                best, at_x, at_y = here.best[legs - 1, i, j], i, j
    # A robot that no place is near enough to stays where it is.
    if best < 0.0:
        return 1
    _trace(here, at_x, at_y)
    return 0


FIND_WAY = Entry(_find_way)


class Lost(NamedTuple):
    """Where lost targets may be; see `WayArrays`.

    Attributes
    ----------
    cloud : ndarray, shape (legs, points, 2), float64
        Places at the end of each leg.
    chance : ndarray, shape (legs, points), float64
        What it is worth to sense them.
    pull : ndarray, shape (points,), float64
        What it is worth to be there after the plan.
    """

    cloud: Floats
    chance: Floats
    pull: Floats


class Far(NamedTuple):
    """What robots can go to after the plan; see `WayArrays`."""

    far: Floats
    pull: Floats
    rest: Floats
    kind: Integers


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
        low, high = np.array(arena.bounds, float)
        shape = tuple(int(side / speed) + 1 + 2 * _LEG for side in high - low)
        if math.prod(shape) * self.legs > 400 * _MOST_PLACES or math.prod(shape) > _MOST_PLACES:
            raise ValueError(
                f"robot_speed={speed:g}: in {arena} the planner has {math.prod(shape):,} places, which is too many; "
                "give a higher speed, a smaller arena or fewer steps"
            )
        self._low = low - _LEG * speed
        axes = [start + speed * np.arange(size) for start, size in zip(self._low, shape, strict=True)]
        self.places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        self._wall = np.where(arena.contains(self.places), 0.0, -np.inf)
        for side in (self._wall[:_LEG], self._wall[-_LEG:], self._wall[:, :_LEG], self._wall[:, -_LEG:]):
            side[:] = -np.inf
        around = np.array([
            (i, j) for i in range(-_LEG, _LEG + 1) for j in range(-_LEG, _LEG + 1) if i * i + j * j <= _LEG**2
        ])  # fmt: skip
        self._moves = around[np.argsort((around**2).sum(axis=1), kind="stable")].astype(np.int64)
        self._lengths = np.array([speed, reach, speed * _LEG * (1.0 + 1e-12)])
        far = np.maximum(np.arange(sum(shape)) - reach / speed, 0.0)
        self._fade = np.array([decay**far for decay in _FADES])
        self._worths, self._best = np.zeros(shape), np.zeros((self.legs, *shape))
        self._way = np.zeros((self.legs, 2), np.int64)
        self.none = Lost(np.zeros((self.legs, 0, 2)), np.zeros((self.legs, 0)), np.zeros(0))
        self.nothing = Far(np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0, np.int64))

    def way(
        self, start: Floats, paths: Floats, worth: Floats, lost: Lost | None = None, far: Far | None = None
    ) -> Floats:
        """Return the best way of one robot, shape (ticks + 1, 2); parameters are as in `WayArrays`."""
        cloud, chance, _ = lost or self.none
        goals, pull, rest, kind = far or self.nothing
        found = FIND_WAY(WAY.pack(WayArrays(
            np.ascontiguousarray(start), paths, worth, cloud, chance, goals, pull, rest, kind, self._fade, self._wall,
            self._moves, self._low, self._lengths, self._worths, self._best, self._way,
        )))  # fmt: skip
        ends = np.concatenate([start[np.newaxis], np.tile(start, (self.legs, 1)) if found else self._points()])
        at = np.arange(self.ticks + 1) / _LEG
        return np.stack([np.interp(at, np.arange(self.legs + 1), part) for part in ends.T], axis=-1)

    def _points(self) -> Floats:
        return self.places[self._way[:, 0], self._way[:, 1]]

    def observes(self, way: Floats, paths: Floats) -> Flags:
        """Return which targets are observed on a way at each tick, shape (ticks + 1, targets)."""
        x, y = paths[..., 0] - way[:, :1], paths[..., 1] - way[:, 1:]
        return np.asarray(x * x + y * y <= self.reach**2)

    def improved(
        self,
        start: Floats,
        paths: Floats,
        worth: Floats,
        ways: Floats | None,
        rounds: int,
        rng: np.random.Generator,
        lost: Lost | None = None,
        after: float = 0.0,
    ) -> Floats:
        """Return ways for all robots, shape (robots, ticks + 1, 2).

        Parameters
        ----------
        start : ndarray, shape (robots, 2), float64
            Where the robots are.
        paths, worth
            As in `WayArrays`.
        ways : ndarray, shape (robots, ticks + 1, 2), float64, optional
            Ways to improve; robots without one stay where they are, and observe nothing yet.
        rounds : int
            How often each robot is asked for a better way, at most.
        rng : numpy.random.Generator
            For the order of robots.
        lost : Lost, optional
            Where lost targets may be.
        after : float
            How much it is worth to observe a target after the plan, compared to its last tick.
        """
        robots, paths, lost = len(start), np.ascontiguousarray(paths), lost or self.none
        has_way = np.full(robots, ways is not None)
        planned = np.repeat(start[:, np.newaxis], self.ticks + 1, axis=1) if ways is None else ways.copy()
        all_far = self.nothing
        if after:
            pull = np.concatenate([after * worth[-1], lost.pull])
            kind = (np.arange(len(pull)) >= paths.shape[1]).astype(np.int64)
            all_far = Far(np.concatenate([paths[-1], lost.cloud[-1]]), pull, np.zeros(len(pull)), kind)

        def sees(way: Floats) -> tuple[Flags, Flags, Floats]:
            away = np.hypot(all_far.far[:, 0] - way[-1, 0], all_far.far[:, 1] - way[-1, 1]) / self.speed
            share = self._fade[all_far.kind, np.minimum(away.astype(np.int64), self._fade.shape[1] - 1)]
            return self.observes(way, paths), self.observes(way[_LEG::_LEG], lost.cloud), share

        seen, near, shares = (np.array(part) for part in zip(*map(sees, planned), strict=True))
        seen[~has_way], near[~has_way], shares[~has_way] = False, False, 0.0
        # How many robots sense each.
        counts, nears = seen.sum(axis=0), near.sum(axis=0)
        last = -math.inf
        for number in range(rounds):
            for robot in rng.permutation(robots).tolist():
                counts -= seen[robot]
                nears -= near[robot]
                left, chance = np.where(counts > 0, 0.0, worth), np.where(nears > 0, 0.0, lost.chance)
                far, goals = all_far, np.zeros(0, bool)
                if after:
                    # A robot that alone observes a target is not free for others.
                    is_free = (np.arange(robots) != robot) & ~(seen[:, -1] & (counts[-1] == 1)).any(axis=1)
                    goals = np.concatenate([counts[-1] == 0, nears[-1] == 0]) & (all_far.pull > 0.0)
                    rest = shares[is_free].max(axis=0, initial=0.0)
                    far = Far(all_far.far[goals], all_far.pull[goals], rest[goals], all_far.kind[goals])
                way = self.way(start[robot], paths, left, Lost(lost.cloud, chance, lost.pull), far)
                now = sees(way)
                gains = [
                    float((left * one[0]).sum() + (chance * one[1]).sum())
                    + float((far.pull * np.maximum(one[2][goals] - far.rest, 0.0)).sum())
                    for one in (now, (seen[robot], near[robot], shares[robot]))
                ]
                # Between its ends a way observes less or more than was counted.
                if not has_way[robot] or gains[0] >= gains[1]:
                    planned[robot], has_way[robot] = way, True
                    seen[robot], near[robot], shares[robot] = now
                counts += seen[robot]
                nears += near[robot]
            total = float((worth * (counts > 0)).sum() + (lost.chance * (nears > 0)).sum())
            total /= max(float(worth.sum() + lost.chance.sum()), 1e-300)
            if number and total - last < _LEAST_GAIN:
                break
            last = total
        return planned


class Planner(Policy):
    """A team that is steered by a central planner: the base class.

    Attributes
    ----------
    has_rest : bool
        Whether the run goes on after the end of a plan.
    """

    has_rest = True

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

    def _again(self, paths: Floats, worth: Floats, lost: Lost | None = None) -> None:
        """Plan anew from the present, beginning with what is left of the last plan."""
        ways = None
        if self._ways.size:
            rest = self._ways[:, self._tick - self._since :]
            ways = np.concatenate([rest, np.repeat(rest[:, -1:], self._tick - self._since, axis=1)], axis=1)
        start, rounds = np.array(self._world.robots.position), _ROUNDS if ways is None else _AGAIN
        # A target that goes straight on for ever is observed for as long as a plan looks ahead.
        after = self.has_rest / max(1.0 - _stays(self._world), 1.0 / _HORIZON)
        self._ways = self._plans.improved(start, paths, worth, ways, rounds, self._rng, lost, after)
        self._since = self._tick


class Clairvoyant(Planner):
    """A team that knows where all targets will be at all times.

    Attributes
    ----------
    paths : ndarray, shape (steps + 1, targets, 2), float64
        Where the targets are at each tick.
    """

    has_rest = False

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


def _stays(world: CMOMMT) -> float:
    """Return the probability that a target does not turn in a tick."""
    policy = world.targets.policy
    return 1.0 - policy.turn_probability if isinstance(policy, RandomWalk) else 1.0


class Walkers:
    """Bodies that walk as targets do; only those that are active.

    Parameters
    ----------
    world : CMOMMT
        The world of the targets.
    position, heading : ndarray, shape (n, 2), float64
        Where they begin.
    speed : ndarray, shape (n,), float64
        Their speeds [length/tick].
    """

    def __init__(self, world: CMOMMT, position: Floats, heading: Floats, speed: Floats) -> None:
        self.bodies, self._stays = bodies_at(position, heading), _stays(world)
        self.has_turned = np.zeros(len(position), bool)
        self.bodies.turn_cosine[:], self.bodies.speed[:] = -2.0, speed
        self._aim = np.zeros_like(position)
        self._move = pack_move(world.arena, self.bodies, self._aim, np.array(speed), has_inactive=True)
        self._advance = advance_entry(world.arena)

    def walk(self, rng: np.random.Generator | None, ticks: int = 1) -> None:
        """Let them walk for some ticks, and turn before the first or not at all; without a generator straight on."""
        if rng is not None:
            turned = np.flatnonzero(rng.random(len(self._aim)) >= self._stays**ticks)
            self._aim[turned] = _directions(rng, len(turned))
            self.has_turned[turned] = True
        for _ in range(ticks):
            self._advance(self._move)
            self._aim[:] = 0.0


def _straight_on(world: CMOMMT, ticks: int, which: Flags | slice = slice(None)) -> tuple[Floats, Floats]:
    """Return where targets will be that do not turn, and the probability of that, for 0 to so many ticks."""
    targets = world.targets
    walkers = Walkers(world, targets.position[which], targets.heading[which], targets.speed[which])
    paths = [walkers.bodies.position.copy()]
    for _ in range(ticks):
        walkers.walk(None)
        paths.append(walkers.bodies.position.copy())
    certainty = _stays(world) ** np.arange(ticks + 1.0)
    return np.array(paths), np.repeat(certainty[:, np.newaxis], len(paths[0]), axis=1)


def _foreseen(
    world: CMOMMT, legs: int, rng: np.random.Generator, known: Flags, points: Table | None = None
) -> tuple[Floats, Floats, Lost]:
    """Return where targets may be: paths and worth of those that are known, and clouds of the others and of these.

    Parameters
    ----------
    world : CMOMMT
        The world of the targets.
    legs : int
        How far to look ahead.
    rng : numpy.random.Generator
        What decides where targets turn.
    known : ndarray, shape (targets,), bool
        The targets whose places are known.
    points : Table, optional
        `_POINTS` bodies for each target; those of targets that are not known are where these may be.
    """
    targets, few, stays = world.targets, np.repeat(np.flatnonzero(known), _FEW), _stays(world)
    position, heading, speed = targets.position[few], targets.heading[few], targets.speed[few]
    if points is not None:
        lost = np.repeat(~known, _POINTS)
        position = np.concatenate([position, points.position[lost]])
        heading = np.concatenate([heading, points.heading[lost]])
        speed = np.concatenate([speed, points.speed[lost]])
    is_lost, walkers = np.arange(len(position)) >= len(few), Walkers(world, position, heading, speed)
    cloud, chance = np.zeros((legs, len(position), 2)), np.zeros((legs, len(position)))
    for leg in range(legs):
        walkers.walk(rng, _LEG)
        cloud[leg] = walkers.bodies.position
        # As long as a target goes straight on, it is on its path.
        sooner = stays ** (_LEG * (leg + 1.0))
        chance[leg] = _LEG * np.where(is_lost, sooner / _POINTS, walkers.has_turned * _TURNED / _FEW)
    pull = _EVERY * np.where(is_lost, _PULL / _POINTS, walkers.has_turned * _TURNED_PULL / _FEW)
    pull[np.arange(len(pull)) % _EVERY > 0] = 0.0
    return *_straight_on(world, legs * _LEG, known), Lost(cloud, chance, pull)


class Informed(Planner):
    """A team that knows where all targets are, and takes them to go straight on."""

    def plan(self) -> None:
        self._again(*_foreseen(self._world, self._plans.legs, self._rng, np.full(len(self._world.targets), True)))


def _directions(rng: np.random.Generator, n: int) -> Floats:
    angle = rng.uniform(-np.pi, np.pi, n)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


class Sharing(Planner):
    """A team that knows only what some robot senses or has sensed, and how many targets there are.

    Where a target may be that is out of sight is a cloud of points, which walk as it does: it begins where it was seen
    last, and has no point where robots sense.
    """

    def attend(self, world: CMOMMT, steps: int) -> None:
        super().attend(world, steps)
        n = len(world.targets)
        # Which targets were sensed at the last tick, and where.
        self._known, self._position, self._heading = np.zeros(n, bool), np.zeros((n, 2)), np.zeros((n, 2))
        self._luck = np.random.default_rng([world.seed_used, 1])
        self._clouds = Walkers(
            world, self._anywhere(n * _POINTS), _directions(self._luck, n * _POINTS),
            np.repeat(np.array(world.targets.speed), _POINTS),
        )  # fmt: skip

    def _anywhere(self, n: int) -> Floats:
        """Return places in the arena, uniformly distributed."""
        arena, found = self._world.arena, np.zeros((0, 2))
        low, high = np.array(arena.bounds, float)
        while len(found) < n:
            places = low + (high - low) * self._luck.random((2 * n, 2))
            found = np.concatenate([found, places[arena.contains(places)]])
        return found[:n]

    def _scattered(self, target: int, robots: Floats) -> tuple[Floats, Floats]:
        """Return places and headings where a target may be that is at none of its points."""
        heading = _directions(self._luck, 4 * _POINTS)
        if self._known[target]:
            # It has turned.
            places = self._position[target] + float(self._world.targets.speed[target]) * heading
        else:
            places = self._anywhere(4 * _POINTS)
        free = np.flatnonzero(self._world.arena.contains(places) & ~self._sees(robots, places))
        if not len(free):
            return self._anywhere(_POINTS), heading[:_POINTS]
        chosen = self._luck.choice(free, _POINTS)
        return places[chosen], heading[chosen]

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        self._look()
        return super().decide(percept, state, noise)

    def _look(self) -> None:
        """Note what some robot senses now."""
        targets, points = self._world.targets, self._clouds.bodies
        position, heading = points.position.reshape(-1, _POINTS, 2), points.heading.reshape(-1, _POINTS, 2)
        robots = np.array(self._world.robots.position)
        seen = self._sees(robots, np.array(targets.position))
        if self._tick:
            lost = self._known & ~seen
            position[lost], heading[lost] = self._position[lost, np.newaxis], self._heading[lost, np.newaxis]
            points.active[:] = np.repeat(~seen, _POINTS)
            self._clouds.walk(self._luck)
        for target in np.flatnonzero(~seen).tolist():
            sensed = self._sees(robots, position[target])
            if sensed.all():
                position[target], heading[target] = self._scattered(target, robots)
            elif sensed.any():
                # What remains is likelier by as much.
                chosen = self._luck.choice(np.flatnonzero(~sensed), int(sensed.sum()))
                position[target, sensed], heading[target, sensed] = position[target, chosen], heading[target, chosen]
        self._known = seen
        self._position[seen], self._heading[seen] = targets.position[seen], targets.heading[seen]

    def _sees(self, robots: Floats, places: Floats) -> Flags:
        x, y = places[:, :1] - robots[:, 0], places[:, 1:] - robots[:, 1]
        return np.asarray((x * x + y * y <= self._plans.reach**2).any(axis=1))

    def plan(self) -> None:
        self._again(*_foreseen(self._world, self._plans.legs, self._luck, self._known, self._clouds.bodies))


#: The team that knows most, to which others are compared.
CEILING = "clairvoyant"
PLANNERS: Mapping[str, type[Planner]] = {"sharing": Sharing, "informed": Informed, "clairvoyant": Clairvoyant}


def _is_planner(policy: object) -> bool:
    return isinstance(policy, str) and policy in PLANNERS


def planned(policy: Any, horizon: int, rng: int | None = None, **settings: Any) -> CMOMMT:
    """Return a world whose robots a central planner steers, or that have a policy of their own.

    Parameters
    ----------
    policy : str or Policy
        "clairvoyant", "informed", "sharing", or a policy.
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
    if not _is_planner(policy):
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


def _observed_in(content: bytes) -> Observed:
    return Observed(*(math.nan if one is None else one for one in json.loads(content)))


#: Conversion for a checkpoint; JSON has no NaN.
OBSERVED = Codec(
    lambda found: JSON.encode([None if math.isnan(one) else one for one in found]), _observed_in
)
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
    if isinstance(planner, Planner):
        # A world and its planner refer to each other, so that many runs would keep this memory for long.
        del planner._plans
    return Observed(world.observed_fraction, most)


#: The degree of awareness of policies that are made for another than "pairwise", though they take that too.
_DEGREES = {"adaptive-forces": "ring", "evolved": "ring", "group-forces": "ring"}
#: The strongest A-CMOMMT that docs/evolved.md found, as a team.
STRONGEST = "a-cmommt:idle=wander,idle_when=no-force,weights=shared,turn_probability=0,gain=4"


# A step of a planner takes so many of a compiled policy's. So the runner puts a run of usual length into a chunk of its
# own, and keeps it when it is made.
_PLANNING = 2000.0


@dataclass(frozen=True)
class PlannedRun(Run):
    """A run of `planned`; what a planner takes decides how work is divided, and how much is left."""

    @property
    def cost(self) -> float:
        return super().cost * (_PLANNING if _is_planner(self.parameters["policy"]) else 1.0)


#: Degrees of awareness that a policy is given if its user names none: the first that fits.
_TRIED = ("pairwise", "none", "ring", "shared", "nearest")


def fitting(made: Any) -> str:
    """Return the first degree of awareness that a policy takes; ValueError if it takes none of them."""
    refused: list[Exception] = []
    for name in _TRIED:
        try:
            CMOMMT(policy=made, awareness=name, rng=0).close()
        except ValueError as error:
            refused.append(error)
        else:
            return name
    raise refused[0]


def team_of(text: str) -> dict[str, Any]:
    """Return the settings of a team: a policy, with options after a colon.

    Parameters
    ----------
    text : str
        A name, "module:Class" or "file.py:Class", and options: "a-cmommt:gain=4,idle=wander", "my.py:Mine:gain=4".

    Raises
    ------
    TypeError, ValueError
        If there is no such policy, or it has no such option.
    """
    policy, _, options = text.partition(":")
    is_own = policy not in PLANNERS and not POLICIES.is_built_in(policy) and ":" in text
    if is_own and "=" not in (name := options.partition(":")[0]):
        policy, options = from_file(f"{policy}:{name}"), options[len(name) + 1 :]
    found: dict[str, Any] = {"policy": policy}
    if options:
        found["policy_options"] = assignments(policy, options.split(","))
    if policy in PLANNERS:
        return found
    if not POLICIES.is_built_in(policy):
        # As an object its code is part of what runs are kept by.
        made = policy_of(policy, found.get("policy_options"))
        return {"policy": made, "awareness": fitting(made)}
    degree = _DEGREES.get(policy) or policy_named(policy, found.get("policy_options")).degree
    return found | ({"awareness": degree} if degree else {})


def compare(
    cells: Iterable[tuple[int, int, float]],
    teams: Sequence[str] | Mapping[str, Mapping[str, Any]],
    *,
    runs: int,
    steps: int,
    seed: int,
    pool: Executor | None = None,
    progress: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
) -> pd.DataFrame:
    """Run teams and ceilings on the same worlds.

    Parameters
    ----------
    cells : iterable of (int, int, float)
        Numbers of robots and targets, and the radius of the arena.
    teams : sequence of str, or mapping of str to mapping
        Policies as for `team_of`, and names of `PLANNERS`; or the settings of each team by its name.
    runs, steps : int
        The runs of each cell and team, and their steps.
    seed : int
        The root of the seeds.
    pool, progress, checkpoint
        As for `run_all`.

    Returns
    -------
    DataFrame
        One row for each run: robots, targets, radius, team, replicate, seed, observed_fraction and, of a clairvoyant
        team, teleport.
    """
    settings = dict(teams) if isinstance(teams, Mapping) else {team: team_of(team) for team in teams}
    planned_runs = []
    for (robots, targets, radius), team, replicate in product(cells, settings, range(runs)):
        cell = {"robots": robots, "targets": targets, "radius": radius}
        run_seed = model_seed(seed, replicate, robots, targets, radius)
        run = PlannedRun({**cell, **settings[team], "horizon": steps}, run_seed, steps, measure, planned)
        planned_runs.append(({**cell, "team": team, "replicate": replicate, "seed": run_seed}, run))
    return run_rows(planned_runs, pool, progress=progress, checkpoint=checkpoint)


#: The name of the files that hold results.
RESULTS = "ceilings"
# Ceilings are lines, from what can be reached by radio up to what nobody passes.
_LINES = {"sharing": "-.", "informed": (0, (1, 1)), "clairvoyant": "--", "teleport": ":"}


class Standing(NamedTuple):
    """What a team observes in a cell, or on average over all [%].

    Attributes
    ----------
    robots, radius, team
        The cell and the team; "teleport" for what no team can pass. Of all cells robots is 0 and radius NaN.
    observed : Interval
        Mean with its 95 % interval.
    more : Interval
        The paired difference to the first team.
    share : Interval
        The share of the way from the first team to a clairvoyant one, with its interval to first order in the ratio of
        the means; NaN without a clairvoyant team.
    """

    robots: int
    radius: float
    team: str
    observed: Interval
    more: Interval
    share: Interval


def standings(table: pd.DataFrame, reference: str | None = None, *, overall: bool = False) -> list[Standing]:
    """Return what each team observes in each cell.

    Parameters
    ----------
    table : DataFrame
        From `compare`.
    reference : str, optional
        The team with which others are compared; by default the first.
    overall : bool
        Return the means over all cells, which count the same; their runs are independent.
    """
    rows = table[["robots", "radius", "replicate", "team", "observed_fraction"]]
    if (ceiling := table["team"] == CEILING).any():
        most = rows[ceiling].assign(team="teleport", observed_fraction=table.loc[ceiling, "teleport"])
        rows = pd.concat([rows, most])
    # A column for each team, in order, and a row for each world.
    wide = rows.pivot_table("observed_fraction", ["robots", "radius", "replicate"], "team", sort=False, dropna=False)
    wide = 100.0 * wide[list(dict.fromkeys(rows["team"]))]
    reference = reference or str(wide.columns[0])
    cells = [cell for _, cell in wide.groupby(["robots", "radius"], sort=False)]
    found = []
    for part in [cells] if overall else [[cell] for cell in cells]:
        ways = [(cell[CEILING if CEILING in wide else reference] - cell[reference]).to_numpy() for cell in part]
        robots, radius = (0, math.nan) if overall else part[0].index[0][:2]
        for team in map(str, wide.columns):
            gains = [(cell[team] - cell[reference]).to_numpy() for cell in part]
            observed, more = _over([cell[team].to_numpy() for cell in part]), _over(gains)
            found.append(Standing(robots, radius, team, observed, more, _share(gains, ways)))
    return found


def _share(gains: Sequence[Floats], ways: Sequence[Floats]) -> Interval:
    """Return the ratio of two means over cells, with its interval; NaN if the second is not above 0."""
    whole = _over(ways).mean
    if not whole > 0.0:
        return Interval(math.nan, math.nan, math.nan)
    share = _over(gains).mean / whole
    error = _over([(gain - share * way) / whole for gain, way in zip(gains, ways, strict=True)])
    return Interval(share, share + error.low, share + error.high)


def _over(cells: Sequence[Floats]) -> Interval:
    """Return the mean over cells, which count the same, with Student's interval for independent runs in each.

    Notes
    -----
    Cells differ in their variance, so there are fewer degrees of freedom than runs less cells (F. E. Satterthwaite,
    "An approximate distribution of estimates of variance components", 1946). From two runs in each cell there are more
    of them than estimated here, so such an interval holds the mean more often than in 95 of 100 cases; less often if
    the variance of one cell is far larger than that of all others.
    """
    if len(cells) == 1:
        return interval_of(cells[0])
    counts = np.array([len(cell) for cell in cells])
    mean = float(np.mean([cell.mean() for cell in cells]))
    if counts.min() < 2:
        return Interval(mean, -math.inf, math.inf)
    squares = np.array([cell.var(ddof=1) for cell in cells]) / counts
    freedom = squares.sum() ** 2 / max(float((squares**2 / (counts - 1)).sum()), 1e-300)
    se = math.sqrt(squares.sum()) / len(cells)
    wide = float(half_width(np.array(se), np.array(max(freedom, 1.0) + 1.0)))
    return Interval(mean, mean - wide, mean + wide)


def draw(table: pd.DataFrame) -> Canvas:
    """Return what each team observes against the radius, with the ceilings as lines: a panel for each team size."""
    from teamsight.analysis.plot.kinds import panels
    from teamsight.analysis.plot.style import INK, POLICY, RADIUS_LABEL, colours_of

    found, sizes = standings(table), sorted(set(table["robots"]))
    teams = [one for one in dict.fromkeys(standing.team for standing in found) if one not in _LINES]
    # Of a policy and the same with options, the first has its colour.
    names = [team.partition(":")[0] for team in teams]
    spare = iter(colours_of(["" for _ in teams]))
    colours = [
        POLICY[name] if name in POLICY and name not in names[:place] else next(spare)
        for place, name in enumerate(names)
    ]
    figure, axes = panels(
        "What teams observe, and what they could observe at most",
        "Without marks: teams that know more than robots can, and teleport, which nobody passes. Means of "
        f"{len(set(table['replicate']))} runs in each cell.",
        [f"N = {size}" for size in sizes], x=RADIUS_LABEL, y="observed targets  [%]", sharey=True, sharex=True,
    )  # fmt: skip
    looks: list[tuple[str, dict[str, Any]]] = [
        *((team, {"color": one, "marker": "o", "markersize": 3}) for team, one in zip(teams, colours, strict=True)),
        *((team, {"color": INK, "linestyle": line}) for team, line in _LINES.items()),
    ]
    for size, panel in zip(sizes, axes, strict=True):
        for team, look in looks:
            if of := [one for one in found if (one.robots, one.team) == (size, team)]:
                means, label = [one.observed.mean for one in of], _short(team).replace("`", "")
                panel.plot([one.radius for one in of], means, label=label, linewidth=1.3, **look)
    axes[0].set_ylim(0.0, 102.0)
    axes[0].legend(frameon=False, fontsize=8, loc="lower left")
    return figure


def tables(table: pd.DataFrame) -> list[str]:
    """Return tables of Markdown: means over all cells with the share of the way, and means for each radius.

    The first team is the reference; if the second is another A-CMOMMT, shares of the way from it are given too.
    """
    found, other = standings(table, overall=True), list(dict.fromkeys(table["team"]))[1]
    shares = [found, standings(table, other, overall=True)]
    overall = [
        [_short(one.team), _interval(one.observed), "" if one is found[0] else minus(_interval(one.more, "+.1f")),
         *(share_text(of[number].share) for of in shares)]
        for number, one in enumerate(found)
    ]  # fmt: skip
    radii = sorted(set(table["radius"]))
    by_radius = [standings(table[table["radius"] == radius], overall=True) for radius in radii]
    rows = [
        [_short(one.team), *(f"{of[number].observed.mean:.1f}" for of in by_radius)] for number, one in enumerate(found)
    ]
    columns = ["team", "observed [%]", "more than the reference", "of the way", f"of the way from `{other}`"]
    head = ["team", *(f"R = {radius:g}" for radius in radii)]
    return [markdown.table(columns, overall), markdown.table(head, rows)]


def below(table: pd.DataFrame, team: str = "sharing", other: str = "evolved") -> list[tuple[int, float]]:
    """Return the cells (robots, radius) in which a team observes less than another on average."""
    observed = table.pivot_table("observed_fraction", ["robots", "radius"], "team")
    return [(int(robots), float(radius)) for robots, radius in observed.index[observed[team] < observed[other]]]


def _short(team: str) -> str:
    policy, _, options = team.partition(":")
    return f"`{policy}`, with options" if options else f"`{policy}`"


def share_text(share: Interval) -> str:
    """Return a share of the way in percent; the interval is left out where it is infinite or has no width."""
    mean, low, high = (round(100 * one) + 0 if math.isfinite(one) else one for one in share)
    known = math.isfinite(share.low) and share.high > share.low
    return "" if math.isnan(mean) else minus(f"{mean} %" + (f" ({low} to {high})" if known else ""))


def _interval(found: Interval, how: str = ".1f") -> str:
    return f"{found.mean:{how}} ({found.low:{how}} to {found.high:{how}})"
