"""Recorded positions from a file or a DataFrame: read, check all rows, and sort by robot."""

from __future__ import annotations

import codecs
import difflib
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.runs.simulate import Progress

#: Required columns.
COLUMNS = ("time", "robot", "x", "y")
#: Optional column that divides a record into runs; other columns are ignored.
RUN = "run"
#: Column of trajectories that a world has recorded. All rows count as one team, whatever is in it.
GROUP = "group"
_EXTENSIONS = (".csv", ".csv.gz", ".parquet", ".pq")
# Of the words for what is missing, those that are no names: of a robot "NA" is one.
_MISSING = ["", "nan", "NaN"]
# Other endings of tables as text.
_TEXTS, _RENAME = (".txt", ".tsv", ".dat"), "; if it is text separated by commas, rename it to .csv"
# What loggers call these columns; an x or y may be of any message, as in pose.position.x.
_OTHER_NAMES = {
    "time": ("t", "stamp", "timestamp", "secs", "seconds", "header.stamp"),
    "robot": ("id", "name", "agent", "vehicle", "robot_id", "robot_name", "agent_id"),
}
_POSITION = r"(.*[^a-z])?pos(e|ition)?[\W_]*{0}|{0}[\W_]*(m|mm|cm)?[\W_]*|{0}[\W_]?pos(ition)?"
# A column of the x of one robot, as in x3, robot3_x or /a/odom/x.
_ONE_OF_MANY = r"(.*[^a-z])?x([^a-z].*)?"
# Words above the columns of an export of motion capture (OptiTrack Motive, Vicon Nexus, Qualisys).
_CAPTURE = r"Format Version|Capture Frame Rate|Export Frame Rate|Take Name|Rigid Body|NO_OF_FRAMES|\A\W*Trajectories\b"
# Text columns with more distinct values are not read as categories.
_NAMES = 100_000


def read_trajectories(
    path: str | os.PathLike[str],
    *,
    sort: bool = False,
    progress: Progress = lambda done, total: None,
    content: bytes | None = None,
) -> pd.DataFrame:
    """Read the recorded positions of a team.

    Parameters
    ----------
    path : path
        A CSV file (.csv, .csv.gz; separated by commas, with a header) or a Parquet file (.parquet, .pq) with the
        columns time, robot, x, y. Time and positions are numbers; robots are named by whole numbers or text. Missing
        samples have no row. In a row without x and y the robot is not there, because it has failed or left; from the
        sample before to the sample after it is absent. An optional column run, of whole numbers or text, names the
        recording (the episode) of a row; times and names of robots may repeat in other runs.
    sort : bool
        Sort the rows of each robot of a run by time instead of raising an error if times decrease.
    progress : callable
        Called with the parts of the work done and the parts in all.
    content : bytes, optional
        The file itself, not compressed, if it is in memory; then nothing is opened, and `path` is only its name.

    Returns
    -------
    DataFrame
        time (float64), robot (category), x, y (float64), robot by robot, in the order of time; with runs also run
        (category), run by run in the order in which they first appear. If a column group has several values in one run,
        they are in ``attrs["groups"]``; the names of columns that are ignored are in ``attrs["ignored"]``, the number
        of rows whose time was before that of the row before, of the same robot, in ``attrs["sorted"]``.

    Raises
    ------
    ValueError
        One line with the file, the value, its row (the first row of data is 1) and the cure.

    Notes
    -----
    The rows of runs and robots may be in any order, but the times of each robot must increase within a run. Decreasing
    times usually mean that a clock was set, two robots have one name, or a new recording begins. Sorting would combine
    two trajectories without notice, so it must be requested.
    """
    place = Path(path)
    name = place.name.lower()
    if not name.endswith(_EXTENSIONS):
        cure = _RENAME * name.endswith(_TEXTS)
        raise ValueError(f"{place}: unknown kind of file {place.suffix!r}; known are {', '.join(_EXTENSIONS)}{cure}")
    progress(0, 2)
    try:
        table = _read(place, "CSV" if name.endswith((".csv", ".csv.gz")) else "Parquet", content)
    except OSError as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else error.strerror or _first_line(error)
        raise ValueError(f"{place}: cannot be read ({reason}); check the path and the permissions") from error
    progress(1, 2)
    checked = check_trajectories(table, sort=sort, name=str(place))
    progress(2, 2)
    return checked


