"""Pursuit on a grid as two tasks: hunters that catch prey, and hunters that surround it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np

from teamsight.agents.attributes import AwarenessLike, PolicyLike
from teamsight.agents.awareness import Awareness, PairwiseAwareness
from teamsight.agents.body import Body, Robot
from teamsight.agents.group import Group
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.component import Allowed, Count, Flag
from teamsight.core.kernel import inlined
from teamsight.policies import SurroundPrey
from teamsight.policies.online.modular_q import ModularQ
from teamsight.policies.online.prey_q import PreyQ
from teamsight.tasks.task import Objective, Task
from teamsight.world.arena import Arena, Box, Torus
from teamsight.world.interaction import Interaction, InteractionState


class _OnGrid(Protocol):
    """The part of the rules of pursuit that describes the arena."""

    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def torus(self) -> bool: ...


def check_grid(rule: _OnGrid, arena: Arena) -> None:
    """Refuse an arena that is not the grid of a rule.

    Raises
    ------
    ValueError
        Naming the sides.
    """
    sides = np.array([rule.width, rule.height], float)
    name = type(rule).__name__
    needed = f"{'Torus' if rule.torus else 'Box'}({rule.width}, {rule.height})"
    low, high = (np.asarray(corner, float) for corner in arena.bounds)
    if not (np.array_equal(high - low, sides) and np.array_equal(high + low, np.zeros(2))):
        raise ValueError(
            f"{name}: is made for {needed}, and the arena is {arena}; give {name} the width and the height of the arena"
        )
    if bool(np.any(np.array(arena.period) > 0)) != rule.torus:
        raise ValueError(f"{name}: has torus={rule.torus}, and the arena is {arena}; give it torus={not rule.torus}")


def check_order(rule: Any, order: tuple[str, ...]) -> None:
    """Refuse groups that do not move in the order of the roles.

    Raises
    ------
    ValueError
        Naming the order.
    """
    if order != rule.roles:
        raise ValueError(
            f"{type(rule).__name__}: {order[0]} would move before {order[1]}; add the {rule.roles[0]} to the world "
            f"before the {rule.roles[1]}"
        )


_WIDTH, _HEIGHT, _IS_TORUS, _REACH, _HUNTERS, _REWARD, _COST, _CALLS, _DIAGONALS = range(9)

# The state: the steps of the trial so far, the calls in this step, the prey captured in it, and whether it begins anew.
_STEPS, _CALL, _CAPTURED, _IS_RESTART = range(4)


@inlined
def _across(gap: float, side: float, is_torus: float) -> float:
    """Return the distance along an axis, by the shortest way."""
    gap = abs(gap)
    return min(gap, side - gap) if is_torus > 0.0 else gap


@inlined
def _reaches(hunters: Any, i: int, prey: Any, j: int, parameters: Any) -> bool:
    """Whether hunter `i` is within reach of prey `j`: by the larger gap if diagonals count, else by the sum of both."""
    x = _across(hunters.position[i, 0] - prey.position[j, 0], parameters[_WIDTH], parameters[_IS_TORUS])
    y = _across(hunters.position[i, 1] - prey.position[j, 1], parameters[_HEIGHT], parameters[_IS_TORUS])
    # Half a cell of tolerance, so that rounding decides nothing.
    return bool((max(x, y) if parameters[_DIAGONALS] > 0.0 else x + y) < parameters[_REACH] + 0.5)


@inlined
def _check_captures(hunters: Any, prey: Any, parameters: Any) -> int:
    """Note the hunters that capture a prey where all stand now; return the number of prey captured."""
    captured = 0
    for j in range(prey.position.shape[0]):
        if not prey.active[j]:
            continue
        close = 0
        for i in range(hunters.position.shape[0]):
            close += hunters.active[i] and _reaches(hunters, i, prey, j, parameters)
        if close >= parameters[_HUNTERS]:
            captured += 1
            for i in range(hunters.position.shape[0]):
                if hunters.active[i] and _reaches(hunters, i, prey, j, parameters):
                    hunters.captures[i] = 1
    return captured


@inlined
def _place(hunters: Any, i: int, parameters: Any, noise: Any) -> None:
    """Place a hunter at the centre of a random cell."""
    for axis in range(2):
        side = parameters[_WIDTH + axis]
        hunters.position[i, axis] = float(int(noise[axis, i] * side)) + 0.5 - 0.5 * side


@inlined
def _put_back(bodies: Any, i: int) -> None:
    bodies.position[i, 0] = bodies.before[i, 0]
    bodies.position[i, 1] = bodies.before[i, 1]


@inlined
def _begin_anew(hunters: Any, prey: Any, parameters: Any, noise: Any) -> None:
    """Place the hunters that captured in the last step, and leave all others where they were before this one."""
    for i in range(hunters.position.shape[0]):
        if hunters.captures[i] > 0 and hunters.active[i]:
            _place(hunters, i, parameters, noise)
        else:
            _put_back(hunters, i)
        hunters.captures[i] = 0
    for j in range(prey.position.shape[0]):
        _put_back(prey, j)


@inlined
def _reward(hunters: Any, is_over: bool, parameters: Any) -> None:
    for i in range(hunters.position.shape[0]):
        if hunters.active[i]:
            hunters.reward[i] = parameters[_REWARD] if hunters.captures[i] > 0 else -parameters[_COST]
            hunters.ended[i] = is_over


@inlined
def _capture(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    hunters, prey = bodies.hunters, bodies.prey
    counts = state.ints[0]
    counts[_CALL] += 1
    if counts[_CAPTURED] > 0:
        # The hunters have captured: prey do not move any more in this trial.
        for j in range(prey.position.shape[0]):
            _put_back(prey, j)
    elif counts[_IS_RESTART] == 0:
        counts[_CAPTURED] = _check_captures(hunters, prey, parameters)
    if counts[_CALL] < parameters[_CALLS]:
        return
    counts[_CALL] = 0
    if counts[_IS_RESTART] != 0:
        _begin_anew(hunters, prey, parameters, noise.hunters)
        counts[_IS_RESTART] = 0
        return
    counts[_STEPS] += 1
    scores[0] = counts[_CAPTURED]
    scores[1] = counts[_STEPS]
    _reward(hunters, counts[_CAPTURED] > 0, parameters)
    if counts[_CAPTURED] > 0:
        counts[_IS_RESTART] = 1
        counts[_CAPTURED] = 0
        counts[_STEPS] = 0


class Rule(NamedTuple):
    """Who captures a prey: at least `hunters` of those within `reach` cells of it; and whether groups move in turn."""

    hunters: int
    reach: int
    in_turn: bool


#: The rules by name.
RULES = {"alone": Rule(1, 0, in_turn=True), "pair": Rule(2, 1, in_turn=False)}
#: The orders of moves: that of the rule, or one for any rule.
ORDERS = ("by rule", "at once", "in turn")


@dataclass(frozen=True)
class Capture(Interaction):
    """Hunters capture prey on a grid, and those that did begin anew at random cells.

    With the rule "alone" hunters move, and those in a prey's cell capture it; if there are none, prey move, and hunters
    whose cell a prey has entered capture it. With "pair" all move at once, and then two hunters in or next to the cell
    of a prey, diagonals included, capture it. `order` gives any rule the order of the other. Where hunters move first,
    the world must have them before the prey.

    A capture ends the trial of all hunters. The next step begins another: hunters that captured are placed at random,
    nobody else moves, and no action counts. So robots perceive how a trial ended, as with Gymnasium's next-step
    autoreset.

    The roles are "hunters" and "prey". Each hunter has the column `captures`: 1 after a step in which it captured. The
    history has the columns "captures", the number of prey captured in the step, and "trial_steps", the steps of the
    trial up to this one; both are 0 in a step that begins a trial.

    Parameters
    ----------
    width, height : int
        The sides of the arena [cells].
    torus : bool, default False
        Whether the arena is a `Torus`.
    rule : {"alone", "pair"}, default "alone"
        Who captures.
    order : {"by rule", "at once", "in turn"}, default "by rule"
        Who moves when: "in turn", hunters move, those that can capture do, prey move, and again those that can do; "at
        once", all move, and then those that can capture do.
    diagonals : bool, default True
        Whether cells with a corner in common are next to each other.
    reward : float, default 1
        The reward of each hunter that captures.
    cost : float, default 0.1
        What a step costs every other hunter.

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits.

    Notes
    -----
    *Source:* Tan (1993), §4. *Departs:* the order of moves, and that diagonals are next to a cell, are our inference:
    with them random hunters need about as many steps as in his Table 1. With hunters first everywhere hunters that
    learn do, and random ones do not; see docs/tasks/pursuit.md. A move against the wall is lost.
    """

    width: Annotated[Count, Allowed(unit="cells")]
    height: Annotated[Count, Allowed(unit="cells")]
    torus: Flag = False
    rule: Annotated[str, Allowed(choices=RULES)] = "alone"
    order: Annotated[str, Allowed(choices=ORDERS)] = "by rule"
    diagonals: Flag = True
    reward: Annotated[float, Allowed()] = 1.0
    cost: Annotated[float, Allowed()] = 0.1

    roles = ("hunters", "prey")
    writes = ("position", "reward", "ended")
    scores = ("captures", "trial_steps")
    draws = 2
    columns = (("hunters", "captures", 0),)
    kernel = _capture

    @property
    def in_turn(self) -> bool:  # type: ignore[override]
        """Whether hunters and prey move one after the other."""
        return RULES[self.rule].in_turn if self.order == ORDERS[0] else self.order == ORDERS[2]

    @property
    def parameters(self) -> tuple[float, ...]:
        rule = RULES[self.rule]
        return tuple(map(float, (
            self.width, self.height, self.torus, rule.reach, rule.hunters, self.reward, self.cost,
            2 if self.in_turn else 1, self.diagonals,
        )))  # fmt: skip

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        check_grid(self, arena)
        if self.in_turn:
            check_order(self, order)

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.zeros((1, 4), np.int64))


_SURROUND_WIDTH, _SURROUND_HEIGHT, _SURROUND_IS_TORUS, _SURROUND_REWARD, _SURROUND_COST = range(5)

# The state: the steps of the trial so far, and whether the next step begins another.
_SURROUND_STEPS, _SURROUND_IS_RESTART = range(2)


@inlined
def _gap(one: float, other: float, side: float, is_torus: float) -> float:
    """Return the coordinate of one relative to another, by the shortest way."""
    gap = one - other
    if is_torus > 0.0:
        gap -= side * np.rint(gap / side)
    return gap


@inlined
def _is_at(bodies: Any, i: int, others: Any, j: int, x: float, y: float, parameters: Any) -> bool:
    """Whether body `i` is in the cell at (x, y) relative to body `j` of the others."""
    is_torus = parameters[_SURROUND_IS_TORUS]
    gap_x = _gap(bodies.position[i, 0], others.position[j, 0], parameters[_SURROUND_WIDTH], is_torus)
    gap_y = _gap(bodies.position[i, 1], others.position[j, 1], parameters[_SURROUND_HEIGHT], is_torus)
    return bool(abs(gap_x - x) < 0.5 and abs(gap_y - y) < 0.5)


@inlined
def _put_back_one(bodies: Any, i: int) -> int:
    """Put a body back to where it was before this step; return 1 if it was elsewhere, else 0."""
    moved = bodies.position[i, 0] != bodies.before[i, 0] or bodies.position[i, 1] != bodies.before[i, 1]
    bodies.position[i, 0] = bodies.before[i, 0]
    bodies.position[i, 1] = bodies.before[i, 1]
    return 1 if moved else 0


@inlined
def _put_back_from(bodies: Any, others: Any, parameters: Any) -> int:
    """Put bodies back that have entered the cell of one of the others; return how many."""
    count = 0
    for i in range(bodies.position.shape[0]):
        for j in range(others.position.shape[0]):
            if bodies.active[i] and others.active[j] and _is_at(bodies, i, others, j, 0.0, 0.0, parameters):
                count += _put_back_one(bodies, i)
                break
    return count


@inlined
def _keep_apart(hunters: Any, prey: Any, parameters: Any) -> None:
    """Put prey back that have entered a hunter's cell, then hunters that have entered a prey's, until none has."""
    # A body that is put back may return to a cell that another has entered. Each round puts one back, so it ends.
    count = 1
    while count > 0:
        count = _put_back_from(prey, hunters, parameters)
        count += _put_back_from(hunters, prey, parameters)


@inlined
def _is_surrounded_side(hunters: Any, prey: Any, j: int, x: float, y: float, parameters: Any) -> bool:
    for i in range(hunters.position.shape[0]):
        if hunters.active[i] and _is_at(hunters, i, prey, j, x, y, parameters):
            return True
    return False


@inlined
def _is_captured(hunters: Any, prey: Any, j: int, parameters: Any) -> bool:
    """Whether hunters stand to the east, west, north and south of prey `j`."""
    return bool(
        prey.active[j]
        and _is_surrounded_side(hunters, prey, j, 1.0, 0.0, parameters)
        and _is_surrounded_side(hunters, prey, j, -1.0, 0.0, parameters)
        and _is_surrounded_side(hunters, prey, j, 0.0, 1.0, parameters)
        and _is_surrounded_side(hunters, prey, j, 0.0, -1.0, parameters)
    )


@inlined
def _place_anywhere(bodies: Any, noise: Any, parameters: Any) -> None:
    """Place all active bodies of a group at the centres of random cells."""
    for i in range(bodies.position.shape[0]):
        for axis in range(2 if bodies.active[i] else 0):
            side = parameters[_SURROUND_WIDTH + axis]
            bodies.position[i, axis] = float(int(noise[axis, i] * side)) + 0.5 - 0.5 * side


@inlined
def _surround(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    hunters, prey = bodies.hunters, bodies.prey
    counts = state.ints[0]
    if counts[_SURROUND_IS_RESTART] != 0:
        _place_anywhere(hunters, noise.hunters, parameters)
        _place_anywhere(prey, noise.prey, parameters)
        counts[_SURROUND_IS_RESTART] = 0
        return
    _keep_apart(hunters, prey, parameters)
    captured = 0
    for j in range(prey.position.shape[0]):
        captured += _is_captured(hunters, prey, j, parameters)
    counts[_SURROUND_STEPS] += 1
    scores[0] = captured
    scores[1] = counts[_SURROUND_STEPS]
    for i in range(hunters.position.shape[0]):
        if hunters.active[i]:
            hunters.reward[i] = parameters[_SURROUND_REWARD] if captured > 0 else -parameters[_SURROUND_COST]
            hunters.ended[i] = captured > 0
    if captured > 0:
        counts[_SURROUND_IS_RESTART] = 1
        counts[_SURROUND_STEPS] = 0


@dataclass(frozen=True)
class Surround(Interaction):
    """Hunters on all four sides of a prey capture it; the next step places everybody at random.

    All move at once. Hunters may share a cell, a hunter and a prey may not: prey that would enter a hunter's cell
    stays, and then hunters that would enter a prey's cell stay; those who stay may hinder others. Only where a trial
    begins a hunter and a prey may be in one cell. Inactive bodies stay where they are, and hinder nobody.

    Roles and columns of the history are those of `Capture`; all hunters get the reward.

    Parameters
    ----------
    width, height : int
        The sides of the arena [cells], at least 3.
    torus : bool, default True
        Whether the arena is a `Torus`.
    reward : float, default 1
        The reward of every hunter at a capture.
    cost : float, default 0.1
        What every other step costs a hunter.

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits.

    Notes
    -----
    *Source:* the modified pursuit of Ono and Fukumoto (1996). *Departs:* who stays when two want one cell, and that all
    begin anew, are not known.
    """

    width: Annotated[int, Allowed(least=3, unit="cells")]
    height: Annotated[int, Allowed(least=3, unit="cells")]
    torus: Flag = True
    reward: Annotated[float, Allowed()] = 1.0
    cost: Annotated[float, Allowed()] = 0.1

    roles = ("hunters", "prey")
    writes = ("position", "reward", "ended")
    scores = ("captures", "trial_steps")
    draws = 2
    kernel = _surround

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        check_grid(self, arena)

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.zeros((1, 2), np.int64))


#: The largest side of the grid [cells].
MOST_SIDE = 1000

_SURROUND = "surround"
# Of a cell; hunters must be on all.
_SIDES = 4


class Hunter(Robot):
    """A hunter of the team "hunters"."""

    team = "hunters"


class Prey(Body):
    """A prey, on no team."""


class Scout(Robot):
    """A robot of the hunters' team that senses prey and does not capture any."""

    team = "hunters"


