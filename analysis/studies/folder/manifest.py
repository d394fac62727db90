"""The manifest: which study a folder belongs to, and what made its runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from teamsight.analysis.studies.folder.layout import MANIFEST
from teamsight.core import checks, files

#: The version of the layout of the folder; a newer one is refused.
FORMAT = 1
_MARK = {"software": "teamsight", "format": FORMAT}
_MOST_BYTES = 2_000_000_000


class Manifest(NamedTuple):
    """What ``manifest.json`` says.

    Attributes
    ----------
    study : mapping
        The study as `Study.as_dict` returns it.
    types : mapping of str to str
        Type of each parameter's column.
    code : str
        Digest of teamsight's code.
    sources : mapping of str to str
        Digest of the file of each module that the study names, and of those beside it that these import.
    holds : mapping of str to str
        What each measured column holds, as the first part decided: "int", "number", "flag" or "text".
    earlier : sequence of mapping
        "code" and "sources" of runs that were made by other code, where that was allowed.
    versions : mapping of str to str
        Versions of Python, teamsight and the packages that decide results, when the folder was made.
    commits : mapping
        Git commits of teamsight and of the study file's folder at that time, where there are any.
    machine : mapping
        Host, operating system, processor and number of cores that made the folder.
    created, changed : str
        When the folder was made, and when the study last grew (UTC).
    """

    study: Mapping[str, Any]
    types: Mapping[str, str]
    code: str
    sources: Mapping[str, str]
    holds: Mapping[str, str]
    earlier: tuple[Mapping[str, Any], ...]
    versions: Mapping[str, str]
    commits: Mapping[str, Any]
    machine: Mapping[str, Any]
    created: str
    changed: str


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a folder.

    Raises
    ------
    ValueError
        If there is none, it is damaged or changed by hand, or a newer version has written it.
    """
    path = folder / MANIFEST
    try:
        with files.open_regular(path) as file:
            content = file.read(_MOST_BYTES)
    except (FileNotFoundError, NotADirectoryError):
        raise ValueError(
            f"{folder}: is not the folder of a study (it has no {MANIFEST}); give one that teamsight sweep has made"
        ) from None
    try:
        found = json.loads(content)
    except (ValueError, RecursionError):
        _refuse(path, "it is not JSON")
    if not isinstance(found, dict) or found.get("software") != _MARK["software"]:
        _refuse(path, "teamsight did not write it")
    if found.get("format") != FORMAT:
        versions = found.get("versions")
        wrote = versions.get("teamsight") if isinstance(versions, dict) else None
        raise ValueError(checks.other_format(path, found.get("format"), FORMAT, wrote))
    digest = found.pop("digest", None)
    if digest != _digest(found):
        _refuse(path, "its digest differs")
    try:
        values = {name: found[name] for name in Manifest._fields}
    except KeyError as error:
        _refuse(path, f"it has no {error}")
    return Manifest(**{**values, "earlier": tuple(values["earlier"])})


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write the manifest of a folder, or replace it.

    Raises
    ------
    UnwritableError
        If it cannot be written.
    """
    values: dict[str, Any] = {**_MARK, **manifest._asdict(), "earlier": list(manifest.earlier)}
    values["digest"] = _digest(values)
    # A line for each key: an indent would write a line for each value of a long list, and take minutes.
    lines = (f"  {json.dumps(name)}: {_written(value)}" for name, value in values.items())
    with files.complete(folder / MANIFEST) as draft:
        draft.write(("{\n" + ",\n".join(lines) + "\n}\n").encode())


def _written(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _digest(values: Mapping[str, object]) -> str:
    """Return a digest of values, which finds damage and changes by hand."""
    text = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def _refuse(path: Path, reason: str) -> NoReturn:
    raise ValueError(
        f"{path}: is damaged or was changed ({reason}); restore it from a copy, or move it away and run teamsight "
        "sweep with the study file again: it writes a new one if all parts belong to the study"
    )
