"""`check_awareness`: what ships passes, and a degree that breaks the contract is named with the cure."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teamsight.agents import check_awareness
from teamsight.agents.awareness import (
    Awareness,
    NoAwareness,
    PairwiseAwareness,
    RingAwareness,
    SharedAwareness,
    Width,
)
from teamsight.agents.awareness.interface import team_group_at
from teamsight.core.kernel import kernel

DEGREES = [
    NoAwareness(), RingAwareness(), RingAwareness(1), RingAwareness(5), PairwiseAwareness(), SharedAwareness(),
]  # fmt: skip


@pytest.mark.parametrize("degree", DEGREES, ids=str)
def test_every_degree_that_ships_keeps_the_contract(degree: Awareness) -> None:
    check_awareness(degree, seed=DEGREES.index(degree))


# A degree that shows the nearest teammate, without its identity, and whose situation adds its distance. The others
# differ from it in one thing.


@kernel
def _nearest(scene: Any, i: int) -> int:
    best = -1
    for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
        if best < 0 or scene.teammates.distance[k] < scene.teammates.distance[best]:
            best = k
    return best


@kernel
def _show(scene: Any, teammates: Any, at: int, k: int, identity: int) -> None:
    teammates.identity[at] = identity
    teammates.offset[at, 0] = scene.teammates.offset[k, 0]
    teammates.offset[at, 1] = scene.teammates.offset[k, 1]
    teammates.distance[at] = scene.teammates.distance[k]


@kernel
def _perceive(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    at = 0
    for i in range(scene.heading.shape[0]):
        teammates.start[i] = at
        k = _nearest(scene, i)
        if k >= 0:
            if at < teammates.distance.shape[0]:
                _show(scene, teammates, at, k, -1)
            at += 1
    teammates.start[scene.heading.shape[0]] = at
    return at


@kernel
def _situate(scene: Any, parameters: Any, situation: Any) -> None:
    for i in range(scene.heading.shape[0]):
        k = _nearest(scene, i)
        situation[i, 0] = scene.targets.start[i + 1] - scene.targets.start[i]
        situation[i, 1] = scene.teammates.distance[k] / scene.awareness_range[i] if k >= 0 else 1.0


class Nearest(Awareness):
    name = "nearest"
    order = "Θ(1)"
    perceive = _perceive
    situate = _situate
    delivers = ("targets", "teammates")

    def width(self, team_size: int) -> Width:
        return Width(1, 1)


def test_a_degree_of_ones_own_passes() -> None:
    check_awareness(Nearest())


@kernel
def _no_room(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    at = 0
    for i in range(scene.heading.shape[0]):
        teammates.start[i] = at
        k = _nearest(scene, i)
        if k >= 0:
            _show(scene, teammates, at, k, -1)
            at += 1
    teammates.start[scene.heading.shape[0]] = at
    return at


@kernel
def _returns_nothing_needed(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    return _perceive(scene, parameters, teammates, relayed) * 0


@kernel
def _never_enough(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    need = _perceive(scene, parameters, teammates, relayed)
    return teammates.distance.shape[0] + 1 if need > 0 else 0


@kernel
def _for_nobody(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    _perceive(scene, parameters, teammates, relayed)
    return scene.heading.shape[0]


@kernel
def _no_last_start(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    before = teammates.start[scene.heading.shape[0]]
    need = _perceive(scene, parameters, teammates, relayed)
    teammates.start[scene.heading.shape[0]] = before
    return need


@kernel
def _no_distance(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    need = _perceive(scene, parameters, teammates, relayed)
    for at in range(min(need, teammates.distance.shape[0])):
        teammates.distance[at] = 2.0
    return need


@kernel
def _nan_offset(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    need = _perceive(scene, parameters, teammates, relayed)
    for at in range(min(need, teammates.distance.shape[0])):
        teammates.offset[at, 0] = np.nan
    return need


@kernel
def _place_as_identity(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    need = _perceive(scene, parameters, teammates, relayed)
    for at in range(min(need, teammates.distance.shape[0])):
        teammates.identity[at] = 4_000_000
    return need


@kernel
def _descending(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    at = 0
    for i in range(scene.heading.shape[0]):
        teammates.start[i] = at
        first = scene.teammates.start[i]
        for back in range(scene.teammates.start[i + 1] - first):
            k = scene.teammates.start[i + 1] - 1 - back
            if at < teammates.distance.shape[0]:
                _show(scene, teammates, at, k, scene.teammates.identity[k])
            at += 1
    teammates.start[scene.heading.shape[0]] = at
    return at


@kernel
def _writes_scene(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    scene.heading[0, 0] = 1.0  # writes_scene
    return 0


@kernel
def _other_columns(scene: Any, parameters: Any, situation: Any) -> None:
    situation[:, :] = 1.0
    for k in range(scene.place.shape[0]):
        situation[0, 2 + scene.place[k]] = 1.0  # other_columns


@kernel
def _unwritten(scene: Any, parameters: Any, situation: Any) -> None:
    for i in range(scene.heading.shape[0]):
        situation[i, 0] = 1.0
        if scene.teammates.start[i + 1] > scene.teammates.start[i]:
            situation[i, 1] = 1.0


@kernel
def _not_finite(scene: Any, parameters: Any, situation: Any) -> None:
    for i in range(scene.heading.shape[0]):
        situation[i, 0] = 1.0
        situation[i, 1] = 0.0 / (scene.teammates.start[i + 1] - scene.teammates.start[i])


@kernel
def _adds_up(scene: Any, parameters: Any, situation: Any) -> None:
    for i in range(scene.heading.shape[0]):
        for j in range(2):
            # Neither the mark for what is unwritten nor any other number survives this as it was.
            kept = situation[i, j]
            situation[i, j] = 1.0 if kept != kept else kept + 1.0


@kernel
def _too_far_in_the_team(scene: Any, parameters: Any, situation: Any) -> None:
    situation[:, :] = 1.0
    for group in range(scene.team.shape[0]):
        seen = team_group_at(scene.team[group]).targets
        situation[:, 1] = seen.distance[seen.start[seen.start.shape[0] - 1]]  # too_far_in_the_team


@kernel
def _third_parameter(scene: Any, parameters: Any, situation: Any) -> None:
    situation[:, :] = parameters[0]  # third_parameter


@kernel
def _misspelt(scene: Any, parameters: Any, situation: Any) -> None:
    situation[:, :] = scene.headings[0, 0]  # misspelt


WRONG = [
    ({"perceive": _no_room}, r".*test_check\.py:\d+: perceive uses index 0 of teammates\.identity, whose number of entries is 0; write no more than there is room for"),
    ({"perceive": _returns_nothing_needed}, r"perceive returns 0, but writes \d+ entries of teammates; return how many"),
    ({"perceive": _never_enough}, r"perceive asks for more room on every call, last for \d+; return what is needed"),
    ({"perceive": _for_nobody}, r"perceive returns 3 for robots without a team; it must be 0"),
    ({"perceive": _no_last_start}, r"perceive writes teammates\.start = \[.*-7777777\].*write all n \+ 1 elements"),
    ({"perceive": _no_distance}, r"perceive writes teammates of robot \d+: the distance 2 and an offset of length .*equal"),
    ({"perceive": _nan_offset}, r"perceive writes teammates of robot \d+: an offset or a distance that is unwritten or not finite; write both"),
    ({"perceive": _place_as_identity}, r".*: the identity 4000000, which no agent has; .*-1 to hide"),
    ({"perceive": _descending}, r".*: the identity \d+ after one .*; they must ascend"),
    ({"perceive": _writes_scene}, r".*: perceive writes into scene\.heading, which is read-only; copy"),
    ({"shows_teammates": True}, r".*: perceive writes into teammates\.start, which is read-only"),
    ({"delivers": ("targets",)}, r"delivers=\('targets',\): perceive writes teammates; add 'teammates'"),
    ({"delivers": ("targets", "teammate")}, r"delivers=\('targets', 'teammate'\): must be a tuple of some of targets, teammates, relayed"),
    ({"situate": _other_columns}, r".*: situate uses index \d+ of situation, whose number of inputs is 2; width\(team_size\)"),
    ({"situate": _unwritten}, r"situate, of robot 0 in a team of 1, leaves input 1 of 2 unwritten; write every element"),
    ({"situate": _not_finite}, r"situate, of robot 0 in a team of 1, writes nan to input 1; readings must be finite"),
    ({"situate": _adds_up}, r"situate, .* writes 1 or 1\.5 to input 0, depending on what it was; write before you read"),
    ({"situate": _too_far_in_the_team}, r".*: situate uses index \d+ of scene\.team\.targets\.distance, whose number of neighbours is \d+; those of robot i"),
    ({"situate": _third_parameter}, r".*: situate uses index 0 of parameters, whose number of parameters is 0; add .*`parameters`"),
    ({"width": lambda self, n: Width(1, 2)}, r"situate, of robot 0 in a team of 1, leaves input 2 of 3 unwritten; .*correct width\(1\)"),
    ({"width": lambda self, n: Width(1, 0)}, r".*: situate uses index 1 of situation, whose number of inputs is 1; width\(team_size\)"),
    ({"width": lambda self, n: 2}, r"width\(1\)=2: must be Width\(own, added\), whole numbers of at least 0"),
    ({"width": lambda self, n: Width(18, -1)}, r"width\(1\)=Width\(own=18, added=-1\): must be"),
    ({"rings": lambda self, n: (1, 1)}, r"rings\(1\)=\(1, 1\): must be a tuple of numbers of sectors, in all at most the 1 inputs"),
    ({"rings": lambda self, n: [1]}, r"rings\(1\)=\[1\]: must be a tuple of numbers of sectors"),
    ({"parameters": np.array([np.nan])}, r"parameters=.*: must be finite numbers in 1 dimension"),
    ({"situate": None}, r"has no 'situate'; give a kernel"),
    ({"order": 1}, r"order=1: must be a str"),
]  # fmt: skip


@pytest.mark.parametrize(("members", "message"), WRONG, ids=[f"{n}-{'-'.join(case[0])}" for n, case in enumerate(WRONG)])
def test_what_breaks_the_contract_is_named(members: dict[str, Any], message: str) -> None:
    degree = type("Changed", (Nearest,), members)()
    with pytest.raises((TypeError, ValueError)) as raised:
        check_awareness(degree)
    assert re.match(rf"Changed(: |\.){message}", str(raised.value))
    assert len(str(raised.value)) < 400
    assert "\n" not in str(raised.value)
    rule = members.get("perceive") or members.get("situate")
    mark = f"# {rule.__name__[1:]}" if rule else "no mark"
    for number, line in enumerate(Path(__file__).read_text().splitlines(), 1):
        assert not line.endswith(mark) or f"{Path(__file__).name}:{number}: " in str(raised.value)


def test_a_kernel_that_cannot_be_compiled_is_named_with_its_line() -> None:
    degree = type("Changed", (Nearest,), {"situate": _misspelt})()
    with pytest.raises(TypeError, match=r"test_check\.py:\d+: Scene has no field 'headings'; it has heading, "):
        check_awareness(degree)


@kernel
def _returns_nothing(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> None:
    teammates.start[:] = 0


def test_a_perceive_that_returns_no_number_is_named() -> None:
    degree = type("Changed", (Nearest,), {"perceive": _returns_nothing})()
    with pytest.raises(TypeError, match=r"test_check\.py:\d+: .*returns none; it must return a whole number"):
        check_awareness(degree)


def test_something_else_than_a_degree_is_refused() -> None:
    with pytest.raises(TypeError, match=r"'ring': must be an object of a subclass of Awareness"):
        check_awareness("ring")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"RingAwareness: is a class; give an object, such as RingAwareness"):
        check_awareness(RingAwareness)  # type: ignore[arg-type]
