"""Without the optional packages, the first import names the command that installs them."""

from __future__ import annotations

import subprocess
import sys


def test_the_error_has_the_command() -> None:
    script = """
import sys
sys.modules["pettingzoo"] = None
try:
    import teamsight.env
except ImportError as error:
    print(error)
"""
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert out.startswith("teamsight.env needs the package pettingzoo: ")
    assert out.strip().endswith("pip install 'teamsight[env]'")


def test_the_package_is_imported_without_compiling() -> None:
    script = "import sys, teamsight.env; print('numba' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "False"
