"""Recorded robots on a page: what a file of positions holds, its frames, and its δ.

The page sends the file in messages as short as all others, and the server reads it: what reads a file, resamples it and
bounds a risk is `teamsight.analysis.delta`, and a second one in JavaScript could disagree. What the page says is never
the name of a file to open.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import re
import secrets
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.version import __version__
from teamsight.live import protocol
from teamsight.view.packing import pack
from teamsight.view.page import Panel, asset, page
from teamsight.view.replay import RecordedTrack
from teamsight.view.scene import (
    ACTIVE,
    MOST_LINKS,
    MOST_PART,
    PRESENT,
    TURN,
    Clock,
    Frame,
    LinkList,
    Links,
    Scene,
    SceneGroup,
    Slot,
)
from teamsight.world.limits import SHAPES

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.delta import DeltaReport
    from teamsight.analysis.delta.trajectory_notes import Motion
    from teamsight.analysis.runs.simulate import Progress

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

ASSETS = Path(__file__).parent / "assets"
#: The largest file that a page can send [bytes].
MOST_FILE = 32 * 2**20
#: What files that pages are sending, or that are sent and not read yet, have in all [bytes].
MOST_COMING = 64 * 2**20
# Seconds without a part after which a file that a page is sending gives way to others.
_IDLE = 60.0
#: Files that the server keeps for pages; the oldest makes room.
MOST_KEPT = 8
# What a page can play: frames, robots times frames, and links in all.
# Robots, who may all be neighbours of all: links of one frame are in memory at once.
_MOST_ROBOTS = 2_000
_MOST_FRAMES, _MOST_BODIES, _MOST_ALL_LINKS = 3000, 1_500_000, 3_000_000
# Without one that is given, the awareness range is this share of the longer side of the area, rounded.
_GUESSED = 0.2
# Robots whose median intervals differ by more than this factor have other rates.
_OTHER_RATE = 1.5
# A robot that moves, and has one position for a larger share of the time, is named.
_STOOD = 0.1
_COLOUR = "#1f77b4"
# The longest name of a robot [characters].
_LONGEST = 40
_SHARES = ("probability", "low", "high")
_NO_FILE = "No file is open: drop a CSV of positions on the page, or choose one."


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{name}={checks.shown(value)}: must be a text")
    return value


#: The messages of pages, as in `protocol.KINDS`.
KINDS: dict[str, dict[str, Callable[[str, Any], Any]]] = {
    "file": {"name": _text, "size": partial(checks.count, least=0)},
    "open": {"key": _text},
    "choose": {
        "awareness_range": partial(checks.number, above=0.0),
        "range_shape": partial(checks.choice, allowed=SHAPES),
        "risk": partial(checks.number, above=0.0, most=1.0),
        "window": lambda name, value: None if value is None else checks.number(name, value, above=0.0),
        "run": partial(checks.count, least=0),
    },
    "save": {},
}


@dataclass(frozen=True, kw_only=True)
class Choice:
    """What a page asks of a file.

    Attributes
    ----------
    awareness_range : float or None
        Distance within which two robots are neighbours [length]; None for a guess.
    range_shape : {"disc", "square"}
        The shape of ranges.
    risk : float
        Maximum probability that any robot has more than δ neighbours during a trial.
    window : float or None
        Length of a trial [time]; None as `delta_from_trajectories` chooses it.
    run : int
        The number of the run that is played.
    """

    awareness_range: float | None = None
    range_shape: str = "disc"
    risk: float = 0.01
    window: float | None = None
    run: int = 0

    @classmethod
    def of(cls, *, awareness_range: float | None, **others: Any) -> Choice:
        """Return a choice of checked values."""
        check = KINDS["choose"]
        if awareness_range is not None:
            awareness_range = check["awareness_range"]("awareness_range", awareness_range)
        checked = {name: check[name](name, value) for name, value in others.items()}
        return cls(awareness_range=awareness_range, **checked)


class RecordedTeam:
    """The recorded positions of a team, with what a page shows of them.

    Parameters
    ----------
    name : str
        The name of the file.
    trajectories : DataFrame
        From `read_trajectories`.

    Raises
    ------
    ValueError
        If nothing can be played: a single robot, or more than a page can draw.
    """

    def __init__(self, name: str, trajectories: pd.DataFrame) -> None:
        from teamsight.analysis.delta.resample import make_grid, trajectory_starts
        from teamsight.analysis.delta.trajectory_notes import epoch

        self.name, self.table = name, trajectories
        self._since, self._per_second = epoch(trajectories)
        self.grid = make_grid(trajectories)
        if self.grid.robots > _MOST_ROBOTS:
            raise ValueError(
                f"{name}: {self.grid.robots:,} robots, and a page draws at most {_MOST_ROBOTS:,}; give it to "
                "teamsight delta --trajectories"
            )
        self._starts = trajectory_starts(trajectories)
        self._counted: tuple[Choice, DeltaReport] | None = None

    @cached_property
    def runs(self) -> list[str]:
        """The names of the runs; one without a name if there is no column of runs."""
        return [_name(one) for one in self.table["run"].cat.categories] if "run" in self.table else [""]

    @property
    def _run_of_rows(self) -> Ints:
        codes = self.table["run"].cat.codes if "run" in self.table else np.zeros(len(self.table))
        return np.asarray(codes, np.int64)

    @cached_property
    def guess(self) -> float:
        """An awareness range for a start: a fifth of the longer side of the area, rounded to 1, 2 or 5."""
        area = [np.subtract(*np.nanquantile(self.table[one], [0.95, 0.05])) for one in ("x", "y")]
        wanted = _GUESSED * float(max(area)) or 1.0
        power = math.floor(math.log10(wanted))
        # From decimals: 10 * 1e-6 is not 1e-5.
        choices = (float(f"{factor}e{power}") for factor in (1, 2, 5, 10))
        return min(choices, key=lambda one: abs(math.log(one / wanted)))

    @cached_property
    def _motion(self) -> Motion:
        from teamsight.analysis.delta.trajectory_notes import motion_of

        return motion_of(self.table, self.grid)

    def facts(self) -> list[tuple[str, str]]:
        """Return what was understood of the file, as names and texts."""
        return [(name, text) for name, text in self._facts() if text]

    def _facts(self) -> Iterator[tuple[str, str]]:
        grid, table = self.grid, self.table
        names = [_name(one) for one in table["robot"].cat.categories]
        listed = ", ".join(names[:6]) + ", …" * (len(names) > 6)
        several = len(self.runs) > 1
        of_runs = f"; in {len(self.runs):,} runs, at most {grid.robots:,} in one" * several
        yield "Robots", f"{len(names):,}: {listed}{of_runs}"
        away = int(table["x"].isna().sum())
        yield "Positions", f"{len(table) - away:,}" + f"; rows that say that a robot is away: {away:,}" * bool(away)
        yield "Not read", ", ".join(_name(one) for one in table.attrs.get("ignored", ()) if str(one).strip())
        if back := table.attrs.get("sorted"):
            yield "Sorted by time", (
                f"times went back {back:,} time{'s' * (back > 1)}: check for a clock that was set, two robots of one "
                "name or a new recording, which a column run marks"
            )
        yield "Rate", self._rate()
        spans = (grid.length - 1) * grid.step
        pieces = f" in {len(spans):,} {'runs or ' * several}pieces" * (len(spans) > 1)
        since, per_second = self._since, self._per_second
        begin, end = (f"{time:.12g}" for time in (table["time"].min(), table["time"].max()))
        when = f" ({_short(spans.sum() / per_second)} s)" if since else f", time {begin} to {end}"
        yield "Duration", f"{_short(spans.sum())}{when}{pieces}"
        yield "Gaps", self._gaps()
        yield "Clocks", self._clocks()
        yield "Standing", self._standing()
        motion = self._motion
        speeds = (motion.length / motion.wait)[motion.length > 0]
        speed = float(np.median(speeds)) if len(speeds) else 0.0
        width, height = map(_short, motion.span)
        yield "Area", f"{width} × {height}"
        yield "Speed", f"{_short(speed)} (median of those that move)" if speed else "nobody moves"
        shown = f"{width} m × {height} m, {_short(speed * per_second)} m/s"
        both = "positions are in metres" if since else "positions are in metres and times in seconds"
        yield "Units", f"{since or 'the file names none'}; if {both}: {shown}"

    def _rate(self) -> str:
        step, own = self.grid.interval, self._own_intervals()
        usual = {name: float(np.median(wait)) for name, wait in own if len(wait)}
        low, high = min(usual, key=usual.__getitem__), max(usual, key=usual.__getitem__)
        known, per_second = self._since, self._per_second
        text = (
            f"a position every {_short(step)} ({_short(per_second / step)} a second"
            f"{'' if known else ', if times are seconds'})"
        )
        if usual[high] > _OTHER_RATE * usual[low]:
            text += f"; from every {_short(usual[low])} (robot {low}) to every {_short(usual[high])} (robot {high})"
        return text

    def _own_intervals(self) -> Iterator[tuple[str, Floats]]:
        time, robot = self.table["time"].to_numpy(), self.table["robot"]
        for first, end in zip(self._starts[:-1], self._starts[1:], strict=True):
            yield _name(robot.iat[first]), np.diff(time[first:end])

    def _gaps(self) -> str:
        grid = self.grid
        gap, whole = grid.max_gap * (1 + 1e-9), len(grid.gaps)
        text = f"{whole:,} in which no robot has a position (up to {_short(grid.gaps.max())})" if whole else ""
        longest, who, single = 0.0, "", 0
        all_runs, all_times = self._run_of_rows, self.table["time"].to_numpy()
        for first, end in zip(self._starts[:-1], self._starts[1:], strict=True):
            time, run = all_times[first:end], all_runs[first]
            piece = np.searchsorted(grid.start[grid.run == run], time, side="right")
            wait = np.diff(time)[np.diff(piece) == 0]
            single += int((wait > gap).sum())
            if wait.max(initial=0.0) > max(longest, gap):
                longest, who = float(wait.max()), _name(self.table["robot"].iat[first])
        if single:
            text += f"{'; ' * bool(text)}{single:,} of single robots (longest {_short(longest)}, robot {who})"
        return text or f"none longer than {_short(grid.max_gap)}"

    def _standing(self) -> str:
        """Say who keeps exactly one position for longest, as of a robot that is lost; nothing if that is short."""
        time, x, y = (self.table[one].to_numpy() for one in ("time", "x", "y"))
        longest, who, least = 0.0, "", _STOOD * float(((self.grid.length - 1) * self.grid.step).sum())
        for first, end in zip(self._starts[:-1], self._starts[1:], strict=True):
            # Each place begins at a row, and the last of them ends with the last row.
            new = np.flatnonzero((np.diff(x[first:end]) != 0) | (np.diff(y[first:end]) != 0)) + first + 1
            begun = np.concatenate([[first], new])
            held = time[np.concatenate([new, [end]]) - 1] - time[begun]
            if len(new) and held.max() > max(longest, least):
                longest, who = float(held.max()), _name(self.table["robot"].iat[first])
        return f"robot {who} keeps exactly one position for {_short(longest)}: is it lost by the tracking?" * bool(who)

    def _clocks(self) -> str:
        """Say how far apart robots start in the run where that is most."""
        first = self._starts[:-1]
        time, robot = self.table["time"].to_numpy()[first], self.table["robot"].to_numpy()[first]
        run = self._run_of_rows[first]
        worst = max(np.unique(run), key=lambda one: np.ptp(time[run == one]))
        begun, who = time[run == worst], robot[run == worst]
        if not np.ptp(begun):
            return "robots start together"
        if np.ptp(begun) <= self.grid.interval * (1 + 1e-9):
            return f"robots start within {_short(np.ptp(begun))} of each other"
        late = begun - np.median(begun)
        k = int(np.abs(late).argmax())
        when = "after" if late[k] > 0 else "before"
        return f"robot {_name(who[k])} starts {_short(abs(late[k]))} {when} the others (their median)"

    def report(self, choice: Choice, progress: Progress = lambda done, total: None) -> DeltaReport:
        """Return the report on δ; another risk needs no other count.

        Parameters
        ----------
        choice : Choice
            What is asked for.
        progress : callable
            Called with the frames done and the frames in all.

        Raises
        ------
        ValueError
            If the range is so small that robots cannot be followed from one position to the next.
        """
        from teamsight.analysis.delta import TrajectoryWarning, delta_from_trajectories

        reach = choice.awareness_range or self.guess
        needed = replace(choice, risk=0.5, run=0, awareness_range=reach)
        if self._counted is None or self._counted[0] != needed:
            with warnings.catch_warnings():
                # The report begins with it.
                warnings.simplefilter("ignore", TrajectoryWarning)
                found = delta_from_trajectories(
                    self.table, reach, range_shape=choice.range_shape, window=choice.window, progress=progress
                )
            self._counted = needed, found
        return replace(self._counted[1], risk=choice.risk)

    def answer(self, choice: Choice, progress: Progress = lambda done, total: None) -> dict[str, Any]:
        """Return δ as a page shows it: the answer, its cautions, the curve and further notes."""
        from teamsight.analysis.delta.trajectory_notes import speed_doubt

        report = self.report(choice, progress)
        answer, *more = report.sentences()[len(report.cautions) :]
        assert report.over_time is not None
        largest, curve = report.over_time["max_degree"].to_numpy(), report.exceedance
        last = max(report.largest, report.delta_safe if report.supported else 0) + 1
        rows = curve[curve["delta"] <= min(last, report.robots - 1)]
        cautions = list(report.cautions)
        if choice.awareness_range is None:
            cautions.insert(0, (
                f"The awareness range of {self.guess:g} is a guess, a fifth of the area: set the distance within which "
                "your robots are to know of each other."
            ))  # fmt: skip
        cautions += [text for text in (speed_doubt(self.table, self._motion),) if text]
        cautions += report.advice
        named = re.match(r"δ = (\d+)", answer)
        return {
            "answer": answer,
            "cautions": cautions,
            "notes": [*(one for one in more if one not in cautions), report.subject],
            "delta": int(named[1]) if named else None, "seen": "" if named else self._seen(report),
            "largest": report.largest, "robots": report.robots, "trials": report.trials, "trial": report.trial,
            "length": report.length, "confidence": report.confidence, "independent": report.independent,
            "curve": [
                {**dict(zip(_SHARES, shares, strict=True)), "delta": delta, "time": float(np.mean(largest > delta))}
                for delta, *shares in rows[["delta", *_SHARES]].to_numpy().tolist()
            ],
        }  # fmt: skip

    def _seen(self, report: DeltaReport) -> str:
        """Say that what was seen is no estimate of δ, and how long a record would be that supports one."""
        if report.time_needed is None or report.recorded is None:
            return "What was seen is no estimate of δ."
        known, per_second = self._since, self._per_second
        needed, now = (_short(time / per_second) for time in (report.time_needed, report.recorded))
        unit = " s" * bool(known)
        return (
            f"What was seen is no estimate of δ: a risk of {100 * report.risk:g} % needs a record of about "
            f"{needed}{unit}, and this one has {now}{unit}."
        )

    def play(self, choice: Choice, progress: Progress = lambda done, total: None) -> RecordedTrack:
        """Return the frames of a run; a tick is a frame of the record, and gaps are left out."""
        from teamsight.analysis.delta.resample import blocks, make_grid, trajectory_starts

        table, run = self.table, min(choice.run, len(self.runs) - 1)
        if "run" in table:
            table = table[table["run"].cat.codes == run]
        try:
            grid = make_grid(table, self.grid.step, self.grid.max_gap)
        except ValueError as error:
            raise ValueError(f"run {self.runs[run]}: cannot be played ({error}); choose another run") from error
        rows = trajectory_starts(table)[:-1]
        names = [_name(one) for one in table["robot"].to_numpy()[rows]]
        # Every frame, or every second and so on, so that a browser can hold them.
        most = max(min(_MOST_FRAMES, _MOST_BODIES // len(names)), 1)
        every = -(-grid.frames // most)
        place = np.concatenate([
            block.position[(np.arange(len(block.time)) + block.first) % every == 0] for block in blocks(table, grid)
        ])  # fmt: skip
        # Times since 1970 are too long to read, and where they begin is among the facts.
        origin = grid.start[0] if self._since else 0.0
        clock = Clock(grid.step, grid.split(False).tolist(), (grid.start - origin).tolist())
        scene = replace(self._scene(choice, names, place), every=every, clock=clock)
        frames = []
        for one in _frames(scene, place, choice.range_shape):
            frames.append(one)
            progress(len(frames), len(place))
        return RecordedTrack(scene, frames)

    def _scene(self, choice: Choice, names: list[str], place: Floats) -> Scene:
        reach = choice.awareness_range or self.guess
        low, high = np.nanmin(place, axis=(0, 1)), np.nanmax(place, axis=(0, 1))
        room = 0.05 * float((high - low).max()) or 1.0
        bounds = (*(low - room).tolist(), *(high + room).tolist())
        named = f", run {self.runs[min(choice.run, len(self.runs) - 1)]}" * (len(self.runs) > 1)
        return Scene(
            f"{self.name}{named}", "recorded robots", __version__, 0, 1, bounds,
            groups=(
                # Nobody knows what the robots knew of each other: no degree of awareness.
                SceneGroup(
                    "robots", "robot", _COLOUR, "recorded", awareness={"name": ""}, range_shape=choice.range_shape,
                    fields={"awareness range": reach},
                ),
            ),
            slots=tuple(Slot(0, k, 0.0, reach, name=name) for k, name in enumerate(names)),
            series=("mean_neighbours", "max_neighbours"), links=(LinkList("teammates", "teammates"),),
        )  # fmt: skip

    def saved(self, choice: Choice, progress: Progress = lambda done, total: None) -> tuple[str, str]:
        """Return the name of a file, and a page that plays the run anywhere, with the answer and the facts."""
        track = self.play(choice, progress)
        stem = "".join(c if c.isalnum() else "-" for c in self.name.rsplit(".", 1)[0])[:80]
        style, script = (asset(f"recorded.{kind}", ASSETS) for kind in ("css", "js"))
        data = protocol.text("panel", **self.shown(choice, progress), facts=self.facts())
        return f"teamsight-{stem}.html", page([track], title=track.scene.title, panel=Panel(style, script, data))

    def shown(self, choice: Choice, progress: Progress = lambda done, total: None) -> dict[str, Any]:
        """Return the answer, and for what it holds."""
        chosen = {**asdict(choice), "awareness_range": choice.awareness_range or self.guess}
        return {"choice": chosen, **self.answer(choice, progress)}


def _frames(scene: Scene, place: Floats, range_shape: str) -> Iterator[Frame]:
    """Yield the frames of positions, shape (frames, robots, 2), NaN where a robot is absent."""
    from teamsight.world.search import proximity_graph

    low, high = np.array(scene.bounds[:2]), np.array(scene.bounds[2:])
    reach, heading, left = scene.slots[0].awareness_range, np.zeros(place.shape[1]), _MOST_ALL_LINKS
    for k, now in enumerate(place):
        # To the next frame; of the last one, from the one before.
        after = min(k + 1, len(place) - 1)
        way = place[after] - place[max(after - 1, 0)]
        is_moving = np.hypot(*way.T) > 0
        heading[is_moving] = np.arctan2(way[is_moving, 1], way[is_moving, 0])
        slot = np.flatnonzero(~np.isnan(now[:, 0]))
        graph = proximity_graph(now[slot], None, reach, None, range_shape=range_shape)
        degree, links = graph.degree, len(graph.identity)
        is_held = links <= min(MOST_LINKS, left)
        left -= links * is_held
        source, target = (
            slot[part].astype(np.uint16) if is_held else np.zeros(0, np.uint16)
            for part in (np.repeat(np.arange(len(slot)), degree), graph.identity)
        )
        x, y = (np.nan_to_num((now - low) / (high - low)) * MOST_PART).round().astype(np.uint16).T
        turn = np.round(heading / (2 * np.pi) * TURN).astype(np.int64) % TURN
        flags = np.where(np.isnan(now[:, 0]), 0, PRESENT | ACTIVE).astype(np.uint16)
        series = np.array([degree.mean() if len(degree) else np.nan, degree.max(initial=0)], np.float32)
        yield Frame(
            float(k * scene.every), series, x, y, turn.astype(np.uint16), flags,
            (Links(source, target, omitted=0 if is_held else links),),
        )  # fmt: skip


def _name(one: Any) -> str:
    """Return the name of a robot or a run as people see it; a file that is not in UTF-8 has bytes."""
    text = one.decode(errors="replace") if isinstance(one, bytes) else str(one)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"


def _short(number: Any) -> str:
    return f"{float(number):,.0f}" if 1000 <= abs(number) < 1e9 else f"{float(number):.3g}"


def read_recorded(
    path: str | os.PathLike[str],
    *,
    content: bytes | None = None,
    sort: bool = False,
    progress: Progress = lambda done, total: None,
) -> RecordedTeam:
    """Return the team of a file; see `read_trajectories`.

    Raises
    ------
    ValueError
        If it is no such file.
    """
    from teamsight.analysis.delta import read_trajectories

    return RecordedTeam(os.path.basename(path), read_trajectories(path, content=content, sort=sort, progress=progress))


@dataclass
class Coming:
    """A file that a page is sending, or has sent.

    Attributes
    ----------
    name : str
        Its name, for people.
    size : int
        What it should have [bytes].
    content : bytearray
        What has come of it.
    heard : float
        When its last part came [s].
    """

    name: str
    size: int
    content: bytearray
    heard: float


class LeftError(Exception):
    """Nobody waits for this work any more."""


class Work:
    """What a page has asked for, which takes a thread up to minutes.

    Parameters
    ----------
    act : callable
        Called with `go_on`, it returns the answers.
    """

    def __init__(self, act: Callable[[Progress], list[str]]) -> None:
        self._act, self._is_wanted = act, True

    def cancel(self) -> None:
        """Let it end soon, without an answer."""
        self._is_wanted = False

    def go_on(self, done: float = 0, total: float = 0) -> None:
        """Raise an error if nobody waits for it; called again and again."""
        if not self._is_wanted:
            raise LeftError

    def answers(self) -> list[str]:
        """Do it, and return the answers; what cannot be done changes nothing."""
        try:
            self.go_on()
            return self._act(self.go_on)
        except LeftError:
            return []
        except Exception as error:  # of whatever a file holds
            return [protocol.refusal(error)]


async def _apart(work: Work) -> list[str]:
    """Return the answers of work that another thread does, which ends with the program."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[list[str]] = loop.create_future()

    def deliver(found: list[str]) -> None:
        # Nobody may wait any longer.
        if not done.done():
            done.set_result(found)

    def finish() -> None:
        found = work.answers()
        # The loop may be closed.
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(deliver, found)

    threading.Thread(target=finish, name="teamsight δ", daemon=True).start()
    return await done


