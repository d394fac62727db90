"""Reproductions: a file or folder for each paper or study of our own, with its runs, claims, figures and page."""

from __future__ import annotations

from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.analysis.papers.reproduction import Reproduction

#: The paper that is meant where none is named, that of CMOMMT.
DEFAULT = "touzet2000"


def _is_paper(name: str) -> bool:
    """Whether a module of this folder has a `PAPER`; it is not imported, since that is slow."""
    place = Path(__path__[0], name)
    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    return "\nPAPER = " in file.read_text(encoding="utf-8")


#: The papers by name, as ``teamsight reproduce NAME`` takes them: the `PAPER` of each module of this folder with one.
PAPERS: Registry[Reproduction[Any, Any]] = Registry(
    {
        name: f"teamsight.analysis.papers.{name}:PAPER"
        for name in sorted((one.name for one in iter_modules(__path__)), key=lambda name: (name != DEFAULT, name))
        if _is_paper(name)
    }
)
