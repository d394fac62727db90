"""Controls: what a page can set of a model, and what not."""

from __future__ import annotations

import enum
from typing import Any, Literal

import live_models
import pytest

from teamsight import CMOMMT
from teamsight.agents.awareness import RingAwareness
from teamsight.agents.world import World
from teamsight.core.component import declared
from teamsight.live.controls import controls_of
from teamsight.live.copying import command_of
from teamsight.live.live_page import worlds_of


def named(model: Any, parameters: Any = None) -> dict[str, Any]:
    return {one.name: one for one in controls_of(model, parameters or {})}


def test_controls_of_cmommt_are_its_parameters() -> None:
    controls = named(CMOMMT)
    assert set(controls) == {
        "policy", "awareness", "delta", "robots", "awareness_range", "sensing_range", "robot_speed", "cycle", "targets",
        "target_policy", "target_speed", "uniform_target_speed", "radius", "range_shape", "arena_shape",
        "contact", "drive", "robot_radius", "target_radius",
    }  # fmt: skip
    assert {name for name, one in controls.items() if not one.live} == {
        "robots", "targets", "radius", "uniform_target_speed", "arena_shape", "range_shape", "contact", "drive", "robot_radius", "target_radius",
    }  # fmt: skip
    # A slider with a step of 0 would move by 1.
    steps = {name: one.as_json()["step"] for name, one in controls.items()}
    assert all(step is None or step > 0 for step in steps.values())
    for one in controls.values():
        # Each holds the model's own default.
        default = declared(CMOMMT)[one.name].default
        assert one.checked(one.shown(default) if one.kind == "choice" else (default if one.name != "cycle" else 1)) is not None


def test_limits_hold_what_is_given() -> None:
    controls = named(CMOMMT, {"robots": 5000, "radius": 70.0, "awareness_range": 0.001, "delta": 200})
    assert controls["robots"].checked(5000) == 5000
    assert controls["radius"].checked(70.0) == 70.0
    assert controls["awareness_range"].checked(0.001) == 0.001
    assert controls["delta"].checked(200) == 200
    with pytest.raises(ValueError, match="robots=5001: must be at most 5000"):
        controls["robots"].checked(5001)


def test_objects_that_are_given_can_be_chosen_again() -> None:
    ring = RingAwareness(5)
    control = named(CMOMMT, {"awareness": ring})["awareness"]
    label = control.shown(ring)
    assert "given" in label
    assert control.checked(label) is ring
    assert control.checked("none") == "none"


def test_a_subclass_adds_its_own_parameters() -> None:
    class Own(CMOMMT):
        def __init__(self, robots: int = 3, *, hunger: float = 0.5, name: str = "x", **others: Any) -> None:
            super().__init__(robots, **others)

    controls = named(Own)
    assert {"robots", "hunger"} <= set(controls)
    assert "name" not in controls


class Colour(enum.Enum):
    """A choice."""

    RED = 1
    BLUE = 2


def test_signatures_become_controls() -> None:
    def build(
        count: int = 3, size: float = 2.0, fast: bool = True, colour: Colour = Colour.RED,
        shape: Literal["disc", "box"] = "disc", level: Literal[1, 2] = 1, policy: str = "centroid",
        awareness: str = "none", file: str = "/etc/passwd", policy_name: str = "os:system", limits: Any = None, seed: int = 0,
    ) -> World:  # fmt: skip
        raise NotImplementedError

    controls = {one.name: one for one in controls_of(build, {})}
    assert {name: one.kind for name, one in controls.items()} == {
        "count": "integer", "size": "number", "fast": "flag", "colour": "choice", "shape": "choice", "level": "choice",
        "policy": "choice", "awareness": "choice",
    }  # fmt: skip
    assert controls["colour"].checked("BLUE") is Colour.BLUE
    assert controls["colour"].shown(Colour.BLUE) == "BLUE"
    assert controls["level"].checked("2") == 2
    assert not any(one.live for one in controls.values())
    for name, value in (
        ("count", 2.5), ("count", "3"), ("count", 10**7), ("count", True), ("size", "x"), ("size", 1e300), ("fast", 1),
        ("shape", "os:system"), ("policy", "module:Name"), ("colour", 1), ("level", 2),
        ("count", [1]), ("size", None), ("fast", {}), ("shape", [1]), ("policy", "x" * 3000),
    ):  # fmt: skip
        with pytest.raises((TypeError, ValueError), match=f"^{name}="):
            controls[name].checked(value)


def test_values_that_are_given_replace_defaults() -> None:
    (control,) = [one for one in controls_of(live_models.hives, {"hives": -5}) if one.name == "hives"]
    assert control.checked(-7) == -7


class Painted(CMOMMT):
    """A model with choices of its own."""

    def __init__(self, colour: Colour = Colour.RED, shape: Literal["disc", "box"] = "disc", seed: int = 0) -> None:
        super().__init__(robots=2, targets=2, seed=seed)
        self.colour, self.shape = colour, shape


def test_a_command_gives_members_of_an_enum_by_name_and_no_text_that_is_no_choice() -> None:
    worlds, _ = worlds_of(Painted, {"colour": "BLUE", "shape": "box"}, {"colour": "RED"})
    assert [one["colour"] for one in worlds.settings] == [Colour.BLUE, Colour.RED]
    assert "--set colour=BLUE --set shape=box" in command_of(worlds)
    assert command_of(worlds).endswith("--beside colour=RED")
    for name, text in (("colour", "MAUVE"), ("shape", "cube")):
        with pytest.raises(ValueError, match=f"^{name}='{text}': unknown"):
            worlds_of(Painted, {name: text}, None)
        with pytest.raises(ValueError, match=f"^{name}='{text}': unknown"):
            worlds_of(Painted, {}, {name: text})
