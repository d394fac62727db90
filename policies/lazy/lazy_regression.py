"""Lazy learning by locally weighted regression: how does the reward change with the distance to what is sensed?"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import NonNegative, Positive
from teamsight.core.kernel import Entry, Record, inlined, lowest_bit
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.readings import (
    FREE,
    KINDS,
    LAYOUTS,
    TAKEN,
    TEAMMATE,
    WORD,
    is_taken,
    place,
    readings_of,
    sensed,
    teammates,
    unit_vectors,
)
from teamsight.policies.learner import Learner, refuse
from teamsight.policies.memory.transitions import MOST
from teamsight.policies.rewards import Reward, keep_reward, name_of, rewards_of

# An observation of a larger leverage determines its own fit, so that its residual says nothing about the error.
_MOST_LEVERAGE = 1.0 - 1e-9
# Smaller sums of squares are rounding: all numbers are equal.
_LEAST_SPREAD = 1e-12


class Regression(NamedTuple):
    """The record of a regression.

    Attributes
    ----------
    place, x, y : ndarray, shape (n,), float64
        Where the observations are, the variable and the response.
    control : int
        1 if the slope is that of x at a given place, so that the effect of the place itself is taken out; else 0.
    point : ndarray, shape (points,), float64
        Places at which the slope is wanted.
    bandwidth, ridge : float
        See `local_slopes`.
    slope, error : ndarray, shape (points,), float64
        Written: the slopes and their standard errors.
    """

    place: Annotated[Floats, "n"]
    x: Annotated[Floats, "n"]
    y: Annotated[Floats, "n"]
    control: int
    point: Annotated[Floats, "points"]
    bandwidth: float
    ridge: float
    slope: Annotated[Floats, "points"]
    error: Annotated[Floats, "points"]


REGRESSION = Record(Regression)
regression_at = REGRESSION.at


class _Fit(NamedTuple):
    """What centres the observations around a point: means, and the slopes of x and y along the place."""

    weights: float
    place: float
    x: float
    y: float
    square: float  # the weighted sum of squares of the place, 0 without control
    along_x: float
    along_y: float


@inlined
def _centred(record: Any, i: int, point: float, fit: Any) -> tuple[Any, Any, Any, Any]:
    """Return weight, place, x and y of an observation, centred, and x without what follows from its place."""
    apart = record.place[i] - point
    u = apart / record.bandwidth
    place = apart - fit.place
    return max(0.0, 1.0 - u * u), place, record.x[i] - fit.x - fit.along_x * place, record.y[i] - record.y[0] - fit.y


@inlined
def _fit_at(record: Any, point: float) -> Any:
    """Return the `_Fit` at a point, with 0 weights if no observation is near."""
    fit = _Fit(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    weights, mean_place, mean_x, mean_y = 0.0, 0.0, 0.0, 0.0
    for i in range(record.x.shape[0]):
        # The response is relative to the first, so that equal responses have the slope 0 exactly.
        weight, place, x, y = _centred(record, i, point, fit)
        weights += weight
        mean_place += weight * place
        mean_x += weight * x
        mean_y += weight * y
    if weights == 0.0:
        return fit
    fit = _Fit(weights, mean_place / weights, mean_x / weights, mean_y / weights, 0.0, 0.0, 0.0)
    if record.control == 0:
        return fit
    square, product_x, product_y = 0.0, 0.0, 0.0
    for i in range(record.x.shape[0]):
        weight, place, x, y = _centred(record, i, point, fit)
        square += weight * place * place
        product_x += weight * place * x
        product_y += weight * place * y
    if square <= _LEAST_SPREAD:
        return fit
    return _Fit(weights, fit.place, fit.x, fit.y, square, product_x / square, product_y / square)


@inlined
def _error(record: Any, point: float, fit: Any, square: float, slope: float) -> float:
    """Return the standard error of a slope whose variable has this weighted sum of squares."""
    variance = 0.0
    for i in range(record.x.shape[0]):
        weight, place, x, y = _centred(record, i, point, fit)
        leverage = weight / fit.weights + weight * x * x / square
        if fit.square > 0.0:
            leverage += weight * place * place / fit.square
        if leverage > _MOST_LEVERAGE:
            return math.inf
        residual = (y - fit.along_y * place - slope * x) / (1.0 - leverage)
        variance += (weight * x * residual) ** 2
    return math.sqrt(variance) / square


def _regress(address: int) -> int:
    record = regression_at(address)
    for p in range(record.point.shape[0]):
        point = record.point[p]
        record.slope[p] = 0.0
        record.error[p] = math.inf
        fit = _fit_at(record, point)
        square = 0.0
        product = 0.0
        for i in range(record.x.shape[0]):
            weight, _, x, y = _centred(record, i, point, fit)
            square += weight * x * x
            product += weight * x * y
        if fit.weights > 0.0 and square > _LEAST_SPREAD:
            shrinkage = square / (square + record.ridge)
            record.slope[p] = product / square * shrinkage
            record.error[p] = _error(record, point, fit, square, product / square) * shrinkage
    return 0


_REGRESS = Entry(_regress)


class Slopes(NamedTuple):
    """Slopes and their standard errors at some points, each of shape (points,), float64."""

    slope: Floats
    error: Floats


def local_slopes(
    x: Floats, y: Floats, point: Floats, bandwidth: float, ridge: float, *, given: Floats | None = None
) -> Slopes:
    """Return the slope of a locally weighted linear regression at each point.

    Parameters
    ----------
    x, y : ndarray, shape (n,), float64
        The variable and the response.
    point : ndarray, shape (points,), float64
        Where the slope is wanted.
    bandwidth : float
        An observation at distance u from a point has the weight max(0, 1 − (u / bandwidth)²).
    ridge : float
        Added to the weighted sum of squares of x; it draws slopes towards 0.
    given : ndarray, shape (n,), float64, optional
        A second variable, in whose place the points and the weights are then, and whose own linear effect is taken out:
        the slope is that of x at a given value of it.

    Returns
    -------
    Slopes
        Slope 0 where fewer than two different x have a weight. Errors allow for residuals of unequal variance: each is
        divided by 1 minus its leverage (HC3). They are infinite where a residual cannot be known, as for two x.

    Notes
    -----
    *Source:* C. G. Atkeson, A. W. Moore and S. Schaal, "Locally weighted learning" (1997); HC3: J. G. MacKinnon and
    H. White, "Some heteroskedasticity-consistent covariance matrix estimators" (1985).
    """
    found = Slopes(np.zeros(len(point)), np.zeros(len(point)))
    place, control = (x, 0) if given is None else (given, 1)
    _REGRESS(REGRESSION.pack(Regression(place, x, y, control, point, bandwidth, ridge, *found)))
    return found


def significant(slopes: Slopes, threshold: float) -> Floats:
    """Return slopes drawn towards 0: 0 for those within `threshold` standard errors of 0.

    Each is multiplied by max(0, 1 − (threshold · standard error / slope)²). For the threshold 0 nothing changes.

    Notes
    -----
    *Source:* L. Breiman, "Better subset regression using the nonnegative garrote" (1995).
    """
    slope, error = slopes
    if threshold == 0:
        return slope
    kept = np.abs(slope) > threshold * error
    ratio = np.divide(threshold * error, slope, out=np.ones(len(slope)), where=kept)
    return np.asarray(slope * (1.0 - ratio * ratio))


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
                bit, word = lowest_bit(word)
                at: Any = first + np.int64(bit)
                distance, x, y = place(situation, unit, layout, own, at)
                taken = is_taken(situation, unit, layout, own, at, perceived, ranges)
                force = _force(arrays.table, TAKEN if taken else FREE, distance)
                ahead += force * x
                left += force * y
        for first in range(own, inputs, WORD):
            word = teammates(situation, first, inputs, layout) if first > own else perceived
            while word:
                bit, word = lowest_bit(word)
                at = first + np.int64(bit)
                distance, x, y = place(situation, unit, layout, own, at)
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
        Draws all slopes towards 0.
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
    the transitions show one is an assumption; docs/learning-results.md shows what it is worth.
    """

    reward: Reward = keep_reward
    bandwidth: Positive = 1.0
    ridge: NonNegative = 0.5
    significance: NonNegative = 3.0
    stride: Positive | None = None
    forces: Mapping[str, Floats] = field(init=False)

    title = "locally weighted regression"
    kernel = follow_forces

    def __post_init__(self) -> None:
        super().__post_init__()
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
