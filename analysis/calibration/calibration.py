"""Calibration: which values of what the paper leaves open agree with most of its claims.

The search uses root seeds below 0, which no command accepts, so that the ledger never judges a setting on noise that
helped to choose it. Every combination is screened on a coarse grid; the best are judged again on the paper's grid with
other noise, since the best of hundreds is partly the luckiest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import pandas as pd

from teamsight.analysis.paper.claims import CLAIMS, Claim, Verdict, judge, needed
from teamsight.analysis.paper.experiments import LEARNED, chosen
from teamsight.analysis.runs.experiment import PAPER, QUICK, Grid, Request, make_tables
from teamsight.analysis.runs.seeds import ROOTS
from teamsight.analysis.runs.workers import WorkerPool

#: What is searched; targets are always slower than robots, as the paper says.
ROBOT_SPEEDS = (0.0769, 0.1, 0.15, 0.2, 0.3)
TARGET_RATIOS = (0.5, 0.75)
UNIFORM = (False, True)
SEARCHES = ("redraw", "wander", "stay")
OCCASIONS = ("no-force", "nothing-sensed")
WEIGHTS = ("nearest", "shared", "per-teammate", "none")
#: The claims that a setting can change: those that rest on simulation. Learned behaviour has open constants of its own,
#: and a search of its own (docs/lazy-search.md): it has no say in how fast robots are.
OPEN_CLAIMS = tuple(claim for claim in CLAIMS if claim.needs and not LEARNED & set(claim.needs))
OPTIONS = ("idle", "idle_when", "weights")
PARAMETERS = ("robot_speed", "target_speed", "uniform_target_speed", *OPTIONS)

# One claim that is far off shall not outweigh all others.
_FARTHEST = 5.0


class Stage(NamedTuple):
    """One pass over settings."""

    name: str
    grid: Grid
    runs: int
    roots: tuple[int, ...]
    claims: tuple[Claim, ...]


# What needs surfaces of its own and held under nearly every setting of a first trial is left to the final.
_LATER = {"range-gain", "range-neighbours", "delta-sufficient"}
_SCREENED = tuple(claim for claim in OPEN_CLAIMS if claim.name not in _LATER)
SCREEN = Stage("screen", QUICK, 3, ROOTS["calibration: screen"], _SCREENED)
FINAL = Stage("final", PAPER, 5, ROOTS["calibration: final"], OPEN_CLAIMS)
FINALISTS = 10
#: The defaults of CMOMMT, which the best are measured against.
DEFAULT_VALUES = (0.1, 0.075, False, "redraw", "no-force", "nearest")


def candidates() -> list[dict[str, Any]]:
    """Return every setting; those that differ only in the rules of a policy stand together and share runs."""
    rules = list(product(SEARCHES, OCCASIONS, WEIGHTS))
    return [
        dict(zip(PARAMETERS, (speed, round(ratio * speed, 6), uniform, *rule), strict=True))
        for speed, ratio, uniform in product(ROBOT_SPEEDS, TARGET_RATIOS, UNIFORM)
        for rule in rules
    ]


def model_setting(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword parameters of CMOMMT for the values of `PARAMETERS`; `OPTIONS` are policy options."""
    options = {name: values[name] for name in OPTIONS}
    return {**{name: values[name] for name in PARAMETERS if name not in OPTIONS}, "policy_options": options}


def score(verdicts: Mapping[str, Verdict]) -> tuple[int, float]:
    """Return how many claims hold, and the mean distance from the paper's figures, in tolerances, clipped."""
    holding = sum(found.holds for found in verdicts.values())
    return holding, sum(min(found.distance, _FARTHEST) for found in verdicts.values()) / len(verdicts)


