"""Points: settings that are listed in a CSV or Parquet file, one a row, beside the study file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from teamsight.analysis.studies.definition.axes import MOST_SETTINGS
from teamsight.core import checks

# Bytes of a file of points: ten million rows of 40 characters.
_MOST_BYTES = 400_000_000


def read_points(name: str, folder: Path) -> dict[str, list[Any]]:
    """Return the columns of a file of points.

    Parameters
    ----------
    name : str
        Its path, relative to `folder`; it must be within it, also if it is a link.
    folder : Path
        The folder of the study file.

    Raises
    ------
    ValueError
        If it is elsewhere, cannot be read, is no table, or a value is missing.
    """
    given = f"points={checks.shown(name, 200)}"
    path = _place(given, name, folder)
    table = _table(given, path)
    try:
        names = list(table.column_names)
    except UnicodeDecodeError as error:
        raise ValueError(f"{given}: the name of a column is not UTF-8; save it as UTF-8") from error
    for column in names:
        if names.count(column) > 1:
            raise ValueError(f"{given}: has the column {checks.shown(column)} twice; keep one")
        if not column:
            raise ValueError(f"{given}: has a column without a name; the first line must name the parameters")
    if not table.num_rows:
        raise ValueError(f"{given}: has no rows; give at least one")
    if table.num_rows > MOST_SETTINGS:
        raise ValueError(f"{given}: has {table.num_rows:,} rows, at most {MOST_SETTINGS:,}; give fewer")
    return {column: _values(given, column, table.column(column)) for column in names}


def _place(given: str, name: str, folder: Path) -> Path:
    """Return the real path of a file of points, which is within the folder."""
    if "\0" in name or not name.strip():
        raise ValueError(f"{given}: is no path; give a file such as points.csv")
    try:
        path = (folder / name).resolve()
        size = path.stat().st_size if path.is_relative_to(folder) else 0
        is_file = path.is_file()
    except (OSError, RuntimeError) as error:  # a loop of links
        why = getattr(error, "strerror", None) or error
        raise ValueError(f"{given}: cannot be read ({why}); give a file beside the study file") from error
    if not path.is_relative_to(folder):
        raise ValueError(f"{given}: is outside the study file's folder, {folder}; move it there")
    if path.suffix.lower() not in (".csv", ".parquet"):
        raise ValueError(f"{given}: must end in .csv or .parquet; convert it")
    if not is_file:
        raise ValueError(f"{given}: is no regular file; give a file beside the study file")
    if size > _MOST_BYTES:
        raise ValueError(f"{given}: has {size:,} bytes, at most {_MOST_BYTES:,}; give fewer rows")
    return path


def _table(given: str, path: Path) -> Any:
    import pyarrow as pa
    from pyarrow import csv, parquet

    try:
        with path.open("rb") as file:
            if path.suffix.lower() == ".parquet":
                return parquet.read_table(file)
            # Only an empty cell is a missing value: "none" is a degree of awareness.
            options = csv.ConvertOptions(null_values=[""], strings_can_be_null=True, timestamp_parsers=[])
            return csv.read_csv(file, convert_options=options)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        why = " ".join(str(error).split())
        raise ValueError(f"{given}: cannot be read as a table: {why[:160]}; correct it, or write it anew") from error


def _values(given: str, name: str, column: Any) -> list[Any]:
    import pyarrow as pa

    kind = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
    is_text = pa.types.is_string(kind) or pa.types.is_large_string(kind)
    is_known = is_text or pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    if pa.types.is_binary(kind):
        raise ValueError(f"{given}: column {checks.shown(name)} is not UTF-8; save it as UTF-8")
    if not is_known and not pa.types.is_null(kind):
        raise ValueError(
            f"{given}: column {checks.shown(name)} has the type {kind}; a parameter is a number, text or boolean"
        )
    values: list[Any] = column.to_pylist()
    for row, value in enumerate(values, 1):
        if value is None or value != value:
            raise ValueError(f"{given}: row {row} has no value for {checks.shown(name)}; give one, or remove the row")
    return values
