"""Types: a type checker accepts a correct script of a user's, and finds each typo."""

from __future__ import annotations

import inspect
import re
import runpy
import subprocess
import sys
import typing
from pathlib import Path
from typing import Any, get_args

import pytest

import teamsight
from teamsight.agents.attributes import AwarenessName, PlacementName, PolicyName
from teamsight.agents.awareness import AWARENESS
from teamsight.agents.presets import PRESETS
from teamsight.agents.settings import PresetName
from teamsight.policies.registry import POLICIES

ROOT = Path(teamsight.__file__).resolve().parent.parent
SCRIPTS = Path(__file__).parent / "scripts"
CHECKED = sorted(SCRIPTS.glob("*.py"))
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


# Rare, because mypy reads the whole package anew for half a minute.
@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[int]]:
    """Return the lines of each script in which mypy finds an error, as users have it: with --strict and no settings."""
    folder = tmp_path_factory.mktemp("mypy")
    empty = folder / "mypy.ini"
    # What the package imports is found here, and not checked again: errors in it are no user's.
    # Some other packages have no types.
    settings = f"[mypy]\nmypy_path = {ROOT}\ndisable_error_code = import-untyped\n"
    # Its extra is too large for each machine that tests.
    settings += "[mypy-torch.*]\nignore_missing_imports = True\n"
    empty.write_text(settings, encoding="utf-8")
    options = ["--strict", "--follow-imports=silent", f"--config-file={empty}", f"--cache-dir={folder}"]
    command = [sys.executable, "-m", "mypy", *options, *map(str, [*CHECKED, *EXAMPLES])]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    assert not done.stderr
    found: dict[str, set[int]] = {path.stem: set() for path in [*CHECKED, *EXAMPLES]}
    for name, line in re.findall(r"(\w+)\.py:(\d+): error", done.stdout):
        found[name].add(int(line))
    return found


@pytest.mark.rare
def test_a_correct_script_has_no_errors(reports: dict[str, set[int]]) -> None:
    assert reports["correct"] == set()


@pytest.mark.rare
@pytest.mark.parametrize("name", [path.stem for path in EXAMPLES])
def test_an_example_has_no_errors(reports: dict[str, set[int]], name: str) -> None:
    assert reports[name] == set()


@pytest.mark.rare
def test_each_typo_is_found(reports: dict[str, set[int]]) -> None:
    lines = (SCRIPTS / "typos.py").read_text(encoding="utf-8").splitlines()
    wrong = {number for number, line in enumerate(lines, 1) if "# typo" in line}
    assert len(wrong) == 34
    assert reports["typos"] == wrong


@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_the_correct_script_runs() -> None:
    runpy.run_path(str(SCRIPTS / "correct.py"))


def test_names_for_completion_are_those_of_the_registries() -> None:
    assert set(get_args(PolicyName)) == set(POLICIES)
    assert set(get_args(AwarenessName)) == set(AWARENESS)
    assert set(get_args(PresetName)) == set(PRESETS)
    assert set(get_args(PlacementName)) == {"uniform", "spread", "cells"}


# Where a type cannot be said, by name, and why.
MAY_BE_ANY = {
    "Body.__init__(model)": "the user's own model",
    "World.add(arguments)": "arguments of the user's own class",
}


def test_public_signatures_say_their_types() -> None:
    for name in ("World", "CMOMMT", "Robot", "Target", "Body"):
        kind = getattr(teamsight, name)
        for member, function in inspect.getmembers(kind, inspect.isfunction):
            owner = next(base for base in kind.__mro__ if member in vars(base))
            if not owner.__module__.startswith("teamsight") or (member.startswith("_") and member != "__init__"):
                continue
            hints = _hints(function)
            for parameter, hint in hints.items():
                place = f"{owner.__name__}.{member}({parameter})"
                assert hint is not Any or place in MAY_BE_ANY, f"{place} is Any"


def _hints(function: Any) -> dict[str, Any]:
    space = {**vars(inspect.getmodule(function)), **vars(typing)}
    return {name: space.get(hint, hint) if isinstance(hint, str) else hint for name, hint in function.__annotations__.items()}
