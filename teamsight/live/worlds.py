"""The worlds of a page: one, or two with the same seed that make the same number of steps."""

from __future__ import annotations

import threading
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import accumulate, islice
from types import MappingProxyType
from typing import Any

import numpy as np

from teamsight.agents.awareness.registry import AWARENESS, awareness_named
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.engine.engine import kernels_needed
from teamsight.agents.engine.records import Bound
from teamsight.agents.events.contact_log import CONTACT, ContactLog
from teamsight.agents.events.sources import EventSource
from teamsight.agents.recording.frames import RECORD_FRAME, FrameRecorder
from teamsight.agents.state import State
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.component import Component, declared
from teamsight.core.references import failure, said
from teamsight.live import interventions
from teamsight.live.controls import model_name, seed_name
from teamsight.live.interventions import Act, Entry, Journal
from teamsight.live.measures import Measures
from teamsight.tasks.model import TaskModel
from teamsight.tasks.task import Metric
from teamsight.view.packing import from_raw, raw
from teamsight.view.scene import MOST_LINKS, MOST_SLOTS, Frame, Scene

#: The newest frames that are kept of each world for a recording: their number, and bytes of memory.
MOST_FRAMES, MOST_BYTES = 20_000, 64 * 2**20
#: Rows of the event log that a page shows, and rows of contacts of each log: they change at almost every tick, and
#: would leave no room for other events.
MOST_EVENTS, MOST_CONTACTS = 100, 20
# Ticks between frames that are recorded unasked: none is.
_NEVER = 2**62
_DEGREE = ("awareness", "delta")


class StoppedError(Exception):
    """A world makes no further step: its model failed or stopped."""


class Observer(FrameRecorder):
    """Makes frames of the present state of a world, when it is asked for one.

    Parameters
    ----------
    world : World
        The world.
    every : int
        What its scene says about the ticks from one frame to the next.
    metrics : mapping of str to callable
        The metrics of its task, which can be charted too.

    Attributes
    ----------
    shown_every : int
        The same.
    is_stale : bool
        Whether the scene may have changed: after other bodies, ranges or rules; set it after what needs no binding.
    measures : Measures
        What can be charted beside what frames hold.
    charted : tuple of str
        What is: the further series of its frames.
    """

    # Ranges that controls allow make millions of links, of four bytes each, which no page could draw.
    most_links = MOST_LINKS

    def __init__(self, world: World, every: int, metrics: Mapping[str, Metric] = MappingProxyType({})) -> None:
        super().__init__(world._data, world._engine, type(world).__name__, every=_NEVER)
        self.shown_every, self.is_stale = every, True
        self.measures, self.charted = Measures(world, metrics), tuple[str, ...]()
        self._present: Scene | None = None
        self.begin()

    def bind(self, bound: Bound) -> None:
        """Pack the record again."""
        super().bind(bound)
        self.is_stale = True
        # Only the newest frame is ever read.
        del self._chunks[:-1]

    def frame(self) -> Frame:
        """Return the present frame.

        Raises
        ------
        ValueError
            If more agents have come so far than frames can number.
        """
        self._engine.prepare()
        if self.entry is not RECORD_FRAME:
            raise ValueError(f"agents: more than {MOST_SLOTS:,} have come, and a page can number no more; watch fewer")
        chunk = self._chunks[-1]
        chunk.state[:2] = 0
        RECORD_FRAME(self.record)
        chunk.state[2] += 1
        frame = chunk.frames(self.links, self._space)[-1]
        if not self.charted:
            return frame
        values = np.array(self.measures.read(self.charted), np.float32)
        return replace(frame, series=np.concatenate([frame.series, values]))

    @property
    def present(self) -> Scene:
        """The scene of the newest frame; the same object as long as nothing in it has changed."""
        if self._present is None or self.is_stale:
            self.is_stale = False
            scene = replace(self.scene, every=self.shown_every, series=(*self.scene.series, *self.charted))
            self._present = self._present if scene == self._present else scene
        return self._present


def value_of(model: Callable[..., World], parameters: Mapping[str, Any], name: str) -> Any:
    """Return the value of a parameter, or of a setting of a component: ``policy.gain``.

    It is None if only the other world was given it, and the model takes any.
    """
    base, _, option = name.partition(".")
    usual = declared(model).get(base)
    value = parameters.get(base, None if usual is None else usual.default)
    return getattr(value, option, None) if option else value


