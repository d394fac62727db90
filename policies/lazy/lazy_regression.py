"""Lazy learning by locally weighted regression: how does the reward change with the distance to what is sensed?"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.local_slopes import local_slopes, significant
from teamsight.policies.lazy.readings import (
    FREE,
    KINDS,
    LAYOUTS,
    TAKEN,
    TEAMMATE,
    compass,
    is_taken,
    place_of,
    readings_of,
    teammates,
)
from teamsight.policies.learner import Learner, is_situation, refuse
from teamsight.policies.rewards import Reward, keep_reward, rewards_of

#: Number of distances, equally spaced from 0 to the range, at which slopes are fitted; linear in between.
POINTS = 21

# The parameters end with the unit vector of each input.
_OWN, _LAYOUT, _COMPASS = range(3)


@inlined
def _law(table: Any, kind: int, distance: float) -> Any:
    """Return the force of a reading, by linear interpolation."""
    at = distance * (POINTS - 1)
    point = min(int(at), POINTS - 2)
    return table[kind, point] + (at - point) * (table[kind, point + 1] - table[kind, point])


@inlined
def _climb(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    own = int(parameters[_OWN])
    layout = int(parameters[_LAYOUT])
    inputs = (parameters.shape[0] - _COMPASS) // 2
    directions = parameters[_COMPASS:].reshape((inputs, 2))
    for i in range(percept.heading.shape[0]):
        situation = percept.situation[i]
        if not is_situation(situation, inputs):
            refuse(i, percept, action)
            continue
        ratio = percept.awareness_range[i] / percept.sensing_range[i]
        ahead = 0.0
        left = 0.0
        for sector in range(own):
            distance = float(situation[sector])
            if distance < 1.0:
                x = distance * directions[sector, 0]
                y = distance * directions[sector, 1]
                taken = is_taken(x, y, distance * distance, situation, directions, own, layout, ratio)
                force = _law(arrays.table, TAKEN if taken else FREE, max(distance, 0.0))
                ahead += force * directions[sector, 0]
                left += force * directions[sector, 1]
        for number in range(teammates(inputs, own, layout)):
            distance, x, y = place_of(situation, directions, own, layout, number)
            if distance < 1.0:
                force = _law(arrays.table, TEAMMATE, max(distance, 0.0))
                ahead += force * x
                left += force * y
        _move(ahead, left, i, percept, action)


@inlined
def _move(ahead: float, left: float, i: int, percept: Any, action: Any) -> None:
    """Write a full step along a force relative to the heading, or straight on if there is none."""
    x = percept.heading[i, 0]
    y = percept.heading[i, 1]
    square = ahead * ahead + left * left
    if square > 1e-18:
        shrink = 1.0 / math.sqrt(square)
        x, y = (ahead * x - left * y) * shrink, (left * x + ahead * y) * shrink
    action.heading[i, 0] = x
    action.heading[i, 1] = y
    action.distance[i] = percept.speed[i]


@dataclass(frozen=True, eq=False, repr=False)
class LazyRegression(Learner):
    """Move so that the reward to be expected rises fastest, by locally weighted regression on each reading.

    A reading is a target or a teammate that a sector shows. There are three kinds: free targets, taken targets, to
    which a perceived teammate is nearer than the robot, and teammates. Without awareness all targets are free. For each
    kind, the reward of the transitions is regressed on the distance of the reading after the robot's own move. The
    slope at a distance, times −1, is the force of a reading at that distance. A robot turns along the sum of all forces
    and makes a full step; without a force it goes straight on.

    For taken targets and teammates the slope is that at a given distance before the move: how near they are also says
    which targets the robot has, and with it which rewards to expect whatever it does.

    Parameters
    ----------
    memory, reward, inputs
        As for `Learner`. The default reward is `keep_reward`. Only immediate rewards count.
    bandwidth : float
        Bandwidth of the regression [ranges].
    ridge : float
        Draws all slopes towards 0; see `teamsight.policies.lazy.local_slopes`.
    significance : float
        The force of taken targets and of teammates is 0 unless the slope is farther than this from 0 [standard errors].
    stride : float, optional
        Distance of a full step over the sensing range. By default from the memory's settings.

    Attributes
    ----------
    forces : mapping of str to ndarray, shape (points,), float64
        For each kind of reading the force at equally spaced distances from 0 to the range; positive is attraction.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, the reward does not return a finite number for each transition, or the
        memory's inputs do not show where teammates are.

    Warns
    -----
    UserWarning
        If the transitions are too few for a slope, or all rewards are equal: the robots then go straight on.

    Notes
    -----
    *Source:* §8, one exploration for any reward; locally weighted regression after Atkeson, Moore and Schaal (1997).
    *Departs:* the paper matches whole situations (eq. 1), which does not learn here; docs/lazy-q.md shows why. The
    distance after the robot's own move uses that it knows its own motion. That a taken target exerts no force unless
    the transitions show one is an assumption; docs/learning.md shows what it is worth.
    """

    reward: Reward = keep_reward
    bandwidth: float = 1.0
    ridge: float = 0.5
    significance: float = 3.0
    stride: float | None = None
    forces: Mapping[str, Floats] = field(init=False)

    title = "locally weighted regression"
    kernel = _climb

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.number("bandwidth", self.bandwidth, above=0)
        for name in ("ridge", "significance"):
            checks.number(name, getattr(self, name), least=0)
        object.__setattr__(self, "forces", self._fitted())

    @property
    def layout(self) -> str:
        """How the inputs show where teammates are; see ``Awareness.teammate_layout``."""
        if self.inputs == self.memory.own:
            return ""
        layout = self.memory.settings.get("teammate_layout")
        if layout not in LAYOUTS or not layout:
            degree = self.memory.settings.get("degree", "unknown")
            raise ValueError(
                f"memory: the {self.memory.added} inputs of its degree of awareness, {degree}, do not show where "
                f"teammates are; explore with awareness='ring' or 'pairwise', or give inputs={self.memory.own}"
            )
        return str(layout)

    def _range(self, name: str) -> float:
        value = self.memory.settings.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
            cure = "" if name == "awareness_range" else ", or give stride, a full step over the sensing range"
            raise ValueError(
                f"memory: its settings have {name}={value!r}, and one positive number is needed; add it to the "
                f"settings{cure}"
            )
        return float(value)

    def _fitted(self) -> Mapping[str, Floats]:
        stride = self.stride
        if stride is None:
            stride = self._range("robot_speed") / self._range("sensing_range")
        checks.number("stride", stride, above=0)
        layout = self.layout
        ratio = self._range("awareness_range") / self._range("sensing_range") if layout else 1.0
        rewards = rewards_of(self.memory, self.reward)
        found = readings_of(self.memory, self.inputs, layout, ratio, stride)
        point = np.linspace(0.0, 1.0, POINTS)
        forces = {}
        for kind, name in enumerate(KINDS):
            chosen = found.kind == kind
            moved, response = found.moved[chosen], rewards[found.transition[chosen]]
            given = None if kind == FREE else found.distance[chosen]
            slopes = local_slopes(moved, response, point, self.bandwidth, self.ridge, given=given)
            forces[name] = -significant(slopes, 0.0 if kind == FREE else self.significance)
        if not forces[KINDS[FREE]].any():
            self._warn(rewards)
        return forces

    def _warn(self, rewards: Floats) -> None:
        why = f"{len(self.memory)} transitions are too few for a slope"
        if (rewards == rewards[0]).all():
            why = f"the reward is {rewards[0]:g} for all {len(rewards)} transitions"
        warnings.warn(
            f"LazyRegression: {why}; the robots go straight on: explore longer, or use another reward", stacklevel=5
        )

    @property
    def learned(self) -> Floats:
        return np.stack(list(self.forces.values()))

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.learned.astype(np.float32)

    @property
    def parameters(self) -> Floats:
        own, layout = self.memory.own, self.layout
        return np.concatenate([[own, LAYOUTS[layout]], compass(own, self.inputs - own, layout).ravel()])
