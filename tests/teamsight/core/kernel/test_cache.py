"""The cache of kernels: nothing compiles at import, everything once a machine, and no edit goes unnoticed."""

from __future__ import annotations

import importlib
import os
import pickle
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import teamsight
from teamsight.agents.awareness import RingAwareness
from teamsight.core.kernel import Entry
from teamsight.policies import ACmommt

ROOT = Path(teamsight.__file__).resolve().parent.parent

MAIN = """
import sys
import numpy as np
{imports}
from teamsight.core.kernel.cache import digest
from teamsight.core.kernel import Entry, array_at, kernel

@kernel
def twice(x):
    return 2.0 * {call}(x)

def run(address):
    row = array_at(address, 1, np.float64)
    row[0] = twice(row[0])
    return 0

import teamsight.core.kernel
compiled = []
teamsight.core.kernel.entry.announce = compiled.append
row = np.array([3.0])
Entry(run)(row.ctypes.data)
print(row[0], len(compiled), digest(run))
"""

CALLEE = """
import numpy as np
from teamsight.core.kernel import kernel

STEP = 1.0
TABLE = np.ones(2001)
TABLE[1000] = STEP

@kernel
def shift(x{default}):
    return x + {body}
"""


class Lab:
    """A folder with two modules, one of which calls the other, and a cache of its own."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder, self._capsys = folder, capsys

    def run(
        self, body: str = "STEP", imports: str = "from callee import shift", call: str = "shift", default: str = "",
        step: float = 1.0, *, process: bool = False,
    ) -> list[str]:  # fmt: skip
        """Write the modules, and return what the kernel gives, how many entries were compiled, and the digest.

        The modules are imported anew by this process, or by one of their own.
        """
        callee = CALLEE.replace("STEP = 1.0", f"STEP = {step}")
        (self.folder / "callee.py").write_text(callee.format(body=body, default=default))
        (self.folder / "main.py").write_text(MAIN.format(imports=imports, call=call))
        if process:
            return python(self.folder, "main.py").split()
        sys.modules.pop("callee", None)
        importlib.invalidate_caches()
        runpy.run_path(str(self.folder / "main.py"), run_name="__main__")
        return self._capsys.readouterr().out.split()


def python(folder: Path, *arguments: str, cache: str | None = None) -> str:
    kept = str(folder / "cache") if cache is None else cache
    environment = dict(os.environ, TEAMSIGHT_CACHE_DIR=kept, PYTHONPATH=str(ROOT), PYTHONDONTWRITEBYTECODE="1")
    done = subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Lab]:
    monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield Lab(tmp_path, capsys)
    sys.modules.pop("callee", None)


@pytest.mark.short
def test_a_second_process_finds_what_the_first_compiled_and_notices_an_edit_in_a_called_file(lab: Lab) -> None:
    first = lab.run(process=True)
    assert first[:2] == ["8.0", "1"]
    assert lab.run() == ["8.0", "0", first[2]]
    edited = lab.run(body="2.0 * STEP")
    assert edited[:2] == ["10.0", "1"]
    assert edited[2] != first[2]
    # The old code is still there for the old source.
    assert lab.run(process=True) == ["8.0", "0", first[2]]


@pytest.mark.parametrize(
    ("one", "other", "result"),
    [
        ({}, {"step": 5.0}, "16.0"),
        ({"imports": "import callee", "call": "callee.shift"}, {"body": "2.0 * STEP"}, "10.0"),
        ({"body": "more", "default": ", more=1.0"}, {"default": ", more=2.0"}, "10.0"),
        ({"body": "TABLE[1000]"}, {"step": 5.0}, "16.0"),
    ],
    ids=["a constant", "what is called through its module", "a default", "an element of a table"],
)
def test_a_change_is_noticed(one: dict[str, Any], other: dict[str, Any], result: str, lab: Lab) -> None:
    first = lab.run(**one)
    assert first[:2] == ["8.0", "1"]
    second = lab.run(**{**one, **other})
    assert second[:2] == [result, "1"]
    assert second[2] != first[2]


SCRIPT = """
import sys
import numpy as np
from teamsight.core.kernel import Entry, array_at, kernel

@kernel
def root(x):
    return x**0.5

