"""The fields of a study, checked and in the form in which it keeps them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeding import PAIRINGS
from teamsight.analysis.studies.definition.axes import axis_values
from teamsight.analysis.studies.definition.columns import columns_of
from teamsight.analysis.studies.definition.grid import blocks_of, check_blocks
from teamsight.analysis.studies.definition.recording import record_of, until_of
from teamsight.analysis.studies.definition.sampling import sample_of
from teamsight.analysis.studies.definition.values import Table, frozen
from teamsight.core import checks

#: Runs of a study.
MOST_RUNS = 100_000_000
#: References of the model that the name "cmommt" stands for.
_CMOMMT = ("teamsight:CMOMMT", "teamsight.agents:CMOMMT", "teamsight.agents.cmommt:CMOMMT")
# Arguments of a model, and columns of the table, that are not parameters.
_PLACES = {
    "rng": "seed, the root of all seeds",
    "seed": "seed, the root of all seeds",
    "steps": "steps of the study",
    "replicate": "replicates",
    "setting": "another name",
}


def resolved(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a study; raise TypeError or ValueError for wrong ones."""
    axes = {_parameter("axes", name): axis_values(str(name), one) for name, one in _table("axes", given["axes"]).items()}
    made: dict[str, Any] = {
        "model": _model(given["model"]),
        "fixed": Table(
            {_parameter("fixed", name): frozen(f"fixed.{name}", one) for name, one in _table("fixed", given["fixed"]).items()}
        ),
        "axes": Table(axes),
        "zip": _groups(given["zip"]),
        "points": None if given["points"] is None else columns_of("points", given["points"]),
        "sample": sample_of(given["sample"]),
        "replicates": checks.count("replicates", given["replicates"], most=MOST_RUNS, cure="give fewer, of more steps"),
        "steps": limits.steps(given["steps"]),
        "seed": checks.count("seed", given["seed"], least=0, most=checks.MOST_SEED),
        "pairing": checks.choice("pairing", given["pairing"], PAIRINGS),
        "record": record_of(given["record"]),
        "name": _text("name", given["name"]),
        "path": None if given["path"] is None else os.path.abspath(given["path"]),
    }
    made["until"] = until_of(given["until"], made["replicates"])
    for where in ("points", "sample"):
        for name in made[where] or ():
            _parameter(where, name)
    blocks = blocks_of(made["axes"], made["zip"], made["points"], made["sample"])
    _check_runs(check_blocks(blocks, made["fixed"]), made["replicates"])
    return made


def _check_runs(settings: int, replicates: int) -> None:
    runs = settings * replicates
    if runs > MOST_RUNS:
        raise ValueError(
            f"replicates={replicates}: {settings:,} settings make {runs:,} runs, at most {MOST_RUNS:,}; give fewer "
            "replicates or settings"
        )


def _model(given: object) -> str:
    text = frozen("model", given)
    if not isinstance(text, str) or not text:
        raise TypeError(f"model={checks.shown(given)}: must be 'cmommt', a plug-in or 'package.module:Name'")
    return "cmommt" if text in _CMOMMT else text


def _table(where: str, given: object) -> Mapping[Any, Any]:
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}={checks.shown(given)}: must be a table of parameters")
    return given


def _parameter(where: str, name: object) -> str:
    if not isinstance(name, str):
        raise TypeError(f"{where}: the name {checks.shown(name)} must be a text, such as 'robots'")
    if name in _PLACES:
        raise ValueError(f"{where}: {name!r} is no parameter of a setting; give {_PLACES[name]}")
    return str(name)


def _groups(given: Any) -> tuple[tuple[str, ...], ...]:
    wrong = f"zip={checks.shown(given)}: must be a list of groups of axes, such as [['robots', 'targets']]"
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise TypeError(wrong)
    for group in given:
        if isinstance(group, str) or not isinstance(group, Sequence) or len(group) < 2:
            raise TypeError(wrong)
    return tuple(tuple(frozen("zip", group)) for group in given)


def _text(where: str, given: object) -> str | None:
    if given is not None and not isinstance(given, str):
        raise TypeError(f"{where}={checks.shown(given)}: must be a text")
    return given
