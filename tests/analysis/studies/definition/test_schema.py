"""The JSON Schema of study files: what ships is what the keys declare, and it accepts what `Study` accepts."""

from __future__ import annotations

import inspect
import json
import tomllib
from collections.abc import Iterator
from importlib.resources import files
from typing import Any

import pytest

from teamsight import CMOMMT, Study
from teamsight.analysis.studies.definition.schema import schema, schema_text, study_keys
from teamsight.analysis.studies.definition.settings import RANGE, SAMPLE, SAMPLE_AXIS

COMMAND = "python -m teamsight.analysis.studies.definition.schema > analysis/studies/definition/study.schema.json"


@pytest.mark.short
def test_the_file_that_ships_is_up_to_date() -> None:
    shipped = files("teamsight.analysis.studies.definition").joinpath("study.schema.json").read_text(encoding="utf-8")
    assert shipped == schema_text(), f"write it anew: {COMMAND}"


def test_keys_are_the_parameters_of_the_study() -> None:
    parameters = inspect.signature(Study).parameters
    assert set(study_keys()) == set(parameters) - {"path"}
    for name, key in study_keys().items():
        assert key.get("default", parameters[name].default) == parameters[name].default


def test_editors_propose_the_parameters_of_cmommt() -> None:
    known = set(inspect.signature(CMOMMT).parameters) - {"rng", "seed"}
    for name in ("fixed", "axes"):
        properties = schema()["properties"][name]["properties"]
        assert set(properties) == known
        assert all(one["description"].endswith(".") for one in properties.values())


def test_each_key_says_what_it_means() -> None:
    for table in (RANGE, SAMPLE, SAMPLE_AXIS):
        assert all(key.meaning.endswith(".") for key in table.values())
    for one in (study_keys(), study_keys()["record"]["properties"], study_keys()["until"]["properties"]):
        assert all(key["description"].endswith(".") for key in one.values())


@pytest.fixture(scope="module")
def validate() -> Any:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft7Validator.check_schema(schema())
    return jsonschema.Draft7Validator(schema())


GOOD = [
    "",
    "model = 'cmommt'\nreplicates = 3\n[axes]\nrobots = [1, 2]\nradius = {from = 1, to = 2, step = 0.5}",
    "axes = {radius = {from = 0.1, to = 10, count = 3, scale = 'log'}, policy = ['a-cmommt', 'centroid']}",
    "zip = [['robots', 'targets']]\naxes = {robots = [1, 2], targets = [3, 4]}",
    "sample = {method = 'sobol', count = 8, axes.radius = {from = 1, to = 2}}",
    "sample = {method = 'latin-hypercube', count = 7, seed = 3, axes.robots = {from = 1, to = 20, integer = true}}",
    "record = {measure = 'summary', steps = true, trajectories = 5, events = true}\nuntil.interval = 0.01",
    "name = 'a'\npairing = 'none'\nseed = 5\nsteps = 10\npoints = {radius = [1, 2]}\nuntil = {interval = 1, limit = 50}",
    "fixed = {policy = {use = 'teamsight.policies:ACmommt', idle = 'stay'}, cycle = 5, uniform_target_speed = true}",
]
BAD = [
    "axis = {}", "replicates = 0", "replicates = 1.5", "steps = 'a'", "seed = -1", "pairing = 'all'", "axes = [1]", "axes.robots = []",
    "axes.robots = 5", "axes.radius = {from = 1, to = 2}", "axes.radius = {from = 1, to = 2, step = 1, count = 2}",
    "axes.radius = {from = 1, step = 2}", "axes.radius = {from = 1, to = 2, count = 1}", "axes.radius = {from = 1, to = 2, step = 0}",
    "axes.radius = {from = 1, to = 2, count = 3, scale = 'lg'}", "zip = ['robots']", "zip = [['robots']]", "points = 'points.txt'", "points = 5",
    "sample = {method = 'sobl', count = 8, axes.radius = {from = 1, to = 2}}", "sample = {method = 'sobol', axes.radius = {from = 1, to = 2}}",
    "sample = {method = 'sobol', count = 8, axes = {}}", "sample = {method = 'sobol', count = 8, axes.radius = [1, 2]}", "record = 'summary'",
    "record.step = true", "record.steps = 1", "record.trajectories = -1", "until = {}", "until.interval = 0", "until = {interval = 1, limit = 1}",
    "model = ''", "model = 5", "name = 5", "fixed = 5", "path = '.'",
]  # fmt: skip


@pytest.mark.parametrize("text", GOOD)
def test_good_files(validate: Any, text: str) -> None:
    values = tomllib.loads(text)
    assert list(validate.iter_errors(values)) == []
    Study.from_dict(values).check()


@pytest.mark.parametrize("text", BAD)
def test_what_the_schema_refuses_the_study_refuses(validate: Any, text: str, tmp_path: Any) -> None:
    assert not validate.is_valid(tomllib.loads(text))
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises((TypeError, ValueError)):
        Study.from_file(tmp_path / "study.toml")


def nodes(form: Any) -> Iterator[dict[str, Any]]:
    if isinstance(form, dict):
        yield form
        for one in form.values():
            yield from nodes(one)
    elif isinstance(form, list):
        for one in form:
            yield from nodes(one)


def test_unknown_keys_are_errors_at_every_level() -> None:
    of_the_model = [schema()["properties"][name]["properties"].keys() for name in ("fixed", "axes")]
    tables = [node for node in nodes(schema()) if isinstance(node.get("properties"), dict)]
    closed = [node for node in tables if node["properties"].keys() not in of_the_model]
    assert len(closed) >= 6
    assert all(node["additionalProperties"] is False for node in closed)
    json.dumps(schema(), allow_nan=False)
