"""The JSON Schema of study files, by which editors complete and check them; see `keys`.

``python -m teamsight.analysis.studies.definition.schema`` prints it; ``study.schema.json`` beside this file is its
output.
"""

from __future__ import annotations

import copy
import inspect
import json
import re
from collections.abc import Mapping
from typing import Any

from teamsight.analysis.studies.definition import keys
from teamsight.analysis.studies.definition.model import CMOMMT_NAME, model_of
from teamsight.core import checks

# A line of a docstring that names parameters, and what follows it up to the next such line.
_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : .*\n((?:    .*\n?|\n)+)", re.MULTILINE)


def check_keys(values: Mapping[str, Any]) -> None:
    """Raise an error if a study file has an unknown key; it suggests the nearest.

    Raises
    ------
    ValueError
        If it does.
    """
    for key in values:
        checks.choice("key", key, keys.STUDY)


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a study file."""
    properties = {name: {"description": key.help, **copy.deepcopy(key.form)} for name, key in keys.STUDY.items()}
    axis = properties["axes"]["additionalProperties"]
    refers = {"$ref": "#/definitions/axis"}
    known = _meanings()
    # A draft-07 validator ignores what stands beside a reference.
    properties["axes"] |= {
        "additionalProperties": refers,
        "properties": {name: {"description": text, "allOf": [refers]} for name, text in known.items()},
    }
    properties["fixed"]["properties"] = {name: {"description": text} for name, text in known.items()}
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


def _meanings() -> dict[str, str]:
    """Return the parameters of the usual model, which editors propose, and what they mean; other models have others."""
    text = (inspect.getdoc(model_of(CMOMMT_NAME)) or "").partition("Attributes\n---")[0]
    found = {name: " ".join(meaning.split()) for names, meaning in _ENTRY.findall(text) for name in names.split(", ")}
    return {name: meaning for name, meaning in found.items() if name not in ("rng", "seed")}


if __name__ == "__main__":
    print(schema_text(), end="")
