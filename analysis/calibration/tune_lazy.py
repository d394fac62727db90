"""Search the open constants of lazy learning, and write table and page.

What is chosen is copied by hand into the defaults of `LazyLearner` and of `Exploration`, the exploration of the chosen
seed is shipped, and the seeds of other settings stand in `lazy_teams.SEEDS`: defaults are decisions, not by-products.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict

import numpy as np
import pandas as pd
from rich.progress import Progress

from teamsight import __version__
from teamsight.analysis.calibration import lazy_search
from teamsight.analysis.calibration.lazy_constants import VALUES, Constants
from teamsight.analysis.calibration.lazy_search import OPEN_CLAIMS
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE
from teamsight.analysis.runs import files
from teamsight.analysis.runs.simulate import IMPORTS
from teamsight.analysis.runs.workers import WorkerPool, cores
from teamsight.analysis.stats.paired import half_width


def main() -> None:
    """Search and write ``lazy-search.parquet`` and ``lazy-search.md``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", default="docs", help="folder of the page and the table")
    parser.add_argument("--workers", type=int, default=cores())
    given = parser.parse_args()
    folder = files.prepare_folder(given.out)
    with Progress() as bar, WorkerPool(given.workers, IMPORTS, bar.console.print) as pool:
        task = bar.add_task("trying constants and memories", total=lazy_search.trials(lazy_search.Size()))
        found = lazy_search.search(pool, progress=lambda done: bar.update(task, completed=done))
    files.write_table(folder / "lazy-search.parquet", found, {"version": __version__}, force=True)
    files.write_text(folder / "lazy-search.md", page(found), force=True)


def page(found: pd.DataFrame) -> str:
    """Return what the search found as a page of Markdown."""
    stages = _stages(found)
    constants = lazy_search.chosen_constants(found)
    parts = [
        "# The open constants of lazy learning",
        "The paper gives the size of the exploration (5 robots × 120 steps among 10 targets, 600 pairs), the reward "
        "(+1, −1, 0) and the algorithm, and leaves everything else open: the arena that is explored and how fast, k, "
        "γ, how often Q is computed over, whose targets are rewarded, and which of all possible explorations it was. "
        "This page searches them. Made by `python -m teamsight.analysis.calibration.tune_lazy`; "
        "every trial is a row of "
        "[lazy-search.parquet](lazy-search.parquet).",
        "A trial explores, makes the cooperative and the collective learner, and runs each once at "
        f"N = {_listed(lazy_search.GRID.robots)}, R = {_listed(lazy_search.GRID.radius)} on common noise, at the "
        "default speeds unless it is said otherwise. All worlds have root seeds below 0, so that none is one of a "
        "ledger; what reports shares neither worlds nor memories with what chooses. The largest gain of a trial is "
        "that of single runs, which noise lifts; Figure 11 takes the mean of five.",
        "## In short",
        _short(stages["luck"]),
        "## What was chosen",
        _choice(stages, constants),
        "## The chosen exploration, on worlds that had no part in choosing it",
        _summary(stages["chosen"], "root seeds"),
        "## The luck of one exploration",
        f"The same constants with {len(stages['luck'])} other memories of 600 pairs, each from another seed:",
        _summary(stages["luck"], "memories"),
        _luck(stages["luck"]),
        "## What each constant is worth",
        f"Over {len(stages['draw'])} trials with constants and memory drawn at random: mean ± standard error over "
        "all values of the other constants. Distance is the mean distance of the claims from the paper's figures in "
        "tolerances of their rules, by which constants are chosen; gain is cooperative less collective [pp].",
        _effects(stages["draw"]),
        "## One constant at a time",
        "Each row changes one of the chosen constants, on memories and worlds that had no part in choosing: the "
        "difference that this makes, paired, with its 95 % confidence interval.",
        _variations(stages["vary"], constants),
        *(part for setting in lazy_search.SETTINGS for part in _elsewhere(found, setting)),
    ]
    return "\n\n".join(parts) + "\n"


