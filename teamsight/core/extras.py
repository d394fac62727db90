"""Packages that teamsight needs for some purposes only."""

from __future__ import annotations

import importlib
from typing import Any


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
        raise ModuleNotFoundError(f"{purpose} needs the package {package}: pip install 'teamsight[{name}]'") from None
