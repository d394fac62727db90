"""Components: each limit of each field of every component is checked, with the value, the limit and the cure."""

from __future__ import annotations

import contextlib
import importlib
import math
import pkgutil
import sys
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any

import pytest
import toy_components
from hypothesis import given
from hypothesis import strategies as st

import teamsight
from teamsight import CMOMMT, Study
from teamsight.core.component import Allowed, Component, Declared, built_from, declared
from teamsight.live.controls import controls_of
from teamsight.policies.registry import POLICIES
from teamsight.tasks.model import TaskModel

# Modules that end the program or need a package that need not be there.
_NOT_IMPORTED = ("__main__", "stable_baselines", "dask_executor")


def components(kind: type[Component] = Component) -> Iterator[type[Component]]:
    """Yield every component of the package that can be made."""
    for one in kind.__subclasses__():
        if one.__module__.startswith("teamsight.") and is_dataclass(one):
            yield one
        yield from components(one)


def import_all() -> None:
    """Import what has dataclasses, but no module that would hide the function after which it is called."""
    for one in pkgutil.walk_packages(teamsight.__path__, "teamsight.", onerror=lambda name: None):
        found = one.module_finder.find_spec(one.name, None)
        is_wanted = found is not None and found.origin and "@dataclass" in Path(found.origin).read_text(encoding="utf-8")
        home, _, leaf = one.name.rpartition(".")
        if is_wanted and not one.name.endswith(_NOT_IMPORTED) and leaf not in vars(sys.modules[home]).get("_HOMES", ()):
            with contextlib.suppress(ModuleNotFoundError):  # of an optional package
                importlib.import_module(one.name)


import_all()

ALL = sorted(set(components()), key=lambda one: (one.__module__, one.__name__))
FIELDS = [(kind, one) for kind in ALL for one in declared(kind).values() if one.is_checked]


def beyond(one: Declared) -> Iterator[tuple[Any, str]]:
    """Yield values that a field must refuse, and what the error says beside its name and the cure."""
    allowed = one.allowed
    if one.kind in ("integer", "number"):
        step = 1 if one.kind == "integer" else 1e-3
        if allowed.least is not None:
            yield allowed.least - (step if allowed.least == 0 or one.kind == "integer" else allowed.least / 2), f"{allowed.least:g}"
        if allowed.above is not None:
            yield allowed.above, f"{allowed.above:g}"
        if allowed.most is not None and allowed.most < 1e15:
            yield (allowed.most + step) * (1.0 if one.kind == "integer" else 1.001), ""
        if not one.is_open:
            yield "many", "must be"
        if one.kind == "number":
            yield math.nan, "finite"
    elif one.kind == "choice":
        yield "no such name", "known are"
    elif one.kind == "component":
        yield "no-such-name", "known are"
    elif one.kind == "flag":
        yield 1, "True or False"
    elif one.item is not None and not allowed.check:
        yield from (((value,), text) for value, text in beyond(one.item))
    elif one.kind == "text" and not allowed.check:
        yield 3, "must be a text"


def named(kind: type[Component]) -> str:
    return f"{kind.__module__.removeprefix('teamsight.')}.{kind.__name__}"


@pytest.mark.parametrize(("kind", "one"), FIELDS, ids=lambda one: named(one) if isinstance(one, type) else one.name)
def test_each_limit_of_each_field_is_refused_with_the_value_the_limit_and_the_cure(kind: type[Component], one: Declared) -> None:
    can_be_made = all(each.default is not MISSING for each in declared(kind).values())
    if can_be_made:
        try:
            kind()
        except Exception:
            # A learner without a memory.
            can_be_made = False
    errors: list[str] = []
    for value, said in beyond(one):
        with pytest.raises((TypeError, ValueError), match=f"^{one.name}=") as found:
            one.checked(value)
        errors.append(str(found.value))
        assert said in errors[-1]
        if can_be_made:
            with pytest.raises((TypeError, ValueError), match=f"^{one.name}=") as made:
                kind(**{one.name: value})
            assert str(made.value) == str(found.value)
    for cure in (one.allowed.cure,) if isinstance(one.allowed.cure, str) else one.allowed.cure:
        if cure and not one.allowed.check:
            assert any(error.endswith(cure) for error in errors)


@pytest.mark.parametrize("kind", ALL, ids=named)
def test_each_setting_has_a_meaning_and_a_default_that_is_allowed(kind: type[Component]) -> None:
    for name, one in declared(kind).items():
        assert one.meaning, f"{name} is missing in the docstring of {named(kind)}"
        if one.default is not MISSING and one.is_checked:
            assert one.checked(one.default) == one.default or one.default is None


def test_components_are_many() -> None:
    # So that a mistake in the list above is noticed.
    assert len(ALL) > 80
    assert {"ACmommt", "RingAwareness", "Sensor", "Disc", "Settings", "Study", "PaperPlan", "Cycle"} <= {one.__name__ for one in ALL}
    assert len(FIELDS) > 250


@given(st.floats(0.001, 1e6), st.integers(1, 10**6))
def test_the_text_of_a_value_gives_the_value_again(number: float, count: int) -> None:
    known = declared(CMOMMT)
    assert known["radius"].parsed(repr(number)) == number
    assert known["robots"].parsed(str(count)) == count
    assert known["uniform_target_speed"].parsed("true") is True


def test_the_schema_refuses_what_python_refuses() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    for _, one in FIELDS:
        validator = jsonschema.Draft7Validator(one.schema())
        if one.kind in ("integer", "number") and not one.is_open:
            for value, _ in beyond(one):
                assert not validator.is_valid(value) or value != value, (one.name, value)
        if isinstance(one.default, (bool, int, float, str)):
            assert validator.is_valid(one.default), one.name


