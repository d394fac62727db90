"""Reading a study file: TOML of at most 1 MB, whose keys are the parameters of `Study`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from teamsight.analysis.studies.definition.points import read_points
from teamsight.core import checks
from teamsight.core.files import open_regular

#: Bytes of a study file.
MOST_BYTES = 1_000_000

# tomllib takes quadratic time for a key of very many parts. The search takes linear time: it begins at words only, and
# gives nothing back.
_LONG_KEY = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){64}""")


def read_study_file(path: Path, known: Iterable[str]) -> dict[str, Any]:
    """Return the arguments of `Study` that a file holds; points are read from their file.

    Parameters
    ----------
    path : Path
        The study file. Its folder is where points and modules are.
    known : iterable of str
        The keys that it may have.

    Raises
    ------
    ValueError
        If it cannot be read, is too large, or is not TOML.
    """
    values = _parsed(path, _read(path))
    try:
        for key in values:
            checks.choice("key", key, known)
        folder = path.resolve().parent
        if isinstance(values.get("points"), str):
            values["points"] = read_points(values["points"], folder)
    except (TypeError, ValueError) as error:
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"{path}: {error}") from error
    return {"name": path.stem, **values, "path": folder}


def _read(path: Path) -> str:
    try:
        with open_regular(path) as file:
            size = file.seek(0, 2)
            file.seek(0)
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror}); give a study file, such as study.toml") from error
    if max(size, len(content)) > MOST_BYTES:
        raise ValueError(
            f"{path}: has {size:,} bytes, at most {MOST_BYTES:,}; list many settings in a CSV or Parquet file of points"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is not UTF-8 (byte {error.start}); save it as UTF-8") from error


def _parsed(path: Path, text: str) -> dict[str, Any]:
    flat = "make it flatter"
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"{path}: line {line} has a key of more than 64 parts; {flat}")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path}: is not TOML: {error}; see https://toml.io") from error
    except RecursionError as error:
        raise ValueError(f"{path}: has too many lists and tables within each other; {flat}") from error
    except ValueError as error:  # an integer of more digits than Python reads
        raise ValueError(f"{path}: is not TOML: {error}; give smaller numbers") from error
