"""The progress of a study, as its folder shows it: heartbeats, and begin and end of every sweep."""

from __future__ import annotations

import contextlib
import json
import math
import os
import platform
import secrets
import socket
import subprocess
import time
from collections import deque
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from teamsight.analysis.studies.folder.parts import ARRAY, PROGRESS, SWEEPS, shard_file
from teamsight.core import files, version

# The folder of teamsight's code: of the repository, or of the installed package.
_CODE = Path(__file__).resolve().parents[3]
# Packages that decide results, and those that write them.
_PACKAGES = ("numpy", "numba", "llvmlite", "mesa", "simpy", "scipy", "pandas", "pyarrow")
_PATIENCE = 10.0


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python, teamsight and the packages that decide results."""
    found = {"python": platform.python_version(), "teamsight": version.__version__}
    for name in _PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def machine() -> dict[str, str | int]:
    """Return host, operating system, processor and number of cores."""
    return {
        "host": socket.gethostname(), "system": f"{platform.system()} {platform.release()}",
        "processor": platform.machine(), "cores": os.cpu_count() or 1,
    }  # fmt: skip


def commits(study_folder: Path | None) -> dict[str, dict[str, str | bool]]:
    """Return the git commits of teamsight and of the folder of the study file, and whether teamsight's has changes.

    Parameters
    ----------
    study_folder : Path or None
        Where the modules of the study are.
    """
    found: dict[str, dict[str, str | bool]] = {}
    for name, folder in (("teamsight", _CODE), ("study", study_folder)):
        head = None if folder is None else _git(folder, "rev-parse", "HEAD")
        # An installed package below a repository, as in its .venv, is none of its files.
        if folder is not None and head and _git(folder, "check-ignore", "--quiet", ".") is None:
            found[name] = {"commit": head.strip()}
    if "teamsight" in found:
        # Not the changes of the study: to compare files, git runs the filters that the configuration of that folder
        # names. The digests of the study's modules say more.
        found["teamsight"]["has_changes"] = bool(_git(_CODE, "status", "--porcelain", "--untracked-files=no"))
    return found


def _git(folder: Path, *arguments: str) -> str | None:
    """Return what git prints; None if it fails or is not there.

    The folder of a study may come from anywhere: no program that its configuration names is run.
    """
    with contextlib.suppress(OSError, subprocess.SubprocessError, UnicodeDecodeError):
        done = subprocess.run(
            ["git", "-C", str(folder), "-c", "core.fsmonitor=false", "-c", f"core.hooksPath={os.devnull}", *arguments],
            capture_output=True, text=True, timeout=_PATIENCE, check=True, stdin=subprocess.DEVNULL,
            env={**os.environ, "GIT_OPTIONAL_LOCKS": "0", "GIT_NO_LAZY_FETCH": "1"},
        )  # fmt: skip
        return done.stdout
    return None


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

    Attributes
    ----------
    last : Progress
        What the next heartbeat says.
    """

    def __init__(self, path: Path, engine: str = "local", workers: int = 1, shard: str = "") -> None:
        self.path = path
        self.last = Progress(os.getpid(), socket.gethostname(), engine, workers, shard, 0, 0, 0, 0, 0, None, False)
        # When how many runs had been made.
        self._made: deque[tuple[float, int]] = deque()
        self._unwritten = 0
        self._written, self._period = -math.inf, _PERIOD

    @property
    def seconds_left(self) -> float | None:
        """Time until all runs are made at the present rate [s]; None until the rate is known."""
        last = self.last
        missing = last.total - last.done - last.failed - self._unwritten
        return max(0, missing) / last.rate if last.rate else None

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
        began, first = self._made[0]
        more = made + unwritten - first
        rate = more / (now - began) if more > 0 and now > began else None
        self.last = self.last._replace(done=done, failed=failed, total=total, running=running, made=made, rate=rate)
        if now - self._written >= self._period:
            self._write()
            self._written = time.monotonic()
            self._period = max(_PERIOD, _FACTOR * (self._written - now))

    def end(self) -> None:
        """Write that the sweep has ended."""
        self.last = self.last._replace(running=0, has_ended=True)
        self._write()

    def _write(self) -> None:
        # A full disk must not stop a sweep here: the parts of its runs say so.
        with contextlib.suppress(files.UnwritableError), files.complete(self.path) as draft:
            draft.write(json.dumps(self.last._asdict()).encode())


def read_progress(path: Path) -> Progress | None:
    """Return the last heartbeat; None if there is none that can be read."""
    with contextlib.suppress(OSError, ValueError, TypeError, RecursionError), files.open_regular(path) as file:
        found = Progress(**json.loads(file.read(_MOST_READ)))
        numbers = (found.pid, found.workers, found.done, found.failed, found.total, found.running, found.made)
        rate = found.rate
        if all(isinstance(number, int) for number in numbers) and (rate is None or 0 < float(rate) < math.inf):
            return found
    return None


Record = Mapping[str, object]


@contextlib.contextmanager
def recorded(
    folder: Path, engine: str, workers: int, code: str, shard: tuple[int, int] | None
) -> Iterator[Heartbeat]:
    """Record begin and end of a sweep; see `StudyFolder.recorded`."""
    name = "" if shard is None else f"{shard[0]}/{shard[1]}"
    path = folder / PROGRESS if shard is None else folder / ARRAY / shard_file(shard, "json")
    heartbeat = Heartbeat(path, engine, workers, name)
    number, began, outcome = secrets.token_hex(4), time.monotonic(), "ended"
    about = {"host": socket.gethostname(), "pid": os.getpid(), "engine": engine, "workers": workers, "shard": name}
    _append(folder, "begin", number, {**about, "code": code, "versions": versions()})
    try:
        yield heartbeat
    except KeyboardInterrupt:
        outcome = "interrupted"
        raise
    except BaseException as error:
        outcome = f"stopped by {type(error).__name__}"
        raise
    finally:
        seconds = round(time.monotonic() - began, 3)
        heartbeat.end()
        # The error that ends a sweep on a full disk must not be hidden by this one.
        with contextlib.suppress(files.UnwritableError):
            last = heartbeat.last
            found = {"outcome": outcome, "seconds": seconds, "made": last.made, "failed": last.failed}
            _append(folder, "end", number, found)


def read_sweeps(folder: Path) -> list[Record]:
    """Return the records in the order in which they were written; lines that were cut off are left out."""
    found: list[Record] = []
    with contextlib.suppress(FileNotFoundError), files.open_regular(folder / SWEEPS) as file:
        for line in file:
            with contextlib.suppress(ValueError, RecursionError):
                record = json.loads(line)
                if isinstance(record, dict):
                    found.append(record)
    return found


def _append(folder: Path, event: str, number: str, about: Record) -> None:
    now = datetime.now(UTC).isoformat(timespec="seconds")
    record = json.dumps({"event": event, "sweep": number, "time": now, **about})
    # A line break before it as well, since the line before may have been cut off.
    files.append(folder / SWEEPS, f"\n{record}\n".encode())
