"""The session: worlds that run in a thread of their own, and carry out the messages of pages."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from teamsight.core import checks
from teamsight.core.references import failure
from teamsight.live.board import Board
from teamsight.live.commands import Commands
from teamsight.live.controls import Control
from teamsight.live.display import Display
from teamsight.live.pacing import Pacer
from teamsight.live.protocol import Message
from teamsight.live.worlds import StoppedError, Worlds
from teamsight.view.frame import Frame
from teamsight.view.page import page
from teamsight.view.scene import Scene

# Seconds between two messages about the state while the worlds run.
_BETWEEN_STATES = 0.25
#: Steps after which a run pauses: its history is kept in memory, and a forgotten page should not fill that.
MOST_STEPS = 1_000_000
SEED = "seed"


class Saved(NamedTuple):
    """A recording: the name of its file, and the page."""

    name: str
    html: str


class _Recorded(NamedTuple):
    scene: Scene
    frames: list[Frame]


class Session:
    """Worlds that run as pages want it.

    Parameters
    ----------
    worlds : Worlds
        The worlds.
    controls : mapping of str to Control
        What pages can set.
    rate : float or None
        Steps a second; None for as many as possible.
    every : int
        Steps from one frame to the next, at least.
    running : bool
        Whether they run from the start.

    Attributes
    ----------
    board : Board
        What pages are to show.
    worlds : Worlds
        The worlds; they belong to the thread.
    """

    def __init__(
        self, worlds: Worlds, controls: Mapping[str, Control], *, rate: float | None, every: int, running: bool
    ) -> None:
        self.board, self.worlds = Board(), worlds
        self._controls, self._commands = dict(controls), Commands()
        self._display = Display(self.board, self._controls.values())
        self._pacer = Pacer(rate, every)
        self._is_running, self._is_busy, self._is_closing = running, False, False
        self._note, self._is_failed = "", False
        # Steps that are left to the next frame.
        self._left = 0
        self._reported = self._reported_steps = 0.0
        self._begin("")
        self._thread = threading.Thread(target=self._work, name="teamsight worlds", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread. Idempotent."""
        self._is_closing = True
        self._commands.wake()
        self._thread.join(timeout=5)

    def ask(self, message: Message) -> None:
        """Let the thread carry a message out soon.

        Raises
        ------
        ValueError
            If too many wait already.
        """
        self._commands.put(message)

    @property
    def is_running(self) -> bool:
        """Whether the worlds make steps."""
        return self._is_running

    def is_alive(self) -> bool:
        """Return whether the thread of the worlds runs."""
        return self._thread.is_alive()

    def busy(self) -> bool:
        """Return whether messages wait or are being carried out."""
        return self._is_busy or bool(self._commands)

    def history(self) -> list[str | bytes]:
        """Return messages by which a new page learns what was so far; for other threads, while the worlds go on."""
        return self._display.history(self.worlds.tracks)

    def recording(self) -> Saved:
        """Return what is kept as a page that plays anywhere; for other threads, while the worlds go on."""
        tracks = [_Recorded(*track.recorded()) for track in self.worlds.tracks]
        title = tracks[0].scene.title
        name = "-".join("".join(c if c.isalnum() else " " for c in title.lower()).split())
        return Saved(f"teamsight-{name[:80]}.html", page(tracks, title=title))

    def _work(self) -> None:
        while not self._is_closing:
            for message in self._commands.take(self._patience()):
                self._try(lambda message=message: self._carry_out(message))  # type: ignore[misc]
                self._commands.done()
            if self._is_running and (self._left or self._pacer.wait(time.monotonic()) <= 0.0):
                self._try(self._advance)

    def _try(self, act: Callable[[], None]) -> None:
        """Do something; an error is shown on the pages, and the worlds stay as they are."""
        try:
            act()
        except (Exception, SystemExit) as error:  # of a model, for whatever reason
            self._is_running = self._is_busy = False
            self._left = 0
            self._display.error(str(error) if isinstance(error, (TypeError, ValueError)) else failure(error))

    def _patience(self) -> float | None:
        """Return how long to wait for messages [s]; None for as long as it takes."""
        if not self._is_running:
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

    def _carry_out(self, message: Message) -> None:
        try:
            getattr(self, f"_on_{message.type}")(**message.fields)
        except (Exception, SystemExit) as error:  # of a model that refuses its arguments, for whatever reason
            self._display.error(str(error) if isinstance(error, (TypeError, ValueError)) else failure(error))
            # The page shows the values that hold, not the one that was refused.
            self._display.controls(self.worlds.tracks, self.worlds.seed)
        self._is_busy = False
        self._report()

    def _on_run(self) -> None:
        if not all(track.world.running for track in self.worlds.tracks):
            raise ValueError("run: the model has stopped; Reset starts again")
        self._is_running, self._note, self._is_failed = True, "", False

    def _on_pause(self) -> None:
        was_between, self._left = bool(self._left), 0
        self._pause()
        if was_between:
            self._display.frames(self.worlds.tracks)

    def _on_step(self) -> None:
        self._on_run()
        self._is_running = False
        if self._make_steps(self._pacer.every):
            self._left = 0
            self._display.frames(self.worlds.tracks)

    def _on_reset(self) -> None:
        self._rebuild(self.worlds.settings, self.worlds.seed, "")

    def _on_rate(self, value: float | None) -> None:
        self._pacer.rate = value

    def _on_every(self, value: int) -> None:
        self._pacer.every = value
        for track in self.worlds.tracks:
            track.draw_every(value)

    def _on_compare(self, on: bool) -> None:
        settings = self.worlds.settings
        if on != (len(settings) == 2):
            # Both begin at tick 0, since neither can catch up with the other's past.
            note = "Started again, two worlds on the same noise." if on else "Started again."
            self._rebuild([settings[0], dict(settings[0])] if on else settings[:1], self.worlds.seed, note)

    def _on_set(self, name: str, value: Any, track: int | None) -> None:
        control = self._controls[checks.choice("name", name, tuple(self._controls))]
        given, tracks = control.checked(value), self.worlds.tracks
        if name == SEED:
            self._rebuild(self.worlds.settings, given, f"Started again with seed {given}.")
            return
        if track is not None and track >= len(tracks):
            raise ValueError(f"track={track}: there is one world only; compare first")
        chosen = tracks if track is None else [tracks[track]]
        if all(control.shown(one.value(name)) == control.shown(given) for one in chosen):
            return
        if not control.live:
            note = f"Started again with {control.label or name} {control.shown(given)}, seed {self.worlds.seed}."
            self._rebuild(self.worlds.with_value(chosen, name, given), self.worlds.seed, note)
            return
        self.worlds.change(chosen, name, given)
        self._note = ""
        self._display.frames(tracks, again=True)
        self._display.controls(tracks, self.worlds.seed)

    def _rebuild(self, settings: list[dict[str, Any]], seed: int, note: str) -> None:
        self._is_busy = True
        self._report()
        self.worlds.rebuild(settings, seed, self._pacer.every)
        self._begin(note)

    def _begin(self, note: str) -> None:
        """Show worlds that have just been built."""
        self._left, self._note, self._reported_steps = 0, note, 0
        self._pacer.forget()
        self._is_failed = False
        self._display.controls(self.worlds.tracks, self.worlds.seed)
        self._display.begin(self.worlds.tracks)
        self._report()

    def _report(self) -> None:
        """Show the state."""
        now, made = time.monotonic(), self.worlds.made
        measured = (made - self._reported_steps) / (now - self._reported) if self._is_running else 0.0
        self._reported, self._reported_steps = now, made
        facts = {
            "running": self._is_running, "busy": self._is_busy, "rate": self._pacer.rate, "every": self._pacer.every,
            "seed": self.worlds.seed, "note": self._note, "failed": self._is_failed,
            "measured": max(measured, 0.0), "made": made,
        }  # fmt: skip
        self._display.state(self.worlds.tracks, facts)
