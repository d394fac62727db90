"""Live pages in a browser: opening one, and waiting for what it shows."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from teamsight.live import LivePage

PATIENCE = 300.0  # seconds, against a hang


def shown(page: Page, server: LivePage, address: str = "") -> None:
    """Open the page and wait until it shows the present tick."""
    page.goto(server.url + address)
    settled(page, server)


def settled(page: Page, server: LivePage) -> None:
    """Wait until the page has drawn the newest frame."""
    until(lambda: not server.session.busy())
    tick = world_of(server).tick
    page.wait_for_function(
        "tick => teamsight.view && teamsight.view.tracks.length && teamsight.view.drawings > 0 && !teamsight.view.isDirty"
        " && teamsight.view.tracks.every(({ frames }) => frames.length) && teamsight.view.following && teamsight.view.shownTime === tick && teamsight.live.state?.tracks[0].tick === tick",
        arg=tick,
    )


def press(page: Page, key: str) -> None:
    """Press a key while no button or field has the focus."""
    page.evaluate("() => document.activeElement.blur()")
    page.keyboard.press(key)


def until(test: Callable[[], Any]) -> None:
    """Wait for something on the server."""
    end = time.monotonic() + PATIENCE
    while not test():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def world_of(server: LivePage, track: int = 0) -> Any:
    """Return the world of a track."""
    return server.session.worlds.tracks[track].world
