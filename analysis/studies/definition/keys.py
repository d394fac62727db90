"""The keys of a study file, in one place: their form as JSON Schema, and what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

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

_LIST: Form = {"type": "array", "items": _VALUE, "minItems": 1}
_RANGE: Form = _table(RANGE, required=["from", "to"], oneOf=[{"required": ["step"]}, {"required": ["count"]}])
_TABLE_FILE = r"\.([cC][sS][vV]|[pP][aA][rR][qQ][uU][eE][tT])$"

#: The forms of the tables of a study file.
TABLES: Mapping[str, Form] = {
    "fixed": _parameters(_VALUE),
    "axes": _parameters({"anyOf": [_LIST, _RANGE]}),
    "zip": {"type": "array", "items": {"type": "array", "items": {"type": "string"}, "minItems": 2}},
    "points": {"anyOf": [{"type": "string", "pattern": _TABLE_FILE}, _parameters(_LIST)]},
    "sample": _table(SAMPLE, required=["method", "count", "axes"]),
}