def with_value(model: Callable[..., World], parameters: Mapping[str, Any], name: str, value: Any) -> dict[str, Any]:
    """Return arguments with another value of a parameter, or of a setting of a component.

    Raises
    ------
    ValueError
        If the component is another one now.
    """
    base, _, option = name.partition(".")
    if option:
        component = value_of(model, parameters, base)
        if not isinstance(component, Component) or option not in declared(type(component)):
            shown = checks.shown(component)
            raise ValueError(f"{name}: {base} is {shown} now, which has none; choose the other first")
        again: Any = replace
        value = again(component, **{option: value})
    return {**parameters, base: value}


class LiveTrack:
    """A world that runs, and can be built again.

    Parameters
    ----------
    model : callable
        A class or function that builds a world.
    parameters : mapping of str to object
        Its arguments, without the seed.
    seed : int
        The seed.
    every : int
        Ticks from one frame to the next.

    Attributes
    ----------
    kept : deque of bytes
        The newest frames, as raw blocks.
    made : int
        The number of steps since the world was built.
    journal : Journal
        What was done to it since.

    Raises
    ------
    TypeError, ValueError
        If the model refuses its arguments, or builds no world with agents.
    """

    def __init__(self, model: Callable[..., World], parameters: Mapping[str, Any], seed: int, every: int) -> None:
        self._model, self.parameters = model, dict(parameters)
        name = seed_name(model)
        self.world = world = model(**self.parameters, **({} if name is None else {name: seed}))
        if not isinstance(world, World):
            raise TypeError(
                f"{model_name(model)}: builds {checks.shown(world)}, which is no World; derive the class from "
                "teamsight.World, or return one from the function"
            )
        if not any(map(len, world.groups)):
            raise ValueError(
                f"{model_name(model)}: builds a world without agents; add some, as in world.add(Robot, 10)"
            )
        self.made = self._bytes = 0
        self.journal = Journal(self.parameters)
        # What was set last, and is not noted yet.
        self._set: Entry | None = None
        self.kept: deque[bytes] = deque()
        self._observer = Observer(world, every, model.task.metrics if isinstance(model, TaskModel) else {})
        # By which the frames that are kept are read.
        self._packed = self._observer.present
        # Held while the scene and the frames change together.
        self._lock = threading.Lock()

    def compile(self) -> None:
        """Compile what steps and frames need; another world with these settings then finds it."""
        self._observer.frame()
        for entry in kernels_needed(self.world._data)():
            _ = entry.address

    @property
    def scene(self) -> Scene:
        """The scene of the newest frame."""
        return self._observer.present

    def newest(self, most: int | None = None) -> tuple[Scene, list[bytes]]:
        """Return the scene and the frames that are kept, or the newest of so many bytes; other threads may call it."""
        with self._lock:
            scene, blocks = self._packed, list(self.kept)
            if (scene.links, scene.series) == (self.scene.links, self.scene.series):
                scene = self.scene
        if most is not None:
            sizes = accumulate(map(len, reversed(blocks)))
            blocks = blocks[len(blocks) - sum(size <= most for size in sizes) :]
        return scene, blocks

    def describe(self, every: int, title: str | None) -> None:
        """Change what the scene says: ticks from one frame to the next, and its title; None for its own."""
        with self._lock:
            self._observer.shown_every, self._observer.title, self._observer.is_stale = every, title, True

    def chart(self, names: Iterable[str]) -> None:
        """Chart these measures from now on, after those of `Observer.charted`; frames of before have none."""
        wanted = tuple(dict.fromkeys([*self._observer.charted, *names]))
        if wanted != self._observer.charted:
            self._observer.charted, self._observer.is_stale = wanted, True

    @property
    def measures(self) -> dict[str, Callable[[], Any]]:
        """What reads each measure that can be charted, by name."""
        return self._observer.measures.all()

    def value(self, name: str) -> Any:
        """Return the value of a parameter."""
        return value_of(self._model, self.parameters, name)

    def with_value(self, name: str, value: Any) -> dict[str, Any]:
        """Return the arguments with another value; see `with_value`."""
        return with_value(self._model, self.parameters, name, value)

    def run(self, steps: int) -> None:
        """Make steps; fewer if the model stops."""
        before = self.world.tick
        try:
            self.world.run(steps, progress=False)
        finally:
            # An event may have reset the world, whose tick then says nothing.
            made = self.world.tick - before
            self.made += made if 0 <= made <= steps else steps

    def look(self, *, again: bool = False) -> bytes:
        """Return the present frame as a raw block and keep it; the oldest ones beyond the limits are dropped.

        Parameters
        ----------
        again : bool
            Whether it takes the place of the newest frame, which shows the same moment.
        """
        kept = self.kept
        with self._lock:
            before = self._packed
            frame = self._observer.frame()
            self._packed = self.scene
            added = len(self.scene.series) - len(before.series)
            if before.links != self.scene.links or self.scene.series[: len(before.series)] != before.series:
                kept.clear()
                self._bytes = 0
            elif added:
                # The frames of before have no value of what is charted now.
                nothing = np.full(added, np.nan, np.float32)
                for k, block in enumerate(kept):
                    old = from_raw(block, before)
                    kept[k] = raw(replace(old, series=np.concatenate([old.series, nothing])), self.scene)
                self._bytes = sum(map(len, kept))
            if again and kept:
                self._bytes -= len(kept.pop())
            kept.append(raw(frame, self.scene))
            self._bytes += len(kept[-1])
            while len(kept) > MOST_FRAMES or (self._bytes > MOST_BYTES and len(kept) > 1):
                self._bytes -= len(kept.popleft())
            return kept[-1]

    def set(self, name: str, value: Any) -> None:
        """Change a parameter of the running world.

        Raises
        ------
        TypeError, ValueError
            If the world refuses the value; nothing is changed then.
        """
        parameters, base, world = self.with_value(name, value), name.partition(".")[0], self.world
        act = Act("set", {"name": name, "value": value})
        # A setting that has no effect now may have one later: a link carries it, and a script need not.
        self._set = Entry(self.made, act)
        if base not in _DEGREE or not isinstance(world, CMOMMT):
            setattr(world, base, parameters[base])
            self._set = Entry(self.made, act, (), base, parameters[base])
        else:
            # A degree by name has the present δ.
            degree, delta = (parameters[one] if one in parameters else self.value(one) for one in _DEGREE)
            if isinstance(degree, str) and (base == "awareness" or "delta" in AWARENESS[degree].options()):
                degree = awareness_named(degree, {"delta": delta})
            elif base != "awareness":
                degree = None
            if degree is not None:
                world.awareness = degree
                self._set = Entry(self.made, act, (), "awareness", degree)
        self.parameters = parameters
        self.renew()

    def renew(self) -> None:
        """Let the next frame have the scene made anew, which something has changed."""
        with self._lock:
            self._observer.is_stale = True

    def note_set(self) -> None:
        """Note in the log of events and in the journal what `set` has set."""
        if self._set is None:
            return
        entry, self._set = self._set, None
        before, rows = self.journal.entries[-1:], self.world._data.sources.events.rows
        name, value = entry.setting, entry.value
        shown = value if isinstance(value, (bool, int, float, str)) else checks.shown(value)
        self.journal.check_room()
        self.journal.note(entry)
        if name is None:
            return
        if before and before[0] not in self.journal.entries and rows and rows[-1].what == "set":
            # A slider that is moved.
            rows.pop()
        self.world.log("set", setting=name, value=shown)

    def intervene(self, act: Act) -> None:
        """Let something be done to the world, and note it."""
        self.journal.check_room()
        lines = getattr(interventions, act.kind)(self.world, **act.fields)
        self.journal.note(Entry(self.made, act, tuple(lines)))
        self.renew()

    def state(self) -> dict[str, Any]:
        """Return what the page shows beside the picture."""
        world = self.world
        return {
            "tick": world.tick, "observed": float(world.observed), "mean": float(world.observed_fraction),
            "most": int(world.max_neighbours), "kept": len(self.kept),
            "done": len(self.journal.entries),
        }  # fmt: skip


