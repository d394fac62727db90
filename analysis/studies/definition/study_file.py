"""Reading a study file: TOML of at most 1 MB, whose keys are the parameters of `Study`; and its points, a table."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from teamsight.core import checks
from teamsight.core.files import open_regular

#: Bytes of a study file.
MOST_BYTES = 1_000_000

# Bytes of a file of points: ten million rows of 40 characters.
_MOST_BYTES_OF_POINTS = 400_000_000
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
    values = _parsed(path)
    folder = path.resolve().parent
    try:
        for key in values:
            checks.choice("key", key, known)
        if isinstance(values.get("points"), str):
            values["points"] = _points(values["points"], folder)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return {"name": path.stem, **values, "path": folder}


def _parsed(path: Path) -> dict[str, Any]:
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
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is not UTF-8 (byte {error.start}); save it as UTF-8") from error
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"{path}: line {line} has a key of more than 64 parts; make it flatter")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError(f"{path}: has too many lists and tables within each other; make it flatter") from error
    except ValueError as error:
        is_syntax = isinstance(error, tomllib.TOMLDecodeError)
        # Else an integer has more digits than Python reads.
        cure = "see https://toml.io" if is_syntax else "give smaller numbers"
        raise ValueError(f"{path}: is not TOML: {error}; {cure}") from error


def _points(name: str, folder: Path) -> dict[str, list[Any]]:
    """Return the columns of a CSV or Parquet file, which is within the folder, also if it is a link."""
    import pyarrow as pa
    from pyarrow import csv, parquet, types

    given = f"points={checks.shown(name, 200)}"
    try:
        # No path has this character.
        path = (folder / name.replace("\0", "?")).resolve()
        if not path.is_relative_to(folder):
            raise ValueError(f"{given}: is outside the study file's folder, {folder}; move it there")
        if path.suffix.lower() not in (".csv", ".parquet"):
            raise ValueError(f"{given}: must end in .csv or .parquet; convert it")
        with open_regular(path) as file:
            if (size := file.seek(0, 2)) > _MOST_BYTES_OF_POINTS:
                raise ValueError(f"{given}: has {size:,} bytes, at most {_MOST_BYTES_OF_POINTS:,}; give fewer rows")
            file.seek(0)
            if path.suffix.lower() == ".parquet":
                table = parquet.read_table(file)
            else:
                # Only an empty cell is a missing value: "none" is a degree of awareness.
                options = csv.ConvertOptions(null_values=[""], strings_can_be_null=True, timestamp_parsers=[])
                table = csv.read_csv(file, convert_options=options)
        names = list(table.column_names)
    except UnicodeDecodeError as error:
        raise ValueError(f"{given}: the name of a column is not UTF-8; save it as UTF-8") from error
    except (pa.ArrowException, OSError, RuntimeError) as error:  # a loop of links
        why = getattr(error, "strerror", None) or " ".join(str(error).split())[:160]
        raise ValueError(f"{given}: cannot be read as a table ({why}); give a file beside the study file") from error
    columns = {}
    for name, column in zip(names, table.columns, strict=True):
        if name in columns:
            raise ValueError(f"{given}: has the column {checks.shown(name)} twice; keep one")
        if not name:
            raise ValueError(f"{given}: has a column without a name; the first line must name the parameters")
        kind = column.type.value_type if types.is_dictionary(column.type) else column.type
        is_known = (types.is_string, types.is_large_string, types.is_integer, types.is_floating, types.is_boolean)
        if not any(one(kind) for one in (*is_known, types.is_null)):
            raise ValueError(
                f"{given}: column {checks.shown(name)} has the type {kind}; a parameter is a number, a boolean, or a "
                "text in UTF-8"
            )
        columns[name] = column.to_pylist()
        for row, value in enumerate(columns[name], 1):
            if value is None or value != value:
                raise ValueError(
                    f"{given}: row {row} has no value for {checks.shown(name)}; give one, or remove the row"
                )
    return columns
