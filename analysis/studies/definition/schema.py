"""The JSON Schema of study files, by which editors complete and check them.

``python -m teamsight.analysis.studies.definition.schema`` prints it; ``study.schema.json`` beside this file is its
output.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING
from typing import Any

from teamsight.analysis.studies.definition.model import CMOMMT_NAME, Record, Until, model_of
from teamsight.analysis.studies.definition.settings import RANGE, SAMPLE, SAMPLE_AXIS
from teamsight.analysis.studies.study import Study
from teamsight.core.component import Declared, declared

Form = dict[str, Any]

_VALUE: Form = {"type": ["string", "number", "boolean", "array", "object"]}
_LIST: Form = {"type": "array", "items": _VALUE, "minItems": 1}
_TABLE_FILE = r"\.([cC][sS][vV]|[pP][aA][rR][qQ][uU][eE][tT])$"
_AXIS: Form = {"$ref": "#/definitions/axis"}


def _table(known: Mapping[str, Declared], **more: Any) -> Form:
    """Return the schema of a table with these keys."""
    required = [name for name, one in known.items() if one.default is MISSING]
    properties = {name: one.schema() for name, one in known.items()}
    form: Form = {"type": "object", "properties": properties, "additionalProperties": False}
    return form | ({"required": required} if required else {}) | more


def _parameters(form: Form, **more: Any) -> Form:
    """Return the schema of a table whose keys are parameters of the model."""
    return {"type": "object", "additionalProperties": form, **more}


def study_keys() -> dict[str, Form]:
    """Return the keys of a study file and the schema of each: the settings of a `Study`."""
    sample = _table(SAMPLE)
    sample["properties"]["axes"] |= _parameters(_table(SAMPLE_AXIS), minProperties=1)
    tables = {
        "fixed": _parameters(_VALUE),
        "axes": _parameters(_AXIS),
        "zip": {"type": "array", "items": {"type": "array", "items": {"type": "string"}, "minItems": 2}},
        "points": {"anyOf": [{"type": "string", "pattern": _TABLE_FILE}, _parameters(_LIST)]},
        "sample": sample,
        "record": _table(declared(Record)),
        "until": _table(declared(Until)),
    }
    known = {name: one for name, one in declared(Study).items() if name != "path"}
    return {
        name: {"description": one.meaning, **tables[name]} if name in tables else one.schema()
        for name, one in known.items()
    }


def schema() -> Form:
    """Return the JSON Schema of a study file; editors propose the parameters of the usual model in it."""
    properties = study_keys()
    known = {name: one for name, one in declared(model_of(CMOMMT_NAME)).items() if name not in ("rng", "seed")}
    # A draft-07 validator ignores what stands beside a reference.
    properties["axes"]["properties"] = {
        name: {"description": one.meaning, "allOf": [_AXIS]} for name, one in known.items()
    }
    properties["fixed"]["properties"] = {name: one.schema() for name, one in known.items()}
    values = _table(RANGE, oneOf=[{"required": ["step"]}, {"required": ["count"]}])
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A study of teamsight",
        "description": "Settings of a model, times replicates: teamsight sweep study.toml --out DIR",
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        "definitions": {"axis": {"anyOf": [_LIST, values]}},
    }


def schema_text() -> str:
    """Return the schema as the file that ships has it."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(schema_text(), end="")
