"""Without the optional packages, the first import names the command that installs them."""

from __future__ import annotations

import subprocess
import sys

import pytest

from teamsight.env.extras import require

SCRIPT = """
import sys
sys.modules["pettingzoo"] = None
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "pettingzoo" else found(name, *rest)
try:
    import teamsight.env
except ImportError as error:
    print(error)
"""


def test_the_error_has_the_command() -> None:
    out = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "teamsight.env needs pettingzoo, which is not installed: pip install 'teamsight[env]'"


def test_all_that_are_missing_are_named() -> None:
    with pytest.raises(ImportError, match="needs nowhere_1 and nowhere_2, which are not installed"):
        require("nowhere_1", "numpy", "nowhere_2")


def test_the_package_is_imported_without_compiling() -> None:
    script = "import sys, teamsight.env; print('numba' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "False"
