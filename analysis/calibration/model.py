"""The search over what the paper leaves open of its model: speeds, idle behaviour, weights and gain of the force.

All combinations of values are screened on a coarse grid. The best, and the defaults, are judged again on a finer grid
with other root seeds. The best of these is reported, with each gain, on further root seeds. `model_page` has the
procedure in words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, product
from typing import Any

import pandas as pd

from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.calibration.search import HERE, Candidate, Phase, Simulator, assess, ranking
from teamsight.analysis.paper.claims import CLAIMS, Claim, needed
from teamsight.analysis.paper.experiments import chosen
from teamsight.analysis.paper.lazy_teams import LEARNED
from teamsight.analysis.runs.experiment import Grid, Request
from teamsight.analysis.runs.seeds import ROOTS

#: Values that are searched; of equal settings the first wins. Targets are slower than robots, as in the paper.
ROBOT_SPEEDS = (0.1, 0.0769, 0.2)
TARGET_RATIOS = (0.75, 0.5)
UNIFORM = (False,)
GAINS = (1.0, 0.5, 2.0)
OPTIONS: Mapping[str, tuple[Any, ...]] = {
    "idle": ("redraw", "wander", "stay"),
    "idle_when": ("no-force",),
    "weights": ("nearest", "shared"),
    "gain": GAINS,
}
PARAMETERS = ("robot_speed", "target_speed", "uniform_target_speed", *OPTIONS)
#: The claims that depend on these parameters and can be decided. Claims about learned policies depend on constants of
#: their own, and do not decide.
OPEN_CLAIMS = {
    name: claim for name, claim in CLAIMS.items() if claim.rule and claim.needs and not LEARNED & set(claim.needs)
}

# Left out of the screening: each reads a further surface, and holds, or fails, under nearly every setting.
_LATER = {"range-gain", "range-neighbours", "delta-sufficient"}
_SCREENED = {name: claim for name, claim in OPEN_CLAIMS.items() if name not in _LATER}
_COARSE = Grid((1, 2, 5, 10, 20, 30), (1.0, 2.0, 3.0, 5.0, 8.0, 9.0))
_FINER = Grid((1, 2, 5, 10, 20, 30), tuple(float(radius) for radius in range(1, 10)))
SCREEN = Phase("screen", _COARSE, ROOTS["calibration: screen"], _SCREENED, runs=3)
FINAL = Phase("final", _FINER, ROOTS["calibration: final"], OPEN_CLAIMS, runs=5)
REPORT = Phase("report", _FINER, ROOTS["calibration: report"], OPEN_CLAIMS, runs=5)
PHASES = (SCREEN, FINAL, REPORT)
FINALISTS = 5


def candidates() -> list[dict[str, Any]]:
    """Return all combinations of values. Those that differ only in policy options are neighbours and share runs."""
    options = list(product(*OPTIONS.values()))
    return [
        dict(zip(PARAMETERS, (speed, round(ratio * speed, 6), uniform, *option), strict=True))
        for speed, ratio, uniform in product(ROBOT_SPEEDS, TARGET_RATIOS, UNIFORM)
        for option in options
    ]


def defaults() -> dict[str, Any]:
    """Return the values of CMOMMT and of A-CMOMMT when none is given."""
    from teamsight.policies import ACmommt

    policy = ACmommt()
    return {name: getattr(policy, name) if name in OPTIONS else DEFAULTS[name] for name in PARAMETERS}


def setting_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword parameters of CMOMMT for values of `PARAMETERS`."""
    options = {name: values[name] for name in OPTIONS}
    return {name: values[name] for name in PARAMETERS if name not in OPTIONS} | {"policy_options": options}


def search(
    simulator: Simulator = HERE,
    *,
    values: Sequence[Mapping[str, Any]] | None = None,
    phases: tuple[Phase, Phase, Phase] = PHASES,
    finalists: int = FINALISTS,
) -> pd.DataFrame:
    """Screen all combinations of values, judge the best of them and the defaults, and report the winner.

    Parameters
    ----------
    simulator : Simulator
        How the runs are made.
    values : sequence of mapping, optional
        Values of `PARAMETERS`; by default those of `candidates`.
    phases : tuple of Phase
        Screening, final and report.
    finalists : int
        How many of the screened are judged again.

    Returns
    -------
    DataFrame
        See `assess`. The ranking of the final decides; the report decides nothing.
    """
    tried = candidates() if values is None else list(values)
    rows = assess(phases[0], tried, candidate_of, simulator)
    order = ranked(pd.DataFrame(rows))[list(PARAMETERS)]
    best: list[Mapping[Any, Any]] = [*order.head(finalists).to_dict("records")]
    again = best if defaults() in best else [*best, defaults()]
    final = assess(phases[1], again, candidate_of, simulator)
    winner = best_of(pd.DataFrame(final))
    gains = [winner, *(winner | {"gain": gain} for gain in GAINS if gain != winner["gain"])]
    reported = [*gains, *([] if defaults() in gains else [defaults()])]
    return pd.DataFrame(rows + final + assess(phases[2], reported, candidate_of, simulator))


def best_of(final: pd.DataFrame) -> dict[str, Any]:
    """Return the values of the best setting of the final, which become the preset."""
    return {str(name): value for name, value in ranked(final)[list(PARAMETERS)].to_dict("records")[0].items()}


def candidate_of(values: Mapping[str, Any], phase: Phase) -> Candidate:
    """Return the candidate with these values, and the experiments that the claims of a phase read."""
    setting = setting_of(values)
    return Candidate(values, Request(setting, chosen(needed(phase.claims, beside=False), phase.grid, setting)))


def ranked(table: pd.DataFrame) -> pd.DataFrame:
    """Return the ranking of settings, with the share of root seeds under which each claim holds."""
    complete = [name for name in judged(table) if table[name].notna().all()]
    return ranking(table, PARAMETERS, complete)


def judged(table: pd.DataFrame) -> dict[str, Claim]:
    """Return the open claims that a table judges. A table that was made before a claim was added leaves it out."""
    return {name: claim for name, claim in OPEN_CLAIMS.items() if name in table}


def never(table: pd.DataFrame) -> list[str]:
    """Return the claims that hold under no setting."""
    return [name for name in judged(table) if not table[name].eq(True).any()]


def never_together(table: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the pairs of claims that each hold under some setting, but never both under one.

    Only rows in which both were judged count, because the screening leaves out some claims.
    """

    def excluded(first: str, second: str) -> bool:
        both = table[[first, second]].dropna().astype(bool)
        return bool(both.any().all() and not both.all(axis=1).any())

    return [pair for pair in combinations(judged(table), 2) if excluded(*pair)]
