"""Sensors: which of the agents within range an observer senses, and where they appear to be."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.agents.sensing import standard
from teamsight.agents.sensing.binding import detect
from teamsight.agents.sensing.interface import View, salt_of
from teamsight.agents.sensing.parameters import PER_RADIAN
from teamsight.core import checks
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Arena
from teamsight.world.noise import Stream, key_of, stream_number
from teamsight.world.proximity.search import proximity_graph
from teamsight.world.proximity.shapes import farthest_of
from teamsight.world.sight import open_sight

#: The largest delay [ticks]; the measurements of as many ticks are kept.
MOST_DELAY = 1_000

_FULL_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Sensor:
    """The sensor of a group for one channel: by default exact, all around, within range and in line of sight.

    Parameters
    ----------
    field_of_view : float, default 2π
        The angle that it covers, centred on the heading [rad]; above 0, at most 2π.
    range_noise : float, default 0
        Standard deviation of distances [length].
    bearing_noise : float, default 0
        Standard deviation of bearings [rad]; at most π.
    missed : float, default 0
        Probability that an agent in view is not sensed at a tick.
    false_positives : float, default 0
        Probability that an observer senses at a tick an agent that is not there: a random agent of the observed groups
        that it does not sense at this tick appears at a random place in the field of view, within range; none if that
        agent is inactive.
    delay : int, default 0
        Time from measuring to the percept [ticks], at most `MOST_DELAY`. Until the first measurement arrives, the
        percept is empty.
    occluded : bool, default True
        Whether obstacles and walls block its sight.
    range : float, optional
        Range of the sensor [length], for other channels than targets and teammates; those have the `sensing_range` and
        the `awareness_range` of the group.

    Attributes
    ----------
    sense : kernel
        ``sense(view, parameters, sensed)`` writes the neighbour list `sensed` for a `View`, and returns the number of
        entries that it needs. If there is less room than that, it is called again with more. `sensed.identity` holds
        the index among the observed, or ``~index`` for a false detection; indices ascend for each observer.

    Raises
    ------
    TypeError, ValueError
        If an option has the wrong type or is outside its limits.

    Notes
    -----
    Noisy distances saturate: a reading is at most the range, √2 times that if ranges are squares, and at least a
    millionth of the range. All noise is a function of
    the world's seed, the channel, the tick, the observer and the observed agent.

    A sensor of one's own is a subclass with another `sense` and the `parameters` that it reads; `check_sensor` checks
    it. Its `delay` and `range` work as here; its kernel has to implement the rest.

    *Departs:* the paper's sensors are exact and see all around (§3, §5).
    """

    field_of_view: float = _FULL_TURN
    range_noise: float = 0.0
    bearing_noise: float = 0.0
    missed: float = 0.0
    false_positives: float = 0.0
    delay: int = 0
    occluded: bool = True
    range: float | None = None

    sense: ClassVar[Callable[..., int]] = standard.sense

    def __post_init__(self) -> None:
        checked = {
            "field_of_view": checks.angle("field_of_view", self.field_of_view, _FULL_TURN),
            "range_noise": checks.number("range_noise", self.range_noise, least=0),
            "bearing_noise": checks.angle("bearing_noise", self.bearing_noise, math.pi),
            "missed": checks.number("missed", self.missed, least=0, most=1),
            "false_positives": checks.number("false_positives", self.false_positives, least=0, most=1),
            "delay": checks.count("delay", self.delay, least=0, most=MOST_DELAY, cure="it is a number of ticks"),
            "occluded": checks.flag("occluded", self.occluded),
            "range": None if self.range is None else checks.number("range", self.range, above=0),
        }
        if checked["field_of_view"] == 0:
            raise ValueError("field_of_view=0.0: must be above 0 [rad]; to sense nothing, use missed=1")
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        values = [(each, getattr(self, each.name)) for each in fields(self)]
        changed = ", ".join(f"{each.name}={value!r}" for each, value in values if value != each.default)
        return f"{type(self).__name__}({changed})"

    @property
    def parameters(self) -> npt.NDArray[np.float64]:
        """The constants that the kernel reads, shape (p,)."""
        is_all_round = self.field_of_view >= _FULL_TURN
        return np.array([
            -2.0 if is_all_round else math.cos(0.5 * self.field_of_view), self.field_of_view * PER_RADIAN,
            self.range_noise, self.bearing_noise * PER_RADIAN,
            self.missed, self.false_positives, self.occluded,
        ])  # fmt: skip

    @property
    def is_perfect(self) -> bool:
        """Whether it senses exactly what is in range, at once; if `occluded`, where nothing blocks its sight."""
        is_standard = type(self).sense is Sensor.sense and type(self).parameters is Sensor.parameters
        is_noisy = self.range_noise or self.bearing_noise or self.missed or self.false_positives or self.delay
        return is_standard and self.field_of_view >= _FULL_TURN and not is_noisy

    def detect(
        self,
        observers: npt.ArrayLike,
        observed: npt.ArrayLike | None,
        heading: npt.ArrayLike,
        reach: npt.ArrayLike,
        *,
        arena: Arena | None = None,
        range_shape: str = "disc",
        seed: int = 0,
        tick: int = 0,
    ) -> NeighbourList:
        """Return what observers sense at once, without a world; `delay` and `range` have no effect here.

        Parameters
        ----------
        observers : array_like, shape (n, 2)
            Positions [length].
        observed : array_like, shape (m, 2), or None
            Positions [length]; None for the observers among themselves.
        heading : array_like, shape (n, 2)
            The observers' headings, unit vectors.
        reach : float or array_like, shape (n,)
            The range of each observer [length].
        arena : Arena, optional
            The arena, with what blocks the sight. By default the plane.
        range_shape : {"disc", "square"}
            The shape of ranges.
        seed, tick : int, default 0
            The noise is a function of these two.

        Returns
        -------
        NeighbourList
            `identity` holds the row in `observed`, or ``~row``, −1 − row, for a false detection.

        Raises
        ------
        ValueError
            If an array has the wrong shape, or a heading is not a unit vector.
        """
        in_range = proximity_graph(observers, observed, reach, arena, range_shape=range_shape)
        position = np.array(observers, float)
        size = len(position)
        facing = np.array(heading, float)
        if facing.shape != (size, 2) or not np.allclose(np.hypot(*facing.T), 1.0, rtol=0, atol=1e-6):
            raise ValueError(f"heading: must be {size} unit vectors, of shape ({size}, 2), one for each observer")
        view = View(
            np.array([checks.count("tick", tick, least=0)]), key_of(seed), salt_of("targets"),
            stream_number(Stream.SENSOR, 0), np.arange(size), position, facing,
            np.array(np.broadcast_to(np.asarray(reach, float), size)),
            np.arange(size if observed is None else len(np.asarray(observed))), 0 if observed is None else -1,
            in_range, arena.sight if arena else open_sight(), farthest_of(range_shape),
        )  # fmt: skip
        return detect(self, view)