class Worlds:
    """One world, or two side by side.

    Parameters
    ----------
    model : callable
        A class or function that builds a world.
    settings : list of dict
        The arguments of each world.
    seed : int
        The seed of all.
    every : int
        Ticks from one frame to the next; `describe` after another one.

    Attributes
    ----------
    tracks : list of LiveTrack
        The worlds; none before `replace`, which replaces the list.
    model : callable
        The model.
    made : int
        The number of steps that all have made, or are to make before the next.
    charted : dict of str to bool
        The measures that are charted, in order; False for those that no longer are, which can be charted again.
    """

    def __init__(
        self, model: Callable[..., World], settings: list[dict[str, Any]], seed: int, every: int = 1
    ) -> None:
        self.model, self._first, self.seed, self.every = model, settings, seed, every
        self.made = 0
        self.tracks: list[LiveTrack] = []
        self.charted: dict[str, bool] = {}

    @property
    def settings(self) -> list[dict[str, Any]]:
        """The arguments of each world, as they are now."""
        return [track.parameters for track in self.tracks] or self._first

    def build(self, settings: list[dict[str, Any]], seed: int) -> list[LiveTrack]:
        """Return new worlds for which everything is compiled; those that run stay as they are."""
        tracks: list[LiveTrack] = []
        for one in settings:
            track = LiveTrack(self.model, one, seed, self.every)
            if any(track.world is other.world for other in (*self.tracks, *tracks)):
                raise ValueError(
                    f"{model_name(self.model)}: returns a world that it returned before; build one on each call"
                )
            tracks.append(track)
        for track in tracks:
            track.chart(name for name, on in self.charted.items() if on)
            track.compile()
        return tracks

    def replace(self, tracks: list[LiveTrack], seed: int) -> None:
        """Put new worlds in place of those that there are."""
        before, self.tracks, self.seed, self.made = self.tracks, tracks, seed, 0
        self.describe()
        for track in before:
            track.world.close()

    def run(self, steps: int) -> None:
        """Let all worlds make steps; one that had stayed behind after an error makes more.

        Raises
        ------
        StoppedError
            If one fails, or stops before.
        """
        target = self.made + steps
        for number, track in enumerate(self.tracks):
            cause: BaseException | None = None
            try:
                track.run(max(target - track.made, 0))
            except BaseException as error:  # whatever the code of a user raises
                cause = error
            if cause or track.made < target:
                # Worlds that did not come as far as others follow before the next step.
                self.made = max(one.made for one in self.tracks)
                what, why = ("failed", f": {failure(cause)}") if cause else ("stopped", "")
                which = f"The world on the {('left', 'right')[number]}" if len(self.tracks) > 1 else "The model"
                raise StoppedError(f"{which} {what} at tick {track.world.tick}{why}") from cause
        self.made = target

    def chart(self, name: str, on: bool) -> None:
        """Chart a measure of all worlds, or no longer.

        Raises
        ------
        ValueError
            If no world has it.
        """
        known = dict.fromkeys(one for track in self.tracks for one in track.measures)
        # One of events is not there again before the first of them.
        checks.choice("chart", name, (*known, *self.charted) or ("nothing",))
        try:
            for track in self.tracks if on else ():
                if name in track.measures:
                    float(track.measures[name]())
        except Exception as error:  # whatever the code of a user raises
            raise ValueError(f"{name}: cannot be charted, {failure(error)}") from error
        self.charted[name] = on
        for track in self.tracks if on else ():
            track.chart([name])

    def change(self, tracks: list[LiveTrack], name: str, value: Any) -> None:
        """Change a parameter of some running worlds; if one refuses it, of none."""
        for track in tracks:
            track.journal.check_room()
        before = [track.value(name) for track in tracks]
        for number, track in enumerate(tracks):
            try:
                track.set(name, value)
            except BaseException:
                for earlier, old in zip(tracks[:number], before, strict=False):
                    earlier.set(name, old)
                raise
        for track in tracks:
            track.note_set()
        self.describe()

    def intervene(self, kind: str, track: int, fields: Mapping[str, Any], *, both: bool) -> None:
        """Let something be done to the body, or at the place, that was named in one world, or to both worlds.

        If it fails in one of them, all are put back to what they were. That is not possible for a world with processes
        or planned functions, which no state holds: the error then names the worlds that keep what was done. What a
        class of the user keeps beside the world's state is not put back either.

        Parameters
        ----------
        kind : str
            Its name, a function of `teamsight.live.interventions`.
        track : int
            In which world it was done on a page.
        fields : mapping of str to object
            Its values.
        both : bool
            Whether it is done to the other world too.

        Raises
        ------
        TypeError, ValueError
            If there is no such body, a world refuses it, or it failed and a world cannot be put back.
        """
        if track >= len(self.tracks):
            raise ValueError(f"track={track}: there is one world only; compare first")
        chosen = self.tracks if both else [self.tracks[track]]
        given = dict(fields)
        if "body" in given:
            given["place"] = interventions.place_of(self.tracks[track].world, given.pop("body"))
        if "group" in given:
            given["number"] = given.pop("group")
        for one in chosen:
            one.journal.check_room()
            if "place" in given:
                # What one of them refuses for this reason has not begun in the other.
                interventions.check_there(one.world, given["place"])
        act = Act(kind, given)
        # Those that cannot be put back come last.
        before = sorted(map(_Before, chosen), key=lambda one: one.state is None)
        try:
            for world in before:
                world.track.intervene(act)
        except BaseException as error:
            kept = [self.tracks.index(one.track) for one in before if not one.is_put_back()]
            if not kept:
                raise
            names = " and ".join(("left", "right")[number] for number in sorted(kept))
            which = f"the {names} world" if len(self.tracks) > 1 else "the world"
            raise ValueError(
                f"{kind}: {said(error)}; {which} may keep a part of it, since it has processes or planned functions "
                "and cannot be put back; what is half done is not in Copy as Python; Reset starts again"
            ) from error
        self.describe()

    def repeat(self, track: LiveTrack, act: Act) -> None:
        """Do to one world what a link says."""
        if act.kind == "set":
            self.change([track], **act.fields)
        else:
            track.intervene(act)
            self.describe()

    def describe(self) -> None:
        """Let the titles of two worlds say in what they differ, and all scenes how often they are drawn."""
        names = dict.fromkeys(name for track in self.tracks for name in track.parameters)
        values = [{name: track.value(name) for name in names} for track in self.tracks]
        differing = [name for name in names if len({checks.shown(one[name]) for one in values}) > 1]
        shown = [{name: _in_title(one[name]) for name in differing} for one in values]
        for track, one in zip(self.tracks, shown, strict=True):
            parts = [f"{name} {one[name]}" for name in differing]
            title = ", ".join([model_name(self.model), *parts, f"seed {track.world.seed_used}"])
            track.describe(self.every, title if differing else None)


