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
    WORD,
    is_taken,
    lowest,
    place,
    readings_of,
    sensed,
    teammates,
    unit_vectors,
)
from teamsight.policies.learner import Learner, refuse
from teamsight.policies.memory.transitions import MOST
from teamsight.policies.rewards import Reward, keep_reward, name_of, rewards_of

#: Number of distances, equally spaced from 0 to the range, at which slopes are fitted; linear in between.
POINTS = 21

# The parameters end with the unit vector of each input.
_OWN, _LAYOUT, _UNIT = range(3)
# Forces below this share of the largest one are what rounding leaves of forces that cancel.
_LEAST_FORCE = 1e-6


@inlined
def _is_situation(situation: Any) -> bool:
    """Return whether all readings are within the limits of a memory; unlike the learners' common check, on lanes."""
    wrong = 0
    for component in range(situation.shape[0]):
        # Written so that NaN is counted too.
        wrong += not abs(situation[component]) <= MOST
    return wrong == 0


@inlined
def _force(table: Any, kind: int, distance: float) -> Any:
    """Return the force of a reading, by linear interpolation."""
    at = distance * (POINTS - 1)
    point = min(int(at), POINTS - 2)
    return table[kind, point] + (at - point) * (table[kind, point + 1] - table[kind, point])


@inlined
def follow_forces(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Turn each robot along the sum of the forces of what it senses; see `LazyRegression`."""
    parameters = arrays.parameters
    own = int(parameters[_OWN])
    layout = int(parameters[_LAYOUT])
    inputs = (parameters.shape[0] - _UNIT) // 2
    unit = parameters[_UNIT:].reshape((inputs, 2))
    for i in range(percept.heading.shape[0]):
        situation = percept.situation[i]
        if not _is_situation(situation):
            refuse(i, percept, action)
            continue
        ahead = 0.0
        left = 0.0
        ranges = (percept.sensing_range[i], percept.awareness_range[i])
        perceived = teammates(situation, own, inputs, layout)
        for first in range(0, own, WORD):
            word = sensed(situation, first, own)
            while word:
                bit, word = lowest(word)
                distance, x, y = place(situation, unit, layout, own, first + bit)
                taken = is_taken(situation, unit, layout, own, first + bit, perceived, ranges)
                force = _force(arrays.table, TAKEN if taken else FREE, distance)
                ahead += force * x
                left += force * y
        for first in range(own, inputs, WORD):
            word = teammates(situation, first, inputs, layout) if first > own else perceived
            while word:
                bit, word = lowest(word)
                distance, x, y = place(situation, unit, layout, own, first + bit)
                force = _force(arrays.table, TEAMMATE, distance)
                ahead += force * x
                left += force * y
        _move(ahead, left, i, percept, action)


@inlined
def _move(ahead: float, left: float, i: int, percept: Any, action: Any) -> None:
    """Write a full step along a force relative to the heading, or straight on if there is none."""
    x = percept.heading[i, 0]
    y = percept.heading[i, 1]
    square = ahead * ahead + left * left
    if square > _LEAST_FORCE * _LEAST_FORCE:
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
        The force of taken targets and of teammates is 0 unless the slope is farther than this from 0 [standard errors];
        0 keeps all slopes as they are.
    stride : float, optional
        Distance of a full step over the sensing range. By default from the memory's settings, which name one speed and
        one range unless the robots of the exploration differed.

    Attributes
    ----------
    forces : mapping of str to ndarray, shape (points,), float64
        For each kind of reading the force at equally spaced distances from 0 to the range [reward per range]; positive
        is attraction.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, the reward does not return a finite number for each transition, the
        memory's settings lack speed and ranges, or its inputs do not show where teammates are.

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
    kernel = follow_forces

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.number("bandwidth", self.bandwidth, above=0)
        for name in ("ridge", "significance"):
            checks.number(name, getattr(self, name), least=0)
        if self.stride is not None:
            checks.number("stride", self.stride, above=0)
        self._check_settings()
        object.__setattr__(self, "forces", self._fitted())

    def _check_settings(self) -> None:
        """Raise an error that names all settings of the memory that are needed and missing."""
        added, settings = self.inputs > self.memory.own, self.memory.settings
        examples = {"robot_speed": 0.1} if self.stride is None else {}
        if self.stride is None or added:
            examples["sensing_range"] = 1.0
        needed = examples | ({"awareness_range": 1.0, "teammate_layout": "sectors"} if added else {})
        missing = {name: example for name, example in needed.items() if settings.get(name) is None}
        if not missing:
            return
        cures = [f"explore again, or add what is true, as in LazyMemory.of(…, settings={missing})"]
        if "merged" in settings:
            cures = ["merge explorations that agree in them"]
        if missing.keys() & {"robot_speed", "sensing_range"} and self.stride is None:
            cures.append("or give stride, the distance of a step over the sensing range")
        if added:
            cures.append(f"or give inputs={self.memory.own}, which uses targets only")
        raise ValueError(f"memory: its settings lack {', '.join(missing)}; {', '.join(cures)}")

    @property
    def layout(self) -> str:
        """How the inputs show where teammates are; see ``Awareness.teammate_layout``."""
        added = self.inputs - self.memory.own
        if not added:
            return ""
        layout = self.memory.settings.get("teammate_layout")
        if layout not in LAYOUTS[1:] or (layout == "offsets" and added % 2):
            degree = checks.shown(self.memory.settings.get("degree"))
            raise ValueError(
                f"memory: the {added} inputs of its degree of awareness, {degree}, do not show where teammates are "
                f"(teammate_layout={checks.shown(layout)}); explore with awareness='ring' or 'pairwise' "
                f"(--awareness ring), use another learner (--learner linear), or give inputs={self.memory.own}, which "
                "uses targets only"
            )
        return str(layout)

    def _length(self, name: str, cure: str) -> float:
        value = self.memory.settings.get(name)
        # Explorations of robots that differ have two values, merged ones that differ none.
        if not isinstance(value, int | float) or not 0 < value < math.inf:
            found = f"memory: {name}={checks.shown(value)} in its settings"
            raise ValueError(f"{found}: must be one positive number; {cure}")
        return float(value)

    def _scales(self) -> tuple[float, float]:
        """Return the distance of a full step and the awareness range, both over the sensing range."""
        stride, cure = self.stride, "explore with robots of one speed and range, or give stride"
        if stride is None:
            # Distances are read as shares of the largest in range.
            farthest = math.sqrt(2.0) if self.memory.settings.get("range_shape") == "square" else 1.0
            stride = self._length("robot_speed", cure) / (farthest * self._length("sensing_range", cure))
        if not self.layout:
            return stride, 1.0
        cure = "explore with robots of one range, or add it to the settings"
        return stride, self._length("awareness_range", cure) / self._length("sensing_range", cure)

    def _fitted(self) -> Mapping[str, Floats]:
        stride, ratio = self._scales()
        rewards = rewards_of(self.memory, self.reward)
        if (most := np.abs(rewards).max()) > MOST:
            name = name_of(self.reward)
            raise ValueError(f"reward {name}: is up to {most:g}, must be at most {MOST:g}; give smaller rewards")
        found = readings_of(self.memory, self.inputs, self.layout, ratio, stride)
        point = np.linspace(0.0, 1.0, POINTS)
        forces = {}
        for kind, name in enumerate(KINDS):
            chosen = found.kind == kind
            moved, response = found.moved[chosen], rewards[found.transition[chosen]]
            given = None if kind == FREE else found.distance[chosen]
            slopes = local_slopes(moved, response, point, self.bandwidth, self.ridge, given=given)
            forces[name] = -significant(slopes, 0.0 if kind == FREE else self.significance)
        if not any(map(np.any, forces.values())):
            self._warn(rewards)
        return forces

    def _warn(self, rewards: Floats) -> None:
        within = f" within bandwidth={self.bandwidth:g}; give a larger bandwidth, such as 1, or"
        near = within if self.bandwidth < 1 else ";"
        why = f"{len(rewards)} transitions are too few for a slope{near} explore longer"
        if (rewards == rewards[0]).all():
            same = f"{name_of(self.reward)} is {rewards[0] + 0.0:g} for all {len(rewards)} transitions"
            why = f"{same}; explore longer, or give another reward"
        # The level is that of the line that makes the learner.
        warnings.warn(f"LazyRegression: robots will go straight on, since {why}", stacklevel=5)

    @property
    def learned(self) -> Floats:
        return np.stack(list(self.forces.values()))

    @property
    def table(self) -> npt.NDArray[np.float32]:
        # Only the direction of the sum matters: in these units it does not depend on the unit of the reward.
        return (self.learned / (np.abs(self.learned).max() or 1.0)).astype(np.float32)

    @property
    def parameters(self) -> Floats:
        return parameters_of(self.memory.own, self.inputs - self.memory.own, self.layout)


def parameters_of(own: int, added: int, layout: str) -> Floats:
    """Return the parameters of `follow_forces`; see `unit_vectors`."""
    return np.concatenate([[own, LAYOUTS.index(layout)], unit_vectors(own, added, layout).ravel()])
