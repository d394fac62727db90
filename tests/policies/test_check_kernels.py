"""`check_policy` on kernels that use memory, parameters, noise or elements which they do not have."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import teamsight
from teamsight.core.kernel import kernel
from teamsight.policies import (
    ACmommt,
    CompiledPolicy,
    LazyRegression,
    LinearQ,
    PessimisticLazyQ,
    PolicyState,
    RandomWalk,
    SheppardLazyQ,
    TabularQ,
    check_policy,
)
from teamsight.policies import compiled as compiled_policies
from teamsight.policies.lazy.lazy_q import shipped

ROOT = Path(teamsight.__file__).resolve().parent.parent
SCRIPT = Path(__file__).parent / "overruns.py"

# The policies of the script have two slots of three fields, two parameters and one draw.
REFUSED = {
    "slot_100": r"index 100 of arrays\.state\.floats, whose number of slots is 2; declare .* start\(size\)",
    "far_slot_of_a_view": r"index 5 of arrays\.state\.ints, whose number of slots is 2; declare .* start\(size\)",
    "nested": r"index 100000 of arrays\.state\.floats, whose number of slots is 2; declare .* start\(size\)",
    "after_a_while": r"index 2 of arrays\.state\.floats, whose number of slots is 2; declare .* start\(size\)",
    "slot_for_each_target": r"index 2 of arrays\.state\.floats, whose number of slots is 2; declare .* start\(size\)",
    "slot_by_identity": r"index -2 of arrays\.state\.floats, .* slots is 2; indices count from 0",
    "negative": r"index -1 of arrays\.state\.floats, .* robots is 1; indices count from 0",
    "undeclared_draw": r"index 1 of noise, whose number of draws is 1; declare .* `draws`",
    "noise_of_nobody": r"index 1 of noise, whose number of robots is 1; .*stop at percept\.heading\.shape\[0\]",
    "noise_as_a_whole": r"index 1 of noise, whose number of robots is 1; .*stop at percept\.heading\.shape\[0\]",
    "noise_into_memory": r"uses noise beyond the 1 robots, .*stop at percept\.heading\.shape\[0\]",
    "undeclared_parameter": r"index 2 of arrays\.parameters, whose number of parameters is 2; add .* `parameters`",
    "robot_of_nobody": r"index 1 of action\.distance, whose number of robots is 1; .*percept\.heading\.shape\[0\]",
    "robot_left_out": r"leaves action\.heading of robot 0 unwritten.*write it for every robot",
    "sighting_beyond": r"index \d+ of percept\.targets\.offset, whose number of neighbours is \d+; .*start\[i \+ 1\]",
    "writes_percept": r"writes into percept\.speed, which is read-only; copy",
    "writes_parameters": r"writes into arrays\.parameters, which is read-only; copy",
    "writes_noise": r"writes into noise, which is read-only; copy",
    "beyond_scratch": r"index 4 of an array of its own, whose number of elements is 4; stay within",
    "behind_its_memory": r"writes next to arrays\.state\.floats",
    "raises": r"raises IndexError\('tuple index out of range'\).*check indices",
    "raises_itself": r"raises ValueError\('too many'\).*check indices",
    "whole_of_nan": r"index -9223372036854775808 of arrays\.state\.floats, .* slots is 2; indices count from 0",
}


@pytest.fixture(scope="module")
def refusals() -> dict[str, str]:
    """What the check says of each policy of the script, which runs in a process of its own: it is dangerous."""
    environment = dict(os.environ, PYTHONPATH=str(ROOT))
    done = subprocess.run(
        [sys.executable, str(SCRIPT)], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(line) for line in done.stdout.splitlines())


@pytest.mark.parametrize("name", REFUSED)
def test_a_kernel_that_leaves_its_arrays_is_named(name: str, refusals: dict[str, str]) -> None:
    said = refusals[name]
    assert re.match(r"ValueError: Overrun: .*" + REFUSED[name], said)
    assert len(said) < 400
    lines = SCRIPT.read_text().splitlines()
    marked = [number for number, text in enumerate(lines, 1) if text.endswith(f"# {name}")]
    assert all(f"overruns.py:{number}: " in said for number in marked), said


def test_every_policy_of_the_script_is_refused(refusals: dict[str, str]) -> None:
    assert set(refusals) == set(REFUSED)


@kernel
def _views(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Does with arrays what kernels may do with them besides taking elements."""
    seen = percept.targets if percept.speed[0] > 1.0 else percept.teammates
    total = percept.speed.sum() + seen.start[0] + percept.heading[..., 0][0] + percept.heading.T[1, 0]
    for row in percept.heading[:1]:
        x, y = row
        total += x * y + row.sum()
    for i, speed in enumerate(percept.speed):
        total += speed * noise[0, np.uint64(i)]
    arrays.state.floats[:, 0, :] = 0.0
    action.heading[:, 0] = 0.0
    action.heading[:, 1].fill(0.0)
    action.distance[:] = total


