"""Whether this process has the code of the sweep: rows of two versions must not be mixed."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Protocol

from teamsight.core import references

#: The modules of teamsight that decide the rows of a study, besides those that decide every run: the seeds, the rows.
DECIDING = ("teamsight.analysis.studies.plan", "teamsight.analysis.studies.shard")


class SourceError(RuntimeError):
    """Raised by a worker that has other code than the sweep; the message names both versions."""


class HasDigests(Protocol):
    """What names the code of a sweep; see `shard.Common`."""

    @property
    def path(self) -> tuple[str, ...]:
        """Folders of modules."""

    @property
    def code(self) -> str:
        """The digest of teamsight's code."""

    @property
    def sources(self) -> dict[str, str]:
        """The digest of each module's file."""


# The digest of each file that was asked for, and the specification of its module at that time: a module that is
# imported again gets another one.
_known: dict[str, tuple[object, str]] = {}


def source_digests(modules: Iterable[str], folders: Iterable[str] = ()) -> dict[str, str]:
    """Return a digest of the file of each module, 16 hexadecimal digits.

    Modules that these import are among them if they stand in the same package, or in one of the folders. A module that
    a function imports when it is called is not known before.

    Parameters
    ----------
    modules : iterable of str
        Names of modules, which are imported already as far as that is possible.
    folders : iterable of str
        Folders of the study.

    Raises
    ------
    ValueError
        If a module was edited after this process has imported it, or stands in the folder of another study.
    """
    names = set(modules)
    return {name: _digest(name) for name in sorted(names.union(_beside(names, tuple(folders))))}


def _beside(names: set[str], folders: tuple[str, ...]) -> Iterator[str]:
    """Yield the names of loaded modules that stand in the packages of others, or in the folders."""
    packages = {top for top in (name.partition(".")[0] for name in names) if hasattr(sys.modules.get(top), "__path__")}
    for name, module in tuple(sys.modules.items()):
        top = name.partition(".")[0]
        # Those of this package are in its own digest.
        if top in ("teamsight", "__main__", "__mp_main__") or not (file := getattr(module, "__file__", None)):
            continue
        place = os.path.join(*name.split("."))
        own = (os.path.join(folder, place + end) for folder in folders for end in (".py", f"{os.sep}__init__.py"))
        if top in packages or any(os.path.abspath(file) == path for path in own):
            yield name
        elif references.is_added(file, place) and (two := references.hidden(name)):
            raise ValueError(references.mixed_up(name, *two))


def check_same_code(common: HasDigests) -> None:
    """Raise an error if this process has another version of the code than the sweep.

    Raises
    ------
    SourceError
        Naming both versions.
    """
    references.search_in(common.path)
    _check(common.code, tuple(common.sources.items()))


@cache
def _check(code: str, sources: tuple[tuple[str, str], ...]) -> None:
    from teamsight.analysis.runs.checkpoint import code_digest

    own = code_digest(*DECIDING)
    if own != code:
        raise SourceError(
            f"worker: has version {own} of teamsight's code, the sweep has {code}; install the same version "
            "for all workers and start them again"
        )
    for name, digest in sources:
        if _digest(name) != digest:
            raise SourceError(
                f"worker: has version {_digest(name)} of module {name!r}, the sweep has {digest}; give all workers the "
                "same file and start them again"
            )


def _digest(name: str) -> str:
    """Return the digest of a module's file, which must be as it was when the module was imported."""
    module = sys.modules.get(name)
    try:
        spec = importlib.util.find_spec(name) if module is None else module.__spec__
    except (ImportError, ValueError):
        spec = None
    file = getattr(spec, "origin", None) or getattr(module, "__file__", None) or ""
    try:
        with open(file, "rb") as content:
            found = hashlib.blake2b(content.read(), digest_size=8).hexdigest()
    except OSError:
        return "no file"
    before, digest = _known.setdefault(file, (spec, found))
    if digest != found and before is spec:
        raise ValueError(f"module {name!r} ({file}) was edited after it was imported; start Python again, or reload it")
    _known[file] = spec, found
    return found


def changed(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    """Return the names of modules that both have in different versions."""
    return sorted(name for name in old.keys() & new.keys() if old[name] != new[name])
