"""The keys of a study file, in one place: their form as JSON Schema, and what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from teamsight.analysis.runs.seeding import PAIRINGS

#: Spacings of an axis.
SCALES = ("linear", "log")
#: Methods of sampling.
METHODS = ("sobol", "latin-hypercube")

Form = dict[str, Any]


class Key(NamedTuple):
    """One key of a table.

    Attributes
    ----------
    help : str
        What it means; editors show it.
    form : dict
        JSON Schema of its value.
    """

    help: str
    form: Form


def _table(keys: Mapping[str, Key], **more: Any) -> Form:
    """Return the schema of a table with these keys."""
    properties = {name: {"description": key.help, **key.form} for name, key in keys.items()}
    return {"type": "object", "properties": properties, "additionalProperties": False, **more}


def _parameters(form: Form, **more: Any) -> Form:
    """Return the schema of a table whose keys are parameters of the model."""
    return {"type": "object", "additionalProperties": form, **more}


_NUMBER: Form = {"type": "number"}
_TEXT: Form = {"type": "string", "minLength": 1}
_FLAG: Form = {"type": "boolean"}
_VALUE: Form = {"type": ["string", "number", "boolean", "array", "object"]}


def _count(least: int, **more: Any) -> Form:
    return {"type": "integer", "minimum": least, **more}


#: An axis that is a range.
RANGE: Mapping[str, Key] = {
    "from": Key("The first value.", _NUMBER),
    "to": Key("The last value, if the step reaches it.", _NUMBER),
    "step": Key("The distance between two values; in place of count.", {"type": "number", "exclusiveMinimum": 0}),
    "count": Key("The number of values; in place of step.", _count(2)),
    "scale": Key("Whether differences or ratios of values are equal.", {"enum": list(SCALES), "default": "linear"}),
}

#: An axis of a sample.
SAMPLE_AXIS: Mapping[str, Key] = {
    "from": Key("The smallest value.", _NUMBER),
    "to": Key("The largest value.", _NUMBER),
    "scale": Key("Whether values or their logarithms are uniform.", {"enum": list(SCALES), "default": "linear"}),
    "integer": Key("Whether values are whole numbers.", {**_FLAG, "default": False}),
}

#: A sample.
SAMPLE: Mapping[str, Key] = {
    "method": Key("A scrambled Sobol sequence, or a Latin hypercube.", {"enum": list(METHODS)}),
    "count": Key("The number of settings; a power of 2 for sobol.", _count(1)),
    "seed": Key("The seed of the sample; it has nothing to do with that of the runs.", _count(0, default=0)),
    "axes": Key(
        "The parameters that are sampled.",
        _parameters(_table(SAMPLE_AXIS, required=["from", "to"]), minProperties=1),
    ),
}

#: What is recorded of each run.
RECORD: Mapping[str, Key] = {
    "measure": Key(
        'What is measured of a whole run: "summary", "evenness", a plug-in, or the function "package.module:name", '
        "which is called as measure(world, steps).",
        {**_TEXT, "default": "summary"},
    ),
    "steps": Key("Whether one row for each step is recorded.", {**_FLAG, "default": False}),
    "trajectories": Key("Record positions at every so many steps; 0 for never.", _count(0, default=0)),
    "events": Key("Whether the log of events is recorded.", {**_FLAG, "default": False}),
}

#: Until when replicates are added.
UNTIL: Mapping[str, Key] = {
    "interval": Key(
        "The largest width of the 95 % interval of the mean, from its low to its high end, in the unit of the measure.",
        {"type": "number", "exclusiveMinimum": 0},
    ),
    "measure": Key("The column of results whose mean it is.", {**_TEXT, "default": "observed_fraction"}),
    "limit": Key("The most replicates of a setting.", _count(2, default=1000)),
}

_LIST: Form = {"type": "array", "items": _VALUE, "minItems": 1}
_RANGE: Form = _table(RANGE, required=["from", "to"], oneOf=[{"required": ["step"]}, {"required": ["count"]}])
_TABLE_FILE = r"\.([cC][sS][vV]|[pP][aA][rR][qQ][uU][eE][tT])$"

#: The study file.
STUDY: Mapping[str, Key] = {
    "name": Key("A name for titles; by default that of the file.", {"type": "string"}),
    "model": Key(
        'The model: "cmommt", "task:NAME", a plug-in, or "package.module:Name", a class or function that is called as '
        "model(**setting, rng=seed).",
        {**_TEXT, "default": "cmommt"},
    ),
    "fixed": Key("Parameters of the model that all settings share.", _parameters(_VALUE)),
    "axes": Key(
        "Parameters that are swept, each with a list of values or a range; all combinations are run.",
        _parameters({"anyOf": [_LIST, _RANGE]}),
    ),
    "zip": Key(
        'Groups of axes that advance together, as [["robots", "targets"]]; they have equally many values.',
        {"type": "array", "items": {"type": "array", "items": {"type": "string"}, "minItems": 2}},
    ),
    "points": Key(
        "Settings that are listed: a CSV or Parquet file in the folder of this file, with a column for each parameter; "
        "or the columns themselves.",
        {"anyOf": [{"type": "string", "pattern": _TABLE_FILE}, _parameters(_LIST)]},
    ),
    "sample": Key(
        "Settings that are drawn.",
        _table(SAMPLE, required=["method", "count", "axes"]),
    ),
    "replicates": Key("Runs of each setting; with until, the first ones.", _count(1, default=1)),
    "steps": Key("Steps of each run.", _count(1, default=600)),
    "seed": Key("The root from which the seeds of all runs derive.", _count(0, default=0)),
    "pairing": Key(
        'Which values enter a run\'s seed: "scenario" (robots, targets and radius: treatments of one scenario meet the '
        'same noise) or "none" (all values: runs of different settings are independent).',
        {"enum": list(PAIRINGS), "default": "scenario"},
    ),
    "record": Key("What is recorded of each run.", _table(RECORD)),
    "until": Key(
        "Add replicates to each setting until its interval is narrow enough with two of 30, 38, 48, 60, … replicates "
        "in succession: a setting has at least 38, or the limit.",
        _table(UNTIL, required=["interval"]),
    ),
}
