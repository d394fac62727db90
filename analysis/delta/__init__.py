"""Choosing δ, the number of inputs about teammates, from simulations or recorded positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.analysis.delta.choose import choose_delta
    from teamsight.analysis.delta.from_trajectories import delta_from_trajectories
    from teamsight.analysis.delta.report import DeltaReport
    from teamsight.analysis.delta.trajectory_files import read_trajectories
    from teamsight.analysis.delta.trajectory_notes import TrajectoryWarning

_HOMES = {
    "DeltaReport": "teamsight.analysis.delta.report",
    "TrajectoryWarning": "teamsight.analysis.delta.trajectory_notes",
    "choose_delta": "teamsight.analysis.delta.choose",
    "delta_from_trajectories": "teamsight.analysis.delta.from_trajectories",
    "read_trajectories": "teamsight.analysis.delta.trajectory_files",
}

__all__ = ["DeltaReport", "TrajectoryWarning", "choose_delta", "delta_from_trajectories", "read_trajectories"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