def _read(place: Path, kind: str, content: bytes | None) -> pd.DataFrame:
    """Return the columns of a file; dates that name runs become text."""
    import pyarrow as pa
    from pyarrow import csv, parquet

    def source() -> Any:
        return place if content is None else pa.BufferReader(content)

    if kind == "CSV":
        _refuse_other_text(place, _beginning(place, content))
    try:
        if kind == "CSV":
            with csv.open_csv(source()) as reader:
                found = reader.schema.names
        else:
            found = parquet.read_schema(source()).names
        _check_columns(found, str(place))
        wanted = [*COLUMNS, *(name for name in (RUN, GROUP) if found.count(name) == 1)]
        if kind == "CSV":
            options = csv.ConvertOptions(
                include_columns=wanted,
                strings_can_be_null=True,
                auto_dict_encode=True,
                auto_dict_max_cardinality=_NAMES,
            )
            table = csv.read_csv(source(), convert_options=options)
            for column in {"robot", RUN} & set(wanted):
                read = table.column(column)
                if read.null_count and not (pa.types.is_integer(read.type) or pa.types.is_floating(read.type)):
                    # NA may be a name.
                    options.include_columns, options.null_values = [column], _MISSING
                    named = csv.read_csv(source(), convert_options=options)
                    table = table.set_column(wanted.index(column), column, named[0])
        else:
            table = parquet.read_table(source(), columns=wanted)
    except (pa.ArrowException, UnicodeDecodeError) as error:
        size = place.stat().st_size if content is None else len(content)
        reason = "the file is empty" if size == 0 else _first_line(error)
        # A picture, for example.
        if isinstance(error, UnicodeDecodeError) or not reason.isprintable() or "\ufffd" in reason:
            reason = "it is not text"
            if size and _beginning(place, content).startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
                raise ValueError(f"{place}: is text in UTF-16; save it as UTF-8, separated by commas") from error
        cure = ", a row for each robot and time; separate them by commas, and write numbers with points, as in 0.5"
        raise ValueError(
            f"{place}: not a readable {kind} file ({reason}); write one with the columns {', '.join(COLUMNS)}"
            f"{cure * (kind == 'CSV')}"
        ) from error
    columns = {name: table.column(name) for name in table.column_names}
    if RUN in columns and pa.types.is_temporal(columns[RUN].type):
        columns[RUN] = columns[RUN].cast(pa.string())
    read = pd.DataFrame({name: column.to_pandas() for name, column in columns.items()}, copy=False)
    read.attrs["ignored"] = [column for column in found if column not in wanted]
    return read


def _beginning(place: Path, content: bytes | None) -> bytes:
    if content is not None:
        return content[:4096]
    with place.open("rb") as file:
        return file.read(4096)


def _refuse_other_text(place: Path, beginning: bytes) -> None:
    """Raise an error if a CSV file begins as JSON or an export of motion capture does, or with blank lines only."""
    text = beginning.decode(errors="replace")
    first = text.lstrip()[:1]
    if text and first in ("", "{", "["):
        raise ValueError(
            f"{place}: {'is JSON' if first else 'begins with blank lines only'}; write a CSV with the columns "
            f"{', '.join(COLUMNS)}, a row for each robot and time"
        )
    if set(COLUMNS) <= set(text.partition("\n")[0].replace('"', "").strip().split(",")):
        return
    if found := re.search(_CAPTURE, text):
        raise ValueError(
            f"{place}: looks like an export of motion capture ({found[0].strip()!r}), with lines above the table and "
            f"all robots side by side; give each robot its own rows, {','.join(COLUMNS)}: docs/recorded.md has the code"
        )


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0].rstrip(".")


def _check_columns(found: Sequence[Any], name: str) -> None:
    names = [str(column) for column in found]
    for column in (*COLUMNS, RUN):
        if names.count(column) > 1:
            raise ValueError(f"{name}: column {column!r} twice; keep one")
    missing = [column for column in COLUMNS if column not in names]
    if not missing:
        return
    listed = ", ".join(map(repr, missing))
    raise ValueError(
        f"{name}: no column{'s' * (len(missing) > 1)} {listed}; found {', '.join(names) or 'none'}; "
        f"{_cure(names, missing)}"
    )


