"""Fig. 3: robots in an arena, their awareness ranges, and their neighbours."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import DEGREE, FAINT, INK, canvas, head
from teamsight.analysis.runs.seeds import model_seed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_ROBOTS, _TARGETS, _RADIUS, _RANGE = 14, 15, 5.0, 1.0
_TEAM, _LINK = DEGREE["ring"], DEGREE["pairwise"]


def _tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.analysis.runs.experiment import Experiment

    seed = model_seed(conditions.root, 0, _ROBOTS, _TARGETS, _RADIUS)
    walk = Experiment("arena", {"policy": "random-walk", "awareness": "none"}, ())
    settings = walk.parameters(conditions.setting)
    with closing(CMOMMT(robots=_ROBOTS, targets=_TARGETS, radius=_RADIUS, **settings, rng=seed)) as model:
        # The paper's picture has three robots that all sense each other: run until there are three.
        while model.tick < conditions.steps and not _has_triangle(model.neighbours.start, model.neighbours.identity):
            model.run(1)
        start, index = model.neighbours.start, model.neighbours.identity
        x, y = model.robots.position.T
        columns = {"robot": np.asarray(model.robots.identity), "x": x, "y": y, "neighbours": np.diff(start)}
        links = pd.DataFrame({"robot": np.repeat(np.arange(_ROBOTS), np.diff(start)), "senses": index})
        robots = pd.DataFrame(columns).assign(step=model.tick, robots=_ROBOTS, radius=_RADIUS, replicate=0, seed=seed)
    return {"": robots, "links": links[links["robot"] < links["senses"]].reset_index(drop=True)}


def _has_triangle(start: np.ndarray, index: np.ndarray) -> bool:
    linked = np.zeros((_ROBOTS, _ROBOTS), dtype=np.int64)
    linked[np.repeat(np.arange(_ROBOTS), np.diff(start)), index] = 1
    return bool(np.trace(linked @ linked @ linked))


def _draw(tables: Tables, conditions: Conditions) -> Canvas:
    from matplotlib.collections import LineCollection, PatchCollection
    from matplotlib.patches import Circle

    robots, links = tables[""], tables["links"]
    place = robots[["x", "y"]].to_numpy()
    figure = canvas(8.6, 9.2)
    head(
        figure,
        f"Fig. 3   {_ROBOTS} robots moving randomly in an arena of radius {_RADIUS:g}",
        f"step {robots['step'].iloc[0]}; circles: awareness range {_RANGE:g}; lines and numbers: the neighbours of a "
        f"robot; seed {conditions.root}",
    )
    axes = figure.add_axes((0.09, 0.06, 0.87, 0.82))
    axes.add_patch(Circle((0, 0), _RADIUS, facecolor="#fafafa", edgecolor=INK, linewidth=1.8))
    ranges = PatchCollection([Circle((x, y), _RANGE) for x, y in place], facecolor=_TEAM, edgecolor=_TEAM, alpha=0.13)
    axes.add_collection(ranges)
    ends = place[links[["robot", "senses"]].to_numpy()]
    axes.add_collection(LineCollection(list(ends), colors=_LINK, linewidths=2.2, zorder=3))
    axes.scatter(place[:, 0], place[:, 1], s=70, color=_TEAM, edgecolor="white", linewidth=1.2, zorder=4)
    for robot, degree in enumerate(robots["neighbours"]):
        if degree:
            _write_degree(axes, place, robot, degree, links)
    edge = _RADIUS + 1.1
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal", xlabel="x  [sensing ranges]")
    axes.set_ylabel("y  [sensing ranges]")
    axes.spines[:].set_visible(False)
    axes.tick_params(colors=FAINT)
    return figure


def _write_degree(axes: Axes, place: np.ndarray, robot: int, degree: int, links: pd.DataFrame) -> None:
    """Write a robot's number of neighbours beside it, on the side away from them."""
    ends = links.to_numpy()
    teammates = ends[(ends == robot).any(axis=1)].ravel()
    away = place[robot] - place[teammates[teammates != robot]].mean(axis=0)
    away *= 14 / max(float(np.hypot(*away)), 1e-9)
    axes.annotate(
        str(degree), place[robot], tuple(away), textcoords="offset points",
        color=_LINK, size=11, weight="bold", ha="center", va="center",
    )  # fmt: skip


FIGURE = Figure("3", "Robots, their ranges and neighbour links", (), _tabulate, _draw)
