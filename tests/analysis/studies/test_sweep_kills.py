"""Kills of a sweep: nothing is lost, mixed or made twice."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.rare
@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_kills_of_the_main_process_at_twenty_moments(tmp_path: Path) -> None:
    script = Path(__file__).with_name("sweeps_until_killed.py")
    found = subprocess.run(
        [sys.executable, str(script), str(tmp_path), "20"], capture_output=True, text=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)), check=False,
    )  # fmt: skip
    assert (found.returncode, found.stdout) == (0, ""), found.stdout + found.stderr
