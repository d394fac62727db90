"""Components of a study: written as references, and made again where runs are made."""

from __future__ import annotations

import inspect
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from teamsight import Batteries, Car, Cycle, Failures, Sensor, Study, Weibull
from teamsight.agents.awareness import RingAwareness
from teamsight.agents.components.durations import Times
from teamsight.analysis.studies.definition.values import Components, frozen, thawed
from teamsight.policies import ACmommt, Avoiding, Centroid, RandomWalk


def again(value: Any) -> Any:
    return Components().made("x", thawed(frozen("x", value)))


@pytest.mark.short
@pytest.mark.parametrize(
    "component",
    [
        ACmommt(weights="shared"), RandomWalk(0.25), Centroid(), RingAwareness(8), Cycle(5, phase=2.0),
        Failures(500, Weibull(30.0, 2.0)), Failures(Times([3, 9]), 5), Sensor(missed=0.25, range=0.5),
    ],
    ids=lambda one: type(one).__name__,
)  # fmt: skip
def test_objects_of_this_package_are_rebuilt(component: Any) -> None:
    made = again(component)
    assert type(made) is type(component)
    assert repr(made) == repr(component)
    assert repr(again([component, {"a": component}])) == repr([component, {"a": component}])


def test_a_class_becomes_its_reference_and_an_object_without_arguments() -> None:
    assert frozen("policy", Centroid) == "teamsight.policies.handmade.centroid:Centroid"
    assert isinstance(again(Centroid), Centroid)


def test_a_function_becomes_its_reference_and_itself() -> None:
    assert frozen("f", inspect.getsource) == "inspect:getsource"
    assert again(inspect.getsource) is inspect.getsource


def test_options_are_those_that_differ_from_the_defaults() -> None:
    assert frozen("policy", RandomWalk()) == {"use": "teamsight.policies.handmade.random_walk:RandomWalk"}
    assert frozen("events", Failures(500)) == {
        "use": "teamsight.agents.components.failures:Failures",
        "time_to_failure": {"use": "teamsight.agents.components.durations:Exponential", "mean": 500.0},
    }


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "my_components.py").write_text(
        "from dataclasses import dataclass\n"
        "class Counting:\n"
        "    def __init__(self, step=1): self.step, self.count = step, 0\n"
        "@dataclass(frozen=True)\n"
        "class Frozen:\n"
        "    size: int\n"
        "    inner: object = None\n"
        "from teamsight.agents.components.durations import Duration\n"
        "class Growing(Duration):\n"
        "    count = 0\n"
        "    def draw(self, uniform):\n"
        "        self.count += 1\n"
        "        return self.count\n"
        "value = {'a': 1}\n"
        "def rule(*a): return 1\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path  # type: ignore[misc]
    sys.modules.pop("my_components", None)


def test_frozen_dataclasses_of_users_are_rebuilt(module: Path) -> None:
    import my_components  # type: ignore[import-not-found]

    one = my_components.Frozen(3, my_components.Frozen(4))
    assert again(one) == one


def test_texts_and_tables_of_a_file(module: Path) -> None:
    import my_components

    components = Components()
    made = components.made("policy", {"use": "my_components:Counting", "step": 5})
    assert (type(made), made.step) == (my_components.Counting, 5)  # type: ignore[attr-defined]
    assert components.made("policy", "my_components:rule") is my_components.rule
    assert components.made("policy", "my_components:value") is my_components.value
    assert components.made("policy", "a-cmommt") == "a-cmommt"
    assert components.made("policy", "note: this") == "note: this"
    nested = components.made("options", {"deep": [{"use": "my_components:Counting"}]})
    assert type(nested["deep"][0]) is my_components.Counting  # type: ignore[index]


def test_what_can_change_is_made_for_each_run_and_what_cannot_is_shared(module: Path) -> None:
    components = Components()
    ours, theirs = {"use": "teamsight:Cycle", "period": 5}, {"use": "my_components:Counting"}
    both = {"use": "teamsight:Failures", "time_to_failure": {"use": "my_components:Growing"}}
    first, second = (components.resolved({"cycle": ours, "policy": theirs, "both": both}) for _ in range(2))
    assert first["cycle"] is second["cycle"]
    assert first["policy"] is not second["policy"]
    assert first["both"] is not second["both"]


@dataclass
class Thawed:
    size: int = 1


@dataclass(frozen=True)
class Lossy:
    size: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", self.size + 1)


class Plain:
    pass


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Thawed(), ["cannot hold this Thawed", "'package.module:Class'"]),
        (Plain(), ["cannot hold this Plain", "'package.module:Class'"]),
        (Batteries, []),
        (lambda: 0, ["is a lambda", "top level"]),
        (object(), ["cannot hold this object"]),
        (b"x", ["cannot hold this bytes"]),
        ({1, 2}, ["cannot hold this set"]),
        (1j, ["cannot hold this complex"]),
    ],
    ids=["thawed", "plain", "class", "lambda", "object", "bytes", "set", "complex"],
)
def test_what_cannot_be_written_is_refused(value: Any, words: list[str]) -> None:
    if not words:
        assert isinstance(frozen("x", value), str)
        return
    with pytest.raises((TypeError, ValueError), match="^x=") as error:
        frozen("x", value)
    for word in words:
        assert word in str(error.value)


