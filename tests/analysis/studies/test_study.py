"""`Study` as a value, and what its check finds before the first run."""

from __future__ import annotations

import copy
import dataclasses
import json
import pickle
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Cycle, Failures, Study
from teamsight.analysis.runs.run_many import summary
from teamsight.analysis.studies.definition.model import Record, Until
from tests.analysis.studies.folders import odd

NAMES = ("robots", "targets", "radius", "policy", "speed", "a", "b")
NUMBERS = st.integers(-(10**6), 10**6) | st.floats(allow_nan=False, allow_infinity=False)
VALUES = NUMBERS | st.booleans() | st.text("abcüx:", max_size=3) | st.lists(NUMBERS, max_size=2)


@st.composite
def studies(draw: st.DrawFn) -> Study:
    """Return a study of any shape: fixed parameters, axes, zipped axes, points and a sample."""
    names = list(draw(st.permutations(NAMES)))
    several = st.lists(VALUES, min_size=1, max_size=3, unique_by=repr).filter(
        lambda one: len(set(map(repr_of, one))) == len(one)
    )
    fixed = {names.pop(): draw(VALUES) for _ in range(draw(st.integers(0, 2)))}
    axes = {names.pop(): draw(several) for _ in range(draw(st.integers(0, 3)))}
    groups = (
        [list(axes)] if len(axes) > 1 and len({len(one) for one in axes.values()}) == 1 and draw(st.booleans()) else []
    )
    points = {names.pop(): draw(several)} if draw(st.booleans()) else None
    sample = {names.pop(): draw(several)} if draw(st.booleans()) else None
    until = draw(st.none() | st.just(Until(0.5, "x", 100)))
    return Study(
        fixed=fixed, axes=axes, zip=groups, points=points, sample=sample, replicates=draw(st.integers(1, 5)), until=until,
        seed=draw(st.integers(0, 2**63 - 1)), pairing=draw(st.sampled_from(["scenario", "none"])),
        record=Record(steps=draw(st.booleans())), name=draw(st.none() | st.just("n")),
    )  # fmt: skip


def repr_of(value: Any) -> str:
    from teamsight.analysis.studies.definition.values import frozen, text_of

    return text_of(frozen("x", value))


@given(studies())
def test_a_study_returns_from_json_copies_and_its_repr(study: Study) -> None:
    again = Study.from_dict(json.loads(json.dumps(study.as_dict(), allow_nan=False)))
    assert repr(again) == repr(study)
    assert again == study
    assert hash(again) == hash(study)
    assert again.as_dict() == study.as_dict()
    assert eval(repr(study)) == study
    for other in (
        copy.copy(study),
        copy.deepcopy(study),
        pickle.loads(pickle.dumps(study)),
        dataclasses.replace(study),
    ):
        assert other == study
        assert repr(other) == repr(study)


@given(
    studies(), st.sampled_from(["seed", "steps", "replicates", "name", "pairing", "record", "model", "fixed", "until"])
)


def test_a_study_with_another_value_is_another(study: Study, field: str) -> None:
    other = {
        "seed": study.seed // 2 + 1, "steps": 7, "replicates": study.replicates + 1, "name": "other", "pairing": "none",
        "record": Record("a:b"), "model": "a:b", "fixed": {**study.fixed, "other": 1}, "until": Until(0.25, "y", 50),
    }[field]  # fmt: skip
    changed = dataclasses.replace(study, **{field: other})
    assert (changed == study) == (getattr(changed, field) == getattr(study, field))
    assert study != 5


def test_true_and_one_are_two_values() -> None:
    assert Study(fixed={"a": True}) != Study(fixed={"a": 1})
    assert Study(fixed={"a": 1.0}) == Study(fixed={"a": 1})
    assert hash(Study(fixed={"a": 1.0})) == hash(Study(fixed={"a": 1}))


def test_the_folder_of_the_file_is_not_compared(tmp_path: Any) -> None:
    assert Study(path=tmp_path) == Study()
    assert Study.from_dict(Study(path=tmp_path).as_dict()).path == str(tmp_path)


@pytest.mark.short
def test_a_study_cannot_be_changed() -> None:
    given = {"robots": [1, 2]}
    study = Study(axes=given)
    given["robots"].append(3)
    assert study.axes == {"robots": (1, 2)}
    with pytest.raises(dataclasses.FrozenInstanceError):
        study.steps = 5  # type: ignore[misc]
    with pytest.raises(TypeError, match=r"cannot be changed; .*dataclasses.replace"):
        study.axes["robots"] = (5,)  # type: ignore[index]
    study.as_dict()["axes"]["robots"].append(3)
    assert study.axes == {"robots": (1, 2)}


