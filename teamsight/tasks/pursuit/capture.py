"""Capture: hunters that reach a prey are rewarded, and begin anew at random places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from teamsight.core.component import Allowed, Count, Flag
from teamsight.core.kernel import inlined
from teamsight.tasks.pursuit.grid import check_grid, check_order
from teamsight.world.arena import Arena
from teamsight.world.interaction import Interaction, InteractionState

_WIDTH, _HEIGHT, _IS_TORUS, _REACH, _HUNTERS, _REWARD, _COST, _CALLS = range(8)

# The state: the steps of the trial so far, the calls in this step, the prey captured in it, and whether it begins anew.
_STEPS, _CALL, _CAPTURED, _IS_RESTART = range(4)


@inlined
def _across(gap: float, side: float, is_torus: float) -> float:
    """Return the distance along an axis, by the shortest way."""
    gap = abs(gap)
    return min(gap, side - gap) if is_torus > 0.0 else gap


@inlined
def _reaches(hunters: Any, i: int, prey: Any, j: int, parameters: Any) -> bool:
    """Whether hunter `i` is within reach of prey `j`, diagonals included."""
    x = _across(hunters.position[i, 0] - prey.position[j, 0], parameters[_WIDTH], parameters[_IS_TORUS])
    y = _across(hunters.position[i, 1] - prey.position[j, 1], parameters[_HEIGHT], parameters[_IS_TORUS])
    # Half a cell of tolerance, so that rounding decides nothing.
    return bool(max(x, y) < parameters[_REACH] + 0.5)


@inlined
def _check(hunters: Any, prey: Any, parameters: Any) -> int:
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
        counts[_CAPTURED] = _check(hunters, prey, parameters)
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


@dataclass(frozen=True)
class Capture(Interaction):
    """Hunters capture prey on a grid, and those that did begin anew at random cells.

    With the rule "alone" hunters move, and those in a prey's cell capture it; if there are none, prey move, and hunters
    whose cell a prey has entered capture it. With "pair" all move at once, and then two hunters in or next to the cell
    of a prey, diagonals included, capture it. With "alone" the world must have the hunters before the prey.

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
    with them random hunters need about as many steps as in his Table 1. A move against the wall is lost.
    """

    width: Annotated[Count, Allowed(unit="cells")]
    height: Annotated[Count, Allowed(unit="cells")]
    torus: Flag = False
    rule: Annotated[str, Allowed(choices=RULES)] = "alone"
    reward: Annotated[float, Allowed()] = 1.0
    cost: Annotated[float, Allowed()] = 0.1

    roles = ("hunters", "prey")
    scores = ("captures", "trial_steps")
    draws = 2
    columns = (("hunters", "captures", 0),)
    kernel = _capture

    @property
    def in_turn(self) -> bool:  # type: ignore[override]
        """Whether hunters and prey move one after the other."""
        return RULES[self.rule].in_turn

    @property
    def parameters(self) -> tuple[float, ...]:
        rule = RULES[self.rule]
        calls = 2 if rule.in_turn else 1
        numbers = (self.width, self.height, self.torus, rule.reach, rule.hunters, self.reward, self.cost, calls)
        return tuple(map(float, numbers))

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        check_grid(self, arena)
        if self.in_turn:
            check_order(self, order)

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.zeros((1, 4), np.int64))
