"""The cache of kernels: nothing compiles at import, everything once a machine, and no edit goes unnoticed."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import teamsight

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
from teamsight.core.kernel import kernel

STEP = 1.0

@kernel
def shift(x{default}):
    return x + {body}
"""


class Lab:
    """A folder with two modules, one of which calls the other, and a cache of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def run(
        self, body: str = "STEP", imports: str = "from callee import shift", call: str = "shift", default: str = ""
    ) -> list[str]:
        """Write the modules, and return what the kernel gives, how many entries were compiled, and the digest."""
        (self.folder / "callee.py").write_text(CALLEE.format(body=body, default=default))
        (self.folder / "main.py").write_text(MAIN.format(imports=imports, call=call))
        return python(self.folder, "main.py").split()


def python(folder: Path, *arguments: str, cache: str | None = None) -> str:
    kept = str(folder / "cache") if cache is None else cache
    environment = dict(os.environ, TEAMSIGHT_CACHE_DIR=kept, PYTHONPATH=str(ROOT), PYTHONDONTWRITEBYTECODE="1")
    done = subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.mark.short
def test_a_second_process_finds_what_the_first_compiled_and_notices_an_edit_in_a_called_file(lab: Lab) -> None:
    first = lab.run()
    assert first[:2] == ["8.0", "1"]
    assert lab.run() == ["8.0", "0", first[2]]
    edited = lab.run(body="2.0 * STEP")
    assert edited[:2] == ["10.0", "1"]
    assert edited[2] != first[2]
    # The old code is still there for the old source.
    assert lab.run() == ["8.0", "0", first[2]]


def test_a_changed_constant_is_noticed(lab: Lab) -> None:
    first = lab.run()
    CALLEE_WITH = CALLEE.replace("STEP = 1.0", "STEP = 5.0")
    (lab.folder / "callee.py").write_text(CALLEE_WITH.format(body="STEP", default=""))
    other = python(lab.folder, "main.py").split()
    assert other[:2] == ["16.0", "1"]
    assert other[2] != first[2]


def test_an_edit_is_noticed_in_what_is_called_through_its_module(lab: Lab) -> None:
    assert lab.run(imports="import callee", call="callee.shift")[0] == "8.0"
    assert lab.run(imports="import callee", call="callee.shift", body="2.0 * STEP")[0] == "10.0"


def test_a_changed_default_is_noticed(lab: Lab) -> None:
    assert lab.run(body="more", default=", more=1.0")[0] == "8.0"
    assert lab.run(body="more", default=", more=2.0")[0] == "10.0"


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


def test_a_script_runs_once_though_another_imported_it_before(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT)
    assert python(tmp_path, "-c", "import script") == "script 3.0\n"
    # The cache names the module in which the kernel was compiled, and the folder of a script is on the path.
    assert python(tmp_path, "script.py") == "__main__ 3.0\n"


COUNT = """
from teamsight.core.kernel import Entry
# All that are needed, whether they are in the cache or not.
compiled, get_ready = [], Entry._compile

def noted(entry):
    compiled.append(entry.function.__qualname__)
    get_ready(entry)

Entry._compile = noted
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
    # 10 rules, 3 arenas, 5 situations, 3 perceptions, and what the loop, the search and the noise take: 126 combinations.
    assert len(names) == number <= 10 + 3 + 5 + 3 + 9, names


def test_an_unwritable_folder_does_not_stop_anybody(tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("a file where the folder should be")
    (tmp_path / "one.py").write_text("from teamsight.world.noise import key_of, uniforms\nimport numpy as np\n"
                                     "print(uniforms(key_of(1), 1, 0, np.arange(3), 1).shape)\n")  # fmt: skip
    assert python(tmp_path, "one.py").split() == ["(1,", "3)"]


def test_entries_survive_pickling(tmp_path: Path) -> None:
    script = """
        import pickle, numpy as np
        from teamsight.policies import ACmommt
        from teamsight.agents.awareness import RingAwareness
        for part in (ACmommt(idle="stay"), RingAwareness(4)):
            assert pickle.loads(pickle.dumps(part)) == part
        print("kept")
    """
    (tmp_path / "keep.py").write_text(textwrap.dedent(script))
    assert python(tmp_path, "keep.py") == "kept\n"
