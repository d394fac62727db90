"""Frames of a run, how they are packed, and the page that plays them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.view.replay import RecordedTrack, Replay
    from teamsight.view.scene import Frame, LinkList, Links, Scene, SceneGroup, Slot

_HOMES = {
    "Frame": "teamsight.view.scene",
    "LinkList": "teamsight.view.scene",
    "Links": "teamsight.view.scene",
    "RecordedTrack": "teamsight.view.replay",
    "Replay": "teamsight.view.replay",
    "Scene": "teamsight.view.scene",
    "SceneGroup": "teamsight.view.scene",
    "Slot": "teamsight.view.scene",
}

__all__ = ["Frame", "LinkList", "Links", "RecordedTrack", "Replay", "Scene", "SceneGroup", "Slot"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