class Pursuit(World):
    """Hunters and prey that move from cell to cell of a grid, at most one cell in a step.

    Bodies are at the centres of cells of side 1; several can be in one cell. A move against the wall is lost.

    Parameters
    ----------
    hunters : int
        Number of hunters.
    prey : int
        Number of prey.
    side : int
        The side of the grid [cells].
    depth : int
        Hunters sense prey in a square of this many cells to each side.
    teammate_depth : int, optional
        They perceive teammates, as their degree of awareness allows, in a square of this many; by default `depth`.
    rule : {"alone", "pair", "surround"}
        Who captures: see `Capture`, and `Surround` for four hunters at once. Fewer than four never surround a prey; a
        warning says so.
    order, diagonals
        As for `Capture`; with the rule "surround" as they are by default.
    torus : bool
        Whether the grid has no walls.
    policy : str or Policy
        The policy of the hunters; "lattice-walk" moves at random.
    awareness : str or Awareness
        What they perceive of teammates.
    prey_policy : str or Policy
        The policy of the prey.
    scouts : int
        The number of scouts, which move at random.
    scout_depth : int, optional
        Scouts sense prey in a square of this many cells to each side; by default `depth`.
    rng, seed : int, optional
        Two names for the seed.

    Attributes
    ----------
    hunters, prey : Group
        The two groups.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a name is unknown.

    Notes
    -----
    *Source:* Tan (1993); Ono and Fukumoto (1996) for "surround". *Departs:* see `Capture` and `Surround`.
    """

    def __init__(
        self,
        hunters: int = 2,
        prey: int = 1,
        side: int = 10,
        *,
        depth: int = 4,
        teammate_depth: int | None = None,
        rule: str = "alone",
        order: str = ORDERS[0],
        diagonals: bool = True,
        torus: bool = False,
        policy: PolicyLike = "lattice-walk",
        awareness: AwarenessLike = "none",
        prey_policy: PolicyLike = "lattice-walk",
        scouts: int = 0,
        scout_depth: int | None = None,
        rng: int | None = None,
        seed: int | None = None,
    ) -> None:
        _check(hunters, prey, side, torus, rule, scouts)
        is_surround = rule == _SURROUND
        if is_surround and (order, diagonals) != (ORDERS[0], True):
            raise ValueError(
                f"order={order!r}, diagonals={diagonals}: are for the rules {' and '.join(RULES)}; leave them out "
                f"where rule={rule!r}"
            )
        super().__init__(Torus(side, side) if torus else Box(side, side), rng=rng, seed=seed)
        near = _range("teammate_depth", depth if teammate_depth is None else teammate_depth, side)
        common: dict[str, Any] = {
            "awareness": awareness, "awareness_range": near, "range_shape": "square", "speed": 1.0,
            "placement": "cells",
        }  # fmt: skip
        self._hunters = self.add(
            Hunter, hunters, policy=policy, sensing_range=_range("depth", depth, side), name="hunters", **common
        )
        self._prey = self.add(Prey, prey, policy=prey_policy, speed=1.0, placement="cells", name="prey")
        self.senses(self._hunters, self._prey)
        if scouts:
            seen = _range("scout_depth", depth if scout_depth is None else scout_depth, side)
            others = self.add(Scout, scouts, policy="lattice-walk", sensing_range=seen, name="scouts", **common)
            self.senses(others, self._prey)
        meets = Surround(side, side, torus) if is_surround else Capture(side, side, torus, rule, order, diagonals)
        self.interact(meets, hunters=self._hunters, prey=self._prey)

    @property
    def hunters(self) -> Group[Hunter]:
        """The hunters."""
        return self._hunters

    @property
    def prey(self) -> Group[Prey]:
        """The prey."""
        return self._prey


