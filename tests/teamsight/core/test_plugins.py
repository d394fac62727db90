"""Plug-ins: those of installed distributions are found by name; a broken one is named with its distribution and error.

Each test installs a distribution, as pip leaves it, below tmp_path, and asks in a process of its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import teamsight

ROOT = Path(teamsight.__file__).resolve().parent.parent

MODULE = """
from dataclasses import dataclass
from typing import Any
from teamsight import CMOMMT, Sensor
from teamsight.agents.awareness import RingAwareness
from teamsight.policies import RandomWalk, Stationary

@dataclass(frozen=True)
class Still(Stationary):
    pass

def walk(turn_probability=0.5):
    return RandomWalk(turn_probability)

class Ring(RingAwareness):
    pass

class Hungry:
    def __init__(self, food):
        self.food = food

    def __call__(self, percept, rng):
        return 0.0, 0.0

made = Stationary()
number = 3

def team(robots: int, rng: int, policy: str = "still", sensor: Any = None):
    return CMOMMT(robots=robots, targets=3, policy=policy, sensor=sensor, rng=rng)

def twice(world, steps):
    world.run(steps)
    return {"policy_name": repr(world.robots.policy).partition("(")[0], "view": round(world.sensor.field_of_view, 6)}

half = Sensor(field_of_view=3.0)
"""


def install(folder: Path, distribution: str, entries: str, module: str = "", name: str = "plugged") -> None:
    """Write what pip would: a module, and the entry points of its distribution."""
    folder.mkdir(parents=True, exist_ok=True)
    info = folder / f"{distribution.replace('-', '_')}-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(entries)
    if module:
        (folder / f"{name}.py").write_text(module)


def python(code: str, *folders: Path, module: str | None = None) -> subprocess.CompletedProcess[str]:
    """Run Python with these folders on its path: a piece of code, or a module with arguments."""
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(map(str, (ROOT, *folders))))
    command = [sys.executable, "-m", module, *code.split()] if module else [sys.executable, "-c", code]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def error_of(code: str, *folders: Path) -> str:
    """Return the last line of the error with which a piece of code ends."""
    done = python(code, *folders)
    assert done.returncode == 1, (done.stdout, done.stderr)
    return done.stderr.strip().splitlines()[-1]


FIND = "from teamsight.core import plugins; print(plugins.find({!r}, {!r}))"
POLICIES = "[teamsight.policies]\n"


@pytest.mark.short
def test_plug_ins_are_listed_and_found_without_importing_them(tmp_path: Path) -> None:
    entries = (
        f"[console_scripts]\nx = y:z\n{POLICIES}still = plugged:number\n# a comment\n\n"
        "[teamsight.measures]\ncount = plugged:number [extra]\n[teamsight.nothing]\nx = y:z\n"
    )
    install(tmp_path, "Nice-Robots", entries, "print('imported'); number = 3")
    code = (
        "import sys; from teamsight.core import plugins\nprint(*plugins.plug_ins(), sep='\\n')\n"
        "print(plugins.names('teamsight.policies'), plugins.has('teamsight.models', 'still'), 'plugged' in sys.modules)\n"
        "print(plugins.find('teamsight.measures', 'count'))"
    )
    assert python(code, tmp_path).stdout.splitlines() == [
        "PlugIn(group='teamsight.policies', name='still', reference='plugged:number', distribution='Nice-Robots 1.2')",
        "PlugIn(group='teamsight.measures', name='count', reference='plugged:number', distribution='Nice-Robots 1.2')",
        "('still',) False False", "imported", "3",
    ]  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize(
    ("value", "why"),
    [
        ("plugged:x", r"module 'plugged' fails to import: ZeroDivisionError: division by zero (plugged.py, line 2); correct the module"),
        ("nowhere:x", "there is no module 'nowhere'; install it"),
        ("math:sqr", "module 'math' has no 'sqr'; did you mean 'sqrt'?"),
        ("math", "is no reference; write the module and the name in it"),
        ("", "is no reference"),
    ],
    ids=["raises", "missing-module", "missing-name", "module", "empty"],
)  # fmt: skip
def test_a_broken_plug_in_is_named_with_its_distribution_and_error(value: str, why: str, tmp_path: Path) -> None:
    install(tmp_path, "nice-robots", f"{POLICIES}flee = {value}\n", "x = 1\nx / 0\n")
    error = error_of(FIND.format("teamsight.policies", "flee"), tmp_path)
    assert error.startswith(f"ValueError: policy='flee': the plug-in {value!r} of nice-robots 1.2 does not load: ")
    assert why in error


@pytest.mark.short
def test_an_unknown_name_is_answered_with_the_nearest_plug_in(tmp_path: Path) -> None:
    install(tmp_path, "nice-robots", "[teamsight.models]\nflocking = plugged:number\n")
    assert error_of(FIND.format("teamsight.models", "floking"), tmp_path) == (
        "ValueError: model='floking': unknown; did you mean 'flocking'? plug-ins are flocking"
    )
    assert "known are teamsight.awareness" in error_of(FIND.format("teamsight.model", "x"), tmp_path)
    code = "import sys\nfrom teamsight.core import checks\nfrom teamsight.policies.registry import policy_named\npolicy_named('flea')"
    install(tmp_path / "late", "late-robots", f"{POLICIES}flee = plugged:number\n")
    assert error_of(code, tmp_path / "late").endswith("flee, group-forces, lattice-walk, lazy-collective, lazy-cooperative, p-cmommt, ppo, random-walk, stationary")


@pytest.mark.short
def test_two_distributions_with_one_name_are_both_named(tmp_path: Path) -> None:
    for letter in "ab":
        install(tmp_path, f"robots-{letter}", f"{POLICIES}flee = {letter}:Flee\nother = math:pi\n")
    error = error_of(FIND.format("teamsight.policies", "flee"), tmp_path)
    assert error == (
        "ValueError: policy='flee': is a plug-in of robots-a 1.2 (a:Flee) and robots-b 1.2 (b:Flee); uninstall one of them"
    )
    # The same object under the same name is no conflict.
    assert python(FIND.format("teamsight.policies", "other"), tmp_path).stdout.startswith("3.14")


@pytest.mark.short
def test_of_two_versions_the_first_on_the_path_counts(tmp_path: Path) -> None:
    for number, folder in enumerate(("first", "second")):
        install(tmp_path / folder, "Robots", f"{POLICIES}flee = plugged:number\n", f"number = {number}\n")
    done = python(FIND.format("teamsight.policies", "flee"), tmp_path / "first", tmp_path / "second")
    assert done.stdout == "0\n", done.stderr


def test_whatever_takes_a_name_finds_plug_ins(tmp_path: Path) -> None:
    entries = (
        f"{POLICIES}still = plugged:Still\nwalk = plugged:walk\nmade = plugged:made\nhungry = plugged:Hungry\nnumber = plugged:number\n"
        "a-cmommt = plugged:number\n[teamsight.awareness]\nmy-ring = plugged:Ring\nnumber = plugged:number\n"
        "[teamsight.rewards]\nmine = plugged:walk\n[teamsight.models]\nteam = plugged:team\n"
        "[teamsight.measures]\ntwice = plugged:twice\n[teamsight.sensors]\nhalf = plugged:half\n"
    )
    install(tmp_path, "nice-robots", entries, MODULE)
    code = """