def _stages(found: pd.DataFrame, setting: str = lazy_search.DEFAULTS) -> dict[str, pd.DataFrame]:
    return {str(name): part for name, part in found[found["setting"] == setting].groupby("stage")}


def _elsewhere(found: pd.DataFrame, setting: str) -> list[str]:
    stages = _stages(found, setting)
    winner = lazy_search.chosen_memory(found, setting)
    luck = stages["luck"]["gain"]
    low, high = _interval(luck)
    return [
        f"## The setting `{setting}`",
        "Under these speeds robots meet another world, which they explore for themselves, with the constants chosen "
        f"above. Of the seeds 0 to {len(stages['memory']) - 1} the best were found as for the defaults: seed "
        f"**{winner}**, at these speeds. On worlds that had no part in choosing it:",
        _summary(stages["chosen"], "root seeds"),
        f"And with {len(luck)} other memories, each from another seed:",
        _summary(stages["luck"], "memories"),
        f"Awareness is worth {luck.mean():+.1f} pp ({low:+.1f} … {high:+.1f}) on the mean over "
        f"these memories, whose standard deviation is {luck.std():.1f}; with {100 * (luck > 0).mean():.0f} % of them "
        "awareness helps on the mean.",
    ]


def _short(luck: pd.DataFrame) -> str:
    means = {name: luck[name].mean() for name in (COOPERATIVE, COLLECTIVE, "random-walk", "a-cmommt", "gain")}
    low, high = _interval(luck["gain"])
    return (
        f"From 600 pairs cooperative robots learn to observe {means[COOPERATIVE]:.1f} % of the targets and collective "
        f"ones {means[COLLECTIVE]:.1f} %, on the mean over {len(luck)} explorations; robots that walk at random "
        f"observe {means['random-walk']:.1f} %, and A-CMOMMT {means['a-cmommt']:.1f} %. The gain by awareness is "
        f"{means['gain']:+.1f} pp ({low:+.1f} … {high:+.1f}): which of all explorations it was matters more than any "
        f"constant. The paper's largest gain, 25 ± 8 pp, is met by {100 * luck['learned-gain'].mean():.0f} % of them "
        "at best, in single runs."
    )


def _choice(stages: dict[str, pd.DataFrame], constants: Constants) -> str:
    changed = {name: value for name, value in asdict(constants).items() if value != getattr(Constants(), name)}
    told = ", ".join(f"`{name}={value!r}`" for name, value in changed.items()) or "none"
    winner = lazy_search.chosen_memory(stages["again"])
    return (
        "Constants began as trials before the search had left them: "
        + ", ".join(f"`{name}={value!r}`" for name, value in asdict(Constants()).items())
        + f". Another value takes its place only when it is nearer to the paper by more than {lazy_search.CLEARLY:g} "
        f"standard errors of the difference: {told}. With so many comparisons, one such is to be expected by chance."
        f"\n\nThen the exploration: of the seeds 0 to {len(stages['memory']) - 1} the "
        f"{stages['again']['memory'].nunique()} with which most claims held, and of equals those nearest to the paper, "
        f"were tried again in other worlds; the best there is **seed {winner}**, which ships as "
        "`policies/data/lazy-600.safetensors`. So the shipped exploration is a lucky one, as the paper's may have "
        "been; how lucky, the next two sections tell."
    )


