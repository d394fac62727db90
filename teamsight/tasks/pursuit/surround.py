"""Surround: hunters on all four sides of a prey capture it, and all begin anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.core.component import Allowed, Flag
from teamsight.core.kernel import inlined
from teamsight.tasks.pursuit.grid import check_grid
from teamsight.world.arena import Arena
from teamsight.world.interaction import Interaction, InteractionState

_WIDTH, _HEIGHT, _IS_TORUS, _REWARD, _COST = range(5)

# The state: the steps of the trial so far, and whether the next step begins another.
_STEPS, _IS_RESTART = range(2)


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
    gap_x = _gap(bodies.position[i, 0], others.position[j, 0], parameters[_WIDTH], parameters[_IS_TORUS])
    gap_y = _gap(bodies.position[i, 1], others.position[j, 1], parameters[_HEIGHT], parameters[_IS_TORUS])
    return bool(abs(gap_x - x) < 0.5 and abs(gap_y - y) < 0.5)


@inlined
def _put_back(bodies: Any, i: int) -> int:
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
                count += _put_back(bodies, i)
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
def _is_held(hunters: Any, prey: Any, j: int, x: float, y: float, parameters: Any) -> bool:
    for i in range(hunters.position.shape[0]):
        if hunters.active[i] and _is_at(hunters, i, prey, j, x, y, parameters):
            return True
    return False


@inlined
def _is_captured(hunters: Any, prey: Any, j: int, parameters: Any) -> bool:
    """Whether hunters stand to the east, west, north and south of prey `j`."""
    return bool(
        prey.active[j]
        and _is_held(hunters, prey, j, 1.0, 0.0, parameters)
        and _is_held(hunters, prey, j, -1.0, 0.0, parameters)
        and _is_held(hunters, prey, j, 0.0, 1.0, parameters)
        and _is_held(hunters, prey, j, 0.0, -1.0, parameters)
    )


@inlined
def _place(bodies: Any, noise: Any, parameters: Any) -> None:
    """Place all active bodies of a group at the centres of random cells."""
    for i in range(bodies.position.shape[0]):
        for axis in range(2 if bodies.active[i] else 0):
            side = parameters[_WIDTH + axis]
            bodies.position[i, axis] = float(int(noise[axis, i] * side)) + 0.5 - 0.5 * side


@inlined
def _surround(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    hunters, prey = bodies.hunters, bodies.prey
    counts = state.ints[0]
    if counts[_IS_RESTART] != 0:
        _place(hunters, noise.hunters, parameters)
        _place(prey, noise.prey, parameters)
        counts[_IS_RESTART] = 0
        return
    _keep_apart(hunters, prey, parameters)
    captured = 0
    for j in range(prey.position.shape[0]):
        captured += _is_captured(hunters, prey, j, parameters)
    counts[_STEPS] += 1
    scores[0] = captured
    scores[1] = counts[_STEPS]
    for i in range(hunters.position.shape[0]):
        if hunters.active[i]:
            hunters.reward[i] = parameters[_REWARD] if captured > 0 else -parameters[_COST]
            hunters.ended[i] = captured > 0
    if captured > 0:
        counts[_IS_RESTART] = 1
        counts[_STEPS] = 0


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
    scores = ("captures", "trial_steps")
    draws = 2
    kernel = _surround

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        check_grid(self, arena)

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.zeros((1, 2), np.int64))