from teamsight import CMOMMT, Robot, run_many, Disc, Study, World
from teamsight.analysis.learning.registry import REWARDS
from teamsight.core import checks
from teamsight.policies.registry import POLICIES, label
for policy, options in (("still", None), ("walk", {"turn_probability": 0.25}), ("made", None), ("a-cmommt", None)):
    model = CMOMMT(robots=2, targets=2, policy=policy, policy_options=options, awareness="my-ring", delta=4, rng=1)
    print(repr(model.robots.policy).partition("(")[0], type(model.robots.awareness).__name__, model.robots.awareness.delta)
print(model.settings["policy"], label(CMOMMT(policy="still", rng=1).robots.policy))
print(World(Disc(3.0), rng=1).add(Robot, 2, policy="still", awareness="my-ring").policy)
print(run_many([{"policy": "still"}, {"policy": "walk"}], steps=3, replicates=1)["policy"].tolist())
print(checks.choice("reward", "mine", REWARDS), REWARDS["mine"].__name__, "theirs" in REWARDS, "still" in list(POLICIES))
study = Study(model="team", axes={"policy": ["still", "walk"]}, fixed={"robots": 2, "sensor": "half"}, steps=2, record={"measure": "twice"})
print(study.run("study").frame[["policy", "policy_name", "view"]].values.tolist())
for settings in (
    {"policy": "hungry"}, {"policy": "number"}, {"awareness": "number"}, {"policy": "still", "policy_options": {"x": 1}},
    {"policy": "stil"}, {"awareness": "your-ring"},
):
    try:
        CMOMMT(**settings, rng=1)
    except (TypeError, ValueError) as error:
        print(error)
