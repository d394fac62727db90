"""The search over what the paper of Touzet leaves open: speeds, idle behaviour, weights and gain of the force.

All combinations of values are screened on a coarse grid. The best, and the defaults, are judged again on a finer grid
with other root seeds. The best of these is reported, with each gain, on further root seeds. The page has the
procedure in words. The winner is copied to ``agents/presets.py`` by hand, because a default is a decision.

All root seeds are below 0, which no command accepts, so that the ledger never judges constants on the worlds with which
they were chosen. Results are reported on further worlds, because the best of many candidates is partly the luckiest.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations, product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.papers.reproduction import Paper, PaperPlan
from teamsight.analysis.papers.touzet2000.claims import CLAIMS, Claim, needed
from teamsight.analysis.papers.touzet2000.experiments import LEARNED, experiments_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import canvas
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.experiment import Tables, make_tables
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.seeds import ROOTS
from teamsight.analysis.runs.simulate import Watch

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

#: Values that are searched; of equal settings the first wins. Targets are slower than robots, as in the paper: their
#: speed is given as a ratio.
VALUES: Mapping[str, tuple[Any, ...]] = {
    "robot_speed": (0.1, 0.0769, 0.2),
    "target_speed": (0.75, 0.5),
    "uniform_target_speed": (False,),
    "idle": ("redraw", "wander", "stay"),
    "idle_when": ("no-force",),
    "weights": ("nearest", "shared"),
    "gain": (1.0, 0.5, 2.0),
}
PARAMETERS = list(VALUES)
#: Those that are options of the policy.
OPTIONS = PARAMETERS[3:]
#: Options that are not searched, each with a value that is not its default. The paper does not mention them, and they
#: would be chosen by the claims that they decide.
UNSEARCHED: Mapping[str, Any] = {"arrive": False}
#: The claims that depend on these parameters and can be decided. Claims about learned policies depend on constants of
#: their own, and do not decide.
OPEN_CLAIMS = {
    name: claim for name, claim in CLAIMS.items() if claim.rule and claim.needs and not LEARNED & set(claim.needs)
}
FINALISTS = 5
# Limit of a claim's distance in the score, so that one claim cannot outweigh all others.
_FARTHEST = 5.0
# Candidates whose runs are made together. Runs that several candidates share are made once.
_BATCH = 36
# Left out of the screening: each reads a further surface, and holds, or fails, under nearly every setting.
_LATER = ("range-gain", "range-neighbours", "delta-sufficient")
_COARSE = Grid((1, 2, 5, 10, 20, 30), (1.0, 2.0, 3.0, 5.0, 8.0, 9.0))
_FINER = Grid((1, 2, 5, 10, 20, 30), tuple(float(radius) for radius in range(1, 10)))
_UNKNOWN = "–"


_PAGE = """
# Calibration

The paper leaves open the speeds, what an idle robot does, how robots share a target, and how the length of a force
becomes a speed: min(gain · |F|, 1) times the robot's speed. `teamsight calibrate --out docs` searches these constants
and writes this page; the preset `touzet2000` is its result.

## Procedure

It was fixed before this search. That a gain of 0.5 agrees with several figures of the paper was known, from a trial
with other root seeds.

1. **Values.** All {combinations} combinations: robot_speed {listed[robot_speed]}; target_speed {listed[target_speed]}
times that; uniform_target_speed {listed[uniform_target_speed]}; {options}. All else has its default; what was worse or
made little difference in an earlier search, on other root seeds, is left out.
2. **Claims.** The {open} claims of the [ledger](claims.md) that simulation of designed policies can check, without
those about learning and those in closed form.
3. **Screening.** Every combination on {worlds[screen]}, root seed {roots[screen]}, without {later}, which need a
surface each.
4. **Final.** The best {finalists}, and the defaults, on {worlds[final]}, root seeds {roots[final]}, all claims.
5. **Rank.** The mean number of claims that hold; then the mean distance of the claims from the paper's figures, in
tolerances of their rules, cut at 5. The first of the final becomes the preset.
6. **Report.** The preset, the preset with each other gain, and the defaults, once more on the grid of the final, root
seeds {roots[report]}; and the preset with a value that was not searched. This decides nothing. No ledger meets the
worlds of any root seed here.

