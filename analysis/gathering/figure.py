"""The figure: δ of both teams and where the objective saturates, against N for each task; and the gathering index."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from teamsight.analysis.gathering.cells import Cell
from teamsight.analysis.gathering.plan import Plan
from teamsight.analysis.plot.style import COLOURS, FAINT, INK, canvas, head, plain, to_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_TITLE = "Does exploration show how many neighbours skill brings?"
# The series of a task: attribute, label, colour and mark.
_SERIES = (
    ("explore", "δ by exploration", COLOURS[1], "o"),
    ("skilled", "δ of the team with skill", COLOURS[2], "s"),
    ("saturation", "objective saturates", COLOURS[3], "^"),
)
# Inches: a panel with what is beside it, the head of the figure, and its least width.
_WIDTH, _HEIGHT, _HEAD, _LEAST = 3.3, 3.0, 1.15, 8.0
_MARKS, _COLOURS = "os^Dv*PX", (*COLOURS, INK)
_GATHERS = {True: "gathers", False: "disperses", None: "unknown"}
# By this share the marks of a series stand beside those of the one before, so that both are seen.
_BESIDE = 0.04
# Where an infinite bound of the index ends, over the largest finite number.
_BEYOND = 2.0
_TICKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)


def draw(cells: Sequence[Cell], plan: Plan, kind: str = "png") -> bytes:
    """Return the figure in a format of `plot.style.FORMATS`.

    Parameters
    ----------
    cells : sequence of Cell
        One for each task and team size.
    plan : Plan
        What was simulated.
    kind : str
        The format.
    """
    return to_picture(draw_on_canvas(cells, plan), _TITLE, kind)


def draw_on_canvas(cells: Sequence[Cell], plan: Plan) -> Canvas:
    """Return the figure; see `draw`."""
    tasks = list(dict.fromkeys(cell.task for cell in cells))
    panels = len(tasks) + 1
    columns = math.ceil(math.sqrt(panels))
    rows = math.ceil(panels / columns)
    width, height = max(0.4 + _WIDTH * columns, _LEAST), _HEAD + _HEIGHT * rows
    figure = canvas(width, height)
    head(
        figure,
        _TITLE,
        f"{plan.runs:,} runs each; δ for a risk of {plan.risk:g}; bounds hold together with 95 %; degree "
        f"{plan.degree}; seed {plan.seed}",
    )
    places = {
        "bottom": 0.55 / height, "top": 1 - _HEAD / height, "left": 0.55 / width, "right": 1 - 0.2 / width,
        "hspace": 0.42, "wspace": 0.25,
    }  # fmt: skip
    grid = figure.add_gridspec(rows, columns, **places)
    for number in range(panels):
        axes = figure.add_subplot(grid[divmod(number, columns)])
        plain(axes)
        axes.tick_params(colors=FAINT)
        axes.set_xlabel("robots N", size=9)
        if number < len(tasks):
            _draw_task(axes, [cell for cell in cells if cell.task == tasks[number]])
            if number == 0:
                axes.legend(frameon=False, fontsize=8)
        else:
            _draw_index(axes, cells, tasks)
    return figure


def _draw_task(axes: Axes, cells: Sequence[Cell]) -> None:
    """Draw δ against N for one task."""
    size = np.array([cell.size for cell in cells], np.float64)
    axes.plot(size, size - 1, color=FAINT, linewidth=0.8, linestyle=":", label="N − 1")
    for place, (name, label, colour, mark) in enumerate(_SERIES):
        values = np.array([getattr(cell, name) for cell in cells], np.float64)
        x = size * (1 + (place - 1) * _BESIDE)
        bars = np.stack([values[:, 0] - values[:, 1], values[:, 2] - values[:, 0]])
        axes.errorbar(x, values[:, 0], np.maximum(bars, 0), color=colour, marker=mark, capsize=2, label=label)
    _scale(axes, size)
    axes.set_ylabel("δ")
    axes.set_ylim(bottom=-0.5)
    axes.set_title(f"{cells[0].task} ({_GATHERS[cells[0].gathers]})", loc="left", size=11)


def _draw_index(axes: Axes, cells: Sequence[Cell], tasks: Sequence[str]) -> None:
    """Draw the gathering index of all tasks."""
    ends = [value for cell in cells for value in cell.ratio if np.isfinite(value) and value > 0]
    least, most = min(ends, default=1.0) / _BEYOND, max(ends, default=1.0) * _BEYOND
    for number, task in enumerate(tasks):
        own = [cell for cell in cells if cell.task == task]
        ratio = np.clip(np.array([cell.ratio for cell in own], np.float64), least, most)
        x = np.array([cell.size for cell in own]) * (1 + number * _BESIDE)
        bars = np.stack([ratio[:, 0] - ratio[:, 1], ratio[:, 2] - ratio[:, 0]])
        colour, mark = _COLOURS[number % len(_COLOURS)], _MARKS[number % len(_MARKS)]
        axes.errorbar(x, ratio[:, 0], np.maximum(bars, 0), color=colour, marker=mark, capsize=2, label=task)
    axes.axhline(1.0, color=FAINT, linewidth=0.8, linestyle=":")
    axes.set_yscale("log")
    axes.set_ylim(least, most)
    shown = [tick for tick in _TICKS if least <= tick <= most]
    axes.set_yticks(shown, [f"{tick:g}" for tick in shown])
    _scale(axes, np.array([cell.size for cell in cells], np.float64))
    axes.set_ylabel("gathering index δ(skilled) / δ(explore)")
    axes.set_title("above 1: exploration shows too few", loc="left", size=11)
    axes.legend(frameon=False, fontsize=7, ncols=2)


def _scale(axes: Axes, sizes: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    """Give the axis of N a logarithmic scale with a tick for each size."""
    axes.set_xscale("log")
    ticks = np.unique(sizes)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
