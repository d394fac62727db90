"""Recordings for tests in a browser, and opening the pages that play them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.agents.world import World
from teamsight.view import Replay
from teamsight.view.page import page as page_of

if TYPE_CHECKING:
    from playwright.sync_api import Page


def recorded(world: World, steps: int, title: str | None = None) -> Replay:
    """Run a world and return what was recorded."""
    return world.record(steps=steps, title=title)


def written(folder: Path, *tracks: Replay, title: str = "A recording") -> Path:
    """Write the page of tracks, and return its path."""
    file = folder / "recording.html"
    file.write_text(page_of(tracks, title=title), "utf-8")
    return file


def opened(page: Page, file: Path, *, state: str = "ready", playing: bool = False) -> Page:
    """Open a page, wait until it has decoded its frames, and stop it unless it shall play."""
    page.goto(file.as_uri())
    page.wait_for_selector(f"#teamsight[data-state={state}]")
    if state == "ready" and not playing:
        page.evaluate("teamsight.view.pause(); teamsight.view.show(0)")
    return page


def at_tick(page: Page, tick: int) -> None:
    """Show a frame, and wait until it is drawn."""
    page.evaluate("tick => { teamsight.view.show(tick); teamsight.view.draw(); }", tick)


def drawn(page: Page, track: int = 0) -> dict[int, tuple[float, float]]:
    """Return where bodies are on the canvas, in units of the arena, by identity."""
    # What was changed is drawn with the next picture of the screen, which may be late.
    page.evaluate("teamsight.view.draw()")
    found: Sequence[dict[str, Any]] = page.evaluate("track => teamsight.view.drawn(track)", track)
    slots = page.evaluate("track => teamsight.view.tracks[track].scene.slots.map(slot => slot.id)", track)
    return {slots[one["slot"]]: (one["x"], one["y"]) for one in found}


def until(page: Page, condition: str) -> None:
    """Wait until an expression of JavaScript is true; `wait_for_function` would violate the policy of the page."""
    for _ in range(50_000):
        if page.evaluate(f"Boolean({condition})"):
            return
        page.wait_for_timeout(20)
    raise AssertionError(f"never true: {condition}")
