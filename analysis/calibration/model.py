"""The search over what the paper leaves open of its model: speeds, idle behaviour and the weights of targets.

All combinations of values are screened on a coarse grid. The best, and the defaults, are judged again on the paper's
grid with other root seeds.
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
from teamsight.analysis.runs.experiment import PAPER, QUICK, Request
from teamsight.analysis.runs.seeds import ROOTS

#: Values that are searched. Targets are slower than robots, as in the paper.
ROBOT_SPEEDS = (0.0769, 0.1, 0.15, 0.2, 0.3)
TARGET_RATIOS = (0.5, 0.75)
UNIFORM = (False, True)
OPTIONS: Mapping[str, tuple[str, ...]] = {
    "idle": ("redraw", "wander", "stay"),
    "idle_when": ("no-force", "nothing-sensed"),
    "weights": ("nearest", "shared", "per-teammate", "none"),
}
PARAMETERS = ("robot_speed", "target_speed", "uniform_target_speed", *OPTIONS)
#: The claims that depend on these parameters. Claims about learned policies depend on constants that have a search of
#: their own, and do not decide the speeds.
OPEN_CLAIMS = {name: claim for name, claim in CLAIMS.items() if claim.needs and not LEARNED & set(claim.needs)}

# Left out of the screening: they read further experiments, and hold under nearly every setting.
_LATER = {"range-gain", "range-neighbours", "delta-sufficient"}
_SCREENED = {name: claim for name, claim in OPEN_CLAIMS.items() if name not in _LATER}
SCREEN = Phase("screen", QUICK, ROOTS["calibration: screen"], _SCREENED, runs=3)
FINAL = Phase("final", PAPER, ROOTS["calibration: final"], OPEN_CLAIMS, runs=5)
FINALISTS = 10


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
    phases: tuple[Phase, Phase] = (SCREEN, FINAL),
    finalists: int = FINALISTS,
) -> pd.DataFrame:
    """Screen all combinations of values, then judge the best of them and the defaults.

    Parameters
    ----------
    simulator : Simulator
        How the runs are made.
    values : sequence of mapping, optional
        Values of `PARAMETERS`; by default those of `candidates`.
    phases : tuple of Phase
        Screening and final.
    finalists : int
        How many of the screened are judged again.

    Returns
    -------
    DataFrame
        See `assess`. The ranking of the final decides.
    """
    tried = candidates() if values is None else list(values)
    rows = assess(phases[0], tried, candidate_of, simulator)
    order = ranked(pd.DataFrame(rows))[list(PARAMETERS)]
    best: list[Mapping[Any, Any]] = [*order.head(finalists).to_dict("records")]
    again = best if defaults() in best else [*best, defaults()]
    return pd.DataFrame(rows + assess(phases[1], again, candidate_of, simulator))


def candidate_of(values: Mapping[str, Any], phase: Phase) -> Candidate:
    """Return the candidate with these values, and the experiments that the claims of a phase read."""
    setting = setting_of(values)
    return Candidate(values, Request(setting, chosen(needed(phase.claims), phase.grid, setting)))


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
