"""The live page: a server that shows a running world in a browser and takes controls."""

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.live.live_page import LivePage, watch, watch_trajectories

_HOMES = dict.fromkeys(("LivePage", "watch", "watch_trajectories"), "teamsight.live.live_page")

__all__ = ["LivePage", "watch", "watch_trajectories"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