def _cure(names: Sequence[str], missing: Sequence[str]) -> str:
    """Say how the columns of a file become those that are needed."""
    needed = f"needed are {', '.join(COLUMNS)}, separated by commas"
    if re.fullmatch(r"\s*[-+]?\d+(\.\d*)?(e[-+]?\d+)?\s*", names[0] if names else "", re.IGNORECASE):
        return f"the first row holds values, not names; begin with the row {','.join(COLUMNS)}"
    spare = {column.lower().strip(): column for column in names if column not in COLUMNS}
    near = {}
    for column in missing:
        known = [one for one in spare if one == column or one in _OTHER_NAMES.get(column, ())]
        if not known and column in ("x", "y"):
            known = [one for one in spare if re.fullmatch(_POSITION.format(column), one)]
        near[column] = known[0] if len(known) == 1 else None
    many = [one for one in names if re.fullmatch(_ONE_OF_MANY, one.lower().strip())]
    if len(many) > 1 and {"robot", "x"} <= set(missing) and near["robot"] is near["x"] is None:
        own = f"give each its own row: {','.join(COLUMNS)}"
        return f"{many[0]!r} and {many[1]!r} look like two robots in one row; {own}"
    for column in missing:
        near[column] = near[column] or next(iter(difflib.get_close_matches(column, spare, n=1, cutoff=0.6)), None)
    hints = [f"rename {spare[one]!r} to {column!r}" for column, one in near.items() if one]
    return "; ".join([", ".join(hints)] * bool(hints) + [needed] * (len(hints) < len(missing)))


def check_trajectories(trajectories: pd.DataFrame, *, sort: bool = False, name: str = "trajectories") -> pd.DataFrame:
    """Return recorded positions in the form of `read_trajectories`, with the same checks.

    Parameters
    ----------
    trajectories : DataFrame
        Columns time, robot, x, y, and run if there are several.
    sort : bool
        Sort the rows of each robot of a run by time instead of raising an error if times decrease.
    name : str
        Name of the record in errors.
    """
    _check_columns(list(trajectories.columns), name)
    if not len(trajectories):
        raise ValueError(f"{name}: no rows; a record needs positions of at least 2 robots")
    robot = _names(trajectories["robot"], name)
    run = _names(trajectories[RUN] if RUN in trajectories else pd.Series(0, trajectories.index, name=RUN), name)
    away = (trajectories["x"].isna() & trajectories["y"].isna()).to_numpy()
    if away.all():
        raise ValueError(f"{name}: no row has a position; a record needs positions of at least 2 robots")
    columns = {
        column: _numbers(trajectories[column], name, away & (column != "time")) for column in ("time", "x", "y")
    }
    place = np.asarray(run.codes, np.int64) * (int(robot.codes.max()) + 1) + robot.codes
    kept = np.argsort(place, kind="stable")
    order = np.lexsort((columns["time"], place)) if sort else kept
    back = int(((np.diff(columns["time"][kept]) < 0) & (np.diff(place[kept]) == 0)).sum())
    run, robot = run[order], robot[order]
    columns = {column: values[order] for column, values in columns.items()}
    _check_times(run, robot, columns["time"], order + 1, name)
    if len(robot.categories) == 1:
        raise ValueError(f"{name}: only robot {_shown(robot.categories[0])}; a neighbour graph needs at least 2 robots")
    checked = {"time": columns["time"], "robot": robot, "x": columns["x"], "y": columns["y"]}
    found = pd.DataFrame(checked | ({RUN: run} if RUN in trajectories else {}), copy=False)
    others = [str(column) for column in trajectories.columns if column not in (*COLUMNS, RUN, GROUP)]
    found.attrs["ignored"] = trajectories.attrs.get("ignored") or others
    found.attrs["name"] = trajectories.attrs.get("name", name)
    found.attrs["sorted"] = trajectories.attrs.get("sorted") or back
    found.attrs["groups"] = trajectories.attrs.get("groups") or _mixed_groups(trajectories)
    return found


