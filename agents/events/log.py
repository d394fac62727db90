"""The event log: who did what when."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.core import checks

# What a detail can be: a value of a table.
_PLAIN = (str, int, float, np.number, np.bool_, type(None))


class LoggedEvent(NamedTuple):
    """One row of the log; see `EventLog.frame`."""

    time: float
    tick: int
    what: str
    group: str | None
    agent: int | None
    source: str | None
    details: dict[str, Any]


class EventLog:
    """The events of a run, in the order in which they happened.

    Attributes
    ----------
    rows : list of LoggedEvent
        One for each event.
    """

    def __init__(self, rows: Iterable[LoggedEvent] = ()) -> None:
        self.rows = list(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def append(
        self, time: float, tick: int, what: str, group: str | None, agent: int | None, source: str | None,
        details: dict[str, Any],
    ) -> None:  # fmt: skip
        """Append an event that has been checked."""
        self.rows.append(LoggedEvent(time, tick, what, group, agent, source, details))

    def frame(self) -> pd.DataFrame:
        """Return the log as a table.

        Returns
        -------
        DataFrame
            The columns time [ticks] (float64), tick (int64), what, group (text), agent (Int64, the `unique_id`), source
            (text), and one for each detail. Values that an event does not have are missing.
        """
        rows = self.rows
        columns: dict[str, Any] = {
            "time": np.array([row.time for row in rows], np.float64),
            "tick": np.array([row.tick for row in rows], np.int64),
            "what": pd.array([row.what for row in rows], dtype="string"),
            "group": pd.array([row.group for row in rows], dtype="string"),
            "agent": pd.array([row.agent for row in rows], dtype="Int64"),
            "source": pd.array([row.source for row in rows], dtype="string"),
        }
        names = dict.fromkeys(name for row in rows if row.details for name in row.details)
        for name in names:
            columns[name] = _column([row.details.get(name) for row in rows])
        return pd.DataFrame(columns)


OWN_COLUMNS = LoggedEvent._fields[:-1]


def check_event(what: Any, details: dict[str, Any]) -> None:
    """Refuse what is no name of an event, and details that a table cannot hold.

    Raises
    ------
    TypeError, ValueError
        If it is not a text, or a detail is not a number, a text, True, False or None, or has the name of a column.
    """
    if not isinstance(what, str) or not what:
        shown = checks.shown(what)
        raise TypeError(f"log({shown}): must be a text that says what happened, as in log('painted', robot)")
    for name, value in details.items():
        if name in OWN_COLUMNS:
            raise ValueError(f"log({what!r}, {name}=…): the log has a column of this name already; take another name")
        if not isinstance(value, _PLAIN):
            raise TypeError(
                f"log({what!r}, {name}={checks.shown(value)}): must be a number, a text, True, False or None; give its "
                "parts as details of their own, as in log('moved', robot, x=0.5, y=1.0)"
            )


def _column(values: list[Any]) -> Any:
    """Return details as an array: numbers as floats or integers, texts as texts, others as objects."""
    present = [value for value in values if value is not None]
    if all(isinstance(value, (bool, np.bool_)) for value in present):
        return pd.array(values, dtype="boolean")
    if all(isinstance(value, (int, np.integer)) and not isinstance(value, bool) for value in present):
        return pd.array(values, dtype="Int64")
    if all(isinstance(value, (int, float, np.number)) and not isinstance(value, bool) for value in present):
        return np.array([np.nan if value is None else value for value in values], np.float64)
    texts = [value if value is None or isinstance(value, str) else str(value) for value in values]
    return pd.array(texts, dtype="string")
