"""The manifest: which study a folder belongs to, and what made its runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Manifest(NamedTuple):
    """What ``manifest.json`` says.

    Attributes
    ----------
    study : mapping
        The study as `Study.as_dict` returns it.
    types : mapping of str to str
        Parquet type of each parameter.
    code : str
        Digest of teamsight's code.
    sources : mapping of str to str
        Digest of the file of each module that the study names.
    path : str
        The folder of the study file, where its modules and points are.
    versions : mapping of str to str
        Versions of Python, teamsight and the packages that decide results.
    commits : mapping
        Git commits of teamsight and of the study file's folder, where there are any.
    machine : mapping
        Host, operating system, processor and number of cores.
    created, changed : str
        When the folder was made, and when the study last grew (UTC).
    """

    study: Mapping[str, object]
    types: Mapping[str, str]
    code: str
    sources: Mapping[str, str]
    path: str
    versions: Mapping[str, str]
    commits: Mapping[str, object]
    machine: Mapping[str, object]
    created: str
    changed: str
