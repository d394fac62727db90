"""The face: the public names, found on first use, and no folder of the house under its bare name."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import teamsight

ROOT = Path(teamsight.__file__).resolve().parent.parent


def python(code: str) -> subprocess.CompletedProcess[str]:
    environment = dict(os.environ, PYTHONPATH=str(ROOT))
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)


@pytest.mark.short
def test_every_public_name_is_there() -> None:
    for name in teamsight.__all__:
        assert getattr(teamsight, name) is not None
    assert set(teamsight.__all__) <= set(dir(teamsight))


@pytest.mark.short
def test_policies_have_every_policy_and_nothing_borrowed() -> None:
    from teamsight import policies

    assert set(policies.__all__) <= set(dir(policies))
    assert {"LazyQ", "TabularQ", "LinearQ"} <= set(policies.__all__)
    assert not {"Any", "Callable"} & set(dir(policies))


def test_a_wrong_name_is_an_ordinary_error_that_lists_the_right_ones() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Cmommt'; it has .*CMOMMT"):
        _ = teamsight.Cmommt


def test_importing_the_package_imports_nothing_slow() -> None:
    slow = ["mesa", "numba", "pandas", "scipy", "matplotlib", "networkx", "simpy", "numpy"]
    done = python(f"import sys, teamsight; print([name for name in {slow} if name in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.parametrize("room", ["agents", "policies", "world", "analysis"])
def test_a_folder_under_its_bare_name_is_refused(room: str) -> None:
    done = python(f"import {room}")
    assert done.returncode == 1
    assert f"ImportError: import teamsight.{room}: the folder {room}/ is a part of the package" in done.stderr


def test_policies_and_world_import_neither_each_other_nor_frameworks() -> None:
    for packages, banned in [
        ("teamsight.policies", ["mesa", "simpy", "pandas", "networkx", "teamsight.world", "teamsight.agents"]),
        (
            "teamsight.world.search, teamsight.world.noise, teamsight.world.motion",
            ["mesa", "pandas", "teamsight.policies", "teamsight.agents"],
        ),
    ]:
        done = python(f"import sys, {packages}; print([name for name in {banned} if name in sys.modules])")
        assert done.stdout.strip() == "[]", done.stdout + done.stderr
