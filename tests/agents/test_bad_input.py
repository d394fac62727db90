"""Bad input: one line that names the value, the limit and the cure, when the model is built."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Robot, Target, Torus, World
from teamsight.agents.awareness import RingAwareness
from teamsight.policies import ACmommt, Centroid, Evasive, Policy, Stationary

nan, inf = math.nan, math.inf

MODELS: list[tuple[dict[str, Any], str]] = [
    ({"robots": -3}, r"robots=-3: must be at least 1"),
    ({"robots": True}, r"robots=True: must be a whole number"),
    ({"radius": "5"}, r"radius='5': must be a number"),
    ({"delta": 0, "awareness": "ring"}, r"delta=0: .*NoAwareness\(\)"),
    ({"policy": "acmommt"}, r"policy='acmommt': unknown; did you mean 'a-cmommt'\? known are a-cmommt, adaptive-forces, b-cmommt"),
    ({"policy": Centroid}, r"policy=Centroid: is a class; give an object, Centroid\(\)"),
    ({"policy": 7}, r"policy=7: must be a name, a Policy, or a callable"),
    ({"target_policy": "evasion"}, r"target_policy='evasion': unknown; did you mean 'evasive'"),
    pytest.param({"target_policy": Evasive}, r"target_policy=Evasive: is a class"),
    ({"awareness": "rings"}, r"awareness='rings': unknown; did you mean 'ring'\? known are .*ring"),
    ({"awareness": RingAwareness}, r"awareness=RingAwareness: is a class; give an object"),
    ({"awareness": 16}, r"awareness=16: is not a degree of awareness; give one, such as PairwiseAwareness\(\), or one of none, ring, "),
    ({"policy_options": {"idle": "wonder"}}, r"idle='wonder': unknown; did you mean 'wander'"),
    ({"policy_options": {"weights": "nearst"}}, r"weights='nearst': unknown; did you mean 'nearest'"),
    ({"policy_options": {"weigths": "none"}}, r"policy_options: 'a-cmommt' has no option 'weigths'; did you mean 'weights'\? its options are idle"),
    ({"policy": "centroid", "policy_options": {"weights": "none"}}, r"policy_options: 'centroid' has no option 'weights'; its options are idle"),
    ({"policy": "stationary", "policy_options": {3: 3}}, r"policy_options: 'stationary' has no option 3; it has no options"),
    ({"policy_options": "stay"}, r"policy_options='stay': must be a mapping"),
    ({"policy": Stationary(), "policy_options": {"weights": "none"}}, r"policy_options=.*policy=Stationary\(\) is an object"),
    ({"target_policy_options": {"weights": 1}}, r"target_policy_options: 'random-walk' has no option 'weights'"),
    ({"target_policy_options": {"turn_probability": 2}}, r"turn_probability=2"),
    ({"preset": "touzet"}, r"preset='touzet': unknown; did you mean 'touzet2000'"),
    ({"rng": -1}, r"rng=-1: must be at least 0"),
    ({"rng": 1.5}, r"rng=1\.5: must be a whole number"),
    ({"seed": "x"}, r"seed='x': must be a whole number of at least 0, .* or None"),
    ({"rng": 1, "seed": 2}, r"rng=1, seed=2: two names for one seed; give one of them"),
]  # fmt: skip


def label(value: Any) -> str:
    """Name a case the same in every process."""
    return re.sub(r" object at 0x\w+", "", str(value))


def assert_one_line(error: BaseException, message: str) -> None:
    assert isinstance(error, (ValueError, TypeError))
    assert re.match(message, str(error)), str(error)
    assert "\n" not in str(error)


@pytest.mark.short
@pytest.mark.parametrize(("settings", "message"), MODELS, ids=label)
def test_a_model_that_cannot_be(settings: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        CMOMMT(**settings)
    assert_one_line(caught.value, message)


def world() -> World:
    return World(Disc(5.0), rng=1)


class NoPolicy:
    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        return None


class Misfit(Policy):
    needs = ("relayed",)

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        return None


GROUPS: list[tuple[dict[str, Any], str]] = [
    ({"count": 0}, r"count=0: must be at least 1"),
    ({"agent_class": object}, r"agent_class=<class 'object'>: must be Robot, Target, Body or a subclass"),
    ({"agent_class": "Robot"}, r"agent_class='Robot': must be Robot"),
    ({"policy": "mine.py:"}, r"policy='mine\.py:': is a file; add the name in it, on a command line mine\.py:Name"),
    ({"policy": "teamsight:Robot"}, r"policy='teamsight:Robot': is a class, but neither a Policy nor callable; .* function"),
    ({"policy": NoPolicy()}, r"policy=NoPolicy: has decide but is not a Policy; derive NoPolicy from teamsight\.policies\.Policy"),
    ({"policy": None}, r"policy: is missing, and Robot does not override decide; .* or a name: a-cmommt, "),
    ({"speed": -1}, r"speed=-1\.0: must be a finite number, at least 0"),
    ({"speed": [0.1, nan, 0.1]}, r"speed=nan: must be a finite number"),
    ({"speed": [0.1, 0.2]}, r"speed: has the shape \(2,\); give one number, or 3, one for each agent"),
    ({"speed": "fast"}, r"speed='fast': must be a number, or one for each agent"),
    ({"speed": True}, r"speed=True: must be a number"),
    ({"speed": None}, r"speed=None: must be a number"),
    ({"turn_limit": -0.1}, r"turn_limit=-0\.1: must be a finite number, at least 0"),
    ({"turn_limit": inf}, r"turn_limit=inf: must be a finite number"),
    ({"placement": "spred"}, r"placement='spred': unknown; did you mean 'spread'"),
    ({"placement": [(0, 0)]}, r"position: has the shape \(1, 2\); it must be \(3, 2\)"),
    ({"placement": [(0, 0), (1, 1), (4, 4)]}, r"position=\(4\.0, 4\.0\): must be two finite numbers inside the arena, Disc\(radius=5\.0\)"),
    ({"placement": [(0, 0), (1, nan), (1, 1)]}, r"position=\(1\.0, nan\): must be two finite numbers"),
    ({"placement": [("a", "b")] * 3}, r"position=.*: must be numbers of shape \(3, 2\)"),
    ({"name": "first"}, r"name='first': another group has this name; give a different one"),
    ({"awareness": None}, r"awareness=None: is not a degree of awareness"),
    pytest.param({"policy": Misfit()}, r"policy=Misfit: needs 'relayed'"),
    pytest.param(
        {"policy": type("Negative", (Misfit,), {"needs": (), "draws": -1})()}, r".*draws=-1"
    ),
]  # fmt: skip


@pytest.mark.parametrize(("settings", "message"), GROUPS, ids=label)
def test_a_group_that_cannot_be(settings: dict[str, Any], message: str) -> None:
    home = world()
    home.add(Target, 2, policy="random-walk", name="first")
    plan: dict[str, Any] = {"agent_class": Robot, "count": 3, "policy": "centroid", **settings}
    with pytest.raises((ValueError, TypeError)) as caught:
        home.add(plan.pop("agent_class"), plan.pop("count"), **plan)
    assert_one_line(caught.value, message)
    # Nothing half-made is left.
    assert len(home.groups) == 1
    assert len(home.agents) == 2
    home.run(3)


POLICIES: list[tuple[Any, dict[str, Any], str]] = [
    (ACmommt, {"do1": 0.5}, r"do2=0\.308: must be at least do1=0\.5"),
    (ACmommt, {"predictive": 0.9}, r"predictive=0\.9: must be at least do3=1"),
    (ACmommt, {"dr2": 0.1}, r"dr2=0\.1: must be at least dr1=0\.481"),
    (ACmommt, {"turn_probability": None}, r"turn_probability=None: must be a number"),
    (World, {"arena": 5.0}, r"arena=5\.0: must be an arena, such as Disc\(5\.0\)"),
    (World, {"arena": Disc}, r"arena=<class .*Disc'>: must be an arena"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "settings", "message"), POLICIES, ids=label)
def test_a_part_that_cannot_be(kind: Any, settings: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        kind(**settings)
    assert_one_line(caught.value, message)


CALLS: list[tuple[Any, str]] = [
    (lambda m: m.run(-1), r"steps=-1: must be at least 0"),
    (lambda m: m.run(1.5), r"steps=1\.5: must be a whole number"),
    (lambda m: m.recording.record_positions(0), r"every=0: must be at least 1"),
    (lambda m: m.clock.at(5, "now"), r"at\(5, 'now'\): the second argument must be callable"),
    (lambda m: m.clock.at(nan, print), r"time=nan: must be a finite number"),
    (lambda m: m.clock.at(1, print), r"time=1: has passed; it must be at least the present time, 2"),
    pytest.param(lambda m: m.clock.process(lambda: None), r"process\("),
    (lambda m: setattr(m.robots[0], "position", (9, 0)), r"position=\(9\.0, 0\.0\): must be two finite numbers inside the arena, Disc"),
    (lambda m: setattr(m.robots[0], "position", (nan, 0)), r"position=\(nan, 0\.0\)"),
    (lambda m: setattr(m.robots[0], "position", 3), r"position: has the shape \(\); it must be \(2,\)"),
    (lambda m: setattr(m.robots[0], "heading", (0, 0)), r"heading=\(0, 0\): must be two finite numbers, not both 0"),
    (lambda m: setattr(m.robots[0], "heading", (nan, 0)), r"heading=\(nan, 0\)"),
    (lambda m: setattr(m.robots[0], "heading", (1, 0, 0)), r"heading=\(1, 0, 0\)"),
    pytest.param(lambda m: setattr(m.robots[0], "heading", "up"), r"heading='up'"),
    (lambda m: m.senses(m.robots, CMOMMT(rng=1).targets), r"senses\(.*must be a group that was added to this world"),
    (lambda m: m.restore(CMOMMT(robots=3).state()), r"restore\(…\): the state is of a world with"),
    (lambda m: m.reset(rng=-1), r"rng=-1: must be at least 0"),
    (lambda m: World(Torus(1, 3)).add(Robot, 1, policy=Stationary()), r"range=1: on a torus a range must be at most half .* 0\.5; take"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "message"), CALLS)
def test_a_call_that_cannot_be(call: Any, message: str) -> None:
    model = CMOMMT(rng=1)
    model.run(2)
    before = model.robots.position.copy()
    with pytest.raises((ValueError, TypeError)) as caught:
        call(model)
    assert_one_line(caught.value, message)
    assert np.array_equal(model.robots.position, before)
    model.run(1)
    assert model.tick == 3
