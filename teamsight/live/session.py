"""The session: worlds that run in a thread of their own, and carry out the messages of pages.

Whatever builds worlds, or may need kernels that are not compiled, is prepared by a `Builder` while the worlds run on.
The worlds stand still while no page shows them.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from teamsight.core import checks
from teamsight.core.references import failure
from teamsight.live.builder import Job
from teamsight.live.commands import keep
from teamsight.live.controls import Control
from teamsight.live.protocol import Message
from teamsight.live.running import Running
from teamsight.live.track import LiveTrack
from teamsight.live.worlds import Worlds
from teamsight.view.page import page
from teamsight.view.scene import Frame, Scene

SEED = "seed"


class Saved(NamedTuple):
    """A recording: the name of its file, and the page."""

    name: str
    html: str


class _Recorded(NamedTuple):
    scene: Scene
    frames: list[Frame]


class Session(Running):
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
    begun : threading.Event
        Set when the first worlds are there, or cannot be built, or something is compiled for them.
    failure : BaseException or None
        Why the first worlds cannot be built.
    """

    def __init__(
        self, worlds: Worlds, controls: Mapping[str, Control], *, rate: float | None, every: int, running: bool
    ) -> None:
        super().__init__(worlds, controls, rate=rate, every=every, running=running)
        self._is_closing = False
        self.begun = threading.Event()
        self.failure: BaseException | None = None
        # The settings on the left when two worlds began, and those of the one before.
        self._before: tuple[dict[str, Any], dict[str, Any]] = {}, {}
        self._start(Job("kernels", worlds.settings, worlds.seed, every, lambda tracks: self._begin(tracks, "")))
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

    def is_alive(self) -> bool:
        """Return whether the thread of the worlds runs."""
        return self._thread.is_alive()

    def busy(self) -> bool:
        """Return whether messages wait or are being carried out, or worlds are being built."""
        return bool(self._commands) or self._builder.is_busy

    def history(self) -> list[str | bytes]:
        """Return messages by which a new page learns what was so far; for other threads, while the worlds go on."""
        return self._display.history(self.worlds.tracks)

    def recording(self) -> Saved:
        """Return what is kept as a page that plays anywhere; for other threads, while the worlds go on."""
        tracks = [_Recorded(*track.recorded()) for track in self.worlds.tracks]
        if not tracks:
            raise ValueError("nothing is there yet; wait until the worlds are compiled")
        title = tracks[0].scene.title
        name = "-".join("".join(c if c.isalnum() else " " for c in title.lower()).split())
        return Saved(f"teamsight-{name[:80]}.html", page(tracks, title=title))

    def _work(self) -> None:
        while not self._is_closing:
            for message in self._commands.take(self._patience()):
                self._try(lambda message=message: self._carry_out(message))  # type: ignore[misc]
                self._commands.done()
            self._try(self._take_built)
            if self._is_moving and (self._left or self._pacer.wait(time.monotonic()) <= 0.0):
                self._try(self._advance)

    def _try(self, act: Callable[[], None]) -> None:
        """Do something; an error is shown on the pages, and the worlds stay as they are."""
        try:
            act()
        except (Exception, SystemExit) as error:  # of a model, for whatever reason
            self._is_running, self._left = False, 0
            self._say(error)

    def _say(self, error: BaseException) -> None:
        self._display.error(str(error) if isinstance(error, (TypeError, ValueError)) else failure(error))

    def _start(self, job: Job) -> None:
        self._builder.start(job)
        self._show_controls()
        self._report()

    def _take_built(self) -> None:
        """Show what is compiled; carry a job out whose worlds are there, and then what has waited for it."""
        if (done := self._builder.take()) is None:
            if self._builder.said != self._said:
                self._said = self._builder.said
                self.begun.set()
                self._report()
            return
        job, outcome, waiting = done
        self._said = ""
        if isinstance(outcome, BaseException):
            self._refuse(outcome)
            self.failure = None if self.worlds.tracks else outcome
        else:
            self._attempt(lambda: job.then(outcome))
        self.begun.set()
        for message in waiting:
            self._carry_out(message)
        self._builder.is_busy = self._builder.job is not None

    def _carry_out(self, message: Message) -> None:
        if self._must_wait(message):
            self._attempt(lambda: keep(self._builder.waiting, message))
            self._show_controls()
        else:
            self._attempt(lambda: getattr(self, f"_on_{message.type}")(**message.fields))

    def _must_wait(self, message: Message) -> bool:
        """Whether a message needs worlds that are being built, or a job of its own."""
        job, control = self._builder.job, self._controls.get(message.fields.get("name", ""))
        if job is None or not self.worlds.tracks:
            return job is not None
        if message.type in ("pause", "rate", "every"):
            return False
        if message.type in ("run", "step"):
            # Worlds that are about to go would take the steps with them.
            return job.replaces or bool(self._builder.waiting)
        return job.replaces or control is None or not control.live or control.kind == "choice"

    def _attempt(self, act: Callable[[], None]) -> None:
        try:
            act()
        except (Exception, SystemExit) as error:  # of a model that refuses its arguments, for whatever reason
            self._refuse(error)
        self._report()

    def _refuse(self, error: BaseException) -> None:
        """Say why something does not happen; the pages show the values that hold, not the one that was refused."""
        self._say(error)
        self._show_controls()
        self._report()

    def _show_controls(self) -> None:
        if self.worlds.tracks:
            self._display.controls(self.worlds.tracks, self.worlds.seed, self._builder.wanted)

    def _on_run(self) -> None:
        if not all(track.world.running for track in self.worlds.tracks):
            raise ValueError("run: the model has stopped; Reset starts again")
        self._is_running, self._note, self._is_failed = True, "", False

    def _on_pause(self) -> None:
        # It acts at once, so a run that waits would come after it.
        self._builder.waiting.pop("run", None)
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
        if on == (len(settings) == 2):
            return
        # Both begin at tick 0, since neither can catch up with the other's past.
        if on:
            (left, right), note = self._blind_and_aware(settings[0])
            self._before = left, settings[0]
            self._rebuild([left, right], self.worlds.seed, f"Started again, two worlds on the same noise{note}.")
            return
        blind, before = self._before
        self._rebuild([before if settings[0] == blind else settings[0]], self.worlds.seed, "Started again.")

    def _blind_and_aware(self, settings: dict[str, Any]) -> tuple[list[dict[str, Any]], str]:
        """Return the settings of a team without awareness and of one with, and what to say; equal ones without such."""
        name, control = "awareness", self._controls.get("awareness")
        if control is None or control.kind != "choice" or "none" not in control.choices:
            return [settings, dict(settings)], ""
        degree = self.worlds.tracks[0].value(name)
        if control.shown(degree) == "none":
            degree = next((one for text, one in control.choices.items() if text != "none"), degree)
        pair = [{**settings, name: one} for one in (control.choices["none"], degree)]
        return pair, f": blind (awareness none), and aware ({control.shown(degree)})"

    def _on_set(self, name: str, value: Any, track: int | None) -> None:
        control = self._controls[checks.choice("name", name, tuple(self._controls))]
        given, tracks = control.checked(value), self.worlds.tracks
        message = Message("set", {"name": name, "value": value, "track": track})
        if name == SEED:
            self._rebuild(self.worlds.settings, given, f"Started again with seed {given}.", message)
            return
        if track is not None and track >= len(tracks):
            raise ValueError(f"track={track}: there is one world only; compare first")
        chosen = tracks if track is None else [tracks[track]]
        if all(control.shown(one.value(name)) == control.shown(given) for one in chosen):
            return
        settings = self.worlds.with_value(chosen, name, given)
        if not control.live:
            note = f"Started again with {control.label or name} {control.shown(given)}, seed {self.worlds.seed}."
            self._rebuild(settings, self.worlds.seed, note, message)
        elif control.kind != "choice":
            self._change(chosen, name, given)
        else:
            # Another rule may have to be compiled, as for these worlds, which are then not needed.
            self._start(Job(
                str(value), settings, self.worlds.seed, self._pacer.every,
                lambda built: self._change(chosen, name, given, built), replaces=False, message=message,
            ))  # fmt: skip

    def _change(self, chosen: list[LiveTrack], name: str, given: Any, built: Iterable[LiveTrack] = ()) -> None:
        """Change a setting of running worlds."""
        for one in built:
            one.close()
        self.worlds.change(chosen, name, given)
        self._note = ""
        self._display.frames(self.worlds.tracks, again=True)
        self._show_controls()

    def _rebuild(self, settings: list[dict[str, Any]], seed: int, note: str, message: Message | None = None) -> None:
        def then(tracks: list[LiveTrack]) -> None:
            self._begin(tracks, note, seed)

        self._start(Job("kernels", settings, seed, self._pacer.every, then, message=message))

    def _begin(self, tracks: list[LiveTrack], note: str, seed: int | None = None) -> None:
        """Show worlds that have just been built."""
        self.worlds.replace(tracks, self.worlds.seed if seed is None else seed)
        self._left, self._note, self._reported_steps = 0, note, 0
        self._pacer.forget()
        self._is_failed = False
        # It may have been changed meanwhile.
        self._on_every(self._pacer.every)
        self._show_controls()
        self._display.begin(tracks)
        self._report()