def _summary(trials: pd.DataFrame, unit: str) -> str:
    lines = [["", "mean", "95 % interval of the mean", f"from … to, over {len(trials)} {unit}"], ["---"] * 4]
    for name, column in (
        ("cooperative, 32 inputs [% observed]", COOPERATIVE),
        ("collective, 16 inputs", COLLECTIVE),
        ("random walk", "random-walk"),
        ("A-CMOMMT", "a-cmommt"),
        ("gain: cooperative less collective [pp]", "gain"),
        ("largest gain of the 20 cells, one run each", "largest"),
        ("gain of N ≤ 8 at R ≥ 7", "few"),
    ):
        low, high = _interval(trials[column])
        least, most = trials[column].min(), trials[column].max()
        lines.append([name, f"{trials[column].mean():.1f}", f"{low:.1f} … {high:.1f}", f"{least:.1f} … {most:.1f}"])
    for claim in OPEN_CLAIMS:
        lines.append([f"{claim.name} holds", f"{100 * trials[claim.name].mean():.0f} %", "", ""])
    return _table(lines)


def _luck(trials: pd.DataFrame) -> str:
    low, high = np.quantile(trials["gain"], (0.025, 0.975))
    return (
        f"95 % of the memories lie between {low:+.1f} and {high:+.1f} pp of mean gain (standard deviation "
        f"{trials['gain'].std():.1f}); with {100 * (trials['gain'] > 0).mean():.0f} % of them awareness helps on the "
        f"mean, and {100 * (trials['largest'] >= 17).mean():.0f} % reach a largest gain of 17 pp or more. The interval "
        "of one figure, which is drawn from one memory, says nothing of this.\n\n"
        "Why so much is luck: robots that walk at random hardly come about in 120 steps. In the 600 pairs of one "
        f"exploration a target is acquired {trials['gained'].mean():.0f} times ({trials['gained'].min()} to "
        f"{trials['gained'].max()}), a robot has a teammate in sight in {100 * trials['met'].mean():.0f} % of the "
        f"pairs ({100 * trials['met'].min():.0f} to {100 * trials['met'].max():.0f}), and in "
        f"{100 * (trials['met'] == 0).mean():.0f} % of the explorations never. What the cooperative learner makes of "
        "teammates is therefore an accident: with some memories its robots draw together, with some they part. The "
        "gain and the change of the largest number of neighbours correlate with "
        f"{trials['gain'].corr(trials['crowding']):+.2f}."
    )


def _effects(drawn: pd.DataFrame) -> str:
    columns = {"distance": "distance_from_paper", "gain [pp]": "gain", "cooperative [%]": COOPERATIVE}
    tables = {title: lazy_search.effects(drawn, column) for title, column in columns.items()}
    lines = [["constant", "value", "trials", *columns], ["---"] * (3 + len(columns))]
    for number, row in enumerate(tables["distance"].to_dict("records")):
        shown = [f"{table['mean'][number]:.2f} ± {table['se'][number]:.2f}" for table in tables.values()]
        lines.append([str(row["constant"]), str(row["value"]), str(row["count"]), *shown])
    return _table(lines)


def _variations(varied: pd.DataFrame, constants: Constants) -> str:
    same = {name: varied[name] == getattr(constants, name) for name in VALUES}
    base = varied[np.logical_and.reduce(list(same.values()))].set_index("memory")
    lines = [["constant", "value", "change of gain [pp]", "change of cooperative [pp]"], ["---"] * 4]
    for name in VALUES:
        for value, part in varied[~same[name]].groupby(name):
            changes = [(part.set_index("memory")[column] - base[column]).dropna() for column in ("gain", COOPERATIVE)]
            lines.append([name, str(value), *(_with_interval(change) for change in changes)])
    return f"Chosen: gain {base['gain'].mean():+.1f} pp over {len(base)} memories.\n\n{_table(lines)}"


def _with_interval(values: pd.Series[float]) -> str:
    low, high = _interval(values)
    return f"{values.mean():+.1f} ({low:+.1f} … {high:+.1f})"


def _interval(values: pd.Series[float]) -> tuple[float, float]:
    wide = float(half_width(np.array([values.sem()]), np.array([len(values)]))[0])
    return float(values.mean()) - wide, float(values.mean()) + wide


def _listed(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _table(lines: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


if __name__ == "__main__":
    main()
