"""Files of results: written completely or not at all, checked before anything is simulated, and replaced by one rule.

Without force only files are replaced that this program wrote. They are recognised by a mark: the metadata of a Parquet
schema, the metadata of a picture, the first line of a page, a key in JSON. Only regular files are replaced.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.core.files import UnwritableError, check_name, check_place, complete, open_regular, unwritable
from teamsight.core.version import __version__

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

__all__ = [
    "UnwritableError", "as_json", "check_replaceable", "check_results", "complete", "prepare_folder", "read_table",
    "write_bytes", "write_json", "write_page", "write_results", "write_table",
]  # fmt: skip

_SOFTWARE = "teamsight"
_MARK = b"software"
_PAGE = f"<!-- written by {_SOFTWARE}"
# How pictures begin, and the mark in their metadata: PNG, SVG and PDF.
_PICTURES = (
    (b"\x89PNG\r\n\x1a\n", b"tEXtSoftware\0" + _SOFTWARE.encode()),
    (b"<?xml", b"<dc:title>" + _SOFTWARE.encode() + b"</dc:title>"),
    (b"%PDF-", b"/Creator (" + _SOFTWARE.encode() + b")"),
)
# Larger pages, pictures and JSON files are not of this program.
_MOST_READ = 50_000_000


def prepare_folder(folder: str | os.PathLike[str]) -> Path:
    """Create a folder if it does not exist, check that it can be written, and return it.

    Raises
    ------
    UnwritableError
        If it cannot be created or written.
    """
    check_name(folder)
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except FileExistsError as error:
        raise UnwritableError(f"{path}: cannot be written (not a folder); give a folder") from error
    except OSError as error:
        raise unwritable(path, error) from error
    return path


def check_replaceable(
    path: str | os.PathLike[str], about: Mapping[str, Any] | None = None, *, force: bool = False
) -> None:
    """Raise an error if a file must not be replaced: one of another program, or with other settings.

    Parameters
    ----------
    path : path
        Place of a result.
    about : mapping, optional
        Settings as JSON values; a table or JSON file with other settings is not replaced. By default settings are not
        compared.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If the file must not be replaced.
    """
    if not check_place(path) or force:
        return
    found = _settings_in(Path(path))
    cure = "give --force (in Python, force=True) to replace it, or another place"
    if found is None:
        raise ValueError(f"{path}: holds something else; {cure}")
    wanted = json.loads(json.dumps(dict(about or {})))
    if any(found.get(name) != value for name, value in wanted.items()):
        raise ValueError(f"{path}: holds results of other settings; {cure}")


def write_bytes(path: str | os.PathLike[str], content: bytes, *, force: bool = False) -> None:
    """Write `content`; see `check_replaceable`."""
    with complete(path, lambda target: check_replaceable(target, force=force)) as draft:
        draft.write(content)


def write_page(path: str | os.PathLike[str], text: str, *, force: bool = False) -> None:
    """Write a page of Markdown below a comment that marks it; see `check_replaceable`."""
    write_bytes(path, f"{_PAGE} {__version__} -->\n{text}".encode(), force=force)


def write_json(path: str | os.PathLike[str], value: Any, *, force: bool = False) -> None:
    """Write `value` as indented JSON, keys in the order given; see `check_replaceable`.

    The mark is the key "software" with the value "teamsight", which the caller includes, as it does settings under the
    key "settings".
    """
    text = json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False)
    write_bytes(path, f"{text}\n".encode(), force=force)


def write_table(
    path: str | os.PathLike[str], table: pd.DataFrame, metadata: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write `table` as Parquet; ``pandas.read_parquet(path).attrs`` returns its ``attrs`` and `metadata`.

    Parameters
    ----------
    path : path
        Place of the file.
    table : DataFrame
        The table; its index is not written.
    metadata : mapping
        The settings as JSON values.
    force : bool
        See `check_replaceable`.

    Raises
    ------
    ValueError
        If the file cannot be written or must not be replaced.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    content = pa.Table.from_pandas(table, preserve_index=False)
    # The key under which pandas stores attributes, and the mark.
    attributes = json.dumps({**table.attrs, **metadata}).encode()
    marks = {b"PANDAS_ATTRS": attributes, _MARK: f"{_SOFTWARE} {__version__}".encode()}
    content = content.replace_schema_metadata({**(content.schema.metadata or {}), **marks})
    # Arrow gets an open file, because it would interpret parts of a name.
    with complete(path, lambda target: check_replaceable(target, force=force)) as draft:
        pq.write_table(content, draft)


def _settings_in(path: Path) -> dict[Any, Any] | None:
    """Return the settings in a file of this program, empty if its kind has none; None for other files."""
    # Readers raise errors of many kinds for files that are not of their format.
    with contextlib.suppress(Exception), open_regular(path) as file:
        head = file.read(len(_PAGE))
        file.seek(0)
        if head.startswith(b"PAR1"):
            return _settings_in_table(file)
        content = file.read(_MOST_READ)
        is_picture = any(head.startswith(start) and mark in content for start, mark in _PICTURES)
        if is_picture or head.startswith(_PAGE.encode()):
            return {}
        value = json.loads(content)
        if isinstance(value, dict) and value.get("software") == _SOFTWARE:
            settings = value.get("settings")
            return settings if isinstance(settings, dict) else {}
    return None


def _settings_in_table(file: io.IOBase | Any) -> dict[Any, Any] | None:
    import pyarrow.parquet as pq

    metadata = pq.read_schema(file).metadata or {}
    if not metadata.get(_MARK, b"").startswith(_SOFTWARE.encode()):
        return None
    return dict(json.loads(metadata.get(b"PANDAS_ATTRS", b"{}")))


def read_table(path: Path) -> tuple[pa.Table, dict[str, Any]]:
    """Return a table that `write_table` wrote, and its metadata.

    Raises
    ------
    ValueError
        If it is another file, or cannot be read.
    """
    import pyarrow.parquet as pq

    found = _settings_in(path)
    if not found:
        raise ValueError(
            f"{path}: is no table that a command of teamsight wrote; give the folder of a study, or read it with "
            "pandas.read_parquet"
        )
    with open_regular(path) as file:
        return pq.read_table(file), found


#: A table, a picture, a page of Markdown, or JSON values.
Content: TypeAlias = "pd.DataFrame | bytes | str | Mapping[str, Any]"


def check_results(
    folder: Path,
    names: Iterable[str],
    about: Mapping[str, Any] | None = None,
    *,
    checkpoint: Checkpoint | None = None,
    force: bool = False,
) -> None:
    """Raise an error if a file must not be replaced by a result or by the checkpoint.

    Parameters
    ----------
    folder : Path
        Where to write.
    names : iterable of str
        Names of the files.
    about : mapping, optional
        Settings as JSON values; tables with other settings are not replaced. By default they are not compared.
    checkpoint : Checkpoint, optional
        Where finished runs are kept.
    force : bool
        Replace any regular file by a result.

    Raises
    ------
    ValueError
        If there is such a file.
    """
    for name in names:
        check_replaceable(folder / name, about if name.endswith(".parquet") else None, force=force)
    if checkpoint is not None:
        checkpoint.check()


def write_results(
    folder: Path, contents: Mapping[str, Content], about: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write results; each file is written completely or not at all.

    Parameters
    ----------
    folder : Path
        An existing folder.
    contents : mapping of str to DataFrame, bytes, str or mapping
        By name of file: tables, which are written as Parquet, pictures, pages of Markdown, and JSON values.
    about : mapping
        The settings as JSON values, which tables contain together with the version of teamsight.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check_results`.
    """
    for name, content in contents.items():
        if isinstance(content, bytes):
            write_bytes(folder / name, content, force=force)
        elif isinstance(content, str):
            write_page(folder / name, content, force=force)
        elif isinstance(content, Mapping):
            write_json(folder / name, {"software": "teamsight", **content}, force=force)
        else:
            write_table(folder / name, content, {**about, "version": __version__}, force=force)


def as_json(settings: Any) -> dict[str, Any]:
    """Return the fields of a dataclass of settings by name, fit for JSON: tuples become lists."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(settings).items()}