def _check(hunters: int, prey: int, side: int, torus: bool, rule: str, scouts: int) -> None:
    """Refuse what is wrong, and warn of hunters that cannot capture."""
    checks.count("hunters", hunters, most=MOST_AGENTS)
    checks.count("prey", prey, most=MOST_AGENTS)
    checks.count("side", side, least=2, most=MOST_SIDE)
    checks.flag("torus", torus)
    checks.choice("rule", rule, (*RULES, _SURROUND))
    checks.count("scouts", scouts, least=0, most=MOST_AGENTS)
    if rule == _SURROUND and hunters < _SIDES:
        warnings.warn(
            f"hunters={hunters}: fewer than {_SIDES} never capture where rule={rule!r}, on all sides of a prey; take "
            f"{_SIDES} or more, add some with hunters.add(…), or take rule='pair'",
            stacklevel=3,
        )


def _range(name: str, depth: int, side: int) -> float:
    """Return the range that reaches so many cells to each side."""
    return float(checks.count(name, depth, most=side))


#: Steps for which a team learns before it counts as skilled.
LEARNING = 500_000
# How it learns: α, T where two capture and where all sides must be held, and the most partners of a hunter.
_RATE, _TEMPERATURE, _SURROUNDING, _PARTNERS = 0.1, 0.03, 0.001, 3