class Views(CompiledPolicy):
    kernel = _views
    draws = 1
    parameters = ()

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 1, 1)), np.zeros((size, 0, 0), np.int64))


@pytest.mark.filterwarnings("error")
def test_views_slices_loops_and_reductions_pass() -> None:
    check_policy(Views())


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "make",
    [
        lambda: RandomWalk(0.3, 1.0, True),
        lambda: ACmommt(idle="wander", weights="per-teammate", target_tracks=3),
        lambda: SheppardLazyQ(inputs=8, capacity=20),
        lambda: PessimisticLazyQ(shipped()),
        lambda: LazyRegression(shipped(), significance=0),
        lambda: TabularQ(shipped(), sweeps=2),
        lambda: LinearQ(shipped(), sweeps=2),
    ],
    ids=["random-walk", "a-cmommt", "sheppard", "pessimistic", "regression", "tabular", "linear"],
)
def test_policies_that_go_by_no_name_pass(make: Any) -> None:
    check_policy(make())


@pytest.mark.parametrize(
    ("member", "value", "message"),
    [
        ("parameters", 1.0, r"parameters=1\.0: must be numbers in 1 dimension, such as"),
        ("parameters", ("slow",), r"parameters=\('slow',\): must be numbers in 1 dimension"),
        ("table", np.zeros(3), r"table=.*: must be numbers in 2 dimensions, such as"),
        (
            "kernel",
            lambda percept, arrays, noise, action: None,
            r"test_check_kernels\.py:\d+: .*decorate it with @kernel",
        ),
    ],
)
def test_what_a_policy_declares_is_checked(member: str, value: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        check_policy(type("Declares", (Views,), {member: value})())


def test_a_policy_without_a_kernel_is_named() -> None:
    with pytest.raises(TypeError, match=r"Bare: has no 'kernel'; give kernel\(percept, arrays, noise, action\)"):
        check_policy(type("Bare", (CompiledPolicy,), {"parameters": ()})())


class Hides(RandomWalk):
    """Decides in Python, by the kernel of another policy, on noise that it cuts."""

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        return super().decide(percept, memory, noise[:1])


def test_a_kernel_that_is_called_by_another_decide_is_guarded_too() -> None:
    check_policy(Hides())
    with pytest.raises(ValueError, match=r"index 1 of noise, whose number of draws is 1"):
        check_policy(Hides(0.5))


def test_decisions_outside_of_a_check_are_not_tried_twice() -> None:
    with pytest.raises(ValueError, match="draws"):
        check_policy(Hides(0.5))
    assert compiled_policies.before_decision is None


def test_a_kernel_that_cannot_run_as_plain_python_is_named() -> None:
    @kernel
    def divides(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
        limit = 0.0
        action.distance[:] = min(1.0, 1.0 / limit)
        action.heading[:] = 0.0

    policy = type("Divides", (CompiledPolicy,), {"kernel": divides, "parameters": ()})()
    where = divides.py_func.__code__.co_firstlineno + 3
    with pytest.warns(UserWarning, match=rf"Divides: .*py:{where}: from here on .* not checked.*ZeroDivisionError"):
        check_policy(policy)


MODULE = """
from teamsight.core.kernel import kernel
from teamsight.policies import CompiledPolicy, check_policy
{comment}
@kernel
def rule(percept, arrays, noise, action):
    action.distance[percept.heading.shape[0]] = 0.0

class Rule(CompiledPolicy):
    kernel = rule
    parameters = ()

try:
    check_policy(Rule())
except ValueError as error:
    print(error)
"""


def test_the_line_is_that_of_the_source_also_after_the_cache(tmp_path: Path) -> None:
    environment = dict(os.environ, PYTHONPATH=str(ROOT), TEAMSIGHT_CACHE_DIR=str(tmp_path / "cache"))
    said = []
    for comment in ("", "# one\n# more"):
        (tmp_path / "rule.py").write_text(MODULE.format(comment=comment))
        done = subprocess.run(
            [sys.executable, "rule.py"], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        said.append((re.findall(r"rule\.py:(\d+): ", done.stdout), "compiling" in done.stderr))
    # The other finds what the first has compiled, although its line has moved.
    assert [places for places, _ in said] == [["7"], ["8"]]
    assert [compiled for _, compiled in said] == [True, False]


def test_a_kernel_without_a_source_file_is_named_by_its_line() -> None:
    names: dict[str, Any] = {"kernel": kernel}
    exec("@kernel\ndef made(percept, arrays, noise, action):\n    action.distance[-1] = 0.0\n", names)
    policy = type("Made", (CompiledPolicy,), {"kernel": names["made"], "parameters": ()})()
    with pytest.raises(ValueError, match=r"Made: <string>:3: its kernel uses index -1 of action\.distance"):
        check_policy(policy)


def test_a_kernel_that_reads_teammates_against_its_declaration_is_named() -> None:
    class Blind(ACmommt):
        @property
        def reads_teammates(self) -> bool:
            return False

    with pytest.raises(ValueError, match=r"Blind\.reads_teammates is False, .* depend on teammates; return True"):
        check_policy(Blind())