class _Before:
    """A world before an intervention, and its state, if that can be saved: not with processes or planned functions."""

    def __init__(self, track: LiveTrack) -> None:
        self.track, self._arena, self._entries = track, track.world.arena, list(track.journal.entries)
        # Those that are removed come back themselves as long as somebody holds them.
        self._agents = [list(group) for group in track.world.groups]
        self._seen = self._look()
        self.state: State | None = None
        with suppress(Exception):  # a user's policy or source may not be made for copying
            self.state = track.world.state()

    def _look(self) -> list[Any]:
        """Return what differs once something was done."""
        world = self.track.world
        places = [(one.identity, one.bodies.position, one.active) for one in world.groups]
        return [world.arena, len(world._data.sources.events), *(one.tobytes() for each in places for one in each)]

    def is_put_back(self) -> bool:
        """Put the world back if something was done; return whether it is as it was."""
        world = self.track.world
        try:
            if self._look() != self._seen:
                if self.state is None:
                    return False
                world.arena = self._arena
                world.restore(self.state)
        except BaseException:  # of a user's class
            return False
        self.track.journal.entries[:] = self._entries
        self.track.renew()
        return True


def _in_title(value: Any) -> str:
    """Return a value as a title has it: of what plans events, its kind only."""
    return type(value).__name__ if isinstance(value, EventSource) else checks.shown(value).strip("'")


