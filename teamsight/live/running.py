"""Worlds that run: how fast, what pages see of them, and when they stand still."""

from __future__ import annotations

import time
from collections.abc import Mapping

from teamsight.live.board import Board
from teamsight.live.builder import Builder
from teamsight.live.commands import Commands
from teamsight.live.controls import Control
from teamsight.live.display import Display
from teamsight.live.pacing import Pacer
from teamsight.live.worlds import StoppedError, Worlds

# Seconds between two messages about the state while the worlds run.
_BETWEEN_STATES = 0.25
#: Steps after which a run pauses: its history is kept in memory, and a forgotten page should not fill that.
MOST_STEPS = 1_000_000


class Running:
    """The part of a `Session` that makes steps; see there for the parameters and attributes."""

    def __init__(
        self, worlds: Worlds, controls: Mapping[str, Control], *, rate: float | None, every: int, running: bool
    ) -> None:
        self.board, self.worlds = Board(), worlds
        self._controls, self._commands = dict(controls), Commands()
        self._display = Display(self.board, self._controls.values())
        self._pacer = Pacer(rate, every)
        self._builder, self._said = Builder(worlds, self._commands.wake), ""
        self._is_running, self._viewers = running, 0
        self._note, self._is_failed = "", False
        # Steps that are left to the next frame.
        self._left = 0
        self._reported = self._reported_steps = 0.0

    @property
    def is_running(self) -> bool:
        """Whether the worlds make steps."""
        return self._is_running

    @property
    def said(self) -> str:
        """What is being compiled, for people; empty if nothing is."""
        return self._builder.said

    def watched_by(self, pages: int) -> None:
        """Say how many pages are open; without one the worlds stand still."""
        self._viewers = pages
        self._commands.wake()

    @property
    def _is_moving(self) -> bool:
        return self._is_running and self._viewers > 0 and bool(self.worlds.tracks)

    def _patience(self) -> float | None:
        """Return how long to wait for messages [s]; None for as long as it takes."""
        if not self._is_moving:
            return None
        return 0.0 if self._left else self._pacer.wait(time.monotonic())

    def _advance(self) -> None:
        """Make a part of the steps up to the next frame, and show that when it is reached."""
        began = time.monotonic()
        if not self._left:
            self._left = self._pacer.stretch()
            self._pacer.begin(began, self._left)
        steps = min(self._left, self._pacer.part())
        if not self._make_steps(steps):
            return
        self._left = max(self._left - steps, 0)
        if not self._left:
            self._display.frames(self.worlds.tracks)
        now = time.monotonic()
        self._pacer.took(steps, now - began)
        if now - self._reported > _BETWEEN_STATES:
            self._report()

    def _make_steps(self, steps: int) -> bool:
        """Let all worlds make steps; return whether they did."""
        before = self.worlds.made
        try:
            self.worlds.run(steps)
        except StoppedError as error:
            self._is_failed = True
            self._pause(f"{error}; Reset starts again.")
            self._display.frames(self.worlds.tracks)
            return False
        if self.worlds.made // MOST_STEPS > before // MOST_STEPS:
            self._pause(f"Paused after {self.worlds.made:,} steps, whose history is in memory; Run goes on.")
        return True

    def _pause(self, note: str = "") -> None:
        self._is_running, self._left, self._note = False, 0, note
        self._report()

    def _report(self) -> None:
        """Show the state."""
        now, made = time.monotonic(), self.worlds.made
        passed = now - self._reported
        measured = (made - self._reported_steps) / passed if self._is_running and passed else 0.0
        self._reported, self._reported_steps = now, made
        job = self._builder.job
        is_building, worlds = job is not None and job.replaces, job.settings if job else self.worlds.tracks
        facts = {
            "running": self._is_running, "rate": self._pacer.rate, "every": self._pacer.every,
            "busy": self._said or ("Building …" if is_building else ""),
            "note": self._note, "failed": self._is_failed,
            "measured": max(measured, 0.0), "made": made,
            "two": len(worlds) == 2,
        }  # fmt: skip
        self._display.state(self.worlds.tracks, facts)
