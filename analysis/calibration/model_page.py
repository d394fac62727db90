"""The page about the search over what the paper leaves open of its model."""

from __future__ import annotations

import pandas as pd

from teamsight.analysis.calibration import model
from teamsight.analysis.calibration.model import PARAMETERS
from teamsight.analysis.plot import markdown

_SHOWN = 12


def page(table: pd.DataFrame) -> str:
    """Return the page in Markdown about a table that `model.search` returned."""
    screened, final = (table[table["phase"] == phase.name] for phase in (model.SCREEN, model.FINAL))
    ranked = model.ranked(final)
    best = ranked[list(PARAMETERS)].to_dict("records")[0]
    return markdown.page(
        "# Calibration",
        "The paper leaves open the speeds, what an idle robot does, and how robots share a target that several of them "
        f"sense. All {len(screened)} combinations of the values below were screened on a coarse grid. The best "
        f"{model.FINALISTS}, and the defaults, were judged again on the paper's grid with {len(model.FINAL.roots)} "
        "other root seeds. All root seeds are below 0, unlike those of any ledger. Settings are ranked by the number "
        f"of simulated claims that hold ({_judged(screened)} are judged in the screening, {_judged(final)} in "
        "the final), then by the mean distance of the claims from the paper's figures, each divided by the tolerance "
        "of its rule. Made by `teamsight calibrate --out docs`.",
        "The best setting: " + ", ".join(f"`{name}={value!r}`" for name, value in best.items()) + ". Settings "
        "of equal rank are listed in the order of the search.",
        _beside_the_defaults(ranked),
        "## The best settings, on the paper's grid",
        _setting_table(ranked.head(_SHOWN)),
        "Columns: “hold” is the number of claims that hold, the mean over the root seeds and the range; “distance” is "
        "the mean distance from the paper; “differ” lists the claims that hold under no root seed or, in brackets, "
        "not under all. Settings whose ranges overlap are not significantly different.",
        "## Effect of each value",
        "Number of claims that hold on the screening grid: the largest number and the mean over all values of the "
        "other parameters.",
        _effect_table(screened),
        "## How often each claim holds",
        "Percentage of the settings in the screening, and of the settings and root seeds in the final.",
        _claim_table(screened, final),
        "## What no setting satisfies",
        f"Over the {len(screened)} screened settings ({model.SCREEN.runs} runs of each cell, "
        f"{len(model.SCREEN.roots)} root seed) and those of the final ({model.FINAL.runs} runs, "
        f"{len(model.FINAL.roots)} root seeds). A claim or pair of claims that holds under no or few settings might "
        "hold under more or fewer with other seeds.",
        "Claims that hold under no setting: " + (", ".join(model.never(table)) or "none") + ".",
        "Pairs of claims that each hold under some setting, but never both:",
        "\n".join(f"- {first} and {second}" for first, second in model.never_together(table)) or "- none",
    )


def _beside_the_defaults(ranked: pd.DataFrame) -> str:
    best = ranked.iloc[0]
    same = pd.concat([ranked[name] == value for name, value in model.defaults().items()], axis=1).all(axis=1)
    if not same.any():
        return "The defaults were not judged."
    given = ranked[same].iloc[0]
    verdict = "do not overlap" if best["fewest"] > given["most"] else "overlap"
    return (
        f"Under the best setting {best['holding']:.1f} ({best['fewest']}–{best['most']}) claims hold, at a mean "
        f"distance of {best['distance_from_paper']:.2f}; under the defaults {given['holding']:.1f} ({given['fewest']}–"
        f"{given['most']}), at {given['distance_from_paper']:.2f}. The two ranges {verdict}."
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
    return f"{100 * holds.eq(True).mean():.0f} %" if holds.notna().any() else "–"