def test_what_python_gives_is_what_a_file_says() -> None:
    study = Study(
        model=CMOMMT, fixed={"cycle": Cycle(5), "events": Failures(500)}, axes={"robots": np.arange(1, 3), "radius": range(2, 4)},
        record={"measure": summary}, until={"interval": 1}, points=pd.DataFrame({"targets": [3, 4]}),
    )  # fmt: skip
    values = study.as_dict()
    assert values["model"] == "cmommt"
    assert values["fixed"]["cycle"] == {"use": "teamsight.agents.decisions.cycle:Cycle", "period": 5}
    assert values["axes"] == {"robots": [1, 2], "radius": [2, 3]}
    assert values["points"] == {"targets": [3, 4]}
    assert values["record"]["measure"] == "teamsight.analysis.runs.run_many:summary"
    study.check()
    assert repr(study.plan().components(0)["cycle"]) == repr(Cycle(5))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"points": "points.csv"}, ["points='points.csv'", "pandas.read_csv"]),
        ({"points": {"robots": [1], "radius": [1, 2]}}, ["different lengths"]),
        ({"points": {"robots": []}}, ["points.robots=[]", "no values"]),
        ({"points": {"robots": 5}}, ["points.robots=5", "list"]),
        ({"points": pd.DataFrame([[1, 2]], columns=["a", "a"])}, ["twice"]),
        ({"points": pd.DataFrame({"a": [1.0, np.nan]})}, ["points.a[1]=nan", "finite"]),
        ({"points": [1, 2]}, ["points=[1, 2]", "DataFrame"]),
        ({"model": lambda rng: 0}, ["is a lambda"]),
        ({"fixed": {5: 1}}, ["name 5", "text"]),
        ({"name": 5}, ["name=5", "text"]),
        ({"path": 5}, ["path=5", "folder"]),
        ({"path": "~/x"}, ["~ is not expanded"]),
        ({"replicates": True}, ["replicates=True"]),
        ({"replicates": 10**12}, ["replicates=1000000000000", "100000000"]),
        ({"steps": 10**9}, ["steps=1000000000"]),
        ({"axes": {f"a{i}": [0, 1] for i in range(60)}}, ["about 10^18 settings"]),
    ],
)


def test_wrong_arguments(given: dict[str, Any], words: list[str]) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        Study(**given)
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_unknown_keys_of_a_dictionary() -> None:
    with pytest.raises(ValueError, match=r"key='axis': unknown; did you mean 'axes'\?"):
        Study.from_dict({"axis": {}})


def test_parameters_are_those_of_the_model() -> None:
    model = "teamsight.agents.world:World"
    with pytest.raises(
        ValueError, match="arena: teamsight.agents.world:World needs this parameter; give it under fixed"
    ):
        Study(model=model).check()
    with pytest.raises(
        ValueError, match=r"arna: is no parameter of teamsight.agents.world:World; did you mean 'arena'\?"
    ):
        Study(model=model, fixed={"arna": 1}).check()


def test_a_parameter_that_a_model_of_any_parameters_passes_on_is_known_there() -> None:
    """Otherwise each run would fail, after the first was made."""
    study = odd("passing_on", fixed={"radus": 3.0})
    with pytest.raises(ValueError, match=r"radus: is no parameter of odd_models:passing_on .*; correct the name"):
        study.check()
    odd("passing_on", fixed={"radius": 3.0}).check()


def test_the_check_builds_a_world_for_each_value_that_is_no_number() -> None:
    Study(axes={"policy": ["a-cmommt", "centroid"], "awareness": ["none", "ring"]}, fixed={"robots": 10**6}).check()
    with pytest.raises(
        ValueError, match=r"awareness='rng': unknown; .*\(in the setting policy='a-cmommt', awareness='rng'\)"
    ):
        Study(axes={"policy": ["a-cmommt", "centroid"], "awareness": ["none", "rng"]}).check()


@settings(max_examples=10)
@given(st.integers(1, 3), st.integers(1, 4), st.integers(1, 5))
def test_numbers_of_settings_and_runs(one: int, other: int, replicates: int) -> None:
    study = Study(axes={"robots": range(one), "a": range(other)}, replicates=replicates)
    assert (study.settings, study.runs) == (one * other, one * other * replicates)
    assert (study.plan().settings, study.plan().runs) == (study.settings, study.runs)


KEYS = [
    "model",
    "fixed",
    "axes",
    "zip",
    "points",
    "sample",
    "replicates",
    "steps",
    "seed",
    "pairing",
    "record",
    "until",
    "name",
    "path",
]
WORDS = [
    "robots",
    "radius",
    "policy",
    "from",
    "to",
    "step",
    "count",
    "scale",
    "method",
    "axes",
    "interval",
    "measure",
    "use",
    "sobol",
    "log",
    "cmommt",
    "a:b",
    "",
    "\0",
    "ü",
]
JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(WORDS) | st.just(10**400) | st.just(b"x"),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(WORDS), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


@settings(max_examples=300)
@given(st.dictionaries(st.sampled_from(KEYS), JUNK, max_size=4))
def test_whatever_is_given_the_error_is_one_line(values: dict[str, Any]) -> None:
    try:
        study = Study.from_dict(values)
    except (TypeError, ValueError) as error:
        assert "\n" not in str(error)
        assert len(str(error)) < 800
    else:
        assert Study.from_dict(json.loads(json.dumps(study.as_dict(), allow_nan=False))) == study
