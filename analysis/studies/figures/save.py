"""Pictures as files: PNG, SVG or PDF."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from teamsight.analysis.plot.style import FORMATS, to_picture
from teamsight.analysis.runs.files import check_replaceable, write_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


def check_picture(path: str | os.PathLike[str], *, force: bool = False) -> str:
    """Return the kind of a picture by its suffix, after a check that the file may be written.

    Raises
    ------
    ValueError
        If the suffix is not one of a picture, or the file must not be replaced.
    """
    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in FORMATS:
        names = ", ".join(f".{name}" for name in FORMATS)
        raise ValueError(f"out={os.fspath(path)}: must be a file that ends with one of {names}, such as study.png")
    check_replaceable(path, force=force)
    return kind


def save_picture(figure: Canvas, path: str | os.PathLike[str], description: str, *, force: bool = False) -> None:
    """Write a picture; see `check_picture`."""
    kind = check_picture(path, force=force)
    write_bytes(path, to_picture(figure, description, kind), force=force)