class Desk:
    """Keeps the files of pages, and answers what these ask.

    Parameters
    ----------
    first : RecordedTeam, optional
        The file that a page shows at first.
    choice : Choice, optional
        With these settings.
    """

    def __init__(self, first: RecordedTeam | None = None, choice: Choice | None = None) -> None:
        self.choice = choice or Choice()
        self._kept: dict[str, RecordedTeam] = {} if first is None else {"": first}
        self._visits: dict[Visit, asyncio.Task[None] | None] = {}
        # One at a time: a count of neighbours takes all of a core.
        self._turn, self._is_closing = asyncio.Lock(), False

    @property
    def has_first(self) -> bool:
        """Whether there is a file that pages show at first."""
        return "" in self._kept

    async def serve(self, connection: Any) -> None:
        """Answer the messages of a page until it closes its socket."""
        visit = Visit(self)
        self._visits[visit] = asyncio.current_task()
        # Beside it the page is read: else nobody would notice that it is closed.
        worker = asyncio.create_task(self._work(connection, visit))
        try:
            async for data in connection:
                for message in visit.hear(data):
                    await connection.send(message)
        finally:
            visit.leave()
            if visit.work is None or self._is_closing:
                worker.cancel()
            try:
                # It has its turn until the thread has ended, so that one thread counts.
                await asyncio.wait([worker])
            finally:
                worker.cancel()
                del self._visits[visit]

    async def _work(self, connection: Any, visit: Visit) -> None:
        try:
            while not visit.is_over:
                await visit.asked.wait()
                async with self._turn:
                    if (work := visit.begin()) is None:
                        continue
                    answers = await _apart(work)
                    visit.work = None
                for message in answers:
                    await connection.send(message)
        except Exception:
            # The connection has ended; if not, a page without answers would wait for ever.
            await connection.close(1011)

    @property
    def pages(self) -> int:
        """The number of pages that are open, or whose count goes on."""
        return len(self._visits)

    def close(self) -> None:
        """Wait for no count of neighbours any longer; in the loop of the server."""
        self._is_closing = True
        for visit, task in self._visits.items():
            visit.leave()
            if task is not None:
                task.cancel()

    def check_room(self, visit: Visit, name: str, size: int) -> None:
        """Refuse a file for which there is no room beside those of other pages; one that has stopped coming gives way.

        Raises
        ------
        ValueError
            If there is none.
        """
        now, taken = time.monotonic(), 0
        for other in self._visits:
            if other is visit or other.coming is None:
                continue
            if not other.is_whole and now - other.coming.heard > _IDLE:
                other.coming = None
            else:
                taken += other.coming.size
        if taken + size > MOST_COMING:
            raise ValueError(
                f"{name}: has {size / 2**20:,.1f} MiB, and other pages are sending {taken / 2**20:,.1f}, at most "
                f"{MOST_COMING // 2**20} in all; send it again when theirs are read"
            )

    def keep(self, team: RecordedTeam) -> str:
        """Keep a file for pages that open it later, and return its key."""
        sent = [key for key in self._kept if key]
        for key in sent[: max(len(sent) - MOST_KEPT + 1, 0)]:
            del self._kept[key]
        key = secrets.token_urlsafe(9)
        self._kept[key] = team
        return key

    def find(self, key: str) -> RecordedTeam:
        """Return the file of a key; an empty one is the first file.

        Raises
        ------
        ValueError
            If it is not kept any more.
        """
        if key not in self._kept:
            raise ValueError(
                f"The server keeps the newest {MOST_KEPT} files, and this one no longer; drop it on the page again."
            )
        return self._kept[key]


