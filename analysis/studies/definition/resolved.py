"""The fields of a study, checked and in the form in which it keeps them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from teamsight.analysis.studies.definition.axes import axis_values, large
from teamsight.analysis.studies.definition.columns import columns_of
from teamsight.analysis.studies.definition.grid import blocks_of, check_blocks
from teamsight.analysis.studies.definition.model import CMOMMT_NAME
from teamsight.analysis.studies.definition.recording import Record, made_of, until_of
from teamsight.analysis.studies.definition.sampling import sample_of
from teamsight.analysis.studies.definition.values import Table, check_distinct, frozen
from teamsight.core import checks
from teamsight.core.files import check_name

#: Runs of a study, with all replicates that `until` allows.
MOST_RUNS = 100_000_000

# References of the model that has a name.
_CMOMMT = ("teamsight:CMOMMT", "teamsight.agents:CMOMMT", "teamsight.agents.cmommt:CMOMMT")
# Arguments of a model and columns of the table that are not parameters, and what is meant instead.
_PLACES = {
    "rng": "the key seed, from which the seeds of all runs derive",
    "seed": "the key seed, from which the seeds of all runs derive",
    "steps": "the key steps of the study",
    "replicate": "the key replicates of the study",
    "setting": "the parameter another name",
    "run": "the parameter another name",
    "error": "the parameter another name",
    "traceback": "the parameter another name",
}


def resolved(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a study by name; raise TypeError or ValueError for wrong ones."""
    fixed, axes = (_table(where, given[where]) for where in ("fixed", "axes"))
    made: dict[str, Any] = {
        "model": _model(given["model"]),
        "fixed": Table({name: frozen(f"fixed.{name}", value) for name, value in fixed.items()}),
        "axes": Table({name: axis_values(name, value) for name, value in axes.items()}),
        "zip": _groups(given["zip"]),
        "points": None if given["points"] is None else columns_of("points", given["points"]),
        "sample": sample_of(given["sample"]),
        "record": made_of("record", given["record"], Record),
        "name": _name(given["name"]),
        "path": _folder(given["path"]),
    }
    made["until"] = until_of(given["until"], given["replicates"])
    for where in ("fixed", "axes", "points", "sample"):
        for name in made[where] or ():
            _check_parameter(where, name)
    blocks = blocks_of(made["axes"], made["zip"], made["points"], made["sample"])
    for block in blocks:
        for name, values in block.columns.items():
            check_distinct(name, values)
    _check_runs(check_blocks(blocks, made["fixed"]), {**given, **made})
    return made


def _check_runs(settings: int, made: Mapping[str, Any]) -> None:
    where = "replicates" if made["until"] is None else "until.limit"
    replicates = made["replicates"] if made["until"] is None else made["until"].limit
    runs = settings * replicates
    if runs > MOST_RUNS:
        raise ValueError(
            f"{where}={replicates}: {settings:,} settings make {large(runs)} runs, at most {MOST_RUNS:,}; give fewer "
            "replicates or settings"
        )


def _check_parameter(where: str, name: str) -> None:
    if name in _PLACES:
        raise ValueError(f"{where}: {name!r} cannot be a parameter; give {_PLACES[name]}")
    if not all(map(str.isidentifier, name.split(".", 1))):
        raise ValueError(f"{where}: {checks.shown(name)} is no name of a parameter; give one such as robots")


def _model(given: object) -> str:
    text = frozen("model", given)
    if not isinstance(text, str) or not text:
        raise TypeError(f"model={checks.shown(given)}: must be 'cmommt', a plug-in or 'package.module:Name'")
    return CMOMMT_NAME if text in _CMOMMT else text


def _table(where: str, given: object) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}={checks.shown(given)}: must be a table of parameters, as {{robots = …}}")
    for name in given:
        if not isinstance(name, str):
            raise TypeError(f"{where}: the name {checks.shown(name)} must be a text, such as 'robots'")
    return given


def _groups(given: Any) -> tuple[tuple[str, ...], ...]:
    wrong = f"zip={checks.shown(given)}: must be a list of groups of axes, such as [['robots', 'targets']]"
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise TypeError(wrong)
    for group in given:
        if isinstance(group, str) or not isinstance(group, Sequence) or len(group) < 2:
            raise TypeError(wrong)
    return tuple(tuple(frozen("zip", group)) for group in given)


def _name(given: object) -> str | None:
    if given is not None and not isinstance(given, str):
        raise TypeError(f"name={checks.shown(given)}: must be a text")
    return None if given is None else str(frozen("name", given))


def _folder(given: str | os.PathLike[str] | None) -> str | None:
    if given is None:
        return None
    if not isinstance(given, (str, os.PathLike)):
        raise TypeError(f"path={checks.shown(given)}: must be the folder of the study file, or None")
    check_name(given)
    return os.path.abspath(given)