def assess(
    pool: WorkerPool, settings: Sequence[Mapping[str, Any]], stage: Stage, steps: int, done: Callable[[int], None]
) -> pd.DataFrame:
    """Return one row for each setting and root: the setting, stage, root, holding, distance, and each claim's verdict.

    Parameters
    ----------
    pool : WorkerPool
        Who does the work.
    settings : sequence of mapping
        Values of `PARAMETERS`.
    stage : Stage
        Over which grid and seeds.
    steps : int
        Length of each run.
    done : callable
        Called with the number of settings done since the last call.
    """
    batch = len(SEARCHES) * len(OCCASIONS) * len(WEIGHTS)
    rows = []
    for start in range(0, len(settings), batch):
        some = settings[start : start + batch]
        for root in stage.roots:
            requests = [
                Request(setting, chosen(needed(stage.claims), stage.grid, setting))
                for setting in map(model_setting, some)
            ]
            made = make_tables(requests, pool, root=root, runs=stage.runs, steps=steps)
            for setting, tables in zip(some, made, strict=True):
                verdicts = judge(tables, stage.claims)
                holding, distance = score(verdicts)
                head = {"stage": stage.name, "root": root, "holding": holding, "distance": distance}
                rows.append({**setting, **head, **{name: found.holds for name, found in verdicts.items()}})
        done(len(some))
    return pd.DataFrame(rows)


def ranking(assessed: pd.DataFrame) -> pd.DataFrame:
    """Return one row a setting, best first: most claims holding on the mean over roots, then the least distance.

    The columns fewest and most tell how far the number that hold varies with the root.
    """
    claims = [claim.name for claim in OPEN_CLAIMS if claim.name in assessed and assessed[claim.name].notna().all()]
    scores = assessed[[*PARAMETERS, "holding", "distance", *claims]].astype(dict.fromkeys(claims, float))
    grouped = scores.groupby(list(PARAMETERS), sort=False)
    spread = grouped.agg(fewest=("holding", "min"), most=("holding", "max"))
    means = grouped.mean().join(spread).reset_index()
    return means.sort_values(["holding", "distance"], ascending=[False, True], kind="stable", ignore_index=True)


def search(
    pool: WorkerPool,
    *,
    settings: Sequence[Mapping[str, Any]] | None = None,
    stages: tuple[Stage, Stage] = (SCREEN, FINAL),
    finalists: int = FINALISTS,
    steps: int = 600,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> pd.DataFrame:
    """Return the assessment of every setting in the first stage, and in the second of the best and of the defaults.

    Returns
    -------
    DataFrame
        See `assess`; the rows of the last stage decide, by `ranking`.
    """
    settings = candidates() if settings is None else settings
    total, finished = len(settings) + min(finalists, len(settings)) + 1, 0

    def done(count: int) -> None:
        nonlocal finished
        finished += count
        progress(finished, total)

    screened = assess(pool, settings, stages[0], steps, done)
    best = ranking(screened).head(finalists)
    again = [{name: row[name] for name in PARAMETERS} for row in best.to_dict("records")]
    default = dict(zip(PARAMETERS, DEFAULT_VALUES, strict=True))
    again += [default] if default not in again else []
    return pd.concat([screened, assess(pool, again, stages[1], steps, done)], ignore_index=True)


def never(assessed: pd.DataFrame) -> list[str]:
    """Return the claims that hold under no setting."""
    return [claim.name for claim in OPEN_CLAIMS if not assessed[claim.name].eq(True).any()]


def never_together(assessed: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the pairs of claims of which each holds under some setting, but never both under one.

    Only where both were judged: the screen leaves out some claims.
    """
    names = [claim.name for claim in OPEN_CLAIMS]
    judged = assessed[names].notna().to_numpy(dtype=int)
    holds = assessed[names].eq(True).to_numpy(dtype=int)
    # [first, second]: in how many rows first holds and second was judged; in how many both hold.
    alone, both = holds.T @ judged, holds.T @ holds
    return [
        (first, second)
        for row, first in enumerate(names)
        for column, second in enumerate(names)
        if row < column and alone[row, column] and alone[column, row] and not both[row, column]
    ]
