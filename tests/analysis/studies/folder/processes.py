"""Child processes of these tests, which end with the test."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import teamsight

ROOT = Path(teamsight.__file__).resolve().parent.parent
PATIENCE = 1800  # seconds, against a hang


@contextlib.contextmanager
def child(*arguments: object) -> Iterator[subprocess.Popen[str]]:
    """Start ``children.py`` with arguments; kill it at the end, if it still runs."""
    command = [sys.executable, str(Path(__file__).with_name("children.py")), *map(str, arguments)]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE)


def finished(*arguments: object) -> str:
    """Return what a child process prints, which must end well."""
    with child(*arguments) as process:
        out, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, errors
        return out
