"""The figures of the paper, and observed targets against δ, each as tidy tables and a drawing."""

from __future__ import annotations

from teamsight.analysis.paper.figures.interface import Conditions, Drawn, Figure, Tables
from teamsight.analysis.paper.figures.registry import FIGURES, Job, make

__all__ = ["FIGURES", "Conditions", "Drawn", "Figure", "Job", "Tables", "make"]
