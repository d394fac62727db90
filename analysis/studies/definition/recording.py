"""What a study records of each run, and until when it adds replicates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeVar

from teamsight.analysis.studies.definition.values import frozen
from teamsight.core import checks

T = TypeVar("T", bound=tuple[Any, ...])


class Record(NamedTuple):
    """What is recorded of each run.

    Attributes
    ----------
    measure : str
        What is measured of the whole run: "summary", "evenness", a plug-in, or the function "package.module:name",
        which is called as ``measure(world, steps)`` and returns a NamedTuple or a mapping.
    steps : bool
        Whether the history is recorded: one row for each step.
    trajectories : int
        Record the positions of all robots at every so many steps; 0 for never.
    events : bool
        Whether the log of events is recorded.
    """

    measure: str = "summary"
    steps: bool = False
    trajectories: int = 0
    events: bool = False


class Until(NamedTuple):
    """Until when replicates are added to a setting.

    Attributes
    ----------
    interval : float
        The largest width of the 95 % interval of the mean, from its low to its high end, in the unit of the measure.
    measure : str
        The column of the table whose mean it is.
    limit : int
        The most replicates of a setting.

    Notes
    -----
    The interval is Student's; for True and False it is Wilson's. A setting has at least 38 replicates, or the limit;
    see `teamsight.analysis.studies.adaptive` for what the intervals are worth.
    """

    interval: float
    measure: str = "observed_fraction"
    limit: int = 1000


def record_of(given: object) -> Record:
    """Return what to record; raise TypeError or ValueError for what is not."""
    made = _named("record", given, Record, Record)
    measure = made.measure if isinstance(made.measure, str) else frozen("record.measure", made.measure)
    if not isinstance(measure, str) or not measure:
        raise TypeError(f"record.measure={checks.shown(measure)}: must be 'summary' or 'package.module:function'")
    every = checks.count("record.trajectories", made.trajectories, least=0, cure="0 records none")
    return Record(
        str(measure), checks.flag("record.steps", made.steps), every, checks.flag("record.events", made.events)
    )


def until_of(given: object, replicates: int) -> Until | None:
    """Return until when replicates are added; raise TypeError or ValueError for what is wrong."""
    if given is None:
        return None
    if isinstance(given, Mapping) and "interval" not in given:
        raise ValueError("until: has no interval; give one, as in until = {interval = 0.01}")
    made = _named("until", given, Until, Until)
    if not isinstance(made.measure, str) or not made.measure:
        raise TypeError(f"until.measure={checks.shown(made.measure)}: must be a column, such as 'observed_fraction'")
    limit = checks.count("until.limit", made.limit, least=2)
    if limit < replicates:
        raise ValueError(f"until.limit={limit}: must be at least replicates={replicates}; raise it")
    return Until(checks.number("until.interval", made.interval, above=0), str(made.measure), limit)


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


def _named(where: str, given: object, kind: type[T], make: Callable[..., T]) -> T:
    if isinstance(given, kind):
        return given
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}={checks.shown(given)}: must be a table or a {kind.__name__}")
    for key in given:
        checks.choice(f"{where}: key", key, kind._fields)  # type: ignore[attr-defined]
    return make(**given)