## Result

The best setting: {best}.

{in_final}

{in_report}

{no_longer}

## What the gain decides

The gain of the force was chosen by the claims that it decides. That they hold with the gain of the preset is an
explanation of the paper's figures, not evidence for them. Claims whose verdict changes with the gain under the best
setting: {hang}.

Share of root seeds of the report under which a claim holds under the best setting with this gain, and of all screened
settings with it:

![The table below: the share of seeds, and of settings, under which each claim holds, by gain](images/calibration.png)

{by_gain}

## What was not searched

{unsearched}

## The best settings in the final

{ranking}

“Hold” is the number of claims that hold, mean and range over the root seeds; “differ” lists the claims that hold under
no root seed or, in brackets, not under all. Settings whose ranges overlap are not significantly different.

## Effect of each value

Claims that hold in the screening: the largest number and the mean over the other parameters.

{effects}

## What no setting satisfies

Over the {screened} screened settings and those of the final and the report; other seeds might change this:

Claims that hold under no setting: {never}.

Pairs of claims that each hold under some setting, but never both:

{pairs}
"""


class Phase(NamedTuple):
    """One pass over candidates.

    Attributes
    ----------
    name : str
        Value of the column `phase`.
    grid : Grid
        Team sizes and radii.
    roots : tuple of int
        Root seeds; each candidate is judged on each of them.
    claims : mapping of str to Claim
        The claims that are judged.
    runs, steps : int
        Runs of each cell, and steps of each run.
    """

    name: str
    grid: Grid
    roots: tuple[int, ...]
    claims: Mapping[str, Claim]
    runs: int
    steps: int = 600


SCREEN = Phase(
    "screen", _COARSE, ROOTS["calibration: screen"],
    {name: claim for name, claim in OPEN_CLAIMS.items() if name not in _LATER}, runs=3,
)  # fmt: skip
FINAL = Phase("final", _FINER, ROOTS["calibration: final"], OPEN_CLAIMS, runs=5)
REPORT = Phase("report", _FINER, ROOTS["calibration: report"], OPEN_CLAIMS, runs=5)
# The name of the phase that judges what was not searched, on the worlds of the report.
_BESIDE = "unsearched"


def candidates() -> list[dict[str, Any]]:
    """Return all combinations of values. Those that differ only in policy options are neighbours and share runs."""
    found = [dict(zip(PARAMETERS, values, strict=True)) for values in product(*VALUES.values())]
    return [one | {"target_speed": round(one["target_speed"] * one["robot_speed"], 6)} for one in found]


def defaults() -> dict[str, Any]:
    """Return the values of CMOMMT and of A-CMOMMT when none is given."""
    from teamsight.policies import ACmommt

    policy = ACmommt()
    return {name: getattr(policy, name) if name in OPTIONS else DEFAULTS[name] for name in PARAMETERS}


def setting_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword parameters of CMOMMT for values of `PARAMETERS`, and of `UNSEARCHED` if there are any."""
    setting = {name: values[name] for name in PARAMETERS if name not in OPTIONS}
    return setting | {"policy_options": {name: values[name] for name in (*OPTIONS, *UNSEARCHED) if name in values}}


def search(
    pool: Executor | None = None,
    watch: Watch = lambda phase, done, total: None,
    checkpoint: Checkpoint | None = None,
) -> pd.DataFrame:
    """Screen all combinations of values, judge the best of them and the defaults, and report the winner.

    The report is followed by the winner with each value of `UNSEARCHED`.

    Parameters
    ----------
    pool, watch, checkpoint
        See `assess`.

    Returns
    -------
    DataFrame
        See `assess`. The ranking of the final decides; what follows decides nothing.
    """
    how = pool, watch, checkpoint
    rows = assess(SCREEN, candidates(), *how)
    best = ranked(pd.DataFrame(rows))[PARAMETERS].head(FINALISTS).to_dict("records")
    final = assess(FINAL, _with_defaults(best), *how)
    winner = best_of(pd.DataFrame(final))
    gains = [winner, *(winner | {"gain": gain} for gain in VALUES["gain"] if gain != winner["gain"])]
    report = assess(REPORT, _with_defaults(gains), *how)
    other = [{**winner, name: value} for name, value in UNSEARCHED.items()]
    return pd.DataFrame(rows + final + report + assess(REPORT._replace(name=_BESIDE), other, *how))


