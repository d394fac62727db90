"""Setting damaged parts aside, and removing drafts. Nothing else is ever removed from a folder."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Collection
from pathlib import Path

from teamsight.analysis.studies.folder import parts
from teamsight.analysis.studies.folder.layout import ARRAY, DAMAGED, DRAFT, KINDS, make_folder
from teamsight.core import files


def set_aside(folder: Path, shards: Collection[str]) -> list[str]:
    """Move all parts of some shards to ``damaged/``, and return where they are now, below the folder.

    Parts that make a shard done are moved first: an interruption leaves no shard that counts without its other parts.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    shards : collection of str
        Digests of the shards.

    Raises
    ------
    UnwritableError
        If a part cannot be moved.
    """
    found = []
    for kind in reversed(KINDS):
        for part in parts.listed(folder, kind):
            if part.shard in shards:
                found.append(_moved(part.path, folder / DAMAGED / kind))
    return [path.relative_to(folder).as_posix() for path in found]


def remove_drafts(folder: Path) -> int:
    """Remove the drafts that killed processes have left; return how many. No process may write meanwhile."""
    count = 0
    for path in drafts(folder):
        with contextlib.suppress(OSError):
            path.unlink()
            count += 1
    return count


def drafts(folder: Path) -> list[Path]:
    """Return the drafts in the folder of a study."""
    found: list[Path] = []
    for place in (folder, folder / ARRAY, *(folder / kind for kind in KINDS)):
        with contextlib.suppress(OSError):
            found += [place / name for name in sorted(os.listdir(place)) if DRAFT.fullmatch(name)]
    return found


def _moved(path: Path, place: Path) -> Path:
    """Move a file into a folder, under a name that is free there."""
    try:
        make_folder(place, parents=True)
        target, number = place / path.name, 1
        while os.path.lexists(target):
            number += 1
            target = place / f"{path.name}.{number}"
        os.rename(path, target)
    except OSError as error:
        raise files.unwritable(path, error) from error
    return target
