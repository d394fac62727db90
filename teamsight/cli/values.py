"""Kinds of values that only commands take: files, folders, names of what is installed, and parts of a whole."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.agents.settings import PRESETS
from teamsight.cli import limits, paths
from teamsight.core import checks
from teamsight.core.component import Allowed, number_in
from teamsight.policies.registry import POLICIES


def _argument(metavar: str, kind: str) -> Allowed:
    return Allowed(check=partial(paths.path, wanted=kind), metavar=metavar, is_argument=True)


File = Annotated[Path, Allowed(check=partial(paths.path, wanted="a file"), metavar="FILE")]
Folder = Annotated[Path, Allowed(check=partial(paths.path, wanted="a folder"), metavar="FOLDER")]
StudyFile = Annotated[Path, _argument("STUDY", "a file")]
StudyFolder = Annotated[Path, _argument("DIR", "a folder")]
Agents = Annotated[int, Allowed(least=1, most=limits.MOST_AGENTS)]
CellRuns = Annotated[int, Allowed(least=1, most=limits.MOST_CELL_RUNS)]
Risk = Annotated[float, Allowed(least=limits.LEAST_RISK, most=1)]


def registry(module: str, name: str) -> Callable[[], Iterable[str]]:
    """Return a function that returns the names in a registry, imported when it is called."""
    return lambda: getattr(import_module(module), name)


Learner = Annotated[str, Allowed(choices=registry("teamsight.analysis.learning.registry", "LEARNERS"))]
Reward = Annotated[str, Allowed(choices=registry("teamsight.analysis.learning.registry", "REWARDS"))]
Format = Annotated[str, Allowed(choices=registry("teamsight.analysis.plot.style", "FORMATS"))]
PolicyName = Annotated[str, Allowed(choices=POLICIES)]
DegreeName = Annotated[str, Allowed(choices=AWARENESS)]
PresetName = Annotated[str, Allowed(choices=PRESETS)]
Treatment = Annotated[str, Allowed(choices=registry("teamsight.tasks.task", "TREATMENTS"))]
Matches = Annotated[int | None, Allowed(least=1, shown="that of the learner")]
# δ on a command line: finer than a degree of arc is of no use, and each sector costs memory for every transition.
Delta = Annotated[int, Allowed(least=1, most=limits.MOST_SECTORS)]


def _shard(name: str, given: Any) -> tuple[int, int]:
    """Return one part of several equal ones, as in 1/8."""
    first, _, second = given.partition("/") if isinstance(given, str) else (given[0], "/", given[1])
    try:
        count = checks.count(name, number_in(second))
        return checks.count(name, number_in(first), most=count), count
    except (TypeError, ValueError):
        raise ValueError(
            f"{name}={checks.shown(given)}: must be i/n with i from 1 to n; give, for example, 1/8"
        ) from None


Shard = Annotated[tuple[int, int] | None, Allowed(check=_shard, parse=str, metavar="I/N", shown="all")]
