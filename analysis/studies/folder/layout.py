"""Where the files of a study are."""

from __future__ import annotations

import os
import re
from pathlib import Path

from teamsight.core import files

MANIFEST, SWEEPS, PROGRESS, LOCK = "manifest.json", "sweeps.jsonl", "progress.json", "lock"
#: Locks and heartbeats of the shards i/n of a job array.
ARRAY = "array"
#: Where damaged parts are set aside.
DAMAGED = "damaged"
#: Folders of parts. Parts of "failed" and "runs" are written last: they make a shard done.
KINDS = ("steps", "trajectories", "events", "failed", "runs")
#: What a part is called: a digest of its run ids, and one of its bytes.
PART = re.compile(r"([0-9a-f]{16})-([0-9a-f]{16})\.parquet")
#: The lock of shard i of n of a job array.
SHARD_LOCK = re.compile(r"(\d{4,})-of-(\d{4,})\.lock")
#: Files that were being written when their process ended; see `teamsight.core.files.complete`.
DRAFT = re.compile(r"\..+\.[0-9a-f]{16}\.part")
#: Kinds of which each run has one row; a shard with such a part is done.
DONE = ("failed", "runs")
_OWN = frozenset({MANIFEST, SWEEPS, PROGRESS, LOCK, ARRAY, DAMAGED, *KINDS})


def is_own(name: str) -> bool:
    """Whether a file of this name may stand in the folder of a study. Hidden files of the system may, too."""
    return name in _OWN or name.startswith(".")


def foreign_parts(folder: Path, kind: str) -> list[str]:
    """Return what stands among the parts of a kind and is neither a part nor a draft nor hidden, below the folder.

    Raises
    ------
    OSError
        If the folder of the kind cannot be listed.
    """
    names = sorted(os.listdir(folder / kind))
    return [f"{kind}/{name}" for name in names if not (PART.fullmatch(name) or name.startswith("."))]


def make_folder(folder: Path, *, parents: bool = False) -> None:
    """Create a folder that stays after a power cut, unless it is there.

    Raises
    ------
    UnwritableError
        If it cannot be created.
    """
    if not os.path.isdir(folder):
        if parents and folder.parent != folder:
            # One after the other: each name must be on disk.
            make_folder(folder.parent, parents=True)
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise files.unwritable(folder, error) from error
        files.sync_folder(folder.parent)


def shard_file(shard: tuple[int, int], suffix: str) -> str:
    """Return the name of a file of shard i of n."""
    return f"{shard[0]:04d}-of-{shard[1]:04d}.{suffix}"
