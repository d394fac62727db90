"""Packages that teamsight needs for some purposes only."""

from __future__ import annotations

import importlib
import os
import shutil
import sys
from typing import Any


def installing(name: str) -> str:
    """Return the command that installs an extra for the Python that runs, also if its environment is not active.

    Parameters
    ----------
    name : str
        The extra of teamsight.
    """
    pip, here = shutil.which("pip"), os.path.dirname(sys.executable)
    is_own = pip is not None and os.path.dirname(os.path.abspath(pip)) == here
    return f"{'pip' if is_own else f'{sys.executable} -m pip'} install 'teamsight[{name}]'"


def extra(package: str, purpose: str, name: str) -> Any:
    """Return a package that is an extra of teamsight.

    Parameters
    ----------
    package : str
        Its name; it is imported.
    purpose : str
        What needs it, for the error.
    name : str
        The extra of teamsight that installs it.

    Raises
    ------
    ModuleNotFoundError
        If it is not installed.
    """
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as error:
        if error.name != package:
            # The package is there, and something that it needs itself is not.
            raise
        raise ModuleNotFoundError(f"{purpose} needs the package {package}: {installing(name)}") from None
