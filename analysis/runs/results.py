"""Result files of an analysis: checked before it simulates, and written together when it has."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.core.version import __version__

#: A table, a picture, a page of Markdown, or JSON values.
Content = pd.DataFrame | bytes | str | Mapping[str, Any]


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
        files.check_replaceable(folder / name, about if name.endswith(".parquet") else None, force=force)
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
        if isinstance(content, pd.DataFrame):
            files.write_table(folder / name, content, {**about, "version": __version__}, force=force)
        elif isinstance(content, bytes):
            files.write_bytes(folder / name, content, force=force)
        elif isinstance(content, str):
            files.write_page(folder / name, content, force=force)
        else:
            files.write_json(folder / name, {"software": "teamsight", **content}, force=force)
