"""Contacts and observations as tables, from the contact logs of a world."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.events.contact_log import ContactLog


def contact_table(sources: Iterable[Any]) -> pd.DataFrame:
    """Return the contacts of the contact logs among event sources; see `World.contacts`."""
    logs = [source for source in sources if isinstance(source, ContactLog)]
    logged = [log.contacts for log in logs]
    rows = [len(one.tick) for one in logged]

    def joined(name: str, dtype: Any) -> Any:
        return np.concatenate([np.zeros(0, dtype), *(getattr(one, name) for one in logged)])

    return pd.DataFrame({
        "tick": joined("tick", np.int64),
        "begun": joined("begun", np.bool_),
        "group": np.repeat(np.array([log.observers for log in logs], object), rows),
        "channel": np.repeat(np.array([log.channel for log in logs], object), rows),
        "observer": joined("observer", np.int64),
        "observed": joined("observed", np.int64),
    })  # fmt: skip


class Observations(NamedTuple):
    """When agents began to be observed by any, and ceased to be: arrays of shape (k,), by tick and then by agent.

    Attributes
    ----------
    tick : ndarray, int64
        When.
    begun : ndarray, bool
        Whether it is now observed; False if it is no longer.
    observed : ndarray, int64
        The `unique_id` of the agent.
    """

    tick: npt.NDArray[np.int64]
    begun: npt.NDArray[np.bool_]
    observed: npt.NDArray[np.int64]


def observations(logs: Iterable[ContactLog]) -> Observations:
    """Return when agents were observed by at least one of the observers of these logs, and when no longer."""
    logged = [log.contacts for log in logs]
    tick = np.concatenate([np.zeros(0, np.int64), *(one.tick for one in logged)])
    observed = np.concatenate([np.zeros(0, np.int64), *(one.observed for one in logged)])
    change = np.concatenate([np.zeros(0, np.int64), *(np.where(one.begun, 1, -1) for one in logged)])
    order = np.lexsort((tick, observed))
    tick, observed = tick[order], observed[order]
    # All observers that an agent gains and loses so far, as one sum over all agents: what begins ends no earlier.
    count = np.cumsum(change[order])
    last = np.ones(len(tick), bool)
    last[:-1] = (np.diff(tick) != 0) | (np.diff(observed) != 0)
    tick, observed, count = tick[last], observed[last], count[last]
    first = np.ones(len(tick), bool)
    first[1:] = np.diff(observed) != 0
    # Agents that are still observed in the end leave their observers in the sum.
    left_over = np.concatenate([[0], count])[:-1]
    base = np.maximum.accumulate(np.where(first, np.arange(len(tick)), 0)) if len(tick) else np.zeros(0, np.int64)
    is_so = count - left_over[base] > 0
    was_so = np.concatenate([[False], is_so])[:-1] & ~first
    changed = is_so != was_so
    tick, observed, begun = tick[changed], observed[changed], is_so[changed]
    order = np.lexsort((observed, tick))
    return Observations(tick[order], begun[order], observed[order])