def trial_steps(world: World) -> float:
    """Return the steps of a trial: all steps of trials over the trials that have ended; infinite without any."""
    history = world.recording.history
    ended = int(np.count_nonzero(history["captures"]))
    return float(np.count_nonzero(history["trial_steps"]) / ended) if ended else math.inf


def captures(world: World) -> float:
    """Return the number of prey captured."""
    return float(world.recording.history["captures"].sum())


def learned(
    scenario: Mapping[str, Any], awareness: Awareness | None, rng: int, steps: int = LEARNING
) -> dict[str, Any]:
    """Let a team learn by trial and error, and return its parameters: its degree, and its greedy policy.

    Parameters
    ----------
    scenario : mapping
        All parameters of the scenario.
    awareness : Awareness, optional
        The degree of awareness; by default all teammates, "pairwise".
    rng : int
        The seed of the world in which it learns.
    steps : int
        Steps for which it learns; 0 for a team that has learned nothing.

    Notes
    -----
    Two capture a prey, so a hunter uses the closest teammate of those that its degree shows, however many these are.
    Where hunters must stand on all sides of a prey ("surround") it uses the three closest, each in a module.
    The rate, the temperature and the steps are ours: with Tan's, hunters need longer
    (``benchmarks/pursuit_constants.py``). The team that has learned keeps the temperature, since greedy hunters that
    sense nothing would repeat one move.
    """
    degree = PairwiseAwareness() if awareness is None else awareness
    policy = _learner(scenario, degree)
    world = Pursuit(**scenario, policy=policy, awareness=degree, rng=rng)
    if steps > 0:
        world.run(steps, progress=False)
    state = world.hunters.policy_state
    frozen = policy.frozen(state.floats if isinstance(policy, PreyQ) else state)
    return {"policy": replace(frozen, temperature=policy.temperature), "awareness": degree}


