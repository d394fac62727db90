"""`status`: how far a study is, read from its folder without writing."""

from __future__ import annotations

import os
from typing import NamedTuple


class Holder(NamedTuple):
    """A sweep that runs now."""

    host: str
    pid: int
    since: str
    shard: str
    engine: str
    workers: int


class Status(NamedTuple):
    """How far a study is.

    Attributes
    ----------
    planned : int
        Runs of the study; those known so far if it is adaptive.
    done, failed, missing : int
        Runs that are done, that have failed, and that are neither.
    running : int
        Those of the missing runs that workers have now.
    seconds_left : float or None
        Time until none is missing at the present rate [s]; None if no sweep runs, or its rate is not known yet.
    rate : float or None
        Runs per second of the sweeps that run now, or else of the last one.
    holders : tuple of Holder
        The sweeps that run now.
    damaged : tuple of str
        Parts that are damaged; their runs are missing.
    """

    planned: int
    done: int
    failed: int
    missing: int
    running: int
    seconds_left: float | None
    rate: float | None
    holders: tuple[Holder, ...]
    damaged: tuple[str, ...]


def status(folder: str | os.PathLike[str]) -> Status:
    """Return how far a study is, also while a sweep runs.

    Raises
    ------
    ValueError
        If this is not the folder of a study.
    """
    raise NotImplementedError