def _with_defaults(values: list[dict[Any, Any]]) -> list[dict[Any, Any]]:
    return values if defaults() in values else [*values, defaults()]


def assess(
    phase: Phase,
    tried: Sequence[Mapping[str, Any]],
    pool: Executor | None = None,
    watch: Watch = lambda phase, done, total: None,
    checkpoint: Checkpoint | None = None,
) -> list[dict[str, Any]]:
    """Simulate candidates, and return one row for each of them and each root seed.

    Parameters
    ----------
    phase : Phase
        Worlds and claims.
    tried : sequence of mapping
        Values of `PARAMETERS`.
    pool : Executor, optional
        Processes that do the work; by default this process.
    watch : callable
        Called with the phase, the candidates done in it and all its candidates.
    checkpoint : Checkpoint, optional
        File of finished runs, which are not made again.

    Returns
    -------
    list of dict
        Columns phase, the values, root, holding, distance_from_paper, and one for each claim: whether it holds.
    """
    rows: list[dict[str, Any]] = []
    experiments = experiments_of(needed(phase.claims.values(), beside=False))
    for first in range(0, len(tried), _BATCH):
        batch = tried[first : first + _BATCH]
        made: list[list[dict[str, pd.DataFrame]]] = []
        for root in phase.roots:

            def progress(done: float, total: float, start: int = first, share: float = len(batch) / len(phase.roots),
                         before: int = len(made)) -> None:  # fmt: skip
                watch(phase.name, start + share * (before + done / max(total, 1.0)), len(tried))

            made.append(
                make_tables(
                    [(setting_of(values), experiments) for values in batch], pool, grid=phase.grid, root=root,
                    runs=phase.runs, steps=phase.steps, progress=progress, checkpoint=checkpoint,
                )
            )  # fmt: skip
        rows += [
            {"phase": phase.name, **values, "root": root, **score(tables, phase.claims)}
            for values, by_root in zip(batch, zip(*made, strict=True), strict=True)
            for root, tables in zip(phase.roots, by_root, strict=True)
        ]
    return rows


def score(tables: Tables, claims: Mapping[str, Claim]) -> dict[str, Any]:
    """Return the number of claims that hold, their mean distance from the paper's figures, and whether each holds."""
    found = {name: claim.judge(tables) for name, claim in claims.items()}
    distance = sum(min(one.distance, _FARTHEST) for one in found.values()) / len(found)
    holds = {name: one.holds for name, one in found.items()}
    return {"holding": sum(map(bool, holds.values())), "distance_from_paper": distance, **holds}