def _learner(scenario: Mapping[str, Any], degree: Awareness) -> PreyQ | ModularQ:
    depth, is_surround = scenario["depth"], scenario["rule"] == "surround"
    shown = min(checks.count("hunters", scenario["hunters"]) - 1, getattr(degree, "delta", _PARTNERS))
    if "teammates" not in degree.delivers:
        shown = 0
    if is_surround and shown > 0:
        return ModularQ(depth, modules=min(shown, _PARTNERS), by="distance")
    moves, temperature = (5, _SURROUNDING) if is_surround else (4, _TEMPERATURE)
    partner = depth if shown > 0 else 0
    return PreyQ(depth, partner=partner, learning_rate=_RATE, temperature=temperature, moves=moves, values_ends=True)


PURSUIT = Task(
    name="pursuit",
    title="Hunters that capture prey together",
    world=Pursuit,
    scenario={"hunters": 2, "prey": 2, "side": 10, "depth": 4, "rule": "pair", "torus": False},
    objective=Objective("trial_steps", "less"),
    metrics={"trial_steps": trial_steps, "captures": captures},
    explore={"policy": "lattice-walk", "awareness": "none"},
    skilled=learned,
    team="hunters",
    size="hunters",
    steps=600,
    gathers=True,
    about="Two hunters next to a prey on a grid capture it. They gather around it. Source: Tan (1993), case 3.",
)


SURROUND = Task(
    name="surround",
    title="Hunters that surround prey",
    world=Pursuit,
    scenario={"hunters": 4, "prey": 1, "side": 20, "depth": 3, "rule": "surround", "torus": True},
    objective=Objective("trial_steps", "less"),
    metrics={"trial_steps": trial_steps, "captures": captures},
    explore={"policy": "lattice-walk", "awareness": "none"},
    skilled={"policy": SurroundPrey(), "awareness": "pairwise"},
    team="hunters",
    size="hunters",
    steps=600,
    gathers=True,
    about="Four hunters on all sides of a prey on a torus capture it. Source: Ono and Fukumoto (1996), whose hunters "
    "learn; the team with skill is made by hand.",
)
