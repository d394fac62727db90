"""Compiles what the runs of a study need, in one worker, so that no two workers compile the same kernels."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from teamsight.analysis.studies.definition.values import hex_of
from teamsight.analysis.studies.failure import failure_of
from teamsight.analysis.studies.resolved import Resolved
from teamsight.analysis.studies.same_code import check_same_code
from teamsight.analysis.studies.shard import Common, Shard
from teamsight.analysis.studies.shard_run import ShardRun

if TYPE_CHECKING:
    from teamsight.analysis.studies.plan import Plan

# Settings that are examined, and kinds of runs that are made.
_MOST_EXAMINED, _MOST_KINDS = 256, 32


def one_of_each_kind(plan: Plan, common: Common) -> Shard:
    """Return a run for each combination of values that are no numbers, since numbers do not change what is compiled."""
    # Alike settings follow each other, so these meet all kinds that have many settings.
    places = np.linspace(0, plan.settings - 1, min(plan.settings, _MOST_EXAMINED)).astype(int)
    kinds: dict[str, ShardRun] = {}
    for setting in plan.order[places].tolist():
        parameters = plan.parameters(setting)
        kind = repr({name: parameters.get(name) for name, type_ in common.types.items() if type_ in ("text", "flag")})
        if len(kinds) < _MOST_KINDS and kind not in kinds:
            kinds[kind] = ShardRun(hex_of(plan.ids[setting]), 0, plan.seed(setting, 0), parameters)
    return Shard(common, tuple(kinds.values()))


def warm_up(shard: Shard) -> None:
    """Make one step of each run; errors are left to the runs themselves.

    Raises
    ------
    SourceError
        If this process has another version of the code.
    """
    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.analysis.runs.simulate import announcing

    common = shard.common
    check_same_code(common)
    with contextlib.closing(ReusedWorlds()) as worlds, announcing(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with _left_to_the_runs():
            resolved = Resolved(common.model, common.record.measure, common.path)
            for run in shard.runs:
                with _left_to_the_runs():
                    worlds.begin(resolved.model, resolved.parameters(run.parameters), run.seed).run(1)


@contextlib.contextmanager
def _left_to_the_runs() -> Iterator[None]:
    """Pass over what the runs themselves keep as their failure, such as the `SystemExit` of a model."""
    try:
        yield
    except BaseException as error:
        failure_of(error)  # raises an interrupt of this process again
