"""The JSON Schema of study files, by which editors complete and check them; see `keys`.

``python -m teamsight.analysis.studies.definition.schema`` prints it; ``study.schema.json`` beside this file is its
output.
"""

from __future__ import annotations

import copy
import json
from dataclasses import MISSING
from typing import Any

from teamsight.analysis.studies.definition import keys
from teamsight.analysis.studies.definition.model import CMOMMT_NAME, model_of
from teamsight.analysis.studies.definition.recording import Record, Until
from teamsight.analysis.studies.study import Study
from teamsight.core.component import Component, declared


def study_keys() -> dict[str, dict[str, Any]]:
    """Return the keys of a study file and the schema of each: the settings of a `Study`."""
    known = declared(Study)
    found = {
        name: {"description": one.meaning, **keys.TABLES[name]} if name in keys.TABLES else one.schema()
        for name, one in known.items()
        if name != "path"
    }
    for name, kind in (("record", Record), ("until", Until)):
        found[name] |= {"type": "object", **_table(kind)}
    return found


def _table(kind: type[Component]) -> dict[str, Any]:
    """Return the schema of a table whose keys are the settings of a component."""
    known = declared(kind)
    required = [name for name, one in known.items() if one.default is MISSING]
    properties = {name: one.schema() for name, one in known.items()}
    return {"properties": properties, "additionalProperties": False} | ({"required": required} if required else {})


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a study file; editors propose the parameters of the usual model in it."""
    properties = copy.deepcopy(study_keys())
    axis = properties["axes"]["additionalProperties"]
    refers = {"$ref": "#/definitions/axis"}
    known = {name: one for name, one in declared(model_of(CMOMMT_NAME)).items() if name not in ("rng", "seed")}
    # A draft-07 validator ignores what stands beside a reference.
    properties["axes"] |= {
        "additionalProperties": refers,
        "properties": {name: {"description": one.meaning, "allOf": [refers]} for name, one in known.items()},
    }
    properties["fixed"]["properties"] = {name: one.schema() for name, one in known.items()}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A study of teamsight",
        "description": "Settings of a model, times replicates: teamsight sweep study.toml --out DIR",
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        "definitions": {"axis": axis},
    }


def schema_text() -> str:
    """Return the schema as the file that ships has it."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(schema_text(), end="")