"""
    done = python(code.replace('"study")', f'{str(tmp_path / "study")!r})'), tmp_path)
    assert done.stdout.splitlines() == [
        "Still Ring 4",
        "RandomWalk Ring 4",
        "Stationary Ring 4",
        "ACmommt Ring 4",
        "a-cmommt 'still'",
        "Still()",
        "['still', 'walk']",
        "mine walk False False",
        "[['still', 'Still', 3.0], ['walk', 'RandomWalk', 3.0]]",
        "policy='hungry': needs food; give policy_options={'food': …}, on a command line --policy.food",
        "policy='number': its policy=3: must be a name, a Policy, or a callable f(percept, rng) -> (turn, distance)",
        "awareness='number': this plug-in is no class derived from teamsight.agents.awareness.Awareness",
        "policy_options: 'still' has no option 'x'; it has no options",
        "policy='stil': unknown; did you mean 'still'? known are a-cmommt, adaptive-forces, b-cmommt, centroid, evasive, evolved, "
        "group-forces, hungry, lattice-walk, lazy-collective, lazy-cooperative, made, number, p-cmommt, ppo, random-walk, stationary, still, walk",
        "awareness='your-ring': unknown; did you mean 'my-ring'? known are my-ring, nearest, none, number, pairwise, relayed, ring, shared",
    ], done.stderr  # fmt: skip


def test_commands_find_plug_ins_and_list_them(tmp_path: Path) -> None:
    entries = (
        f"{POLICIES}still = plugged:Still\nbroken = plugged:Nothing\na-cmommt = plugged:Still\n"
        "[teamsight.measures]\ncount = plugged:number\n[teamsight.awareness]\nmy-ring = plugged:Ring\n"
    )
    install(tmp_path, "nice-robots", entries, MODULE)
    install(tmp_path, "more-robots", "[teamsight.measures]\ncount = math:pi\n")
    done = python("run --policy still --awareness my-ring --robots 2 --steps 3", tmp_path, module="teamsight")
    assert done.returncode == 0, done.stderr
    assert "observed targets" in done.stdout
    done = python("run --policy broken", tmp_path, module="teamsight")
    assert done.returncode == 2
    assert done.stderr == (
        "teamsight: policy='broken': the plug-in 'plugged:Nothing' of nice-robots 1.2 does not load: module 'plugged' has no "
        "'Nothing'; did you mean 'Ring'?\n"
    )
    done = python("plugins", tmp_path, module="teamsight")
    assert done.returncode == 1
    lines = [" ".join(line.split()) for line in done.stdout.splitlines()]
    assert lines[0] == "group name object distribution state"
    assert "teamsight.policies still plugged:Still nice-robots 1.2 loads" in lines
    assert "teamsight.awareness my-ring plugged:Ring nice-robots 1.2 loads" in lines
    assert any(line.startswith("teamsight.policies a-cmommt") and "is never used" in line for line in lines)
    assert any(line.startswith("teamsight.policies broken") and "has no 'Nothing'" in line for line in lines)
    assert any(line.startswith("teamsight.measures count math:pi more-robots") and "nice-robots 1.2 has one" in line for line in lines)
    assert lines[-1] == "6 plug-ins, of which 4 cannot be used"


@pytest.mark.short
def test_names_of_our_own_never_look_for_plug_ins() -> None:
    code = (
        "import sys; from teamsight.policies.registry import POLICIES, policy_named; policy_named('stationary'); list(POLICIES)\n"
        "from teamsight.agents.awareness.registry import awareness_named; awareness_named('ring')\n"
        "print('teamsight.core.plugins' in sys.modules)"
    )
    assert python(code).stdout == "False\n"