def run(address):
    row = array_at(address, 1, np.float64)
    row[0] = root(row[0])
    return 0

row = np.array([9.0])
Entry(run)(row.ctypes.data)
print(__name__, row[0])
"""


def test_a_script_runs_once_though_another_imported_it_before(lab: Lab, capsys: pytest.CaptureFixture[str]) -> None:
    (lab.folder / "script_of_a_test.py").write_text(SCRIPT)
    importlib.import_module("script_of_a_test")
    assert capsys.readouterr().out == "script_of_a_test 3.0\n"
    # The cache names the module in which the kernel was compiled, and the folder of a script is on the path.
    assert python(lab.folder, "script_of_a_test.py") == "__main__ 3.0\n"


COUNT = """
from teamsight.core.kernel import Entry
# All that are needed, whether they are in the cache or not.
compiled, get_ready = [], Entry._get_ready

def noted(entry):
    compiled.append(entry.function.__qualname__)
    get_ready(entry)

Entry._get_ready = noted
import teamsight.agents.cmommt, teamsight.agents.world, teamsight.policies, teamsight.world.arena
assert not compiled, compiled
from teamsight import CMOMMT, Box, Disc, Robot, Target, Torus, World
from teamsight.agents.awareness import AWARENESS
from teamsight.policies.registry import POLICIES, policy_named

for arena in (Disc(2.0), Box(3.0, 4.0), Torus(3.0, 4.0)):
    for policy in POLICIES:
        degree, needs = policy_named(policy).degree, set(policy_named(policy).needs)
        fitting = [name for name, kind in AWARENESS.items() if needs <= set(kind.delivers)]
        for awareness in fitting if degree is None else (degree,):
            world = World(arena, rng=1)
            robots = world.add(Robot, 3, policy=policy, awareness=awareness)
            world.senses(robots, world.add(Target, 3, policy="random-walk"))
            world.run(2)
            world.step()
            robots[0].situation
print(len(compiled))
print(*sorted(set(compiled)))
"""


def test_compilation_adds_up_and_never_multiplies(tmp_path: Path) -> None:
    (tmp_path / "count.py").write_text(COUNT)
    # With the cache of all tests: to compile everything anew takes a minute.
    first, second = python(tmp_path, "count.py", cache=os.environ.get("TEAMSIGHT_CACHE_DIR", "")).splitlines()
    number, names = int(first), second.split()
    # 13 rules, 3 arenas, 6 situations, 4 perceptions, and what the loop, the search and the noise take: 186 combinations.
    assert len(names) == number <= 13 + 3 + 6 + 4 + 9, names


def test_an_unwritable_folder_does_not_stop_anybody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cache").write_text("a file where the folder should be")
    monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(tmp_path / "cache"))
    assert Entry(lambda given: given + 3)(4) == 7


WARM = """
import sys
import teamsight.core.kernel.entry
from teamsight.core.kernel.cache import _settings

teamsight.core.kernel.entry.announce = print
from teamsight import CMOMMT

world = CMOMMT(robots=3, targets=3, seed=1)
world.run(5)
settings = _settings()
is_there = "numba" in sys.modules
import numba
print(is_there, settings == _settings())
"""


def test_what_is_in_the_cache_runs_without_numba(tmp_path: Path) -> None:
    (tmp_path / "warm.py").write_text(WARM)
    kept = os.environ.get("TEAMSIGHT_CACHE_DIR", "")
    python(tmp_path, "warm.py", cache=kept)
    assert python(tmp_path, "warm.py", cache=kept) == "False True\n"


RAISING = """
import teamsight.core.kernel.entry
from teamsight.core.kernel import Entry

teamsight.core.kernel.entry.announce = print

def refuse(number):
    if number < 0:
        raise ValueError("negative")
    return number

print(Entry(refuse)(3), Entry(refuse)(-3))
"""


def test_code_that_calls_functions_of_numba_is_loaded_with_them(tmp_path: Path) -> None:
    (tmp_path / "raising.py").write_text(RAISING)
    assert [python(tmp_path, "raising.py") for _ in range(2)] == ["refuse\n3 0\n", "3 0\n"]


def test_entries_survive_pickling() -> None:
    for part in (ACmommt(idle="stay"), RingAwareness(4)):
        assert pickle.loads(pickle.dumps(part)) == part
