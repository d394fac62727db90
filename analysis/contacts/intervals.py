"""Contacts as intervals of time: how long two robots are neighbours, and how long they are not between two contacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.contacts.frames import Edges

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

# Why a contact begins or ends.
_CAUSES = ["range", "presence", "record", "unknown"]


class Spans(NamedTuple):
    """Contacts by frame, ordered by pair and time.

    Attributes
    ----------
    one, other : ndarray of int64, shape (k,)
        Rows of the two robots.
    first, last : ndarray of int64, shape (k,)
        The first and the last frame in which they are neighbours.
    """

    one: Ints
    other: Ints
    first: Ints
    last: Ints


def spans(edges: Edges, size: int, frames: int) -> Spans:
    """Return the longest stretches of successive frames in which the same two robots are neighbours.

    Parameters
    ----------
    edges : Edges
        The edges of all frames.
    size, frames : int
        Number of robots and of frames.
    """
    frames = max(frames, 1)
    key = np.sort((edges.one * size + edges.other) * frames + edges.frame)
    # Frame 0 of a pair may follow the last frame of the pair before.
    new = (np.diff(key, prepend=-2) != 1) | (key % frames == 0)
    begin, end = key[new], key[np.append(new[1:], True)[: len(key)]]
    pair, first = np.divmod(begin, frames)
    one, other = np.divmod(pair, max(size, 1))
    return Spans(one, other, first, end % frames)


def contact_table(
    found: Spans, time: Floats, present: NDArray[np.bool_] | None, identity: NDArray[np.generic]
) -> pd.DataFrame:
    """Return one row for each contact; see `TemporalGraph.contacts`. `present` is None if nobody knows who is there."""
    end = len(time) - 1
    before, after = np.maximum(found.first - 1, 0), np.minimum(found.last + 1, end)

    def cause(frame: Ints, at_edge: NDArray[np.bool_]) -> pd.Categorical[str]:
        why: NDArray[np.str_] = np.full(len(frame), "unknown")
        if present is not None:
            why = np.where(present[frame, found.one] & present[frame, found.other], "range", "presence")
        return pd.Categorical(np.where(at_edge, "record", why), _CAUSES)

    return pd.DataFrame(
        {
            "one": identity[found.one],
            "other": identity[found.other],
            "begin": time[found.first],
            "end": time[after],
            "duration": time[after] - time[found.first],
            "began_by": cause(before, found.first == 0),
            "ended_by": cause(after, found.last == end),
        }
    )


def gap_table(
    found: Spans, time: Floats, present: NDArray[np.bool_] | None, identity: NDArray[np.generic]
) -> pd.DataFrame:
    """Return one row for each time between contacts of two robots; see `TemporalGraph.gaps` and `contact_table`."""
    end = len(time) - 1
    new = (np.diff(found.one, prepend=-1) != 0) | (np.diff(found.other, prepend=-1) != 0)
    last = np.append(new[1:], True)[: len(new)]
    # Before the first contact of a pair, between two, and after the last one.
    lead, tail = new & (found.first > 0), last & (found.last < end)
    between = np.flatnonzero(~new)
    row = np.concatenate([np.flatnonzero(lead), between, np.flatnonzero(tail)])
    begin = np.concatenate([np.zeros(lead.sum(), np.int64), found.last[between - 1] + 1, found.last[tail] + 1])
    until = np.concatenate([found.first[lead], found.first[between], np.full(tail.sum(), end)])
    one, other = found.one[row], found.other[row]
    unknown = pd.array([pd.NA] * len(row), "boolean")
    absence = unknown if present is None else _absence(present, begin, until, one, other)
    table = pd.DataFrame(
        {
            "one": identity[one],
            "other": identity[other],
            "begin": time[begin],
            "end": time[until],
            "duration": time[until] - time[begin],
            "left_censored": np.repeat([True, False, False], [lead.sum(), len(between), tail.sum()]),
            "right_censored": np.repeat([False, False, True], [lead.sum(), len(between), tail.sum()]),
            "absence": absence,
        }
    )
    return table.iloc[np.lexsort((begin, other, one))].reset_index(drop=True)


def _absence(present: NDArray[np.bool_], begin: Ints, until: Ints, one: Ints, other: Ints) -> NDArray[np.bool_]:
    """Return whether one of two robots was not there in any frame from `begin` to before `until`."""
    absent = np.zeros((len(present) + 1, present.shape[1]), np.int64)
    np.cumsum(~present, axis=0, out=absent[1:])
    return np.asarray(sum(absent[until, side] - absent[begin, side] for side in (one, other))) > 0
