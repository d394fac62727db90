"""What a study records of each run, and until when it adds replicates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from teamsight.analysis.studies.definition.values import frozen
from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Flag, Positive, declared

C = TypeVar("C", bound=Component)


def _measure(name: str, given: Any) -> str:
    measure = given if isinstance(given, str) else frozen(name, given)
    if not isinstance(measure, str) or not measure:
        shown = checks.shown(measure)
        raise TypeError(f"{name}={shown}: must be a text, such as 'summary' or 'package.module:function'")
    return str(measure)


@dataclass(frozen=True)
class Record(Component):
    """What is recorded of each run.

    Parameters
    ----------
    measure : str
        What is measured of a whole run: "summary", "evenness", a plug-in, or the function "package.module:name", which
        is called as ``measure(world, steps)`` and returns a NamedTuple or a mapping.
    steps : bool
        Whether one row for each step is recorded.
    trajectories : int
        Record positions at every so many steps; 0 for never.
    events : bool
        Whether the log of events is recorded.
    """

    measure: Annotated[str, Allowed(check=_measure)] = "summary"
    steps: Flag = False
    trajectories: Annotated[int, Allowed(least=0, cure="0 records none")] = 0
    events: Flag = False


@dataclass(frozen=True)
class Until(Component):
    """Until when replicates are added to a setting.

    Parameters
    ----------
    interval : float
        The largest width of the 95 % interval of the mean, from its low to its high end, in the unit of the measure.
    measure : str
        The column of results whose mean it is.
    limit : int
        The most replicates of a setting.

    Notes
    -----
    The interval is Student's; for True and False it is Wilson's. A setting has at least 38 replicates, or the limit;
    see `teamsight.analysis.studies.standing` for what the intervals are worth.
    """

    interval: Positive
    measure: Annotated[str, Allowed(check=_measure)] = "observed_fraction"
    limit: Annotated[int, Allowed(least=2)] = 1000


def until_of(given: object, replicates: int) -> Until | None:
    """Return until when replicates are added; raise TypeError or ValueError for what is wrong."""
    if given is None:
        return None
    if isinstance(given, Mapping) and "interval" not in given:
        raise ValueError("until: has no interval; give one, as in until = {interval = 0.01}")
    made = made_of("until", given, Until)
    if made.limit < replicates:
        raise ValueError(f"until.limit={made.limit}: must be at least replicates={replicates}; raise it")
    return made


def made_of(where: str, given: object, kind: type[C]) -> C:
    """Return a component for a table of a study; errors name the place."""
    if isinstance(given, kind):
        return given
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}={checks.shown(given)}: must be a table or a {kind.__name__}")
    known = declared(kind)
    for key in given:
        checks.choice(f"{where}: key", key, known)
    return kind(**{key: known[key].checked(value, f"{where}.{key}") for key, value in given.items()})


def check_measured(until: Until, kinds: Mapping[str, str | None]) -> None:
    """Check that what decides how many replicates there are is a number.

    Parameters
    ----------
    until : Until
        Its measure is looked for.
    kinds : mapping of str to str or None
        What each measured column holds: "text" or another; None where it is not known.

    Raises
    ------
    ValueError
        If it is not measured, or a text.
    """
    shown = f"until.measure={checks.shown(until.measure)}"
    if until.measure not in kinds:
        hint = checks.suggestion(until.measure, kinds)
        raise ValueError(f"{shown}: is not measured; {hint}give one of {', '.join(kinds)}")
    if kinds[until.measure] == "text":
        raise ValueError(f"{shown}: holds texts; give a measure that is a number")