def test_an_object_that_its_options_do_not_rebuild_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, Lossy.__module__, sys.modules.get(Lossy.__module__, inspect.getmodule(Lossy)))
    with pytest.raises((TypeError, ValueError), match=r"^x=Lossy\(size=2.0\)"):
        frozen("x", Lossy())


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"use": "my_components:rule", "a": 1}, ["is no class and takes no options"]),
        ({"use": "my_components:Countin"}, ["x='my_components:Countin'", "did you mean 'Counting'"]),
        ("no_such_module_at_all:X", ["no module 'no_such_module_at_all'", "install it"]),
        ({"use": 5}, ["x=5"]),
        ({"use": "my_components:Counting", "stp": 5}, ["stp"]),
    ],
    ids=["options", "name", "module", "number", "option"],
)
def test_what_does_not_load_is_named(module: Path, value: Any, words: list[str]) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        Components().made("x", value)
    for word in words:
        assert word in str(error.value)


def test_degrees_that_need_more_robots_than_the_check_builds_are_checked_with_all() -> None:
    axes = {"robots": [5], "awareness": ["relayed"], "awareness.hops": [1, 2, 4]}
    Study(axes=axes, replicates=1, steps=5).check()
    with pytest.raises(ValueError, match="hops=5: must be at most 4 in a team of 5"):
        Study(axes={**axes, "awareness.hops": [5]}, replicates=1, steps=5).check()


STUDY = """
steps = 2
replicates = 1
[fixed]
robots = 3
robot_radius = 0.1
contact = "stop"
drive = {use = "car", acceleration = 0.05}
policy = {use = "teamsight.policies:Avoiding", policy = {use = "a-cmommt", weights = "shared"}}
[axes]
"drive.steering_rate" = [0.1, 0.2]
"policy.policy.gain" = [0.5, 1.0]
"policy.margin" = [0.1]
"""


@pytest.mark.short
def test_a_component_in_a_component_is_swept(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY)
    plan = Study.from_file(tmp_path / "study.toml").plan()
    made = [plan.components(k) for k in range(plan.settings)]
    assert [one["policy"] for one in made[:2]] == [
        Avoiding(ACmommt(weights="shared", gain=gain), margin=0.1) for gain in (0.5, 1.0)
    ]
    assert [one["drive"] for one in made[::2]] == [Car(steering_rate=rate, acceleration=0.05) for rate in (0.1, 0.2)]
    results = Study.from_file(tmp_path / "study.toml").run(tmp_path / "out", workers=1)
    assert list(results.frame["policy.policy.gain"]) == [0.5, 1.0] * 2


@pytest.mark.parametrize("policy", ["teamsight.policies:Avoiding", {"use": "teamsight.policies:Avoiding"}])
def test_a_setting_that_is_needed_may_be_an_axis(policy: Any) -> None:
    wrapped = ["a-cmommt", {"use": "random-walk", "turn_probability": 0.5}, ACmommt(gain=2.0)]
    study = Study(fixed={"policy": policy, "robot_radius": 0.1}, axes={"policy.policy": wrapped}, steps=2)
    study.check()
    made = [study.plan().components(k)["policy"] for k in range(3)]
    assert made == [Avoiding("a-cmommt"), Avoiding(RandomWalk(0.5)), Avoiding(ACmommt(gain=2.0))]


@pytest.mark.parametrize(
    ("fixed", "axes", "message"),
    [
        ({"policy": "teamsight.policies:Avoiding"}, {"policy.margin": [0.1]},
         "policy='teamsight.policies:Avoiding': needs policy; give policy.policy too"),
        ({"policy": "teamsight.policies:Avoiding"}, {"policy.policy.gain": [0.1]},
         r"policy\.policy\.gain: is a setting of a component; give policy\.policy too"),
        ({"policy": {"use": "teamsight.policies:Avoiding", "policy": "a-cmommt"}}, {"policy.policy.gian": [0.1]},
         r"policy\.policy\.gian: 'a-cmommt' has none; did you mean 'gain'\? its settings are idle"),
        ({"drive": {"use": "bike"}}, {}, "drive='bike': unknown; known are car, differential, free"),
        ({}, {".".join("p" * 20): [1]}, "is no name of a parameter"),
    ],
)  # fmt: skip
def test_settings_of_settings_are_checked(fixed: Any, axes: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Study(fixed=fixed, axes=axes, steps=2).check()
