"""``sweeps.jsonl``: begin and end of every sweep, one line of JSON each."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import socket
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

from teamsight.analysis.studies.folder.layout import ARRAY, PROGRESS, SWEEPS, shard_file
from teamsight.analysis.studies.folder.origin import versions
from teamsight.analysis.studies.folder.progress import Heartbeat
from teamsight.core import files

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
            found = {"outcome": outcome, "seconds": seconds, "made": heartbeat.made, "failed": heartbeat.failed}
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
    record = json.dumps({"event": event, "sweep": number, "time": now, **about}).encode() + b"\n"
    files.append(folder / SWEEPS, (b"" if _ends_whole(folder / SWEEPS) else b"\n") + record)


def _ends_whole(path: Path) -> bool:
    """Return whether a file ends with a line break, or is empty or absent."""
    try:
        with files.open_regular(path) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - 1))
            return file.read() in (b"", b"\n")
    except OSError:
        return True
