"""``python -m teamsight.analysis.calibration.calibrate``: search what the paper leaves open, and write table and page.

The winner is copied by hand into ``agents/presets.py``: a preset is a decision, not a by-product.
"""

from __future__ import annotations

import argparse
from functools import reduce
from operator import and_

import pandas as pd
from rich.progress import Progress

from teamsight import __version__
from teamsight.analysis.calibration import calibration
from teamsight.analysis.calibration.calibration import OPEN_CLAIMS, PARAMETERS
from teamsight.analysis.runs import files
from teamsight.analysis.runs.simulate import IMPORTS
from teamsight.analysis.runs.workers import WorkerPool, cores

_SHOWN = 12


def main() -> None:
    """Search and write ``calibration.parquet`` and ``calibration.md``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", default="docs", help="folder of the page and the table")
    parser.add_argument("--workers", type=int, default=cores())
    given = parser.parse_args()
    folder = files.prepare_folder(given.out)
    with Progress() as bar, WorkerPool(given.workers, IMPORTS, bar.console.print) as pool:
        task = bar.add_task("calibrating", total=None)

        def show(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)
            if not bar.console.is_terminal:
                bar.console.print(f"{done} of {total} settings judged")

        assessed = calibration.search(pool, progress=show)
    files.write_table(folder / "calibration.parquet", assessed, {"version": __version__}, force=True)
    files.write_text(folder / "calibration.md", page(assessed), force=True)


def page(assessed: pd.DataFrame) -> str:
    """Return what the search found as a page of Markdown."""
    screened = assessed[assessed["stage"] == "screen"]
    final = calibration.ranking(assessed[assessed["stage"] == "final"])
    best = {name: final.iloc[0][name] for name in PARAMETERS}
    parts = [
        "# Calibration",
        "The paper leaves out speeds, what a robot does that senses nothing, and how robots that sense one target "
        f"share it. All {len(screened)} combinations of the values below were screened on a coarse grid; the best "
        f"{calibration.FINALISTS}, and the defaults, were judged again on the paper's grid, each with "
        f"{len(calibration.FINAL.roots)} other root seeds, all of which are below 0 and so never those of a ledger. "
        f"Settings rank by the number of the {len(OPEN_CLAIMS)} simulated claims that hold (when screened: "
        f"{len(calibration.SCREEN.claims)}), then by their mean distance from the paper's figures in tolerances of the "
        "rule. Made by `python -m teamsight.analysis.calibration.calibrate`.",
        "The best: " + ", ".join(f"`{name}={value!r}`" for name, value in _plain(best).items()) + ". Of "
        "settings with equal numbers the one searched first stands first.",
        _beside_the_defaults(final),
        "## The best settings, on the paper's grid",
        _settings_table(final.head(_SHOWN)),
        "## What each value is worth",
        "Claims that hold on the screening grid: with the best of all other values, and on average over them.",
        _effects_table(screened),
        "## How often each claim holds",
        "Share of the screened settings, and of the best ones on the paper's grid.",
        _claims_table(screened, assessed[assessed["stage"] == "final"]),
        "## What no setting satisfies",
        f"Over the {len(screened)} settings on the coarse grid ({calibration.SCREEN.runs} runs, "
        f"{len(calibration.SCREEN.roots)} root seed) and the best on the paper's grid ({calibration.FINAL.runs} runs, "
        f"{len(calibration.FINAL.roots)} root seeds): “no setting” means none of these, and a claim or pair that holds "
        "with few of them, as the table above tells, could come out otherwise with another seed.",
        "Under no setting: " + (", ".join(calibration.never(assessed)) or "none") + ".",
        "Each under some setting, but never both:\n\n"
        + ("\n".join(f"- {first} and {second}" for first, second in calibration.never_together(assessed)) or "- none"),
    ]
    return "\n\n".join(parts) + "\n"


def _plain(row: dict[str, object]) -> dict[str, object]:
    return {name: value.item() if hasattr(value, "item") else value for name, value in row.items()}


def _beside_the_defaults(final: pd.DataFrame) -> str:
    """Return how the best setting compares with the defaults."""
    best = final.iloc[0]
    same = [final[name] == value for name, value in zip(PARAMETERS, calibration.DEFAULT_VALUES, strict=True)]
    found = final[reduce(and_, same)]
    if found.empty:
        return "The defaults were not among those judged."
    defaults = found.iloc[0]
    apart = best["fewest"] > defaults["most"]
    return (
        f"With the best setting {best['holding']:.1f} ({best['fewest']}–{best['most']}) claims hold, at a mean "
        f"distance of {best['distance']:.2f}; with the defaults {defaults['holding']:.1f} ({defaults['fewest']}–"
        f"{defaults['most']}), at {defaults['distance']:.2f}. By their ranges the two are "
        f"{'told apart' if apart else 'not told apart'}."
    )


def _settings_table(ranked: pd.DataFrame) -> str:
    names = [claim.name for claim in OPEN_CLAIMS]
    lines = [[*PARAMETERS, "hold", "distance", "differ"], ["---"] * (len(PARAMETERS) + 3)]
    for row in ranked.to_dict("records"):
        missing = ", ".join(name if row[name] == 0 else f"({name})" for name in names if row.get(name, 1) < 1) or "none"
        lines.append(
            [
                *(str(row[name]) for name in PARAMETERS),
                f"{row['holding']:.1f} ({row['fewest']}–{row['most']})",
                f"{row['distance']:.2f}",
                missing,
            ]
        )
    return _table(lines) + (
        "\n\nCounts are means over the root seeds, with their range; claims in brackets differ with some of them. "
        "Settings whose ranges overlap are not told apart: another seed may turn them round."
    )


def _effects_table(screened: pd.DataFrame) -> str:
    lines = [["parameter", "value", "best", "mean"], ["---"] * 4]
    ratio = (screened["target_speed"] / screened["robot_speed"]).round(2)
    table = screened.assign(**{"target_speed / robot_speed": ratio})
    for name in (
        "robot_speed",
        "target_speed / robot_speed",
        "uniform_target_speed",
        "idle",
        "idle_when",
        "weights",
    ):
        for value, rows in table.groupby(name, sort=False):
            lines.append([name, str(value), f"{rows['holding'].max()}", f"{rows['holding'].mean():.1f}"])
    return _table(lines)


def _claims_table(screened: pd.DataFrame, final: pd.DataFrame) -> str:
    lines = [["claim", "rule", "screened", "best"], ["---"] * 4]
    for claim in OPEN_CLAIMS:
        shares = [_share(table[claim.name]) for table in (screened, final)]
        lines.append([claim.name, claim.rule, *shares])
    return _table(lines)


def _share(holds: pd.Series[bool]) -> str:
    return f"{100 * holds.eq(True).mean():.0f} %" if holds.notna().any() else "–"


def _table(lines: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


if __name__ == "__main__":
    main()
