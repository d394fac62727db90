"""The figure of learning curves: the gain from awareness against the number of transitions, and where it begins."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from teamsight.analysis.learning.curves import BEST, mean_gains
from teamsight.analysis.learning.evaluation import BY_HAND, DESIGNED, RANDOM
from teamsight.analysis.learning.plans import LEAST_FOR_INTERVAL, Curves
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.analysis.plot.kinds import draw_means, mark_values, panels
from teamsight.analysis.plot.style import FAINT, INK, colours_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_MOST_MARKS = 6
_MARKS = "os^DvP*X<>hp"
# The colour of each learner, which does not depend on the others that are drawn.
_COLOURS = dict(zip(LEARNERS, colours_of(list(LEARNERS)), strict=True))


def draw(gains: pd.DataFrame, crossings: pd.DataFrame, curves: Curves) -> Canvas:
    """Return the figure.

    A panel for each scenario has the gain from awareness against the number of transitions. The last two have the
    observed targets, mean of all scenarios, and the crossings against the size of the search space.

    Parameters
    ----------
    gains, crossings : DataFrame
        From `awareness_gains` and `crossings`.
    curves : Curves
        The settings.
    """
    few, columns = curves.memories < LEAST_FOR_INTERVAL, max(len(curves.robots), 2)
    scenarios = [(robots, radius) for radius in curves.radius for robots in curves.robots]
    figure, shown = panels(
        _finding(mean_gains(crossings)),
        f"mean{' (too few for an interval)' if few else ' and 95 % interval'} over {curves.memories} exploration"
        f"{'s' * (curves.memories > 1)}, {curves.worlds} world{'s' * (curves.worlds > 1)} each; {curves.targets} "
        f"targets, {curves.steps} steps, reward {curves.reward}, γ = {curves.discount:g}, seed {curves.seed}; explored "
        "by 5 robots among 10 targets at R = 3; observed targets are the mean of the scenarios, solid with awareness, "
        "Θ(1), dotted without, Θ(0)",
        [*(f"N = {robots}, R = {radius:g}" for robots, radius in scenarios),
         "Observed targets", "Fewest transitions from which awareness pays"],
        x=[*["transitions"] * (len(scenarios) + 1), "size of the search space  [log10]"],
        y=[*("" if at % columns else "Θ(1) minus Θ(0)  [pp]" for at in range(len(scenarios))), "observed  [%]", ""],
        columns=columns, size=(4.1, 3.1),
    )  # fmt: skip
    # Fewer dots than other figures have, since it has many panels.
    figure.set_dpi(74)
    one = gains[gains["robots"].notna()]
    known = 100 * pd.concat([one["gain"], pd.Series([0.0])])
    margin = 0.12 * (known.max() - known.min()) + 1.0
    for axes, (robots, radius) in zip(shown, scenarios, strict=False):
        _draw_gain(axes, one[(one["robots"] == robots) & (one["radius"] == radius)], curves, few)
        axes.set_ylim(known.min() - margin, known.max() + margin)
    _draw_observed(shown[-2], mean_gains(gains), curves)
    for axes in shown[:-1]:
        marks = sorted(curves.samples)
        # Every second mark, with the largest, if there are many.
        mark_values(axes, marks[::-2][::-1] if len(marks) > _MOST_MARKS else marks)
        axes.tick_params(axis="x", labelsize=8)
    _draw_crossings(shown[-1], crossings[crossings["learner"] != BEST], curves)
    handles, labels = shown[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _finding(crossings: pd.DataFrame) -> str:
    """Return from how many transitions awareness pays, mean of all scenarios, for each learner, in words."""
    known = crossings[crossings["learner"] != BEST].set_index("learner")["crossing"]
    pays = ", ".join(f"{at:,.0f} ({learner})" for learner, at in known.dropna().sort_values().items())
    never = ", ".join(map(str, known.index[known.isna()]))
    said = [f"Awareness pays from {pays} transitions"] * bool(pays) + [f"is not shown to pay for {never}"] * bool(never)
    return "; ".join(said) if pays else f"Awareness {said[0]}"


def _draw_gain(axes: Axes, points: pd.DataFrame, curves: Curves, few: bool) -> None:
    """Draw a line for each learner, with a band for its interval if it is known."""
    axes.axhline(0.0, color=INK, linewidth=0.9)
    for learner in (*curves.learners, BEST):
        of = points[points["learner"] == learner].sort_values("transitions")
        found = 100 * of[["gain", "low", "high"]].to_numpy(float)
        if few or learner == BEST:
            found[:, 1:] = np.inf
        look: dict[str, Any] = {"marker": "o", "markersize": 3.5}
        label, colour = "best with awareness minus best without", INK
        if learner == BEST:
            look = {"linestyle": "--", "linewidth": 1.3}
        else:
            label, colour = LEARNERS[learner].title or learner, _COLOURS[learner]
        draw_means(axes, of["transitions"], found, colour, label, **look)


def _draw_observed(axes: Axes, points: pd.DataFrame, curves: Curves) -> None:
    """Draw what each learner observes with and without awareness, and the teams that learn nothing."""
    for learner, (which, style) in itertools.product(curves.learners, (("cooperative", "-"), ("collective", ":"))):
        of = points[points["learner"] == learner].sort_values("transitions")
        axes.plot(of["transitions"], 100 * of[which], color=_COLOURS[learner], linestyle=style, linewidth=1.6)
    at_once = points[points["transitions"] == 0].set_index("learner")
    observed: pd.Series[float] = 100 * at_once[["cooperative", "collective"]].max(axis=1)
    lines = {f"{DESIGNED}, Θ(N)": [DESIGNED], RANDOM: [RANDOM]}
    for degree in dict.fromkeys(degree for _, degree in BY_HAND.values()):
        teams = [name for name, (_, own) in BY_HAND.items() if own == degree]
        teams.sort(key=lambda name: -observed[name])
        laws = ", ".join(name.rpartition(", ")[2] for name in teams)
        lines[f"{teams[0].rpartition(', ')[0]}: {laws}"] = teams
    for text, names in lines.items():
        # The form of the teams by hand is that of the regression.
        is_by_hand = names[0] in BY_HAND
        for name in names:
            axes.axhline(
                observed[name], color=_COLOURS["regression"] if is_by_hand else INK, linewidth=0.8,
                linestyle="-" if is_by_hand else "--",
            )  # fmt: skip
        axes.annotate(
            text, (1.0, observed[names].max()), xycoords=("axes fraction", "data"), xytext=(0, 2 if is_by_hand else -2),
            textcoords="offset points", ha="right", va="bottom" if is_by_hand else "top", size=8, color=FAINT,
        )  # fmt: skip
    low, high = axes.get_ylim()
    axes.set_ylim(low - 2, high + 2)  # room for the notes


def _draw_crossings(axes: Axes, crossings: pd.DataFrame, curves: Curves) -> None:
    """Draw a point for each learner and scenario; learners that never cross are above the line at the top."""
    most = max(curves.samples)
    never = 3.0 * most
    single = crossings[crossings["robots"].notna()]
    places = _places(single, curves)
    for (robots, radius), mark in zip(curves.scenarios, itertools.cycle(_MARKS)):
        of = single[(single["robots"] == robots) & (single["radius"] == radius)]
        look: dict[str, Any] = {"marker": mark, "s": 30, "zorder": 3}
        where = [places[learner, robots, radius] for learner in of["learner"]]
        axes.scatter(where, of["crossing"].fillna(never), color=[_COLOURS[one] for one in of["learner"]], **look)
        axes.scatter([], [], color=INK, label=f"N = {robots}, R = {radius:g}", **look)
    axes.axhline(1.7 * most, color=FAINT, linewidth=0.8, linestyle=":")
    axes.set(yscale="log", ylim=(0.5 * min(curves.samples), 2 * never))
    numbers = sorted(curves.samples)[::-2][::-1]
    axes.set_yticks([*numbers, never], [*(f"{number:,}" for number in numbers), f"not within\n{most:,}"])
    sizes = single.groupby("log10_size", sort=True)["learner"].unique()
    names = [",\n".join(learners) + f"\n{size:.1f}" for size, learners in sizes.items()]
    mark_values(axes, list(sizes.index), names, is_log=False)
    axes.tick_params(axis="x", labelsize=8)
    axes.set_xlim(min(places.values()) - 0.3, max(places.values()) + 0.3)
    axes.legend(frameon=False, fontsize=8, loc="center right")


def _places(crossings: pd.DataFrame, curves: Curves) -> dict[tuple[str, int, float], float]:
    """Return where to draw each learner and scenario: side by side around the size of the learner's search space."""
    sizes = crossings.drop_duplicates("learner").set_index("learner")["log10_size"]
    different = sorted(set(sizes))
    gap = min((high - low for low, high in itertools.pairwise(different)), default=1.0)
    found = {}
    for size in different:
        points = list(itertools.product(sizes.index[sizes == size], curves.scenarios))
        apart = min(0.8 * gap / len(points), 0.2)
        for number, (learner, (robots, radius)) in enumerate(points):
            found[learner, robots, radius] = size + (number - (len(points) - 1) / 2) * apart
    return found