def _mixed_groups(trajectories: pd.DataFrame) -> list[str]:
    """Return the names in the column group if several are in one run; otherwise nothing."""
    if list(trajectories.columns).count(GROUP) != 1:
        return []
    names = trajectories[GROUP].groupby(trajectories[RUN], observed=True) if RUN in trajectories else None
    several = trajectories[GROUP].nunique() if names is None else names.nunique().max()
    return sorted(map(str, trajectories[GROUP].dropna().unique())) if several > 1 else []


def _names(column: pd.Series[Any], name: str) -> pd.Categorical:
    """Return the names of robots or of runs as categories that are all used."""
    what = column.name
    missing = column.isna().to_numpy()
    if missing.any():
        raise ValueError(f"{name}: {what} is missing in row {int(np.argmax(missing)) + 1}; name a {what} in every row")
    if isinstance(column.dtype, pd.CategoricalDtype):
        return pd.Categorical(column).remove_unused_categories()
    one = column.iloc[0]
    wrong = np.array([isinstance(one, bool) or not isinstance(one, (str, int, float, np.number))])
    if pd.api.types.is_float_dtype(column.dtype):
        wrong = (column % 1).to_numpy() != 0
    if wrong.any():
        row = int(wrong.argmax())
        raise ValueError(f"{name}: {what}={_shown(column.iloc[row])} in row {row + 1}: must be a whole number or text")
    codes, names = pd.factorize(column.astype(np.int64) if pd.api.types.is_float_dtype(column.dtype) else column)
    return pd.Categorical.from_codes(codes, categories=names)


def _numbers(column: pd.Series[Any], name: str, away: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return a column as float64, after checking that all values are finite, but those of robots that are away."""
    types = pd.api.types
    if types.is_numeric_dtype(column.dtype) and not types.is_bool_dtype(column.dtype):
        numbers = column
    elif types.is_datetime64_any_dtype(column.dtype) or types.is_bool_dtype(column.dtype):
        numbers = pd.Series(np.nan, column.index)
    else:
        numbers = pd.to_numeric(column.astype(object), errors="coerce")
    wrong = (numbers.isna() & column.notna()).to_numpy()
    if wrong.any():
        row = int(np.argmax(wrong))
        cure = " (of seconds, say); turn dates into the time since the first" * (column.name == "time")
        if isinstance(value := column.iloc[row], str) and re.fullmatch(r"[-+\d.]+,[\d.,]*", value.strip()):
            cure = ", without commas, as in 1234.5"
        raise ValueError(
            f"{name}: {column.name}={_shown(column.iloc[row])} in row {row + 1}: must be a number{cure}"
        )
    values = numbers.to_numpy(dtype=np.float64, na_value=np.nan)
    wrong = ~np.isfinite(values) & ~away
    if wrong.any():
        row = int(np.argmax(wrong))
        value = "missing" if np.isnan(values[row]) else f"{values[row]}"
        raise ValueError(f"{name}: {column.name} is {value} in row {row + 1}; leave out rows without a position")
    return values


def _shown(value: Any) -> str:
    value = value.item() if isinstance(value, np.generic) else value
    return repr(value) if isinstance(value, str) else str(value)


def _check_times(run: pd.Categorical, robot: pd.Categorical, time: Any, rows: Any, name: str) -> None:
    """Raise an error if a robot has two rows at one time, or if its times decrease."""
    wrong = (time[1:] <= time[:-1]) & (np.diff(robot.codes) == 0) & (np.diff(run.codes) == 0)
    if not wrong.any():
        return
    later = int(np.argmax(wrong)) + 1
    who = f"robot {_shown(robot.categories[robot.codes[later]])}"
    if len(run.categories) > 1:
        who += f" of run {_shown(run.categories[run.codes[later]])}"
    if time[later] == time[later - 1]:
        raise ValueError(
            f"{name}: {who} twice at time {time[later]:.12g}, in rows {rows[later - 1]} and {rows[later]}; keep one of "
            "them, or distinguish recordings by a column run"
        )
    raise ValueError(
        f"{name}: {who} goes back from time {time[later - 1]:.12g} in row {rows[later - 1]} to {time[later]:.12g} in "
        f"row {rows[later]}; check for a clock that was set, two robots with one name or a new recording (number it in "
        "a column run), or sort: --sort, read_trajectories(…, sort=True)"
    )
