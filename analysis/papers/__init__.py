"""Reproductions: a file or folder for each paper or study of our own, with its runs, claims, figures and page."""

from __future__ import annotations

from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.analysis.papers.reproduction import Reproduction

#: The paper that is meant where none is named, that of CMOMMT.
DEFAULT = "touzet2000"
# Modules of this folder that are no papers: what papers share, and what has a command of its own.
_OTHERS = frozenset({"reproduction", "calibration", "evolution", "training"})
#: The papers by name, as ``teamsight reproduce NAME`` takes them: the `PAPER` of each further module of this folder.
PAPERS: Registry[Reproduction[Any, Any]] = Registry(
    {
        name: f"teamsight.analysis.papers.{name}:PAPER"
        for name in sorted((one.name for one in iter_modules(__path__)), key=lambda name: (name != DEFAULT, name))
        if name not in _OTHERS
    }
)
