"""Progress: the heartbeat of a running sweep, and how fast it is."""

from __future__ import annotations

import contextlib
import json
import math
import os
import socket
import time
from collections import deque
from pathlib import Path
from typing import NamedTuple

from teamsight.core import files

# Seconds between two heartbeats, and over which the rate is a mean.
_PERIOD, _WINDOW = 1.0, 60.0
# Bringing a file to disk may take long: the work lasts so many times as long as writing its heartbeats.
_FACTOR = 200.0
_MOST_READ = 65_536


class Progress(NamedTuple):
    """What a heartbeat says.

    Attributes
    ----------
    pid : int
        The process.
    host : str
        Its machine.
    engine, workers : str, int
        What makes the runs.
    shard : str
        The shard of a job array, as in "3/16"; empty if all is made.
    done, failed, total, running, made : int
        See `Heartbeat.update`.
    rate : float or None
        Runs per second over the last minute; None until it is known.
    has_ended : bool
        Whether the sweep has ended in good order.
    """

    pid: int
    host: str
    engine: str
    workers: int
    shard: str
    done: int
    failed: int
    total: int
    running: int
    made: int
    rate: float | None
    has_ended: bool


class Heartbeat:
    """Writes how far a sweep is, at most once a second, and more rarely on a slow disk; errors of writing are
    ignored.

    Durations come from the monotonic clock, which nobody sets.

    Parameters
    ----------
    path : Path
        The file.
    engine, workers, shard
        See `Progress`.
    """

    def __init__(self, path: Path, engine: str = "local", workers: int = 1, shard: str = "") -> None:
        self.path = path
        self._last = Progress(os.getpid(), socket.gethostname(), engine, workers, shard, 0, 0, 0, 0, 0, None, False)
        # When how many runs had been made.
        self._made: deque[tuple[float, int]] = deque()
        self._unwritten = 0
        self._written, self._period = -math.inf, _PERIOD

    @property
    def made(self) -> int:
        """The number of runs that this sweep has made, done or failed."""
        return self._last.made

    @property
    def failed(self) -> int:
        """The number of runs that have failed; see `update`."""
        return self._last.failed

    @property
    def rate(self) -> float | None:
        """Runs per second over the last minute; None until it is known."""
        return self._last.rate

    @property
    def seconds_left(self) -> float | None:
        """Time until all runs are made at the present rate [s]; None until the rate is known."""
        last = self._last
        return seconds_left(last.total - last.done - last.failed - self._unwritten, last.rate)

    def update(
        self, done: int, total: int, *, failed: int = 0, running: int = 0, made: int = 0, unwritten: int = 0
    ) -> None:
        """Take note of how far the sweep is.

        Parameters
        ----------
        done, failed : int
            Runs of the study that are done and that have failed, those of earlier sweeps included.
        total : int
            Runs that this sweep wants made in the end, those of earlier sweeps included.
        running : int
            Runs that workers have now.
        made : int
            Runs that this sweep has made, done or failed.
        unwritten : int
            Runs that workers have made of shards that are not whole; they count for the rate.
        """
        now, self._unwritten = time.monotonic(), unwritten
        self._made.append((now, made + unwritten))
        while len(self._made) > 2 and now - self._made[1][0] > _WINDOW:
            self._made.popleft()
        self._last = self._last._replace(
            done=done, failed=failed, total=total, running=running, made=made, rate=self._rate()
        )
        if now - self._written >= self._period:
            self._write()
            self._written = time.monotonic()
            self._period = max(_PERIOD, _FACTOR * (self._written - now))

    def end(self) -> None:
        """Write that the sweep has ended."""
        self._last = self._last._replace(running=0, has_ended=True)
        self._write()

    def _rate(self) -> float | None:
        (began, first), (now, last) = self._made[0], self._made[-1]
        return (last - first) / (now - began) if last > first and now > began else None

    def _write(self) -> None:
        # A full disk must not stop a sweep here: the parts of its runs say so.
        with contextlib.suppress(files.UnwritableError), files.complete(self.path) as draft:
            draft.write(json.dumps(self._last._asdict()).encode())


def seconds_left(missing: int, rate: float | None) -> float | None:
    """Return how long missing runs take at a rate [s]; None if that is not known."""
    return max(0, missing) / rate if rate else None


def read_progress(path: Path) -> Progress | None:
    """Return the last heartbeat; None if there is none that can be read."""
    with contextlib.suppress(OSError, ValueError, TypeError, RecursionError), files.open_regular(path) as file:
        found = Progress(**json.loads(file.read(_MOST_READ)))
        numbers = (found.pid, found.workers, found.done, found.failed, found.total, found.running, found.made)
        rate = found.rate
        if all(isinstance(number, int) for number in numbers) and (rate is None or 0 < float(rate) < math.inf):
            return found
    return None