def ranked(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each candidate, best first: most claims hold, then the least distance from the paper.

    Returns
    -------
    DataFrame
        The values; means over the root seeds of holding, of distance_from_paper and of each claim that all rows judge;
        the smallest and the largest holding in fewest and most.
    """
    claims = [name for name in _claims_of(table) if table[name].notna().all()]
    grouped = table.astype(dict.fromkeys(claims, float)).groupby(PARAMETERS, sort=False)
    means = grouped[["holding", "distance_from_paper", *claims]].mean()
    extremes = grouped.agg(fewest=("holding", "min"), most=("holding", "max"))
    return means.join(extremes).reset_index().sort_values(
        ["holding", "distance_from_paper"], ascending=[False, True], kind="stable", ignore_index=True
    )  # fmt: skip


def best_of(final: pd.DataFrame) -> dict[str, Any]:
    """Return the values of the best setting of the final, which become the preset."""
    return {str(name): value for name, value in ranked(final)[PARAMETERS].to_dict("records")[0].items()}


def _claims_of(table: pd.DataFrame) -> list[str]:
    """Return the open claims that a table judges. A table that was made before a claim was added leaves it out."""
    return [name for name in OPEN_CLAIMS if name in table]


def never_together(table: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the pairs of claims that each hold under some setting, but never both under one.

    Only rows in which both were judged count, because the screening leaves out some claims.
    """
    pairs = {pair: table[[*pair]].dropna().astype(bool) for pair in combinations(_claims_of(table), 2)}
    return [pair for pair, both in pairs.items() if both.any().all() and not both.all(axis=1).any()]


def page_values(table: pd.DataFrame, plan: PaperPlan) -> dict[str, Any]:
    """Return the values of the page about a table that `search` returned."""
    screened, final, report = (table[table["phase"] == phase.name] for phase in (SCREEN, FINAL, REPORT))
    best = best_of(final)
    like = _like_the_best(table)
    shares = _by_gain(table)
    hang = [name for name, *shares in shares.values.tolist() if len({*shares[: len(VALUES["gain"])]} - {_UNKNOWN}) > 1]
    searched = table[table["phase"] != _BESIDE]
    never = [name for name in _claims_of(table) if not searched[name].eq(True).any()]
    effects = (
        [name, str(value), f"{most}", f"{mean:.1f}"]
        for name in PARAMETERS
        for value, most, mean in screened.groupby(name)["holding"].agg(["max", "mean"]).itertuples()
    )
    return {
        "combinations": len(candidates()), "open": len(OPEN_CLAIMS), "later": ", ".join(_LATER), "finalists": FINALISTS,
        "listed": {name: _listed(values) for name, values in VALUES.items()},
        "options": "; ".join(f"{name} {_listed(VALUES[name])}" for name in OPTIONS),
        "worlds": {phase.name: _worlds(phase) for phase in (SCREEN, FINAL)},
        "roots": {phase.name: _listed(phase.roots) for phase in (SCREEN, FINAL, REPORT)},
        "best": ", ".join(f"`{name}={value!r}`" for name, value in best.items()),
        "in_final": _beside_the_defaults(best, final, "In the final"),
        "in_report": _beside_the_defaults(best, report, "In the report, on worlds that chose nothing,"),
        "no_longer": _no_longer_judged(table), "hang": ", ".join(hang) or "none",
        "by_gain": markdown.table([*shares], shares.values.tolist()),
        "unsearched": _unsearched(table, like[like["gain"] == best["gain"]]),
        "ranking": markdown.table(
            [*PARAMETERS, "hold", "distance", "differ"], map(_row, ranked(final).to_dict("records"))
        ),
        "effects": markdown.table(["parameter", "value", "best", "mean"], effects),
        "screened": len(screened), "never": ", ".join(never) or "none",
        "pairs": "\n".join(f"- {' and '.join(pair)}" for pair in never_together(searched)) or "- none",
    }  # fmt: skip


def _like_the_best(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the report that differ from the best setting in the gain at most."""
    best, report = best_of(table[table["phase"] == FINAL.name]), table[table["phase"] == REPORT.name]
    others = [name for name in best if name != "gain"]
    return report[(report[others] == report[others].iloc[0]).all(axis=1)]


def _by_gain(table: pd.DataFrame) -> pd.DataFrame:
    """Return the share of root seeds, and of screened settings, under which a claim holds with each gain, as texts."""
    like, screened = _like_the_best(table), table[table["phase"] == SCREEN.name]
    columns = {"claim": _claims_of(table[table["phase"] == REPORT.name])}
    for where, of in (("", like), ("screened, ", screened)):
        for gain in sorted(VALUES["gain"]):
            shares = [_share(of.loc[of["gain"] == gain, name]) for name in columns["claim"]]
            columns[f"{where}gain {gain:g}"] = shares
    return pd.DataFrame(columns)


def draw(table: pd.DataFrame, plan: PaperPlan | None = None) -> Canvas:
    """Return the claims that hold with each gain, as a map; for the parameters see `page_values`."""
    by_gain = _by_gain(table)
    names, *columns = (by_gain[name].tolist() for name in by_gain)
    texts = [["nan" if text == _UNKNOWN else text.removesuffix(" %") for text in one] for one in columns]
    shares = np.array(texts, np.float64).T
    figure = canvas(6.4, 5.6)
    figure.set(dpi=200, layout_engine="constrained")
    axes = figure.add_subplot()
    axes.imshow(shares, aspect="auto", cmap="Blues", vmin=0, vmax=100)
    for (row, column), share in np.ndenumerate(shares):
        colour = "white" if share > 55 else "black"
        axes.text(column, row, columns[column][row], ha="center", va="center", size=8, color=colour)
    axes.axvline(len(VALUES["gain"]) - 0.5, color="black", lw=1.5)
    axes.set_yticks(range(len(names)), names, size=8)
    heads = [head.replace(", ", ",\n") if "," in head else f"best setting,\n{head}" for head in [*by_gain][1:]]
    axes.set_xticks(range(len(heads)), heads, size=8)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    return figure


def _listed(values: Iterable[Any]) -> str:
    return ", ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values)


def _worlds(phase: Phase) -> str:
    robots, radius = map(_listed, phase.grid)
    return f"N = {robots} and R = {radius}, {phase.runs} runs of {phase.steps} steps a cell"


def _beside_the_defaults(best: Mapping[str, Any], table: pd.DataFrame, where: str) -> str:
    rows = ranked(table).to_dict("records")
    found = [[row for row in rows if values.items() <= row.items()] for values in (best, defaults())]
    if not all(found):
        return f"{where} the best setting and the defaults were not both judged."
    (one, *_), (other, *_) = found
    judging = sum(bool(table[name].notna().all()) for name in _claims_of(table))
    overlap = one["fewest"] <= other["most"] and other["fewest"] <= one["most"]
    return (
        f"{where} {one['holding']:.1f} ({one['fewest']}–{one['most']}) of {judging} claims hold under it, at a "
        f"mean distance of {one['distance_from_paper']:.2f}; under the defaults {other['holding']:.1f} "
        f"({other['fewest']}–{other['most']}), at {other['distance_from_paper']:.2f}. The two ranges "
        f"{'overlap' if overlap else 'do not overlap'}."
    )


def _unsearched(table: pd.DataFrame, best: pd.DataFrame) -> str:
    """Return which claims another value of `UNSEARCHED` decides under the best setting, in words and as a table."""
    beside = table[table["phase"] == _BESIDE]
    rows = [
        [f"{option}={value}", name, *shares]
        for option, value in UNSEARCHED.items()
        if option in beside
        for name in _claims_of(beside)
        if len({*(shares := [_share(of[name]) for of in (best, beside[beside[option].notna()])])}) > 1
    ]
    judged = [f"`{option}={value}`" for option, value in UNSEARCHED.items() if option in beside]
    if not judged:
        return "Nothing."
    return "\n\n".join((
        f"The paper does not mention {', '.join(judged)}, and no claim chose the default. Share of root seeds of the "
        "report under which a claim holds under the best setting, and with this value; the claims that it decides:",
        markdown.table(["value", "claim", "default", "with the value"], rows),
    ))  # fmt: skip


def _no_longer_judged(table: pd.DataFrame) -> str:
    """Return which claims the search judged that have no rule any more, in words; empty if there are none."""
    held = ", ".join(
        f"{name} ({int(table[name].eq(True).sum())} times)"
        for name, claim in CLAIMS.items()
        if not claim.rule and name in table
    )
    return held and (
        f"When the search was made, it also judged what is not decidable any more; how often it held: {held}. Its "
        "distance is part of the mean distances of the final and of the report."
    )


def _row(row: Mapping[Any, Any]) -> list[str]:
    doubtful = [name for name in OPEN_CLAIMS if row.get(name, 1) < 1]
    differ = ", ".join(name if row[name] == 0 else f"({name})" for name in doubtful) or "none"
    holding = f"{row['holding']:.1f} ({row['fewest']}–{row['most']})"
    return [*(str(row[name]) for name in PARAMETERS), holding, f"{row['distance_from_paper']:.2f}", differ]


def _share(holds: pd.Series[bool]) -> str:
    return f"{100 * holds.eq(True).mean():.0f} %" if holds.notna().any() else _UNKNOWN


#: The search, as what it makes: the table of all trials, and the page about them.
SEARCH = Paper(
    plan=PaperPlan, name="calibration", template=_PAGE, values=page_values, figures={"images/calibration": draw},
    make=lambda plan, *how: search(*how), sentences=lambda table, plan: [f"best: {best_of(table)}"],
)  # fmt: skip
