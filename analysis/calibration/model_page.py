"""The page about the search over what the paper leaves open of its model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from teamsight.analysis.calibration import model
from teamsight.analysis.calibration.model import PARAMETERS
from teamsight.analysis.paper.claims import CLAIMS
from teamsight.analysis.plot import markdown

_UNKNOWN = "–"


def procedure() -> tuple[str, ...]:
    """Return the parts of the page that say how the search is made; they were written before its first run."""
    return (
        "The paper leaves open the speeds, what an idle robot does, how robots share a target that several of them "
        "sense, and how the length of a force becomes a speed: a robot moves by min(gain · |F|, 1) times its speed. "
        "`teamsight calibrate --out docs` searches these constants and writes this page; the preset `touzet2000` is "
        "its result.",
        "## Procedure",
        "The procedure was fixed before the search was run with a gain. That a gain of 0.5 agrees with several figures "
        "of the paper was known, from a trial with other root seeds.",
        "\n".join(f"{place}. {step}" for place, step in enumerate((_searched(), *_phases()), start=1)),
        "All root seeds are below 0, which no command accepts: no ledger meets these worlds.",
    )


def _searched() -> str:
    """Return the values that are searched, as a step of the procedure."""
    options = "; ".join(f"{name} {_values(values)}" for name, values in model.OPTIONS.items())
    return (
        f"**Values.** All {len(model.candidates())} combinations: robot_speed {_values(model.ROBOT_SPEEDS)}; "
        f"target_speed {_values(model.TARGET_RATIOS)} times that; uniform_target_speed {_values(model.UNIFORM)}; "
        f"{options}. An earlier search, without a gain and on other root seeds, found that the weights “per-teammate” "
        "and “none” hold 1 claim less on average, and that uniform_target_speed, idle_when and the robot speeds 0.15 "
        "and 0.3 make little difference: they are left out to make room for the gain, so that the search takes "
        "minutes. All else has its default."
    )


def _phases() -> tuple[str, ...]:
    """Return the claims that count, and the phases of the search, as steps of the procedure."""
    screen, final, report = model.PHASES
    left_out = [name for name in model.OPEN_CLAIMS if name not in screen.claims]
    return (
        f"**Claims.** The {len(model.OPEN_CLAIMS)} claims that simulation of designed policies can check, each by its "
        f"rule in the [ledger](claims.md): {', '.join(model.OPEN_CLAIMS)}. Claims about learning do not count, nor "
        "those in closed form.",
        f"**Screening.** Every combination on N = {_values(screen.grid.robots)} and R = {_values(screen.grid.radius)}, "
        f"{screen.runs} runs of {screen.steps} steps a cell, root seed {_values(screen.roots)}, without "
        f"{', '.join(left_out)}, which need a surface each.",
        f"**Final.** The best {model.FINALISTS}, and the defaults, on N = {_values(final.grid.robots)} and R = "
        f"{_values(final.grid.radius)}, {final.runs} runs of {final.steps} steps a cell, root seeds "
        f"{_values(final.roots)}, all claims.",
        "**Rank.** The number of claims that hold, the mean over the root seeds; then the mean distance of the claims "
        "from the paper's figures, each divided by the tolerance of its rule and cut at 5; then the order of the "
        "values above. The first of the final becomes the preset.",
        "**Report.** The preset, the preset with each other gain, and the defaults, once more on the grid of the "
        f"final, root seeds {_values(report.roots)}. This decides nothing.",
    )


def page(table: pd.DataFrame) -> str:
    """Return the page in Markdown about a table that `model.search` returned."""
    screened, final, report = (table[table["phase"] == phase.name] for phase in model.PHASES)
    best = model.best_of(final)
    return markdown.page(
        "# Calibration",
        *procedure(),
        "## Result",
        "The best setting: " + ", ".join(f"`{name}={value!r}`" for name, value in best.items()) + ".",
        _beside_the_defaults(best, final, "In the final"),
        _beside_the_defaults(best, report, "In the report, on worlds that chose nothing,"),
        _no_longer_judged(table),
        "## What the gain decides",
        *_on_the_gain(screened, report),
        "## The best settings in the final",
        _setting_table(model.ranked(final)),
        "Columns: “hold” is the number of claims that hold, the mean over the root seeds and the range; “distance” is "
        "the mean distance from the paper; “differ” lists the claims that hold under no root seed or, in brackets, "
        "not under all. Settings whose ranges overlap are not significantly different.",
        "## Effect of each value",
        "Number of claims that hold in the screening: the largest number and the mean over all values of the other "
        "parameters.",
        _effect_table(screened),
        "## How often each claim holds",
        "Percentage of the settings in the screening, and of the settings and root seeds in the final.",
        _claim_table(screened, final),
        "## What no setting satisfies",
        f"Over the {len(screened)} screened settings and those of the final and the report. A claim or pair of claims "
        "that holds under no or few settings might hold under more or fewer with other seeds.",
        "Claims that hold under no setting: " + (", ".join(model.never(table)) or "none") + ".",
        "Pairs of claims that each hold under some setting, but never both:",
        "\n".join(f"- {first} and {second}" for first, second in model.never_together(table)) or "- none",
    )


def _no_longer_judged(table: pd.DataFrame) -> str:
    """Return which claims the search judged that have no rule any more, in words; empty if there are none."""
    names = [name for name, claim in CLAIMS.items() if not claim.rule and name in table]
    if not names:
        return ""
    held = ", ".join(f"{name} ({int(table[name].eq(True).sum())} times)" for name in names)
    return (
        f"When the search was made, it also judged what is not decidable any more; how often it held: {held}. Its "
        "distance is part of the mean distances of the final and of the report."
    )


def _on_the_gain(screened: pd.DataFrame, report: pd.DataFrame) -> tuple[str, ...]:
    """Return which claims hold with which gain, under the best setting and in the screening."""
    best = report.iloc[0]
    others = [name for name in PARAMETERS if name != "gain"]
    like = report[(report[others] == best[others]).all(axis=1)]
    gains = sorted(model.GAINS)
    rows, hang = [], []
    for name in model.judged(report):
        reported, everywhere = ([_share(of[name][of["gain"] == gain]) for gain in gains] for of in (like, screened))
        rows.append([name, *reported, *everywhere])
        if len({*reported} - {_UNKNOWN}) > 1:
            hang.append(name)
    return (
        "The gain of the force was chosen by the claims that it decides. That they hold with the gain of the preset "
        "is an explanation of the paper's figures, not evidence for them. Claims whose verdict changes with the gain "
        f"under the best setting: {', '.join(hang) or 'none'}.",
        "Percentage of root seeds of the report under which a claim holds, under the best setting with this gain, and "
        "of all screened settings with this gain:",
        markdown.table(
            ["claim", *(f"gain {gain:g}" for gain in gains), *(f"screened, gain {gain:g}" for gain in gains)], rows
        ),
    )


def _values(values: Iterable[Any]) -> str:
    return ", ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values)


def _beside_the_defaults(best: Mapping[str, Any], judged: pd.DataFrame, where: str) -> str:
    ranked = model.ranked(judged)
    first, given = (
        ranked[pd.concat([ranked[name] == value for name, value in values.items()], axis=1).all(axis=1)]
        for values in (best, model.defaults())
    )
    if first.empty or given.empty:
        return f"{where} the best setting and the defaults were not both judged."
    one, other = first.iloc[0], given.iloc[0]
    overlap = one["fewest"] <= other["most"] and other["fewest"] <= one["most"]
    return (
        f"{where} {one['holding']:.1f} ({one['fewest']}–{one['most']}) of {_judged(judged)} claims hold under it, at a "
        f"mean distance of {one['distance_from_paper']:.2f}; under the defaults {other['holding']:.1f} "
        f"({other['fewest']}–{other['most']}), at {other['distance_from_paper']:.2f}. The two ranges "
        f"{'overlap' if overlap else 'do not overlap'}."
    )


def _setting_table(ranked: pd.DataFrame) -> str:
    rows = []
    for row in ranked.to_dict("records"):
        doubtful = [name for name in model.OPEN_CLAIMS if row.get(name, 1) < 1]
        differ = ", ".join(name if row[name] == 0 else f"({name})" for name in doubtful)
        rows.append(
            [
                *(str(row[name]) for name in PARAMETERS),
                f"{row['holding']:.1f} ({row['fewest']}–{row['most']})",
                f"{row['distance_from_paper']:.2f}",
                differ or "none",
            ]
        )
    return markdown.table([*PARAMETERS, "hold", "distance", "differ"], rows)


def _effect_table(screened: pd.DataFrame) -> str:
    ratio = (screened["target_speed"] / screened["robot_speed"]).round(2)
    table = screened.assign(**{"target_speed / robot_speed": ratio})
    names = ("robot_speed", "target_speed / robot_speed", *PARAMETERS[2:])
    rows = (
        [name, str(value), f"{part['holding'].max()}", f"{part['holding'].mean():.1f}"]
        for name in names
        for value, part in table.groupby(name, sort=False)
    )
    return markdown.table(["parameter", "value", "best", "mean"], rows)


def _claim_table(screened: pd.DataFrame, final: pd.DataFrame) -> str:
    rows = (
        [name, claim.rule, *(_share(table[name]) for table in (screened, final))]
        for name, claim in model.judged(final).items()
    )
    return markdown.table(["claim", "rule", "screened", "final"], rows)


def _judged(table: pd.DataFrame) -> int:
    """Return the number of claims that all rows judge."""
    return sum(bool(table[name].notna().all()) for name in model.judged(table))


def _share(holds: pd.Series[bool]) -> str:
    return f"{100 * holds.eq(True).mean():.0f} %" if holds.notna().any() else _UNKNOWN
