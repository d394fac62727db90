"""The figures of the paper, and observed targets against δ, each as tidy tables and a drawing."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.agents.awareness import AWARENESS
from teamsight.analysis.papers.touzet2000.claims import shortfall
from teamsight.analysis.papers.touzet2000.experiments import EXPERIMENTS, LEARNED, READINGS, gains_in
from teamsight.analysis.papers.touzet2000.ledger import runs_of_cells
from teamsight.analysis.plot.kinds import draw_curves, draw_means, mark_values, panels
from teamsight.analysis.plot.style import (
    DEGREE,
    FAINT,
    INK,
    POLICY,
    ROBOTS_LABEL,
    canvas,
    head,
    minus,
    signed,
    superscript,
    to_picture,
)
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.runs.experiment import Tables
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.stats.paired import CELL, cell_means, grid_of, includes_zero, maxima, paired

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

    from teamsight.analysis.papers.touzet2000 import Touzet

@dataclass(frozen=True)
class Figure:
    """A figure: the experiments that it reads, and how their tables become its tables and its drawing.

    Parameters
    ----------
    title : str
        What it shows, on one line.
    needs : tuple of str
        Names of the experiments whose tables it reads.
    tabulate : callable
        Takes the tables of the experiments and the plan, and returns the figure's tidy tables by the suffix of
        their file names. The table "" holds what was measured; the others are computed from it, where they are.
    draw : callable
        Takes the figure's tables and the plan, and returns the drawing.
    summarise : callable, optional
        Takes the figure's tables by suffix and returns the result in one line, for the terminal.
    """

    title: str
    needs: tuple[str, ...]
    tabulate: Callable[[Tables, Touzet], dict[str, pd.DataFrame]]
    draw: Callable[[Tables, Touzet], Canvas]
    summarise: Callable[[Tables], str] | None = None


def pictures(job: tuple[str, Tables, Touzet, Sequence[str]]) -> dict[str, bytes]:
    """Return the pictures of a figure by format, from its name, its tables, the plan and the formats."""
    name, tables, plan, formats = job
    figure = FIGURES[name]
    drawing, description = figure.draw(tables, plan), f"{figure.title}; {plan.in_words()}"
    return {kind: to_picture(drawing, description, kind) for kind in formats}


# Fig. 2: inputs of a robot, and size of its search space.

_LARGEST_TEAM = 30


def _tabulate_search_space(tables: Tables, plan: Touzet) -> dict[str, pd.DataFrame]:
    from teamsight.analysis.search_space import TOUZET, dimensions_table

    return {"": dimensions_table(range(1, _LARGEST_TEAM + 1), degrees=TOUZET)}


def _draw_search_space(tables: Tables, plan: Touzet) -> Canvas:
    texts = {"inputs": "dimensions d of the search space  [inputs]", "log10_size": "size pᵈ for p = 2"}
    last = tables[""].groupby("degree", sort=False)["inputs"].last()
    found = ", ".join(f"{number} ({degree})" for degree, number in last.items())
    figure, shown = panels(
        f"Fig. 2   Inputs of each of {_LARGEST_TEAM} robots: {found}",
        "search space against team size, for each degree of awareness: n = 16 sensors of the world, δ = 16 inputs for "
        "all teammates, σ = 2 for each; in closed form",
        ["", ""], x=ROBOTS_LABEL, y=list(texts.values()), size=(7.2, 5.4),
    )  # fmt: skip
    for axes, value in zip(shown, texts, strict=True):
        ends = tables[""].groupby("degree", sort=False)[value].last()
        near = 0.05 * ends.max()
        for degree, rows in tables[""].groupby("degree", sort=False):
            colour, last = DEGREE[str(degree)], rows.iloc[-1]
            axes.plot(rows["team_size"], rows[value], color=colour, linewidth=2.2, marker="o", markersize=3)
            number, gaps = f"{last[value]:.0f}", ends - last[value]
            formula = f"d = {last['formula']}  ({number})" if value == "inputs" else f"10{superscript(number)}"
            # The labels of lines that end close together move apart.
            up, down = gaps.between(-near, 0, "neither").any(), gaps.between(0, near, "neither").any()
            axes.annotate(
                f"{last['growth']}:  {formula}", (last["team_size"], last[value]), xytext=(8, 4 * up - 5 * down),
                textcoords="offset points", color=colour, va="center", size=9.5,
            )  # fmt: skip
        axes.set(xlim=(0, _LARGEST_TEAM + 0.5), ylim=0)
        axes.set_xticks([1, *range(5, _LARGEST_TEAM + 1, 5)])
    axes.yaxis.set_major_formatter(lambda power, _: f"10{superscript(f'{power:.0f}')}")
    return figure


# Fig. 3: robots in an arena, their awareness ranges, and their neighbours.

_ROBOTS, _TARGETS, _RADIUS, _RANGE = 14, 15, 5.0, 1.0


def _tabulate_arena(tables: Tables, plan: Touzet) -> dict[str, pd.DataFrame]:
    from teamsight.agents.cmommt import CMOMMT

    seed = model_seed(plan.seed, 0, _ROBOTS, _TARGETS, _RADIUS)
    walk = EXPERIMENTS["random-walk"]
    settings = walk.parameters(plan.settings[plan.preset])
    with closing(CMOMMT(robots=_ROBOTS, targets=_TARGETS, radius=_RADIUS, **settings, rng=seed)) as model:
        while True:
            start, senses = model.neighbours.start, model.neighbours.identity
            links = pd.DataFrame({"robot": np.repeat(np.arange(_ROBOTS), np.diff(start)), "senses": senses})
            linked = np.zeros((_ROBOTS, _ROBOTS), dtype=np.int64)
            linked[links["robot"], links["senses"]] = 1
            # The paper's picture has three robots that all sense each other: run until there are three.
            if np.trace(linked @ linked @ linked) or model.tick >= plan.steps:
                break
            model.run(1)
        x, y = model.robots.position.T
        columns = {"robot": np.asarray(model.robots.identity), "x": x, "y": y, "neighbours": np.diff(start)}
        robots = pd.DataFrame(columns).assign(step=model.tick, robots=_ROBOTS, radius=_RADIUS, replicate=0, seed=seed)
    return {"": robots, "links": links[links["robot"] < links["senses"]].reset_index(drop=True)}


def _draw_arena(tables: Tables, plan: Touzet) -> Canvas:
    from matplotlib.collections import LineCollection, PatchCollection
    from matplotlib.patches import Circle

    robots, links = tables[""], tables["links"].to_numpy()
    team, link = DEGREE["ring"], DEGREE["pairwise"]
    place = robots[["x", "y"]].to_numpy()
    figure, (axes,) = panels(
        f"Fig. 3   {int((robots['neighbours'] > 0).sum())} of {_ROBOTS} robots that move randomly have neighbours",
        f"arena of radius {_RADIUS:g}, step {robots['step'].iloc[0]}; circles: awareness range {_RANGE:g}; lines and "
        f"numbers: the neighbours of a robot; seed {plan.seed}",
        [""], x="x  [sensing ranges]", y="y  [sensing ranges]", size=(8.6, 8.2), is_plain=False,
    )  # fmt: skip
    axes.add_patch(Circle((0, 0), _RADIUS, facecolor="#fafafa", edgecolor=INK, linewidth=1.8))
    ranges = [Circle((x, y), _RANGE) for x, y in place]
    axes.add_collection(PatchCollection(ranges, facecolor=team, edgecolor=team, alpha=0.13))
    axes.add_collection(LineCollection(list(place[links]), colors=link, linewidths=2.2, zorder=3))
    axes.scatter(place[:, 0], place[:, 1], s=70, color=team, edgecolor="white", linewidth=1.2, zorder=4)
    for robot in np.unique(links):
        ends = links[(links == robot).any(axis=1)]
        # Beside the robot, on the side away from its neighbours.
        away = place[robot] - place[ends[ends != robot]].mean(axis=0)
        away *= 14 / max(float(np.hypot(*away)), 1e-9)
        axes.annotate(
            str(len(ends)), place[robot], tuple(away), textcoords="offset points",
            color=link, size=11, weight="bold", ha="center", va="center",
        )  # fmt: skip
    edge = _RADIUS + 1.1
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
    axes.spines[:].set_visible(False)
    axes.tick_params(colors=FAINT)
    return figure


# Figs. 4 to 7: a quantity of each team size in each arena.

# Height of the curves below the surface [inches].
_CURVES = 4.6


def _level_figure(name: str, title: str, experiment: str, value: str) -> Figure:
    """Return a figure of observed targets, or of the largest number of neighbours, with confidence intervals."""
    in_percent = value == "observed_fraction"

    def tabulate(tables: Tables, plan: Touzet) -> dict[str, pd.DataFrame]:
        return {"": tables[experiment], "cells": cell_means(tables[experiment], value)}

    def draw(tables: Tables, plan: Touzet) -> Canvas:
        cells = tables["cells"].copy()
        if in_percent:
            cells[["mean", "low", "high"]] *= 100
        grid = grid_of(cells) if in_percent else maxima(tables[""])
        robots, radius = grid.index, grid.columns
        extent = f"N = {robots.min()}..{robots.max()}, R = {radius.min():g}..{radius.max():g}"
        figure = canvas(WIDTH, HEAD + HEIGHT + _CURVES)
        what = "mean" if in_percent else "of each cell the maximum"
        found = f"{grid.min().min():.0f} to {grid.max().max():.0f}{' %' * in_percent}"
        about = f"{what} over {plan.in_words()}; 15 targets, ranges 1; {extent}"
        head(figure, f"Fig. {name}   {title}, {found}", about)
        label = "observed targets  [%]" if in_percent else "largest number of neighbours  [robots]"
        # All teammates of the largest team: both figures have one scale, even if one of them is drawn alone.
        most = 100 if in_percent else max(1, robots.max() - 1)
        draw_row(figure, grid, Look(label, "{:.0f}".format, 0, most))
        total = figure.get_figheight()
        axes = figure.add_axes((0.065, 0.62 / total, 0.81, (_CURVES - 1.25) / total))
        draw_curves(axes, cells, label if in_percent else "largest number in a run  [robots]")
        axes.set(xlim=(robots.min(), robots.max()), ylim=(0, 1.02 * most))
        what = "mean over the runs" if in_percent else "mean of the runs' maxima, which the maximum of all exceeds"
        axes.set_title(f"{what}; bands: 95 % confidence interval of the mean", loc="left", size=11, color=FAINT)
        return figure

    return Figure(title, (experiment,), tabulate, draw)


# Figs. 8, 10 and 11: paired differences of each team size in each arena.

# Letters in a line of a caption, which stands above a surface, beside the heat map.
_CAPTION = 84


class _Contrast(NamedTuple):
    """A difference, treated − base, of two experiments; its value in the column `variant`; text above its surface."""

    treated: str
    base: str
    variant: str
    caption: str


def _difference_figure(name: str, title: str, *contrasts: _Contrast) -> Figure:
    """Return a figure of paired differences in percentage points, one row for each contrast, all on one scale.

    Of learned teams each replicate of a cell is another exploration, and the figure says how far these differ.
    """
    are_learned = contrasts[0].treated in LEARNED

    def tabulate(tables: Tables, plan: Touzet) -> dict[str, pd.DataFrame]:
        parts = []
        for contrast in contrasts:
            part = paired(tables[contrast.treated], tables[contrast.base])
            if are_learned:
                seeds = tables[contrast.treated].drop_duplicates("replicate").set_index("replicate")["exploration"]
                part["exploration"] = part["replicate"].map(seeds)
            parts.append(part.assign(variant=contrast.variant))
        runs = pd.concat(parts, ignore_index=True)
        found = {"": runs, "cells": cell_means(runs, "difference", ("variant", *CELL))}
        if are_learned:
            means = runs.groupby(["variant", "exploration"], sort=False)[["with", "without", "difference"]].mean()
            found["explorations"] = means.reset_index()
        return found

    def draw(tables: Tables, plan: Touzet) -> Canvas:
        cells = tables["cells"]
        figure = canvas(WIDTH, HEIGHT * len(contrasts) + HEAD)
        runs = plan.in_words(runs_of_cells(tables[""]))
        each = ", each with another unselected exploration" if are_learned else ""
        subtitle = f"paired on common noise, mean over {runs}{each}; in brackets: the 95 % interval includes 0"
        # What learned teams gain stands above each surface.
        ends = (signed(100 * end) for end in (cells["mean"].min(), cells["mean"].max()))
        head(figure, f"Fig. {name}   {title}" + ("" if are_learned else f", {' to '.join(ends)} points"), subtitle)
        # One scale for all, in which noise looks as small as it is: whole points, or fives from ten on.
        most = 100 * float(cells["mean"].abs().max())
        step = 1.0 if most < 10 else 5.0
        limit = max(1.0, step * float(np.ceil(most / step)))
        # Most differences have one sign: cut the axis where no cell reaches.
        heights = (min(0.0, float(np.floor(100 * cells["mean"].min() + 0.05))), limit)
        look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, True, heights)
        for row, (*_, variant, text) in enumerate(contrasts):
            of = cells[cells["variant"] == variant]
            draw_row(figure, grid_of(of) * 100, look, row=row, open_cells=includes_zero(of))
            if are_learned:
                text += f": {_spread(variant, tables)}; standard error of a cell up to {100 * of['se'].max():.1f} pp"
            lines = textwrap.fill(text, _CAPTION, break_long_words=False, break_on_hyphens=False)
            top = 1 - (HEAD + row * HEIGHT + 0.12) / figure.get_figheight()
            figure.text(0.03, top, lines, size=11, color=FAINT, va="top", linespacing=1.4)
        return figure

    def summarise(tables: Tables) -> str:
        lines = []
        for *_, variant, text in contrasts:
            most = tables["cells"].query("variant == @variant").nlargest(1, "mean").iloc[0]
            cell = f"N = {most['robots']:.0f}, R = {most['radius']:g}"
            lines.append(f"{text}: {_spread(variant, tables)}; largest {100 * most['mean']:+.1f} pp at {cell}")
        number = tables[""]["exploration"].nunique()
        return f"gain from awareness over {number} explorations: " + "; ".join(lines)

    needs = tuple(dict.fromkeys(name for contrast in contrasts for name in contrast[:2]))
    return Figure(title, needs, tabulate, draw, summarise if are_learned else None)


def _spread(variant: str, tables: Tables) -> str:
    """Return the mean gain over all cells, its interval, and the range of the explorations, in words."""
    gains = gains_in(tables[""].query("variant == @variant"))
    mean = gains.average()
    # Not all explorations have run the same cells.
    single = mean.mean + np.nanmean(gains.values - gains.mean(), axis=(1, 2))
    interval = f" (95 % interval {mean.low:+.1f} to {mean.high:+.1f})" if np.isfinite(mean.low) else ""
    return minus(
        f"{mean.mean:+.1f} pp on average over all cells{interval}, single explorations {single.min():+.1f} to "
        f"{single.max():+.1f}"
    )


# Fig. 9: the repulsive force between robots against their distance.


def _tabulate_repulsion(tables: Tables, plan: Touzet) -> dict[str, pd.DataFrame]:
    from teamsight.policies import ACmommt
    from teamsight.policies.handmade.forces import repulsion

    distance = np.round(np.linspace(0.0, 1.2, 601), 6)
    parts = []
    # The two scalings of Fig. 10 at an awareness range of half the sensing range.
    for scaling, scale in (("sensing", 1.0), ("awareness", 0.5)):
        d1, d2 = ACmommt().dr1 * scale, ACmommt().dr2 * scale
        magnitude = repulsion(distance, d1, d2)
        parts.append(pd.DataFrame({"scaling": scaling, "d1": d1, "d2": d2, "distance": distance, "force": magnitude}))
    return {"": pd.concat(parts, ignore_index=True)}


def _draw_repulsion(tables: Tables, plan: Touzet) -> Canvas:
    figure, (axes,) = panels(
        "Fig. 9   A nearby robot repels less from d₁ on, and not at all beyond d₂",
        "in closed form; constants in common use (1250 and 2000 for a sensing range of 2600): the paper prints none",
        [""], x="distance between the robots  [sensing ranges]",
        y="force along the line between them  [of the largest]", size=(9.6, 5.0),
    )  # fmt: skip
    looks = {
        "sensing": ("-", "scaled with the sensing range 1, the default"),
        "awareness": ("--", "scaled with an awareness range of 0.5, an option in Fig. 10"),
    }
    by_scaling = dict(list(tables[""].groupby("scaling")))
    for scaling, (dashes, label) in looks.items():
        rows = by_scaling[scaling]
        axes.plot(rows["distance"], rows["force"], dashes, color=POLICY["a-cmommt"], linewidth=2.6, label=label)
    for symbol, value, bottom in zip("₁₂", by_scaling["sensing"][["d1", "d2"]].iloc[0], (-1.0, 0.0), strict=True):
        axes.vlines(value, bottom, 0.11, color=FAINT, linewidth=0.9, linestyle=":")
        text, offset = f"d{symbol} = {value:g}", (5, 0)
        axes.annotate(text, (value, 0.07), offset, textcoords="offset points", color=INK, va="center")
    axes.set(xlim=(0, 1.2), ylim=(-1.12, 0.14))
    axes.legend(frameon=False, loc="lower right")
    return figure


# Observed targets against the number of sectors δ, which the paper discusses but does not draw.

_DEGREES = ("none", "ring", "pairwise")


def _tabulate_delta(tables: Tables, plan: Touzet) -> dict[str, pd.DataFrame]:
    parts = [tables[f"delta-{degree}"].assign(awareness=degree) for degree in _DEGREES]
    runs = pd.concat(parts, ignore_index=True)
    # Only the ring has a δ. 0 elsewhere keeps the column integer.
    runs["delta"] = runs["delta"].fillna(0).astype("int64")
    return {"": runs, "cells": cell_means(runs, "observed_fraction", (*CELL, "awareness", "delta"))}


def _draw_delta(tables: Tables, plan: Touzet) -> Canvas:
    runs, cells = tables[""], tables["cells"].copy()
    cells[["mean", "low", "high"]] *= 100
    short, enough = shortfall(*(runs[runs["awareness"] == degree] for degree in ("ring", "pairwise")))
    found = f"{enough} sectors are as good as Θ(N), to 1 point on average"
    if enough is None:
        found = f"no ring of up to {short.index[-1]} sectors is as good as Θ(N)"
    worlds = list(cells.groupby(["radius", "robots"]))
    most = runs.query("awareness == 'pairwise'").groupby(["radius", "robots"], as_index=False)["max_neighbours"].max()
    figure, shown = panels(
        f"Fig. δ   Observed targets against the sectors δ of the ring: {found}",
        f"A-CMOMMT: mean and 95 % confidence band over {int(cells['count'].iloc[0])} runs of {plan.steps} steps; "
        f"15 targets, ranges 1; setting {plan.preset}, seed {plan.seed}",
        [f"N = {n}, R = {radius:g}   (at most {met} neighbours)" for radius, n, met in most.itertuples(index=False)],
        x="sectors δ of the ring", y="observed targets  [%]", columns=3, size=(4.7, 3.4), sharey=True,
    )  # fmt: skip
    for axes, (_, of) in zip(shown, worlds, strict=True):
        deltas = of.loc[of["awareness"] == "ring", "delta"].to_numpy()
        for degree in ("none", "pairwise", "ring"):
            look: dict[str, Any] = {"marker": "o"} if degree == "ring" else {"linestyle": "--"}
            level = of[of["awareness"] == degree]
            # A degree without δ is the same at all of them.
            level = level.loc[level.index.repeat(len(deltas) // len(level))]
            about = AWARENESS[degree]
            draw_means(
                axes, deltas, level, DEGREE[degree], f"{about.__name__}, {about.order}: {about.shows}", **look
            )
        mark_values(axes, deltas.tolist())
    handles, labels = shown[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


#: Every figure by the name that the command line uses, in the order of the paper.
FIGURES: dict[str, Figure] = {
    "2": Figure("Search space against team size", (), _tabulate_search_space, _draw_search_space),
    "3": Figure("Robots, their ranges and neighbour links", (), _tabulate_arena, _draw_arena),
    "4": _level_figure("4", "Largest number of neighbours: random walk", "random-walk", "max_neighbours"),
    "5": _level_figure("5", "Largest number of neighbours: A-CMOMMT", "a-cmommt", "max_neighbours"),
    "6": _level_figure(
        "6", "Observed targets: centroid of the sensed targets, no awareness", "centroid", "observed_fraction"
    ),
    "7": _level_figure("7", "Observed targets: A-CMOMMT, pairwise awareness", "a-cmommt", "observed_fraction"),
    "8": _difference_figure(
        "8", "Gain by awareness: A-CMOMMT − centroid",
        _Contrast("a-cmommt", "centroid", "a-cmommt - centroid", "Fig. 7 − Fig. 6"),
    ),
    "9": Figure("Repulsive force from a nearby robot", (), _tabulate_repulsion, _draw_repulsion),
    "10": _difference_figure(
        "10", "Gain by an awareness range of 1 instead of 0.5: A-CMOMMT",
        _Contrast(
            "a-cmommt", "half-range", "repulsion scaled with sensing range",
            "repulsion scaled with the sensing range (d1, d2 = 0.481, 0.769)",
        ),
        _Contrast(
            "a-cmommt", "half-range-scaled", "repulsion scaled with awareness range",
            "repulsion scaled with the awareness range (half of that at 0.5)",
        ),
    ),
    "11": _difference_figure(
        "11", "Gain by awareness in lazy learning: 32 inputs − 16 inputs of the same transitions",
        *(
            _Contrast(
                f"{reading.name}-cooperative", f"{reading.name}-collective", reading.name,
                f"{letter}) {reading.title}, reward {reading.reward}",
            )
            for letter, reading in zip("ab", READINGS, strict=True)
        ),
    ),
    "delta": Figure(
        "Observed targets against δ", tuple(f"delta-{degree}" for degree in _DEGREES), _tabulate_delta, _draw_delta
    ),
}  # fmt: skip