class Visit:
    """A page: the file that it shows, the one that it is sending, what it has chosen, and what it waits for.

    Attributes
    ----------
    asked : asyncio.Event
        Set when something waits.
    coming : Coming or None
        The file that it is sending, or that has come and is not read yet.
    work : Work or None
        What is being done for it.
    is_over : bool
        Whether it is closed.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk, self._choice = desk, desk.choice
        self._team: RecordedTeam | None = None
        self.asked, self.is_over = asyncio.Event(), False
        self.coming: Coming | None = None
        self.work: Work | None = None
        # By kind, in order: of each the newest.
        self._waiting: dict[str, Work] = {}
        self._is_lost = False

    @property
    def is_whole(self) -> bool:
        """Whether all of the file has come."""
        return self.coming is not None and len(self.coming.content) >= self.coming.size

    def hear(self, data: str | bytes) -> list[str]:
        """Take a message or a part of a file, and return what can be said at once; the rest waits for its turn."""
        try:
            if isinstance(data, bytes):
                self._on_part(data)
                return []
            kind, fields = protocol.parsed(data, KINDS)
            if kind == "file":
                return self._on_file(**fields)
            self._ask(kind, partial(getattr(self, f"_on_{kind}"), **fields))
        except (TypeError, ValueError) as error:
            return [protocol.refusal(error)]
        return []

    def _ask(self, kind: str, act: Callable[[Progress], list[str]]) -> None:
        if kind in ("open", "read"):
            # Another file: nobody looks at what is counted of the one before.
            self._waiting.pop("choose", None)
            if self.work is not None:
                self.work.cancel()
        self._waiting.pop(kind, None)
        self._waiting[kind] = Work(act)
        self.asked.set()

    def begin(self) -> Work | None:
        """Return what is to be done now, if anything is."""
        self.work = self._waiting.pop(next(iter(self._waiting))) if self._waiting else None
        if not self._waiting:
            self.asked.clear()
        return self.work

    def leave(self) -> None:
        """Let what is being done for the page end soon. Idempotent."""
        self.is_over, self.coming = True, None
        self._waiting.clear()
        if self.work is not None:
            self.work.cancel()

    def _on_part(self, data: bytes) -> None:
        coming = self.coming
        if coming is None or self.is_whole:
            # Once: a file has thousands of parts.
            if not self._is_lost:
                self._is_lost, self.coming = True, None
                self._waiting.pop("read", None)
                raise ValueError(
                    f"a part of a file came before its name and size, after its end, or so late ({_IDLE:g} s) that "
                    "others have its room; send the file again"
                )
            return
        coming.content.extend(data)
        coming.heard = time.monotonic()
        if self.is_whole:
            self._ask("read", partial(self._on_read, coming))

    def _on_file(self, name: str, size: int) -> list[str]:
        self.coming, self._is_lost = None, False
        self._waiting.pop("read", None)
        # Only for people, and for its ending; nothing of this name is opened.
        name = "".join(c for c in name.replace("\\", "/").rsplit("/", 1)[-1] if c.isprintable())[-120:] or "file"
        if not name.lower().endswith(".csv"):
            raise ValueError(
                f"{name}: is not a CSV file; drop a .csv with the columns time, robot, x, y; if it is one, "
                "rename it to .csv"
            )
        if size > MOST_FILE:
            raise ValueError(
                f"{name}: has {size / 2**20:,.0f} MiB, and a page can send {MOST_FILE // 2**20}; open it by teamsight "
                "watch --trajectories, or keep every tenth row of each robot"
            )
        self._desk.check_room(self, name, size)
        self.coming = Coming(name, size, bytearray(), time.monotonic())
        if not size:
            self._ask("read", partial(self._on_read, self.coming))
            return []
        return [protocol.text("send")]

    def _on_read(self, coming: Coming, go_on: Progress) -> list[str]:
        try:
            if len(coming.content) != coming.size:
                raise ValueError(f"{coming.name}: is longer than it was said to be; send it again")
            team = read_recorded(coming.name, content=bytes(coming.content), sort=True, progress=go_on)
        finally:
            # Another one may be coming already.
            if self.coming is coming:
                self.coming = None
        choice = replace(self._desk.choice, awareness_range=None, window=None, run=0)
        shown = self._shown(team, choice, go_on)
        return [protocol.text("kept", key=self._desk.keep(team)), *shown]

    def _on_open(self, go_on: Progress, key: str) -> list[str]:
        if not key and not self._desk.has_first:
            return [protocol.text("empty")]
        choice = self._desk.choice if not key else Choice(risk=self._desk.choice.risk)
        return self._shown(self._desk.find(key), choice, go_on)

    def _shown(self, team: RecordedTeam, choice: Choice, go_on: Progress) -> list[str]:
        """Return all that a page shows of a file; it is the file of this page from now on, unless that fails."""
        answers = [protocol.text("record", name=team.name, facts=team.facts(), runs=team.runs)]
        answers += [self._answer(team, choice, go_on), self._track(team, choice, go_on)]
        go_on(1, 1)
        self._team, self._choice = team, choice
        return answers

    def _on_choose(self, go_on: Progress, **chosen: Any) -> list[str]:
        if self._team is None:
            raise ValueError(_NO_FILE)
        choice, before = Choice(**chosen), self._choice
        if before.awareness_range is None and choice.awareness_range == self._team.guess:
            # The page shows the guess, and nobody has chosen it.
            choice = replace(choice, awareness_range=None)
        answers = [self._answer(self._team, choice, go_on)]
        if replace(choice, risk=before.risk, window=before.window) != before:
            answers.append(self._track(self._team, choice, go_on))
        self._choice = choice
        return answers

    def _answer(self, team: RecordedTeam, choice: Choice, go_on: Progress) -> str:
        return protocol.text("answer", **team.shown(choice, go_on))

    def _track(self, team: RecordedTeam, choice: Choice, go_on: Progress) -> str:
        from base64 import b64encode

        track = team.play(choice, go_on)
        frames = b64encode(pack(track.frames, track.scene)).decode()
        return protocol.text("track", scene=track.scene.as_json(), frames=frames)

    def _on_save(self, go_on: Progress) -> list[str]:
        if self._team is None:
            raise ValueError(_NO_FILE)
        name, html = self._team.saved(self._choice, go_on)
        return [protocol.text("recording", name=name, html=html)]
