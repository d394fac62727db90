"""The session: worlds that run in a thread of their own, and carry out the messages of pages.

The worlds stand still while no page shows them, and while kernels are compiled for others.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Hashable, Mapping
from contextlib import suppress
from functools import partial
from itertools import chain
from typing import Any, NamedTuple, TypeAlias

from teamsight.agents.components.failures import Failures
from teamsight.agents.engine.engine import PREPARING, Engine
from teamsight.agents.recording.frames import FrameRecorder
from teamsight.core import checks
from teamsight.core.component import Component
from teamsight.core.kernel.report import listening
from teamsight.core.references import said
from teamsight.live import links, protocol
from teamsight.live.band import Band
from teamsight.live.controls import Control, controls_of, model_name
from teamsight.live.copying import command_of, script_of
from teamsight.live.interventions import Act
from teamsight.live.protocol import Message
from teamsight.live.worlds import StoppedError, Worlds, event_rows
from teamsight.view.animation import FPS, MOST_IN_GIF, check_video, rendered, width_of
from teamsight.view.packing import from_raw, raw, ticks_of
from teamsight.view.page import page
from teamsight.view.replay import RecordedTrack
from teamsight.view.scene import Scene

SEED = "seed"
#: Messages of pages that wait, at most.
MOST_WAITING = 64
#: Steps after which a run pauses: its history is kept in memory, and a forgotten page should not fill that.
MOST_STEPS = 1_000_000
#: Of more frames an MP4 shows every second, or third, and so on: it would take minutes to draw.
MOST_IN_FILM = 3000
_SCALES = {".mp4": 2, ".gif": 1}
# Bytes of a picture of a film, and of each body in it; right within a factor of two for 10 to 300 bodies that move.
_BYTES_OF_PICTURE, _BYTES_OF_BODY = 2000, 230
#: Pages draw at most this many frames a second, so more are not made.
FRAMES_A_SECOND = 60.0
# Seconds between two messages about the state while the worlds run.
_BETWEEN_STATES = 0.25
# Seconds over which steps are counted, at least, before a page says how many are made in one.
_MEASURED = 0.5
# Bytes of the frames of each world that a new page gets.
_MOST_HISTORY = 4 * 2**20
# Seconds that a part of a stretch may take, after which messages of pages are read.
_PART = 0.015
# A simulation that is late by more than this does not catch up [s].
_LATEST = 0.25
_MOST_AT_ONCE = 10**6


class Pacer:
    """Says how many steps to make at once, and how long to wait before.

    Parameters
    ----------
    rate : float or None
        Steps a second; None for as many as possible.
    every : int
        Steps from one frame to the next, at least.

    Attributes
    ----------
    rate, every
        The parameters; assign new ones at any time.
    """

    def __init__(self, rate: float | None, every: int) -> None:
        self.rate, self.every = rate, every
        self._due = -1.0
        self.forget()

    def start(self, now: float) -> None:
        """Note that a run begins: it does not catch up on the time in which it stood still."""
        self._due = max(self._due, now)

    def forget(self) -> None:
        """Forget what steps cost, since the worlds are others now."""
        # Seconds that a step takes, as measured; a slow one at first, so that the first part is short.
        self._cost = _PART

    def stretch(self) -> int:
        """Return the number of steps from this frame to the next, a multiple of `every`."""
        wanted = (1 / self._cost if self.rate is None else self.rate) / FRAMES_A_SECOND
        return self.every * max(int(min(wanted, _MOST_AT_ONCE) / self.every + 1e-9), 1)

    def part(self) -> int:
        """Return how many steps to make before messages of pages are read again."""
        return max(int(min(_PART / self._cost, _MOST_AT_ONCE)), 1)

    def took(self, steps: int, seconds: float) -> None:
        """Note how long steps took, frames included."""
        self._cost += 0.3 * (max(seconds / max(steps, 1), 1e-7) - self._cost)

    def wait(self, now: float) -> float:
        """Return how long to wait from `now` until the next stretch is due [s]."""
        return 0.0 if self.rate is None else max(self._due - now, 0.0)

    def begin(self, now: float, steps: int) -> None:
        """Note that a stretch begins; the next one is due when it should take `steps` to be over."""
        if self.rate is not None:
            # Late ones catch up a little, so that the mean rate is right.
            self._due = max(self._due, now - _LATEST) + steps / self.rate


# The task of a class whose name pages know too.
_TASK_OF = {"CMOMMT": "cmommt"}
#: Returns worlds that run on a seed, and their controls.
Making: TypeAlias = Callable[[int], tuple[Worlds, Mapping[str, Control]]]


class _Reel(NamedTuple):
    """What a film shows: the scene and the kept blocks of each world, and the ticks that are drawn.

    Also how many frames were chosen, from which tick to which, of which ticks frames are kept, how many a film has at
    most, and the ending of its file.
    """

    kept: list[tuple[Scene, list[bytes]]]
    ticks: frozenset[int]
    frames: int
    first: int
    last: int
    oldest: int
    newest: int
    most: int
    ending: str

    def of(self, scene: Scene, blocks: list[bytes]) -> list[bytes]:
        """Return the blocks of a world that are drawn."""
        return [block for tick, block in zip(ticks_of(scene, blocks), blocks, strict=True) if tick in self.ticks]


def _file_name(title: str) -> str:
    name = "-".join("".join(c if c.isalnum() else " " for c in title.lower()).split())
    return f"teamsight-{name[:80]}"


class Frames(NamedTuple):
    """The messages of one moment: its number, which pages acknowledge, those of the scenes it needs, and its own."""

    number: int
    scenes: tuple[str, ...]
    messages: tuple[bytes, ...]


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
    running : bool
        Whether they run from the start.
    tasks : mapping of str to callable, optional
        What pages can choose in place of these worlds, by name: called with a seed, it returns other worlds and their
        controls.
    row : callable, optional
        Called with the id of a run of the study that the page shows, it returns its world and controls.

    Attributes
    ----------
    board : dict of str to object
        What pages are to show: the newest message of each kind. Nothing waits in a queue, so a slow page skips frames,
        costs no memory, and never holds up the simulation. Under "scene" and "frame" are those of all worlds.
    on_news : callable
        Called after each change of the board.
    begun : threading.Event
        Set when the first worlds are there, or cannot be built, or something is compiled for them.
    failure : BaseException or None
        Why the first worlds cannot be built.
    said : str
        What is being compiled, for people; empty if nothing is.
    is_running : bool
        Whether the worlds make steps.
    """

    def __init__(
        self,
        worlds: Worlds,
        controls: Mapping[str, Control],
        *,
        rate: float | None,
        running: bool,
        tasks: Mapping[str, Making] | None = None,
        row: Callable[[str], tuple[Worlds, Mapping[str, Control]]] | None = None,
    ) -> None:
        self._row = row
        self.worlds, self._controls = worlds, dict(controls)
        # What pages can choose, the first model among it, with what it was given.
        given, self._first = dict(worlds.settings[0]), model_name(worlds.model)
        self._tasks: dict[str, Making] = {
            self._first: lambda seed: (Worlds(worlds.model, [dict(given)], seed), dict(controls)),
            **{name: one for name, one in (tasks or {}).items() if name != self._first},
        }
        self.board: dict[str, Any] = {}
        self.on_news: Callable[[], object] = lambda: None
        self.begun, self.said, self.is_running = threading.Event(), "", running
        self.failure: BaseException | None = None
        self._pacer = Pacer(rate, worlds.every)
        self._news = threading.Condition()
        self._waiting: dict[Hashable, Message] = {"reset": Message("reset", {})}
        self._is_acting, self._is_closing, self._viewers = False, False, 0
        self._note, self._is_failed = "", False
        self._state: dict[str, Any] = {}
        # Steps that are left to the next frame; and the tick of a link, to which the worlds run, or 0.
        self._left = self._goal = 0
        # What that link says was done to each world until then, after how many steps.
        self._acts: list[deque[tuple[int, Act]]] = []
        self._reported = 0.0
        # Since when steps are counted, and how many were made then; None while the worlds stand still. And the steps
        # in a second, once they have been counted.
        self._counted: tuple[float, int] | None = None
        self._measured: float | None = None
        self._number = 0
        # Another value shows pages that other worlds run, maybe of another server.
        self._run = secrets.token_hex(4)
        self._scenes: list[Scene] = []
        # Of worlds that are being built.
        self._engines: list[Engine] = []
        # The settings on the left when two worlds began, and those of the one before.
        self._before: tuple[dict[str, Any], dict[str, Any]] = {}, {}
        self._band: Band | None = None
        self._thread = threading.Thread(target=self._work, name="teamsight worlds", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread. Idempotent."""
        with self._news:
            self._is_closing = True
            self._news.notify()
        self._thread.join(timeout=1)
        if self._band is not None:
            self._band.cancel()

    def ask(self, message: Message) -> None:
        """Let the thread carry a message out soon, in place of one that waits to set the same.

        Raises
        ------
        ValueError
            If too many wait already.
        """
        kind, fields = message
        # A slider sends more values than can be used; each step counts: three are three.
        key: object = kind
        if kind in ("set", "chart"):
            key = kind, fields["name"], fields.get("track")
        elif kind in ("step", *protocol.INTERVENTIONS):
            key = object()
        with self._news:
            if key not in self._waiting and len(self._waiting) >= MOST_WAITING:
                raise ValueError(f"{kind}: {MOST_WAITING} messages wait already; try again when they are done")
            self._waiting.pop(key, None)
            self._waiting[key] = message
            self._news.notify()

    def watched_by(self, pages: int) -> None:
        """Say how many pages are open; without one the worlds stand still."""
        with self._news:
            if not self._viewers:
                # While nobody watches, nothing is made.
                self._counted = None
                self._pacer.start(time.monotonic())
            self._viewers = pages
            if not pages:
                self._waiting["drop"] = Message("drop", {})
            self._news.notify()

    def busy(self) -> bool:
        """Return whether messages wait or are being carried out."""
        return bool(self._waiting) or self._is_acting

    def history(self) -> list[str | bytes]:
        """Return what a new page has missed: the scenes, then the newest frames; for other threads.

        If the worlds are built anew meanwhile, the scenes that follow make the page drop them.
        """
        run, newest = self._run, [track.newest(_MOST_HISTORY) for track in self.worlds.tracks]
        return [
            *self._scene_messages([scene for scene, _ in newest], run),
            *(protocol.history_message(i, blocks) for i, (_, blocks) in enumerate(newest) if blocks),
        ]

    def recording(self) -> tuple[str, str]:
        """Return what is kept as a page that plays anywhere, after the name of its file; for other threads."""
        tracks, name = self._kept()
        return f"{name}.html", page(tracks, title=tracks[0].scene.title)

    def film(
        self, progress: Callable[[int, int], object], run: str, first: int | None = None, last: int | None = None
    ) -> tuple[str, bytes]:
        """Return frames as a film, after the name of its file; for other threads.

        It is an MP4, sharp on a screen with two pixels for each one of a page, if imageio-ffmpeg is installed, else a
        GIF.

        Parameters
        ----------
        progress : callable
            Called with the number of drawn frames and that of all; what it raises ends the film.
        run, first, last
            As for `reel`.
        """
        reel = self._reel(run, first, last)
        tracks = [
            RecordedTrack(scene, [from_raw(one, scene) for one in blocks])
            for scene, blocks in ((scene, reel.of(scene, kept)) for scene, kept in reel.kept)
        ]
        title = tracks[0].scene.title
        film = rendered(tracks, reel.ending, scale=_SCALES[reel.ending], title=title, progress=progress)
        return f"{_file_name(title)}{reel.ending}", film

    def reel(self, run: str, first: int | None = None, last: int | None = None) -> dict[str, Any]:
        """Return what a film would be, as a page shows it; for other threads.

        Parameters
        ----------
        run : str
            Of which worlds; those that were built anew since have other frames.
        first, last : int, optional
            Its first and its last tick; by default those of the newest frames, as many as a GIF has.

        Raises
        ------
        ValueError
            If there are no such frames.
        """
        found = self._reel(run, first, last)
        pictures, bodies = len(found.ticks), sum(len(scene.slots) for scene, _ in found.kept)
        return {
            "first": found.first, "last": found.last, "oldest": found.oldest, "newest": found.newest,
            "frames": found.frames, "pictures": pictures, "most": found.most, "ending": found.ending[1:].upper(),
            "bytes": pictures * (_BYTES_OF_PICTURE + _BYTES_OF_BODY * bodies),
            "seconds": pictures / FPS, "width": width_of(found.ending, len(found.kept), _SCALES[found.ending]),
        }  # fmt: skip

    def _reel(self, run: str, first: int | None, last: int | None) -> _Reel:
        kept = [track.newest() for track in self.worlds.tracks]
        if run != self._run:
            raise ValueError("the worlds were built anew meanwhile, and these frames are gone; choose again")
        if not kept or not all(blocks for _, blocks in kept):
            raise ValueError("nothing is recorded yet; wait until the worlds are compiled")
        try:
            check_video()
            ending, most = ".mp4", MOST_IN_FILM
        except ImportError:
            ending, most = ".gif", MOST_IN_GIF
        times = ticks_of(*kept[0])
        last = times[-1] if last is None else last
        first = min([one for one in times if one <= last][-MOST_IN_GIF:], default=last) if first is None else first
        chosen = [one for one in times if first <= one <= last]
        if first < min(times) or last > max(times) or not chosen:
            raise ValueError(
                f"ticks {first:,} to {last:,}: frames are kept of ticks {min(times):,} to {max(times):,}, and a film "
                "has one at least; choose others"
            )
        every = -(-len(chosen) // most)
        return _Reel(kept, frozenset(chosen[::every]), len(chosen), first, last, min(times), max(times), most, ending)

    def _kept(self) -> tuple[list[RecordedTrack], str]:
        """Return the frames that are kept, of each world, and a name for a file of them."""
        newest = [track.newest() for track in self.worlds.tracks]
        tracks = [RecordedTrack(scene, [from_raw(one, scene) for one in blocks]) for scene, blocks in newest]
        if not tracks:
            raise ValueError("nothing is there yet; wait until the worlds are compiled")
        return tracks, _file_name(tracks[0].scene.title)

    def _work(self) -> None:
        PREPARING.set(self._prepare)
        with listening(self._say):
            while not self._is_closing:
                try:
                    for kind, fields in self._take():
                        if kind in protocol.INTERVENTIONS:
                            self._attempt(partial(self._intervene, kind), **fields)
                        else:
                            self._attempt(getattr(self, f"_on_{kind}"), **fields)
                    if self._goal and self._viewers:
                        self._approach()
                    elif self._is_moving and not self._patience():
                        self._advance()
                    if self.said:
                        self._report()
                except BaseException as error:  # of a model, for whatever reason; Ctrl-C comes to the main thread
                    self.is_running, self._left, self._goal = False, 0, 0
                    self._show_error(error)
                    with suppress(BaseException):  # it may be the state that cannot be read
                        self._report()
                self.begun.set()

    def _take(self) -> list[Message]:
        """Return the messages that wait, in order; wait for some as long as there is nothing else to do."""
        with self._news:
            self._is_acting = False
            if not self._waiting and not self._is_closing:
                self._news.wait(self._patience())
            self._is_acting = bool(self._waiting)
            messages, self._waiting = list(self._waiting.values()), {}
        return messages

    @property
    def _is_moving(self) -> bool:
        return self.is_running and self._viewers > 0 and bool(self.worlds.tracks)

    def _patience(self) -> float | None:
        """Return how long to wait for messages [s]; None for as long as it takes."""
        if self._goal and self._viewers:
            return 0.0
        if not self._is_moving:
            return None
        return 0.0 if self._left else self._pacer.wait(time.monotonic())

    def _attempt(self, act: Callable[..., None], **fields: Any) -> None:
        """Carry a message out; an error is shown on the pages, and the worlds stay as they are."""
        try:
            act(**fields)
        except BaseException as error:  # of a model that refuses its arguments, for whatever reason
            self._show_error(error)
            # The pages show the values that hold, not the one that was refused.
            self._show_controls()
        self._report()

    def _show_error(self, error: BaseException) -> None:
        if not self.worlds.tracks:
            self.failure = error
        self._show("error", protocol.refusal(error, self.labels))

    @property
    def labels(self) -> dict[str, str]:
        """What pages call each control; of two that are called alike also of whom they are."""
        same = Counter(one.label for one in self._controls.values())
        return {
            name: one.label + f" of {one.section.lower()}" * (same[one.label] > 1)
            for name, one in self._controls.items()
        }

    def _say(self, number: str) -> None:
        """Say which kernel is being compiled, maybe within a step."""
        self.said = f"Compiling kernels, once on this machine ({number})"
        self._post("state", **{**self._state, "busy": self.said})
        if not self.worlds.tracks and len(self._engines) > len(self._scenes):
            # The first picture: the kernels of steps, which building may need too, take several times as long.
            self._show_outlines()
        self.begun.set()

    def _prepare(self, engine: Engine) -> None:
        """Note a world that is being built, if there are no others that could be shown meanwhile."""
        if not self.worlds.tracks and engine not in self._engines:
            self._engines.append(engine)

    def _show_outlines(self) -> None:
        """Show where the bodies are of worlds that are being built."""
        name = model_name(self.worlds.model)
        title = f"{name}: where all start"
        shown = [FrameRecorder(one._data, one, name, title=title).outline() for one in self._engines]
        self._show_blocks([scene for scene, _ in shown], [raw(frame, scene) for scene, frame in shown])

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
            self._show_frames()
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
            self._is_failed = error.__cause__ is not None
            self._on_pause(f"{error}; Reset starts again.")
            self._show_frames()
            return False
        if self.worlds.made // MOST_STEPS > before // MOST_STEPS:
            self._on_pause(f"Paused after {self.worlds.made:,} steps, whose history is in memory; Run goes on.")
        return True

    def _on_run(self) -> None:
        if not all(track.world.running for track in self.worlds.tracks):
            raise ValueError("run: the model has stopped; Reset starts again")
        self._pacer.start(time.monotonic())
        self.is_running, self._note, self._is_failed, self._goal = True, "", False, 0

    def _on_pause(self, note: str = "") -> None:
        was_between = (self._left or self._goal) and not note
        self.is_running, self._left, self._goal, self._note = False, 0, 0, note
        self._report()
        if was_between:
            self._show_frames()

    def _on_step(self) -> None:
        self._on_run()
        self.is_running = False
        if self._make_steps(self._pacer.every):
            self._left = 0
            self._show_frames()

    def _on_reset(self) -> None:
        self._rebuild(self.worlds.settings, "")

    def _on_rate(self, value: float | None) -> None:
        self._pacer.rate = value

    def _on_every(self, value: int) -> None:
        self._pacer.every = self.worlds.every = value
        self.worlds.describe()

    def _on_compare(self, on: bool) -> None:
        first, *others = self.worlds.settings
        if on == bool(others):
            return
        # Both begin at tick 0, since neither can catch up with the other's past.
        if on:
            (left, right), note = self._blind_and_aware(first)
            self._before = left, first
            self._rebuild([left, right], f"Started again, two worlds on the same noise{note}.")
        else:
            blind, before = self._before
            self._rebuild([before if first == blind else first], "Started again.")

    def _blind_and_aware(self, settings: dict[str, Any]) -> tuple[list[dict[str, Any]], str]:
        """Return the settings of a team without awareness and of one with, and what to say; equal ones without such."""
        name, control = "awareness", self._controls.get("awareness")
        if control is None or "none" not in control.choices:
            return [settings, dict(settings)], ""
        degree = self.worlds.tracks[0].value(name)
        if control.shown(degree) == "none":
            degree = next((one for text, one in control.choices.items() if text != "none"), degree)
        pair = [{**settings, name: one} for one in (control.choices["none"], degree)]
        return pair, f": blind (awareness none), and aware ({control.shown(degree)})"

    def _on_chart(self, name: str, on: bool) -> None:
        self.worlds.chart(name, on)
        self._show_frames(again=True)

    def _on_band(self, runs: int, ticks: int | None) -> None:
        """Run worlds of other seeds, by default to the present tick, in place of those that do."""
        band = Band(self.worlds, runs, self.worlds.made if ticks is None else ticks, self._post)
        self._on_drop()
        self._band = band
        band.start()

    def _on_drop(self) -> None:
        """Show no band, and stop its runs."""
        if self._band is not None:
            self._band.cancel()
            self._band = None
            self._post("band", runs=0)

    def _on_set(self, name: str, value: Any, track: int | None) -> None:
        control = self._controls[checks.choice("name", name, tuple(self._controls))]
        given, tracks, worlds = control.checked(value), self.worlds.tracks, self.worlds
        if track is not None and track >= len(tracks):
            raise ValueError(f"track={track}: there is one world only; compare first")
        chosen = tracks if track is None else [tracks[track]]
        if name == SEED:
            self._show_controls({name: value})
            self._rebuild(worlds.settings, f"Started again with seed {given}.", given)
            return
        if all(control.shown(one.value(name)) == control.shown(given) for one in chosen):
            return
        settings = [one.with_value(name, given) if one in chosen else one.parameters for one in tracks]
        self._show_controls({name: value}, track)
        if not control.live:
            note = f"Started again with {control.label or name} {control.shown(given)}, seed {worlds.seed}."
            self._rebuild(settings, note)
            return
        if control.kind == "choice":
            # Another rule may have to be compiled, as for these worlds, which are then not needed.
            for one in worlds.build(settings, worlds.seed):
                one.world.close()
        worlds.change(chosen, name, given)
        self._on_drop()
        self._note = ""
        self._show_frames(again=True)
        self._show_controls()

    def _on_task(self, name: str) -> None:
        """Show another task, under the same seed."""
        worlds, controls = self._tasks[checks.choice("task", name, tuple(self._tasks))](self.worlds.seed)
        self._rebuild(worlds.settings, f"{name}, seed {self.worlds.seed}.", onto=(worlds, controls))

    def _on_row(self, run: str) -> None:
        """Show a run of the study."""
        if self._row is None:
            raise ValueError(f"run={checks.shown(run)}: there is no study; start with teamsight watch --study FOLDER")
        worlds, controls = self._row(run)
        self._rebuild(worlds.settings, f"Run {run} of the study, seed {worlds.seed}.", worlds.seed, (worlds, controls))

    @property
    def _listed(self) -> list[str]:
        """The names that pages offer: of a task and its class, CMOMMT and cmommt, that which is shown, or was first."""
        shown = {_TASK_OF.get(name, name): name for name in (*self._tasks, self._first, model_name(self.worlds.model))}
        return list(dict.fromkeys(shown[_TASK_OF.get(name, name)] for name in self._tasks))

    @property
    def _presets(self) -> dict[str, list[dict[str, Any]]]:
        """What a page can show at once, by name: in what the two worlds differ from the settings."""
        control, found = self._controls.get("awareness"), dict[str, list[dict[str, Any]]]()
        degrees = control.choices if control is not None else {}
        if "none" in degrees and "pairwise" in degrees:
            found["Blind and aware"] = [{"awareness": "none"}, {"awareness": "pairwise"}]
        if links.has_failures(self.worlds.model):
            found["Failures"] = [{}, {"events": Failures(200, 50)}]
        if {"ring", "pairwise"} <= degrees.keys() and "delta" in self._controls:
            for delta in (1, 2, 3):
                found[f"δ = {delta}"] = [{"awareness": "ring", "delta": delta}, {"awareness": "pairwise"}]
        return found

    def _on_preset(self, name: str) -> None:
        """Show two worlds side by side that differ in one thing; what pages have set otherwise holds in both."""
        presets, first = self._presets, self.worlds.settings[0]
        pair = presets[checks.choice("preset", name, tuple(presets))]
        settings = [{**first, **one} for one in pair]
        # Alone again, the first world is as it was before.
        self._before = settings[0], first
        self._rebuild(settings, f"{name}: two worlds on the same noise.")
        self._on_run()

    def _on_open(self, link: str) -> None:
        """Go where a link leads: other settings, another seed, and a tick, to which the worlds then run."""
        if not self._is_failed:
            # That of a link before.
            self._note = ""
        try:
            found = links.read(link)
            worlds, controls = self._tasks[checks.choice("task", found.task, tuple(self._tasks))](self.worlds.seed)
            to = links.opened(found, worlds.model, controls, worlds.settings[0])
            # Components of the link bring controls for their options, and what may be left out one of its own.
            left = to.settings[0]
            parts = {name for name, value in left.items() if isinstance(value, Component) or name not in controls}
            theirs = [one for one in controls_of(worlds.model, to.settings[0]) if one.name.partition(".")[0] in parts]
            anew = {**controls, **{one.name: one for one in theirs}}
            self._rebuild(to.settings, "Opened from a link.", to.seed, (worlds, anew))
        except (TypeError, ValueError) as error:
            raise ValueError(f"This link cannot be opened: {error}. The page goes on with what ran.") from error
        self.is_running, self._goal, self._acts = False, to.tick, [deque(acts) for acts in to.acts]
        self._repeat(found.task)

    def _repeat(self, task: str) -> None:
        """Do what a link says was done after the steps that are made, before the next one."""
        worlds = self.worlds
        try:
            for track, acts in zip(worlds.tracks, self._acts, strict=True):
                while acts and acts[0][0] <= worlds.made:
                    worlds.repeat(track, acts.popleft()[1])
        except BaseException as error:  # of a model, for whatever reason
            made, anew = worlds.made, self._tasks[task](worlds.seed)
            self._rebuild(anew[0].settings, "", None, anew)
            raise ValueError(
                f"This link cannot be followed beyond tick {made:,}: {said(error)}. The page goes on with the defaults."
            ) from error
        self._show_frames(again=True)
        self._show_controls()

    def _approach(self) -> None:
        """Make a part of the steps to the tick of a link, and do what it says was done."""
        began, made = time.monotonic(), self.worlds.made
        due = min([self._goal, *(acts[0][0] for acts in self._acts if acts)])
        steps = min(due - made, self._pacer.part())
        if steps and not self._make_steps(steps):
            return
        if self.worlds.made == due and any(self._acts):
            self._attempt(self._repeat, task=model_name(self.worlds.model))
            return
        now = time.monotonic()
        self._pacer.took(steps, now - began)
        if self.worlds.made >= self._goal:
            self._goal = 0
            self._show_frames()
            self._report()
        elif now - self._reported > _BETWEEN_STATES:
            self._show_frames()
            self._report()

    def _intervene(self, kind: str, track: int, both: bool, run: str, **fields: Any) -> None:
        if run != self._run:
            # Bodies of other worlds have the same numbers.
            raise ValueError(f"{kind}: the worlds were built anew meanwhile, so nothing was done; do it again")
        self.worlds.intervene(kind, track, fields, both=both)
        self._note = ""
        self._show_frames(again=not self._left)

    def copied(self, form: str) -> tuple[str, list[str]]:
        """Return the worlds as a command, as a script or as a link, and what is not in that; for other threads."""
        if form == "link":
            return links.written(self.worlds, self._controls, running=self.is_running)
        unknown = list[str]()
        text = (script_of if form == "Python" else command_of)(self.worlds, unknown)
        said = [f"Not in it: {'; '.join(' '.join(one.split()) for one in unknown)}."] * bool(unknown)
        if form == "command" and any(track.journal.entries for track in self.worlds.tracks):
            said.append("What was done to the world is not in the command; it is in the Python.")
        return text, said

    def _rebuild(
        self,
        settings: list[dict[str, Any]],
        note: str,
        seed: int | None = None,
        onto: tuple[Worlds, Mapping[str, Control]] | None = None,
    ) -> None:
        """Build other worlds in place of those that there are, and show them; pages drop the frames of those before.

        `onto` are those of another task, with their controls.
        """
        seed = self.worlds.seed if seed is None else seed
        self._report(settings)
        if onto is None:
            self.worlds.replace(self.worlds.build(settings, seed), seed)
        else:
            before, (worlds, controls) = self.worlds, onto
            worlds.every = before.every
            worlds.replace(worlds.build(settings, seed), seed)
            self.worlds, self._controls = worlds, dict(controls)
            for track in before.tracks:
                track.world.close()
        self._on_drop()
        self._left, self._note, self._is_failed, self._goal, self._counted = 0, note, False, 0, None
        self._acts = []
        self._pacer.forget()
        self._pacer.start(time.monotonic())
        self._run = secrets.token_hex(4)
        self._scenes = []
        self._engines.clear()
        self._show_controls()
        self._show_frames()

    def _show(self, kind: str, value: Any) -> None:
        self.board[kind] = value
        self.on_news()

    def _post(self, kind: str, **fields: Any) -> None:
        text = protocol.text(kind, **fields)
        if kind == "error" or text != self.board.get(kind):
            self._show(kind, text)

    def _show_frames(self, *, again: bool = False) -> None:
        """Show the present frames; `again` if the last ones showed the same moment."""
        tracks = self.worlds.tracks
        blocks = [track.look(again=again) for track in tracks]
        self._show_blocks([track.scene for track in tracks], blocks)

    def _show_blocks(self, scenes: list[Scene], blocks: list[bytes]) -> None:
        """Show frames of all worlds, and their scenes if these have changed."""
        self._number += 1
        if list(map(id, scenes)) != list(map(id, self._scenes)):
            self._scenes = scenes
            self._show("scene", self._scene_messages(scenes, self._run))
        messages = tuple(protocol.frame_message(i, self._number, block) for i, block in enumerate(blocks))
        self._show("frame", Frames(self._number, self.board["scene"], messages))

    @staticmethod
    def _scene_messages(scenes: list[Scene], run: str) -> tuple[str, ...]:
        return tuple(
            protocol.text("scene", track=i, tracks=len(scenes), run=run, scene=scene.as_json())
            for i, scene in enumerate(scenes)
        )

    def _show_controls(self, wanted: Mapping[str, Any] | None = None, track: int | None = None) -> None:
        """Show the controls and their values, or those that will hold soon, in one world or in all."""
        values = []
        for number, one in enumerate(self.worlds.tracks):
            held = {name: self.worlds.seed if name == SEED else one.value(name) for name in self._controls}
            values.append({name: self._controls[name].shown(value) for name, value in held.items()})
            if track in (None, number):
                values[-1] |= wanted or {}
        if values:
            self._post("controls", controls=[one.as_json() for one in self._controls.values()], values=values)

    def _report(self, building: list[dict[str, Any]] | None = None) -> None:
        """Show the state and the event logs; which worlds are being built, if any."""
        now, worlds = time.monotonic(), self.worlds
        self._measure(now)
        self._reported, self.said = now, ""
        self._state = {
            "running": self.is_running, "rate": self._pacer.rate, "every": self._pacer.every,
            "busy": "Building …" if building else f"Running to tick {self._goal:,} …" if self._goal else "",
            "note": self._note, "failed": self._is_failed,
            "ended": not all(track.world.running for track in worlds.tracks),
            "measured": self._measured, "made": worlds.made, "two": len(building or worlds.tracks) == 2,
            "tracks": [track.state() for track in worlds.tracks], "task": model_name(worlds.model), "goal": self._goal,
            "tasks": self._listed, "presets": list(self._presets),
            "study": self._row is not None,
            "measures": list(dict.fromkeys(chain(*(one.measures for one in worlds.tracks), worlds.charted))),
            "charted": [name for name, on in worlds.charted.items() if on],
            "link": links.written(worlds, self._controls, running=self.is_running)[0] if worlds.tracks else "",
        }  # fmt: skip
        self._post("state", **self._state)
        self._post("events", tracks=[event_rows(track.world) for track in worlds.tracks])

    def _measure(self, now: float) -> None:
        """Count the steps in a second, over a time that says something."""
        made = self.worlds.made
        if not self._is_moving or self._counted is None:
            self._measured = None
            self._counted = (now, made) if self._is_moving else None
            return
        passed, steps = now - self._counted[0], made - self._counted[1]
        if passed >= _MEASURED and steps:
            self._measured, self._counted = steps / passed, (now, made)
