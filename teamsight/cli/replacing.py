"""Replacing: results of the same settings may be replaced, anything else only when told."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def check_replaced(path: Path, about: Mapping[str, Any], force: bool) -> None:
    """Refuse to write over a file that is no table of these settings, unless told.

    Raises
    ------
    ValueError
        If it is not, or a folder.
    """
    if path.is_dir():
        raise ValueError(f"{path}: is a folder; give a file")
    if force or not path.exists():
        return
    wanted = json.loads(json.dumps(dict(about)))
    found = _told(path)
    if found is None:
        raise ValueError(f"{path}: holds something else; give --force to replace it, or another place")
    if any(found.get(name) != value for name, value in wanted.items()):
        raise ValueError(f"{path}: holds results of other settings; give --force to replace them, or another place")


def _told(path: Path) -> dict[Any, Any] | None:
    """Return what a table tells of its settings; None where it is no table."""
    import pandas as pd

    try:
        return pd.read_parquet(path).attrs
    except Exception:  # whatever a reader of Parquet finds wrong with what is none
        return None
