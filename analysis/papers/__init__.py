"""Reproductions: a file or folder for each paper or study of our own, with its runs, claims, figures and page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.analysis.papers.reproduction import Paper

#: The papers by name, as ``teamsight reproduce NAME`` takes them; the first, that of CMOMMT, is meant without a name.
PAPERS: Registry[Paper[Any, Any]] = Registry(
    {"touzet2000": "teamsight.analysis.papers.touzet2000.reproduce:PAPER"}
    | {
        name: f"teamsight.analysis.papers.{name}:PAPER"
        for name in (
            "tan1993", "ono_fukumoto1996", "balch_arkin1994", "kube_zhang1992", "mataric", "gathering", "unreliable",
        )
    }
)  # fmt: skip
