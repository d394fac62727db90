"""Where results come from: versions of packages, git commits and the machine."""

from __future__ import annotations

import contextlib
import os
import platform
import socket
import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path

from teamsight.core import version

# The folder of teamsight's code: of the repository, or of the installed package.
_CODE = Path(__file__).resolve().parents[3]
# Packages that decide results, and those that write them.
_PACKAGES = ("numpy", "numba", "llvmlite", "mesa", "simpy", "scipy", "pandas", "pyarrow")
_PATIENCE = 10.0


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python, teamsight and the packages that decide results."""
    found = {"python": platform.python_version(), "teamsight": version.__version__}
    for name in _PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def machine() -> dict[str, str | int]:
    """Return host, operating system, processor and number of cores."""
    system = platform.system(), platform.release()
    return {
        "host": socket.gethostname(), "system": " ".join(system), "processor": platform.machine(),
        "cores": os.cpu_count() or 1,
    }  # fmt: skip


def commits(study_folder: Path | None) -> dict[str, dict[str, str | bool]]:
    """Return the git commits of teamsight and of the folder of the study file, and whether teamsight's has changes.

    Parameters
    ----------
    study_folder : Path or None
        Where the modules of the study are.
    """
    found = {"teamsight": _commit(_CODE)}
    if found["teamsight"]:
        found["teamsight"]["has_changes"] = bool(_git(_CODE, "status", "--porcelain", "--untracked-files=no"))
    if study_folder is not None:
        # Not its changes: to compare files, git runs the filters that the configuration of that folder names. The
        # digests of the study's modules say more.
        found["study"] = _commit(study_folder)
    return {name: commit for name, commit in found.items() if commit}


def _commit(folder: Path) -> dict[str, str | bool]:
    """Return the commit that is checked out in a folder; empty if it is not under version control."""
    head = _git(folder, "rev-parse", "HEAD")
    if not head or _git(folder, "check-ignore", "--quiet", ".") is not None:
        # An installed package below a repository, as in its .venv, is none of its files.
        return {}
    return {"commit": head.strip()}


def _git(folder: Path, *arguments: str) -> str | None:
    """Return what git prints; None if it fails or is not there.

    The folder of a study may come from anywhere: no program that its configuration names is run.
    """
    with contextlib.suppress(OSError, subprocess.SubprocessError, UnicodeDecodeError):
        done = subprocess.run(
            ["git", "-C", str(folder), "-c", "core.fsmonitor=false", "-c", f"core.hooksPath={os.devnull}", *arguments],
            capture_output=True, text=True, timeout=_PATIENCE, check=True, stdin=subprocess.DEVNULL,
            env={**os.environ, "GIT_OPTIONAL_LOCKS": "0", "GIT_NO_LAZY_FETCH": "1"},
        )  # fmt: skip
        return done.stdout
    return None
