"""What a record says about itself: cautions, with which no number is to be trusted, and notes that limit the result."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.delta.degrees import SQUARE_RANGES
from teamsight.analysis.delta.resample import Floats, Grid, trajectory_starts
from teamsight.analysis.delta.trajectory_trials import Trials, recordings

if TYPE_CHECKING:
    from teamsight.analysis.delta.resample import Neighbours
    from teamsight.world.arena import Arena

Ints = NDArray[np.int64]

# Robots that move more ranges than this between samples cannot be followed from one to the next; more than the second
# are suspicious; the third loses little of what happens between samples.
_MOST_MOVE, _USUAL_MOVE, _FINE = 10.0, 1.0, 0.5
# Smallest share of the robots that is present at a time in a record without faults; and that of which nothing is said.
_USUALLY_PRESENT, _NEARLY_ALL = 0.95, 0.995
# Largest difference between the first samples of robots that start together [intervals].
_APART = 2.0
# Share of the intervals that are at most as long as the one that counts: samples at random times start apart.
_USUAL = 0.99
# Longest step [medians], unless it hardly changes who is a neighbour, however still the robots are [awareness ranges].
_LONG, _FAR = 10.0, 0.5
# Median speeds of robots that move [m/s]: small robots, of 3 cm, make 1 cm a second, and hardly a drone makes 50 m.
_SLOWEST, _FASTEST = 3e-3, 50.0
# Whole times at least so far apart, of robots that would then make at most so many m/s, may be milliseconds.
_FEW, _USUALLY_FASTEST = 10.0, 20.0
# Positions may be pixels if they span this much: whole ones, and others if none is negative and a video would have
# recorded so often [seconds], and is not larger.
_WHOLE_SPAN, _VIDEO_SPAN, _VIDEO, _MOST_PIXELS = 100.0, 200.0, 0.2, 8192.0
# Degrees of latitude and longitude: a team is within 10 km, and farther from the origin than that by this factor.
_MOST_DEGREES, _DEGREES_AWAY = 0.1, 100.0
# Times since 1970, by the number of units in a second; of this century until 2100.
_EPOCHS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
_FROM, _UNTIL = 946_684_800.0, 4_102_444_800.0


class TrajectoryWarning(UserWarning):
    """Recorded positions that have faults, are not of one team, or have another unit than the awareness range."""


class Motion(NamedTuple):
    """How robots move from sample to sample, without moves over gaps.

    Attributes
    ----------
    row : ndarray of int64
        Row of the later sample of each move.
    wait, length : ndarray of float64
        Time between the samples [time], and their distance [length]; NaN if the robot is away at one of them.
    typical : float
        Median distance that a robot moves between two samples, or between two frames if these are farther apart
        [length]; moves of length 0 do not count.
    span : (float, float)
        Ranges of all x and of all y [length].
    """

    row: Ints
    wait: Floats
    length: Floats
    typical: float
    span: tuple[float, ...]


def motion_of(trajectories: pd.DataFrame, grid: Grid, arena: Arena | None = None) -> Motion:
    """Return how robots move; in a periodic arena the shortest ways."""
    time, x, y = (trajectories[name].to_numpy() for name in ("time", "x", "y"))
    own = np.ones(len(time) - 1, bool)
    own[trajectory_starts(trajectories)[1:-1] - 1] = False
    wait = np.diff(time)
    own &= (wait > 0) & (wait <= grid.max_gap * (1 + 1e-9))
    way = np.column_stack([np.diff(x), np.diff(y)])[own]
    if arena is not None and max(arena.period) > 0:
        way = arena.displacement(np.zeros(2), way)
    wait, length = wait[own], np.hypot(*way.T)
    move = length * np.maximum(1.0, grid.step / wait)
    move = move[move > 0]
    # NaN stands for robots that are not there.
    span = tuple(float(np.nanmax(values) - np.nanmin(values)) for values in (x, y))
    return Motion(np.flatnonzero(own) + 1, wait, length, float(np.median(move)) if len(move) else 0.0, span)


def epoch(trajectories: pd.DataFrame) -> tuple[str, float]:
    """Say the unit of times that look like times since 1970, and return how many are a second; 1 if unknown."""
    begin, end = float(trajectories["time"].min()), float(trajectories["time"].max())
    for unit, per_second in _EPOCHS.items():
        if _FROM * per_second <= begin and end <= _UNTIL * per_second:
            date = datetime.fromtimestamp(begin / per_second, UTC)
            return f"times look like {unit} since 1970 and begin on {date:%Y-%m-%d %H:%M} UTC", per_second
    return "", 1.0


def speed_doubt(trajectories: pd.DataFrame, motion: Motion) -> str:
    """Say if robots would be faster or slower than any are, were the units metres and seconds; nothing if not.

    No caution of a report: δ is the same in any units, if the awareness range and the window have the same.
    """
    speeds = (motion.length / motion.wait)[motion.length > 0]
    speed = float(np.median(speeds)) * epoch(trajectories)[1] if len(speeds) else 0.0
    if not speed or _looks_like_degrees(trajectories, motion):
        return ""
    if _SLOWEST <= speed <= _FASTEST:
        return _unit_doubt(trajectories, motion, speed)
    which, limit = ("fast", f"above {_FASTEST:g}") if speed > _FASTEST else ("slow", f"below {_SLOWEST:g}")
    return (
        f"Check the units: in metres and seconds robots would move {_rounded(speed)} m/s (median of those that move), "
        f"{limit}, too {which} for robots. Are times in days or milliseconds, or positions in millimetres or pixels? "
        "The awareness range and the window must have the units of the file."
    )


def _unit_doubt(trajectories: pd.DataFrame, motion: Motion, speed: float) -> str:
    """Say if times look like milliseconds, or positions like pixels, though robots would be neither slow nor fast."""
    unit, per_second = epoch(trajectories)
    wait, narrow = float(np.median(motion.wait)), min(motion.span)
    time, place = trajectories["time"], trajectories[["x", "y"]]
    is_whole = bool((place.dropna() % 1 == 0).all(axis=None))
    least, most = float(place.min().min()), float(place.max().max())
    is_video = wait / per_second <= _VIDEO and least >= 0 and most <= _MOST_PIXELS and narrow >= _VIDEO_SPAN
    if not unit and (time % 1 == 0).all() and wait >= _FEW and 1000 * speed <= _USUALLY_FASTEST:
        seen = f"times are whole numbers {wait:g} apart, taken as seconds"
        other = f"milliseconds, in which robots would move {_rounded(1000 * speed)} m/s in place of {_rounded(speed)}"
    elif is_video or (is_whole and narrow >= _WHOLE_SPAN):
        seen = f"positions are {'whole ' * is_whole}numbers over {_size(motion.span)}, taken as metres"
        other = "pixels or millimetres"
    else:
        return ""
    return (
        f"Check the units: {seen}. If they are {other}, δ is right only if the awareness range and the "
        "window are in the units of the file too: give them so, or convert the column."
    )


def _looks_like_degrees(trajectories: pd.DataFrame, motion: Motion) -> bool:
    far = [float(trajectories[name].abs().max()) for name in ("x", "y")]
    within = max(far) <= 180 and min(far) <= 90 and 0 < max(motion.span) < _MOST_DEGREES
    return within and max(far) > _DEGREES_AWAY * max(motion.span)


def check_motion(motion: Motion, grid: Grid, awareness_range: float, frames: int | None) -> None:
    """Raise an error if robots move so many ranges between samples that trials say nothing about what happens in them.

    Parameters
    ----------
    motion : Motion
        How robots move.
    grid : Grid
        Times of the frames.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    frames : int or None
        Length of a trial; None for whole recordings. In a single frame nothing happens between samples.

    Raises
    ------
    ValueError
        If they do.
    """
    ranges = motion.typical / awareness_range
    if frames != 1 and ranges > _MOST_MOVE:
        raise ValueError(
            f"awareness_range={awareness_range:g}: robots move {_rounded(ranges)} ranges between samples (median "
            f"{_rounded(motion.typical)}), at most {_MOST_MOVE:g}, so their neighbours in between are unknown; give "
            f"the range in the unit of the positions, which span {_size(motion.span)}, or record at least every "
            f"{grid.step * _FINE / ranges:.2g}"
        )


class Record(NamedTuple):
    """A record with what was found in it.

    Attributes
    ----------
    trajectories : DataFrame
        From `check_trajectories`.
    found : Neighbours
        The frames.
    tried : Trials
        The trials.
    motion : Motion
        How robots move.
    awareness_range : float
        Distance within which two robots are neighbours [length].
    """

    trajectories: pd.DataFrame
    found: Neighbours
    tried: Trials
    motion: Motion
    awareness_range: float

    @property
    def recording(self) -> Ints:
        """The number of the recording of each row: of its run, or of its piece if pieces are the trials."""
        if self.tried.kind == "piece":
            return np.searchsorted(self.found.grid.start, self.trajectories["time"], side="right") - 1
        if "run" in self.trajectories:
            return np.asarray(self.trajectories["run"].cat.codes, np.int64)
        return np.zeros(len(self.trajectories), np.int64)

    @property
    def first(self) -> Ints:
        """The first row of each robot in each recording."""
        robot = np.asarray(self.trajectories["robot"].cat.codes)
        return np.flatnonzero((np.diff(robot, prepend=-1) != 0) | (np.diff(self.recording, prepend=-1) != 0))

    @property
    def team_sizes(self) -> Ints:
        """The number of robots that have a position in each recording."""
        recording, first = self.recording, self.first
        seen = np.logical_or.reduceat(self.trajectories["x"].notna().to_numpy(), first)
        return np.bincount(recording[first[seen]], minlength=int(recording.max()) + 1)

    @property
    def present(self) -> float:
        """The mean share of the robots of a recording that is present in a frame of a trial.

        The first and the last interval of a piece do not count, in which some robots have not sent their first sample.
        """
        grid, tried = self.found.grid, self.tried
        edge = int(np.ceil(grid.interval / grid.step))
        within = np.arange(grid.frames) - np.repeat(grid.split(False), grid.length)
        inner = tried.kept & (within >= edge) & (within < np.repeat(grid.length, grid.length) - edge)
        piece = np.repeat(np.arange(len(grid.length)), grid.length)
        size = self.team_sizes[piece if tried.kind == "piece" else grid.run[piece]]
        share = self.found.over_time["robots"].to_numpy() / size
        return float(share[inner if inner.any() else tried.kept].mean())

    def name(self, row: Any) -> str:
        """Return the robot of a row, and its run if there are several."""
        of_run = f" of run {self.trajectories['run'].iat[row]}" if "run" in self.trajectories else ""
        return f"robot {self.trajectories['robot'].iat[row]}{of_run}"


def cautions(record: Record) -> tuple[str, ...]:
    """Return why a record may be of another unit, not of one team, or faulty; one sentence or two each."""
    return tuple(text for text in (*_of_unit(record), *_of_faults(record)) if text)


def _of_unit(record: Record) -> list[str]:
    found, reach, motion = record.found, record.awareness_range, record.motion
    span, robots, said = f"the positions span {_size(motion.span)}", found.over_time["robots"], []
    if (ranges := motion.typical / reach) > _USUAL_MOVE:
        said.append(
            f"robots move {_rounded(ranges)} awareness ranges between samples (median {_rounded(motion.typical)}; "
            f"{span}). If the unit is right, record more often: neighbours between samples are not found."
        )
    if not found.over_time["max_degree"].any():
        said.append(f"no two robots were ever within the awareness range of {reach:g} ({span}).")
    if (robots > 1).any() and (found.over_time["mean_degree"] == robots - 1)[robots > 1].all():
        said.append(
            f"every robot always has all others within the awareness range of {reach:g}; they are at most "
            f"{_rounded(found.farthest)} apart, {_rounded(found.farthest / reach)} ranges ({span})."
        )
    doubts = [f"Check the unit: {sentence}" for sentence in said]
    if _looks_like_degrees(record.trajectories, motion):
        doubts.insert(0, (
            f"Check the units: x and y look like degrees of latitude and longitude ({span}), of which one is shorter "
            "than the other: distances are wrong. Convert them to metres east and north of a point."
        ))  # fmt: skip
    if groups := record.trajectories.attrs.get("groups"):
        listed = ", ".join(groups)
        doubts.append(f"Check the groups: all agents of {listed} count as one team; leave out the rows of others.")
    return doubts


def _of_faults(record: Record) -> list[str]:
    said, present, size = [], record.present, record.team_sizes
    if present < _USUALLY_PRESENT:
        said.append(
            f"Check the tracking: {100 * present:.3g} % of the robots are present at a time, fewer than "
            f"{100 * _USUALLY_PRESENT:g} %. Absent robots are no neighbours: if they were there, δ is too small."
        )
    if size.min() < size.max():
        few, most = int((size == size.min()).sum()), int((size == size.max()).sum())
        kind = "piece" if record.tried.kind == "piece" else "run"
        said.append(
            f"Check the robots: their number differs between {kind}s, from {size.min()} (in {few:,}) to {size.max()} "
            f"(in {most:,}). Fewer robots meet fewer: analyse records of one number."
        )
    return [*said, _never_there(record), _names_alike(record), _offsets(record), _jumps(record)]


def _never_there(record: Record) -> str:
    """Say which robots have no position in the whole record, of which nothing else is said."""
    there = record.trajectories.groupby("robot", observed=False)["x"].count()
    names = [str(name) for name in there.index[there == 0]]
    listed = ", ".join(names[:6]) + ", …" * (len(names) > 6)
    return f"Check the tracking: never a position of {listed}; δ is that of the other robots." * bool(names)


def _names_alike(record: Record) -> str:
    """Say which two robots may be one, whose name is written in two ways: it would be its own neighbour."""
    seen: dict[str, str] = {}
    for name in record.trajectories["robot"].cat.categories:
        if isinstance(name, str) and (other := seen.setdefault(name.strip().casefold(), name)) != name:
            return (
                f"Check the names: {other!r} and {name!r} count as two robots. If they are one, it is its own "
                "neighbour, and δ is too large: write its name in one way."
            )
    return ""


def _offsets(record: Record) -> str:
    """Say which robot starts farthest from the others, if robots start apart in most recordings."""
    grid, first, time = record.found.grid, record.first, record.trajectories["time"].to_numpy()
    start = pd.Series(time[first]).groupby(record.recording[first])
    interval = np.diff(time)[np.setdiff1d(np.arange(len(time) - 1), first - 1)]
    usual = float(np.quantile(interval[interval <= grid.max_gap * (1 + 1e-9)], _USUAL))
    most = max(_APART * grid.interval, usual) * (1 + 1e-9)
    apart = int((start.max() - start.min() > most).sum())
    if apart <= 0.5 * start.ngroups:
        return ""
    offset = (time[first] - start.transform("median")).to_numpy()
    row = int(np.abs(offset).argmax())
    which = f" in {apart:,} of {start.ngroups:,} recordings" * (start.ngroups > 1)
    return (
        f"Check the clocks: the first samples of robots are more than {most:.3g} apart{which}; "
        f"{record.name(first[row])} starts {abs(offset[row]):.3g} {'after' if offset[row] > 0 else 'before'} the "
        "others (their median). If the clocks differ, so do the times at which robots seem to be near each other."
    )


def _jumps(record: Record) -> str:
    motion = record.motion
    # Over several intervals a robot goes farther.
    length = motion.length * np.minimum(1.0, record.found.grid.interval / motion.wait)
    moving = length[length > 0]
    median = float(np.median(moving)) if len(moving) else 0.0
    long = np.flatnonzero((length > _LONG * median) & (length > _FAR * record.awareness_range))
    if not len(long):
        return ""
    longest = long[length[long].argmax()]
    row = motion.row[longest]
    return (
        f"Check the tracking: {len(long):,} step{'s' * (len(long) > 1)} of more than {_LONG:g} medians; the longest, "
        f"{_rounded(float(length[longest]))} instead of {_rounded(median)}, is that of {record.name(row)} before time "
        f"{record.trajectories['time'].iat[row]:.12g}. It may be a false position, two robots under one name, or an "
        "arena that is periodic."
    )


def notes(record: Record, chosen: bool) -> tuple[str, ...]:
    """Return the notes of a report, one sentence or two each; `chosen` is whether the user gave the window."""
    found, tried, reach, grid = record.found, record.tried, record.awareness_range, record.found.grid
    kind, size = recordings(grid)
    pieces, gaps, short = len(grid.length), len(grid.gaps), int((grid.length < tried.frames).sum())
    several, length = gaps > 1, f"{tried.frames * grid.step:g}"
    part = "a twentieth of the record" if pieces == 1 else "at most a twentieth of the record"
    few = "with few robots present" + " or short" * (tried.kind == "piece")
    doubt = speed_doubt(record.trajectories, record.motion)
    move, width, height = (_rounded(one / reach) for one in (record.motion.typical, *record.motion.span))
    said = [
        (
            True,
            f"Frames every {grid.step:g}; between samples of a robot up to {grid.max_gap:g} apart it moves in a line.",
        ),
        (
            pieces > 1 and kind == "run",
            f"The record holds {len(size):,} runs of {_between(size * grid.step)}.",
        ),
        (
            gaps,
            f"{gaps:,} gap{'s' * several} of {_between(grid.gaps)} in which no robot has a sample "
            f"divide{'s' * (not several)} the record into {pieces:,} pieces of {_between(grid.length * grid.step)}: "
            "there are no frames in gaps, and no window includes one.",
        ),
        (
            tried.kind != "window",
            f"Each {tried.kind} is one trial; give a window to state the risk for a fixed length of time.",
        ),
        (
            tried.kind == "window" and not chosen,
            f"The window of {length} is {part}; give the window for which the risk is to be stated.",
        ),
        (
            tried.kind == "piece",
            "Pieces are of one team, and may be correlated; mark independent runs by a column run.",
        ),
        (
            tried.kind == "window" and short,
            f"{short:,} of {pieces:,} pieces are shorter than the window and contain no trial.",
        ),
        (tried.left_out, f"{tried.left_out} {tried.kind}s {few} are left out of the exceedance."),
        (
            _USUALLY_PRESENT <= record.present < _NEARLY_ALL,
            f"On average {record.present:.0%} of the robots are present in a frame; absent robots are not counted as "
            "neighbours, so numbers of neighbours may be too low.",
        ),
        (
            found.move > _FAR * reach,
            f"Robots move {found.move:.3g} between frames, over half the awareness range: larger numbers of neighbours "
            "between frames are not found.",
        ),
        (
            True,
            f"In awareness ranges of {reach:g}: positions span {width} × {height}, and a robot that moves covers "
            f"{move} from one sample to the next (median).",
        ),
        (found.range_shape == "square", SQUARE_RANGES),
        (doubt, doubt),
    ]
    return tuple(text for holds, text in said if holds)


def _between(values: Any) -> str:
    """Return the smallest and the largest value, or the value if all are equal."""
    if not len(values):
        return ""
    low, middle, high = (f"{float(value):.4g}" for value in (np.min(values), np.median(values), np.max(values)))
    return low if low == high else f"{low} to {high} (median {middle})"


def _size(span: tuple[float, ...]) -> str:
    return " × ".join(map(_rounded, span))


def _rounded(number: float) -> str:
    """Return a number in three digits, without an exponent unless it is very large or small."""
    return f"{number:,.0f}" if 1000 <= number < 1e9 else f"{number:.3g}"
