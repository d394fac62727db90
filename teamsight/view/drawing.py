"""Frames drawn by matplotlib: the arena of each track, and below them what is observed against time."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from teamsight.core.checks import shown
from teamsight.view.page import Track
from teamsight.view.scene import ACTIVE, BLOCKED, OBSERVED, PRESENT, Frame, Scene

Floats = npt.NDArray[np.float64]

_RIGHT = 0.5 * math.pi


def square_outline(reach: float, angle: float, field_of_view: float) -> Floats:
    """Return the corners of a square range around the origin, or of the part in view, shape (corners, 2) [length].

    Parameters
    ----------
    reach : float
        Half the side, which is along the axes [length].
    angle, field_of_view : float
        The heading and the angle around it that is in view [rad].
    """
    if field_of_view >= 2 * math.pi - 1e-9:
        return reach * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    first, last = angle - 0.5 * field_of_view, angle + 0.5 * field_of_view
    # Corners are at odd eighths of a turn.
    number = np.arange(math.floor(first / _RIGHT - 0.5) + 1, math.ceil(last / _RIGHT - 0.5))
    turns = np.array([first, *(number + 0.5) * _RIGHT, last])
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    return np.concatenate([np.zeros((1, 2)), reach * ways / np.abs(ways).max(axis=1, keepdims=True)])


_DPI = 100
_INK, _PALE, _GREY, _BLOCKED = "#1b1f24", "#d0d7de", "#8c959f", "#c2185b"
# The lines of two runs; their titles have the same colours.
_LINES = ("#1f77b4", "#d1242f")
# The size of a marker, and that of one among many or in a small body [points²].
_MARKER, _SMALL_MARKER = 26.0, 6.0
# Beyond these numbers of bodies, links and trails are not drawn, since they would cover each other.
_MOST_LINKED, _MOST_TRAILED = 400, 400
_TRAIL = 12
# Points of the arc of a sector.
_CORNERS, _FULL_TURN = 33, 2 * np.pi
# The shapes of bodies by role; groups of one role differ, as in view.js. A robot is a disc with a line ahead.
_SHAPES = {"robot": ("disc",), "target": ("disc", "diamond", "square"), "other": ("square", "diamond", "disc")}
_OUTLINES = {
    "disc": Path.unit_circle().transformed(Affine2D().scale(0.5)),
    "square": Path.unit_rectangle().transformed(Affine2D().translate(-0.5, -0.5).scale(0.9)),
    "diamond": Path.unit_regular_polygon(4).transformed(Affine2D().scale(0.62)),
}
# The heights of the chart, the legend and the titles [pixels], and the width of a letter of a title.
_CHART, _LEGEND, _HEAD, _LETTER = 90, 18, 44, 6.4


class Drawing:
    """A figure that draws one frame of each track after the other.

    Parameters
    ----------
    tracks : sequence of Track
        One run, or two side by side.
    width : int
        The width of the figure [pixels].
    scale : int
        The number of pixels of the picture, along each side, for one of the figure.
    """

    def __init__(self, tracks: Sequence[Track], width: int, scale: int = 1) -> None:
        self._tracks = [(track.scene, list(track.frames)) for track in tracks]
        self.frames = max(len(frames) for _, frames in self._tracks)
        self.figure = Figure(figsize=(width / _DPI, _height(tracks, width) / _DPI), dpi=_DPI * scale)
        self._canvas = FigureCanvasAgg(self.figure)
        height = self.figure.get_figheight() * _DPI
        bottom, top = (_CHART + _LEGEND) / height, 1 - _HEAD / height
        share = 1 / len(tracks)
        self._arenas = [
            _Arena(self.figure.add_axes((k * share, bottom, share, top - bottom)), *track, width * share, colour)
            for k, (track, colour) in enumerate(zip(self._tracks, _LINES if len(tracks) > 1 else (_INK,), strict=False))
        ]
        left, low = 42 / width, 20 / height
        chart = self.figure.add_axes((left, low, 1 - left - 12 / width, _CHART / height - low - 8 / height))
        _draw_legend(self.figure, self._tracks[0][0], (_CHART + 0.5 * _LEGEND) / height)
        self._cursor = _chart(chart, self._tracks)
        self._moving: list[Artist] = [self._cursor, *(one for arena in self._arenas for one in arena.artists)]
        for artist in self._moving:
            artist.set_animated(True)
        self._canvas.draw()  # type: ignore[no-untyped-call]
        self._still: Any = self._canvas.copy_from_bbox(self.figure.bbox)  # type: ignore[no-untyped-call]

    def show(self, number: int) -> npt.NDArray[np.uint8]:
        """Draw a frame; return the picture, shape (height, width, 3).

        Parameters
        ----------
        number : int
            The number of the frame of the run that has the most, from 0; the other run shows its last one until then.
        """
        self._set(number)
        self._canvas.restore_region(self._still)  # type: ignore[no-untyped-call]
        for artist in self._moving:
            if artist.axes is not None:
                artist.axes.draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()  # type: ignore[no-untyped-call]

    def save(self, file: Any, number: int, software: str) -> None:
        """Write a frame as a PNG picture."""
        self._set(number)
        for artist in self._moving:
            artist.set_animated(False)
        self.figure.savefig(file, format="png", metadata={"Software": software})

    def _set(self, number: int) -> None:
        longest = max((frames for _, frames in self._tracks), key=len)
        time = longest[number].time
        for arena, (_, frames) in zip(self._arenas, self._tracks, strict=True):
            # Both show the same tick, also if they have frames at other ticks.
            arena.show(max(bisect_right(frames, time, key=lambda frame: frame.time) - 1, 0))
        self._cursor.set_xdata([time] * 2)


# What a slot is: whether it is a robot or a target; its colour and outline; its range, the angle in which it senses,
# and whether the range is square; the radius of its body.
_LOOK = np.dtype([
    ("robot", bool), ("target", bool), ("colour", object), ("outline", object), ("reach", float), ("angle", float),
    ("square", bool), ("radius", float),
])  # fmt: skip


class _Arena:
    """The arena of one track."""

    def __init__(self, axes: Axes, scene: Scene, frames: list[Frame], width: float, colour: str) -> None:
        self._scene, self._frames, self._axes = scene, frames, axes
        self._name = shown(scene.title, max(int(width / _LETTER), 8)).strip("'")
        _draw_walls(axes, scene)
        self._title = axes.set_title(" ", fontsize=8.5, color=colour, pad=4)
        outlines = [_OUTLINES[shape] for shape in shapes_of(scene)]
        looks = [
            (
                group.role == "robot", group.role == "target", group.colour, outlines[slot.group],
                slot.sensing_range, slot.field_of_view, group.range_shape == "square", slot.radius,
            )
            for slot in scene.slots for group in (scene.groups[slot.group],)
        ]  # fmt: skip
        self._looks = np.array(looks, _LOOK)
        self._ranges = EllipseCollection([], [], [], units="xy", offset_transform=axes.transData, alpha=0.08, zorder=1)
        self._sectors = PolyCollection([], alpha=0.08, zorder=1)
        self._trails = LineCollection([], linewidths=0.8, alpha=0.35, zorder=2)
        self._links = LineCollection([], linewidths=0.6, colors=_GREY, alpha=0.6, zorder=2.5)
        self._bodies = EllipseCollection([], [], [], units="xy", offset_transform=axes.transData, zorder=3.5)
        self._noses = LineCollection([], linewidths=1.3, zorder=4)
        self.artists: list[Artist] = []
        for collection in (self._ranges, self._sectors, self._trails, self._links, self._bodies, self._noses):
            self.artists.append(axes.add_collection(collection, autolim=False))
        if scene.wraps:
            x0, y0, x1, y1 = scene.bounds
            self._bodies.set_clip_path(Rectangle((x0, y0), x1 - x0, y1 - y0, transform=axes.transData))
        self._dots = axes.scatter([], [], linewidths=1.0, zorder=5)
        self.artists += [self._dots, self._title]

    def show(self, number: int) -> None:
        """Set what is drawn to a frame."""
        scene, frame = self._scene, self._frames[number]
        looks, place, angle = self._looks[: len(frame)], frame.positions(scene.bounds), frame.angles()
        there, active, observed = ((frame.flags & flag) > 0 for flag in (PRESENT, ACTIVE, OBSERVED))
        colours = np.where(active, looks["colour"], _GREY)
        self._dots.set_offsets(place[there])
        self._dots.set_sizes(self._sizes(looks["radius"][there]))
        self._dots.set_paths(looks["outline"][there].tolist())
        self._dots.set_facecolor(np.where(~looks["target"] | observed, colours, "none")[there].tolist())
        self._dots.set_edgecolor(colours[there].tolist())
        facing = there & active & looks["robot"]
        nose = 0.028 * max(scene.bounds[2] - scene.bounds[0], scene.bounds[3] - scene.bounds[1])
        ahead = place + np.maximum(nose, looks["radius"])[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        self._noses.set_segments(list(np.stack([place, ahead], axis=1)[facing]))
        self._noses.set_color(list(colours[facing]))
        self._show_ranges(looks[facing], place[facing], angle[facing])
        solid = there & (looks["radius"] > 0)
        self._show_bodies(place[solid], looks["radius"][solid], colours[solid], (frame.flags & BLOCKED)[solid] > 0)
        if len(scene.slots) <= _MOST_LINKED:
            self._links.set_segments(_lines_of_links(scene, frame, place))
        if len(scene.slots) <= _MOST_TRAILED:
            self._show_trails(number, there)
        value = dict(zip(scene.series, frame.series.tolist(), strict=True)).get("observed", float("nan"))
        seen = f" · {100 * value:.0f} % observed" if value == value else ""
        self._title.set_text(f"{self._name}\ntick {frame.time:,.0f}{seen}")

    def _show_ranges(self, looks: npt.NDArray[np.void], place: Floats, angle: Floats) -> None:
        """Draw circles, sectors where the field of view is narrower, and squares."""
        is_round, square = looks["angle"] >= _FULL_TURN - 1e-9, looks["square"]
        circles, sectors = is_round & ~square, ~is_round & ~square
        _set_circles(self._ranges, place[circles], looks["reach"][circles])
        self._ranges.set_facecolor(list(looks["colour"][circles]))
        turns = angle[sectors, None] + looks["angle"][sectors, None] * np.linspace(-0.5, 0.5, _CORNERS)
        arc = looks["reach"][sectors, None, None] * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
        centre = place[sectors, None, :]
        outlines = [
            place[row] + square_outline(looks["reach"][row], angle[row], looks["angle"][row])
            for row in np.flatnonzero(square)
        ]
        self._sectors.set_verts([*np.concatenate([centre, centre + arc], axis=1), *outlines])
        self._sectors.set_facecolor([*looks["colour"][sectors], *looks["colour"][square]])

    def _sizes(self, radius: Floats) -> Floats:
        """Return the sizes of markers [points²]: none is larger than its body, as long as it can be seen."""
        size = _MARKER if len(self._scene.slots) <= 200 else _SMALL_MARKER
        points = 2 * radius * self._axes.transData.get_matrix()[0, 0] * 72 / self._axes.figure.dpi
        return np.where(radius > 0, np.clip(points**2, _SMALL_MARKER, size), size)

    def _show_bodies(
        self, place: Floats, radius: Floats, colours: npt.NDArray[np.object_], is_blocked: npt.NDArray[np.bool_]
    ) -> None:
        """Draw circles of the true radius, also across the seam; those of blocked bodies are thick."""
        shifts = [np.array([0.0, *(-period, period)[: 2 * (period > 0)]]) for period in self._scene.wraps or (0.0, 0.0)]
        shift = np.stack(np.meshgrid(*shifts), axis=-1).reshape(-1, 1, 2)
        x0, y0, x1, y1 = self._scene.bounds
        beyond = np.maximum([x0, y0] - (place + shift), place + shift - [x1, y1]).max(axis=-1)
        copy, row = np.nonzero((beyond < radius) | (shift == 0.0).all(axis=-1))
        _set_circles(self._bodies, (place + shift)[copy, row], radius[row])
        self._bodies.set_facecolor([to_rgba(colour, 0.25) for colour in colours[row]])
        self._bodies.set_edgecolor(np.where(is_blocked, _BLOCKED, colours)[row].tolist())
        self._bodies.set_linewidth(np.where(is_blocked, 2.0, 0.9)[row].tolist())

    def _show_trails(self, number: int, there: npt.NDArray[np.bool_]) -> None:
        """Draw where bodies were; a jump, as across the seam of a torus, ends a trail."""
        x0, y0, x1, y1 = bounds = self._scene.bounds
        past = [one for one in self._frames[max(number - _TRAIL, 0) : number + 1] if len(one) == len(there)]
        places = np.stack([one.positions(bounds) for one in past])
        was = np.stack([(one.flags & PRESENT) > 0 for one in past]).all(axis=0)
        was &= ~(np.abs(np.diff(places, axis=0)) > 0.4 * np.array([x1 - x0, y1 - y0])).any(axis=(0, 2))
        self._trails.set_segments(list(places[:, was].transpose(1, 0, 2)))
        self._trails.set_color(list(self._looks["colour"][: len(there)][was]))


def _set_circles(circles: EllipseCollection, place: Floats, radius: Floats) -> None:
    circles.set_offsets(place)
    circles._widths = circles._heights = radius  # type: ignore[attr-defined]
    circles._angles = np.zeros(len(radius))  # type: ignore[attr-defined]


def shapes_of(scene: Scene) -> list[str]:
    """Return the shape of each group: "disc", "square" or "diamond"."""
    used: Counter[str] = Counter()
    found = []
    for group in scene.groups:
        shapes = _SHAPES[group.role if group.role in _SHAPES else "other"]
        found.append(shapes[used[group.role] % len(shapes)])
        used[group.role] += 1
    return found


def _lines_of_links(scene: Scene, frame: Frame, place: Floats) -> list[Floats]:
    """Return the links of teammates as lines, by the shortest way where the arena repeats."""
    found: list[Floats] = []
    for about, links in zip(scene.links, frame.links, strict=True):
        if about.channel == "teammates":
            start = place[links.source]
            way = place[links.target] - start
            for axis, period in enumerate(scene.wraps or ()):
                way[:, axis] -= period * np.rint(way[:, axis] / period) if period else 0.0
            end = place[links.target]
            found += list(np.stack([start, start + way], axis=1))
            # A line that leaves across the seam also arrives on the other side.
            crosses = np.abs(start + way - end).max(axis=1, initial=0.0) > 1e-9
            found += list(np.stack([end - way, end], axis=1)[crosses])
    return found


def _draw_walls(axes: Axes, scene: Scene) -> None:
    x0, y0, x1, y1 = scene.bounds
    margin = 0.03 * max(x1 - x0, y1 - y0)
    axes.set(xlim=(x0 - margin, x1 + margin), ylim=(y0 - margin, y1 + margin), aspect="equal")
    axes.set_axis_off()
    for line in scene.obstacles:
        axes.fill(*zip(*line, strict=True), color=_PALE, zorder=0.5)
    for line in scene.walls:
        axes.plot(*zip(*line, strict=True), color=_INK, linewidth=1.2, linestyle="--" if scene.wraps else "-", zorder=3)


def _draw_legend(figure: Figure, scene: Scene, height: float) -> None:
    """Say below the arenas what the markers of each group mean, at most three groups."""
    entries: list[Line2D] = []
    for group, shape in [*zip(scene.groups, shapes_of(scene), strict=True)][:3]:
        names = ("observed", "missed") if group.role == "target" else ("",)
        for name in names:
            look = {"marker": _OUTLINES[shape], "color": group.colour, "markersize": 5.5, "linestyle": ""}
            hollow = {"markerfacecolor": "none"} if name == "missed" else {}
            entries.append(Line2D([], [], **look, **hollow, label=f"{group.name} {name}".strip()))  # type: ignore[arg-type]
    figure.legend(
        handles=entries, loc="center", bbox_to_anchor=(0.5, height), ncols=len(entries), fontsize=7, frameon=False,
        handletextpad=0.1, columnspacing=1.2, borderaxespad=0.0, labelcolor=_INK,
    )  # fmt: skip


def _chart(axes: Axes, tracks: list[tuple[Scene, list[Frame]]]) -> Any:
    """Draw the observed fraction against time; return the cursor."""
    for number, (scene, frames) in enumerate(tracks):
        if "observed" in scene.series:
            column = scene.series.index("observed")
            values = [frame.series[column] for frame in frames]
            axes.plot([frame.time for frame in frames], values, color=_LINES[number], linewidth=1.0)
    axes.set_ylim(-0.03, 1.03)
    axes.set_yticks([0.0, 1.0])
    axes.tick_params(labelsize=7, colors=_INK)
    axes.set_ylabel("observed", fontsize=8, color=_INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.01)
    return axes.axvline(tracks[0][1][0].time, color=_INK, linewidth=0.8)


def _height(tracks: Sequence[Track], width: int) -> int:
    """Return the height of a figure that fits its arenas [pixels], an even number."""
    ratios = [(s.bounds[3] - s.bounds[1]) / (s.bounds[2] - s.bounds[0]) for s in (track.scene for track in tracks)]
    arena = width / len(tracks) * min(max(*ratios, 0.2), 2.0)
    return 2 * round((arena + _CHART + _LEGEND + _HEAD) / 2)
