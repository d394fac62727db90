"""`rerun`: repeat one run of a study in this process, and compare it with what is stored."""

from __future__ import annotations

import os
from typing import NamedTuple


class Rerun(NamedTuple):
    """A run that was repeated.

    Attributes
    ----------
    run : str
        Its id.
    seed, steps : int
        Its seed and steps.
    parameters : dict of str to object
        Its parameters.
    measures : dict of str to object
        What was measured now.
    stored : dict of str to object, or None
        What is stored; None if the run is missing or has failed.
    error : str or None
        The stored error, if the run has failed.
    differing : tuple of str
        Names of the measures that are not the same to the last bit.
    """

    run: str
    seed: int
    steps: int
    parameters: dict[str, object]
    measures: dict[str, object]
    stored: dict[str, object] | None
    error: str | None
    differing: tuple[str, ...]


def rerun(folder: str | os.PathLike[str], run: str) -> Rerun:
    """Repeat one run of a study in this process.

    An error of the run is raised as it is, so that a debugger shows where it arose.

    Parameters
    ----------
    folder : path
        The folder of the study.
    run : str
        The id of the run, such as ``"0123456789abcdef-7"``.

    Raises
    ------
    ValueError
        If the folder is not that of a study, or the study has no such run.
    """
    raise NotImplementedError
