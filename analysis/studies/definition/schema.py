"""The JSON Schema of study files, by which editors complete and check them; see `keys`.

``python -m teamsight.analysis.studies.definition.schema`` prints it; ``study.schema.json`` beside this file is its
output.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from teamsight.analysis.studies.definition import keys
from teamsight.core import checks


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
    properties = {name: {"description": key.help, **key.form} for name, key in keys.STUDY.items()}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A study of teamsight",
        "description": "Settings of a model, times replicates: teamsight sweep study.toml --out DIR",
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
    }


def schema_text() -> str:
    """Return the schema as the file that ships has it."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(schema_text(), end="")
