"""`verify`: read every part of a study, and set damaged ones aside."""

from __future__ import annotations

import os
from typing import NamedTuple

from teamsight.analysis.studies.folder.parts import Damaged


class Verification(NamedTuple):
    """What was found.

    Attributes
    ----------
    parts : int
        Parts that were read.
    damaged : tuple of Damaged
        Parts that are damaged or belong to another study.
    aside : tuple of str
        Where parts were moved, below the folder; with a damaged part go the others of its shard.
    runs : tuple of str
        Ids of the runs in them, as far as they are known for certain.
    unnamed : int
        Shards among them whose runs are not known.
    foreign : tuple of str
        Files among the parts that are none, which are left where they are.
    drafts : int
        Drafts of killed processes that were removed.
    missing : int
        Planned runs that are neither done nor failed now.
    """

    parts: int
    damaged: tuple[Damaged, ...]
    aside: tuple[str, ...]
    runs: tuple[str, ...]
    unnamed: int
    foreign: tuple[str, ...]
    drafts: int
    missing: int


def verify(folder: str | os.PathLike[str], repair: bool = True) -> Verification:
    """Read all parts of a study; set those aside that are damaged.

    Parameters
    ----------
    folder : path
        The folder of the study.
    repair : bool
        Move damaged parts to ``damaged/`` below it; they are never deleted. Without, nothing is changed.

    Raises
    ------
    LockedError
        If a sweep runs, and `repair` is set.
    """
    raise NotImplementedError