def test_a_choice_of_a_registry_may_be_none() -> None:
    @dataclass(frozen=True)
    class Chosen(Component):
        policy: Annotated[str, Allowed(choices=POLICIES)] | None = None

    assert list(declared(Chosen)["policy"].choices) == list(POLICIES)
    with pytest.raises(ValueError, match="policy='centriod': .*did you mean 'centroid'"):
        Chosen("centriod")


def test_settings_of_a_world_are_those_of_its_component() -> None:
    known = {field.name for field in fields(declared_by(CMOMMT)) if field.init}
    assert set(declared(CMOMMT)) == known
    with pytest.raises(TypeError, match="robot=3.*did you mean 'robots'"):
        CMOMMT(robot=3)  # type: ignore[call-arg]
    assert toy_components.SwampWorld(2).drag == 0.5

    class Marsh(toy_components.SwampWorld):
        def __init__(self, *, drag: float = 0.75, rng: int | None = None) -> None:
            super().__init__(drag=drag, rng=rng)

    assert declared(Marsh)["drag"].allowed.most == 1
    assert declared(Marsh)["drag"].default == 0.75
    assert built_from(toy_components.Swamp)


def declared_by(owner: Any) -> Any:
    return owner.__init__.component


# One field: the option, the slider, the key of a study, the parameter of an environment, the schema and the error.

WRONG = r"drag=-1\.0: must be a finite number, at least 0 and at most 1; a robot with a drag of 1 stays"


def test_a_setting_of_a_task_is_one_field(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    from teamsight.cli import main
    from teamsight.env import parallel_env

    def call(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            main(["run", "--task", "toy_components:SWAMP", "--steps", "2", *arguments])
        return int(ended.value.code or 0), "".join(capsys.readouterr())

    assert "drag                            0.125" in call("--drag", "0.125")[1]
    status, text = call("--drag", "-1")
    assert status == 2
    assert text.strip().endswith(WRONG.replace("\\", ""))
    assert "By which share of their speed robots are slower." in " ".join(call("--help")[1].split())
    model = TaskModel(toy_components.SWAMP)
    control = next(one for one in controls_of(model, {}) if one.name == "drag")
    assert (control.kind, control.least, control.most) == ("number", 0, 1)
    with pytest.raises(ValueError, match=r"^drag=-1\.0: must be a finite number, at least 0 and at most 1"):
        control.checked(-1)
    study = Study(model="task:toy_components:SWAMP", axes={"drag": [0.0, 0.125]}, steps=2)
    assert list(study.run(tmp_path / "out").frame["drag"]) == [0.0, 0.125]
    env = parallel_env(model=toy_components.SWAMP, drag=0.125)
    env.reset(seed=1)
    assert env.world.drag == 0.125
    with pytest.raises(ValueError, match=WRONG):
        parallel_env(model=toy_components.SWAMP, drag=-1)
    with pytest.raises(ValueError, match=WRONG):
        toy_components.SwampWorld(drag=-1)
    assert declared(model)["drag"].schema() == {
        "description": "By which share of their speed robots are slower.", "type": "number", "minimum": 0, "maximum": 1,
        "default": 0.25,
    }  # fmt: skip


def test_a_setting_of_a_policy_is_one_field(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    from teamsight.cli import main
    from teamsight.live.live_page import worlds_of

    wrong = r"pull=-1\.0: must be a finite number, at least 0 and at most 1; with 1 it stays"

    def call(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            main(["run", "--policy", "toy_components:Drift", "--steps", "2", *arguments])
        return int(ended.value.code or 0), "".join(capsys.readouterr())

    with pytest.warns(UserWarning, match="Python"):
        assert call("--policy.pull", "1", "--policy.side", "right")[0] == 0
    assert call("--policy.pull", "-1")[1].strip().endswith(wrong.replace("\\", ""))
    assert "--policy.pull NUMBER" in call("--help")[1]
    _, controls = worlds_of(CMOMMT, {"policy": "toy_components:Drift"}, None)
    assert (controls["policy.pull"].least, controls["policy.pull"].most, controls["policy.pull"].live) == (0, 1, True)
    assert list(controls["policy.side"].choices) == ["left", "right"]
    study = Study(fixed={"policy": "toy_components:Drift", "robots": 2}, axes={"policy.pull": [0.0, 1.0]}, steps=2)
    with pytest.warns(UserWarning, match="Python"):
        assert list(study.run(tmp_path / "out").frame["policy.pull"]) == [0.0, 1.0]
    with pytest.raises(ValueError, match=wrong):
        Study(fixed={"policy": "toy_components:Drift"}, axes={"policy.pull": [-1.0]}).check()
    with pytest.raises(ValueError, match=r"policy\.pull: is a setting of a component; give policy too"):
        Study(axes={"policy.pull": [0.5]}).check()
    with pytest.raises(ValueError, match=r"policy\.gian: 'a-cmommt' has none; did you mean 'gain'"):
        Study(fixed={"policy": "a-cmommt"}, axes={"policy.gian": [0.5]}).check()
    with pytest.raises(ValueError, match=wrong):
        CMOMMT(policy=toy_components.Drift(-1))
    world = CMOMMT(2, policy="toy_components:Drift", policy_options={"pull": 1.0})
    with pytest.warns(UserWarning, match="Python"):
        world.run(2)
    assert world.policy == toy_components.Drift(1.0)