def event_rows(world: World) -> dict[str, Any]:
    """Return the newest events as the page lists them, the newest first; contacts of one tick are one row.

    Parameters
    ----------
    world : World
        The world.

    Returns
    -------
    dict of str to object
        ``total``, the number of all, and ``rows``: time, what, group, agent or None, and details by name.
    """
    logged = world._data.sources.events.rows
    rows: list[list[Any]] = [
        [row.time, row.what, row.group, row.agent, {name: _plain(one) for name, one in row.details.items()}]
        for row in islice(reversed(logged), MOST_EVENTS)
    ]
    total = len(logged)
    for source in world.sources:
        if isinstance(source, ContactLog):
            rows += islice(_contact_rows(source), MOST_CONTACTS)
            total += len(source.rows)
    rows.sort(key=lambda row: float(row[0]), reverse=True)
    return {"total": total, "rows": rows[:MOST_EVENTS]}


def _contact_rows(log: ContactLog) -> Iterator[list[Any]]:
    """Yield the contacts of each tick that began, and those that ended, as one row each; the newest tick first."""
    ticks, end = log.rows[:, 0], len(log.rows)
    while end:
        # Not searchsorted, which would copy the column.
        first = bisect_left(ticks, ticks[end - 1], hi=end)
        of_tick = log.rows[first:end]
        for begun in (True, False):
            found = of_tick[(of_tick[:, 1] != 0) == begun]
            if len(found) == 1:
                tick, _, one, other = found[0].tolist()
                yield [tick, CONTACT[begun], log.observers, one, {"other": other, "channel": log.channel}]
            elif len(found):
                what = CONTACT[begun].replace("contact", f"{len(found):,} contacts")
                yield [int(ticks[first]), what, log.observers, None, {"channel": log.channel}]
        end = first


def _plain(value: Any) -> Any:
    """Return a detail of an event as JSON has it."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return value.item() if hasattr(value, "item") else str(value)
