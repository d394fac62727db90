"""Durations: the times that pass until something happens, drawn from one uniform number each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.core import checks
from teamsight.core.component import Allowed, Component

if TYPE_CHECKING:
    from teamsight.agents.events.sources import EventSource

# Shorter mean durations would be more than a million events for a robot in a tick.
_LEAST = 1e-6
_MOST = 1e15
_CURE = "it is a time in ticks, such as 500; leave the component, or the time to a repair, out for never"
_Time = Annotated[float, Allowed(least=_LEAST, most=_MOST, cure=_CURE, unit="ticks")]


class Duration(Component):
    """The distribution of a time that passes until something happens.

    A distribution of one's own is a subclass with `draw`.
    """

    def draw(self, uniform: float) -> float:
        """Return a duration [ticks], by inversion.

        Parameters
        ----------
        uniform : float
            A uniform random number, in (0, 1).
        """
        raise NotImplementedError(f"{type(self).__name__}: must define draw(uniform), which returns a time [ticks]")


@dataclass(frozen=True)
class Exponential(Duration):
    """Exponential durations: what happens does so at a constant rate, 1 / `mean`, whatever has passed.

    Parameters
    ----------
    mean : float
        The mean duration [ticks], at least 1e-6.

    Raises
    ------
    TypeError, ValueError
        If it is not a number, or outside the limits.
    """

    mean: _Time

    def draw(self, uniform: float) -> float:
        """Return a duration [ticks]; see `Duration.draw`."""
        return -self.mean * math.log(uniform)


@dataclass(frozen=True)
class Weibull(Duration):
    """Weibull durations: with a shape above 1 what is older fails sooner, below 1 later; 1 is exponential.

    Parameters
    ----------
    scale : float
        The duration that the share 1 − 1/e of all does not exceed [ticks], at least 1e-6.
    shape : float
        The shape, from 0.1 to 100.

    Raises
    ------
    TypeError, ValueError
        If a value is not a number, or outside the limits.
    """

    scale: _Time
    shape: Annotated[float, Allowed(least=0.1, most=100, cure="1 is exponential")]

    def draw(self, uniform: float) -> float:
        """Return a duration [ticks]; see `Duration.draw`."""
        return float(self.scale * (-math.log(uniform)) ** (1.0 / self.shape))

    @property
    def mean(self) -> float:
        """The mean duration [ticks]."""
        return self.scale * math.exp(math.lgamma(1.0 + 1.0 / self.shape))


@dataclass(frozen=True)
class Constant(Duration):
    """Durations that are all the same.

    Parameters
    ----------
    value : float
        The duration [ticks], at least 1e-6.

    Raises
    ------
    TypeError, ValueError
        If it is not a number, or outside the limits.
    """

    value: _Time

    def draw(self, uniform: float) -> float:
        """Return the duration [ticks]."""
        return self.value

    @property
    def mean(self) -> float:
        """The duration [ticks]."""
        return self.value


@dataclass(frozen=True)
class Times:
    """A list of times, instead of a distribution.

    As the time to an event, these are the ticks at which it happens, counted from the start of the run; one at which
    it cannot happen, since it has happened and is not over, is passed over. As how long something lasts, they are
    durations: that of the first time, of the second, and so on. After the last there are no more.

    Parameters
    ----------
    times : array_like, or mapping of int to array_like
        The times [ticks], for each agent; or, by member (0 for the first agent of the group), those of some agents.
        Times of events ascend.

    Raises
    ------
    TypeError, ValueError
        If a time is not a number, negative, or infinite; or a member is not a whole number.
    """

    times: tuple[float, ...] | Mapping[int, tuple[float, ...]]

    def __init__(self, times: Iterable[float] | Mapping[int, Iterable[float]]) -> None:
        if isinstance(times, Mapping):
            each = {checks.count("member", member, least=0): _times(some) for member, some in times.items()}
            object.__setattr__(self, "times", each)
        else:
            object.__setattr__(self, "times", _times(times))

    def of(self, member: int) -> tuple[float, ...]:
        """Return the times of a member of the group."""
        return self.times.get(member, ()) if isinstance(self.times, Mapping) else self.times

    def after(self, now: float, member: int) -> float:
        """Return the first time of a member that is later than `now`; infinity if there is none."""
        return next((time for time in self.of(member) if time > now), math.inf)

    def lasting(self, index: int, member: int) -> float:
        """Return the time number `index` of a member as a duration; infinity after the last."""
        times = self.of(member)
        return times[index] if index < len(times) else math.inf

    def check_to_come(self, name: str, now: float) -> None:
        """Refuse times of events that have passed."""
        passed = min((time for times in self.every() for time in times), default=math.inf)
        if passed < now:
            raise ValueError(
                f"{name}: the time {passed:g} has passed; the present tick is {now:g}, so give later times, or attach "
                "it at the start of the run"
            )

    def check_members(self, name: str, members: list[int], group: str) -> None:
        """Refuse times of members that a group does not have."""
        unknown = sorted(set(self.times) - set(members)) if isinstance(self.times, Mapping) else []
        if unknown:
            raise ValueError(
                f"{name}: lists times for the members {', '.join(map(str, unknown))}, which {group!r} does not have; "
                "the first agent of a group is 0, and those that come later must be there, or Arrivals attached, before"
            )

    def every(self) -> list[tuple[float, ...]]:
        """Return all lists of times."""
        return list(self.times.values()) if isinstance(self.times, Mapping) else [self.times]


def time_to(name: str, value: Any) -> Duration | Times:
    """Return a user's value as the time to an event: a number is the mean of an exponential duration.

    Raises
    ------
    TypeError, ValueError
        If it is neither a number, nor a duration, nor `Times` that ascend.
    """
    found = _duration(name, value, "Times([100, 250])")
    for times in found.every() if isinstance(found, Times) else ():
        for one, other in pairwise(times):
            if one >= other:
                raise ValueError(f"{name}: the times {one:g} and {other:g} must ascend; sort them")
    return found


def lasting(name: str, value: Any) -> Duration | Times | None:
    """Return a user's value as how long something lasts; a number is the mean of an exponential duration.

    Raises
    ------
    TypeError, ValueError
        If it is neither a number, nor a duration, nor `Times` of at least 1e-6 ticks.
    """
    if value is None:
        return None
    found = _duration(name, value, "Times([20, 35])")
    for times in found.every() if isinstance(found, Times) else ():
        for time in times:
            _time(name, time)
    return found


#: The fields of components for these two.
TimeTo = Annotated[float | Duration | Times, Allowed(check=time_to, unit="ticks")]
Lasting = Annotated[float | Duration | Times, Allowed(check=lasting, unit="ticks")]


def next_time(source: EventSource, time_to: Any, member: int, number: int, index: int) -> float:
    """Return when the event `number` of a member happens [ticks]; `index` is that of its random number."""
    if isinstance(time_to, Times):
        # At the start, the present moment is not over.
        return time_to.after(math.nextafter(source.now, -1) if number == 0 else source.now, member)
    time: float = source.now + time_to.draw(source.random(member, index))
    return time


def length(source: EventSource, lasting: Any, member: int, number: int, index: int) -> float:
    """Return how long the event `number` of a member lasts [ticks]; `index` is that of its random number."""
    if lasting is None:
        return math.inf
    if isinstance(lasting, Times):
        return lasting.lasting(number, member)
    time: float = lasting.draw(source.random(member, index))
    return time


def _duration(name: str, value: Any, listed: str) -> Duration | Times:
    if isinstance(value, Duration | Times):
        return value
    try:
        return Exponential(_time(name, value))
    except TypeError:
        raise TypeError(
            f"{name}={checks.shown(value)}: must be a number, the mean of an exponential duration [ticks], or a "
            f"duration such as Weibull(500, 1.5), Constant(50) or {listed}; leave the component out for never"
        ) from None


def _time(name: str, value: Any) -> float:
    return checks.number(name, value, least=_LEAST, most=_MOST, cure=_CURE)


def _times(times: Any) -> tuple[float, ...]:
    if isinstance(times, str) or not isinstance(times, Iterable):
        raise TypeError(f"times={checks.shown(times)}: must be a list of times [ticks], such as Times([100, 250])")
    cure = "it is a time in ticks; leave out what never happens"
    return tuple(checks.number(f"times[{k}]", time, least=0, most=_MOST, cure=cure) for k, time in enumerate(times))
