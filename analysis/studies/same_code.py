"""Whether this process has the code of the sweep: rows of two versions must not be mixed."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Protocol


class SourceError(RuntimeError):
    """Raised by a worker that has other code than the sweep; the message names both versions."""


class HasDigests(Protocol):
    """What names the code of a sweep; see `shard.Common`."""

    @property
    def code(self) -> str:
        """The digest of teamsight's code."""

    @property
    def sources(self) -> dict[str, str]:
        """The digest of each module's file."""


def source_digests(modules: Iterable[str]) -> dict[str, str]:
    """Return a digest of the file of each module, 16 hexadecimal digits."""
    return {name: _digest(name) for name in sorted(set(modules))}


def check_same_code(common: HasDigests) -> None:
    """Raise an error if this process has another version of the code than the sweep.

    Raises
    ------
    SourceError
        Naming both versions.
    """
    _check(common.code, tuple(common.sources.items()))


@cache
def _check(code: str, sources: tuple[tuple[str, str], ...]) -> None:
    from teamsight.analysis.runs.checkpoint import code_digest

    if code_digest() != code:
        raise SourceError(
            f"worker: has version {code_digest()} of teamsight's code, the sweep has {code}; install the same version "
            "for all workers and start them again"
        )
    for name, digest in sources:
        if _digest(name) != digest:
            raise SourceError(
                f"worker: has version {_digest(name)} of module {name!r}, the sweep has {digest}; give all workers the "
                "same file and start them again"
            )


@cache
def _digest(name: str) -> str:
    """Return the digest of a module's file as it was when this process asked first, which is before it is imported."""
    module = sys.modules.get(name)
    try:
        spec = importlib.util.find_spec(name) if module is None else module.__spec__
    except (ImportError, ValueError):
        spec = None
    origin = getattr(spec, "origin", None) or getattr(module, "__file__", None)
    try:
        with open(origin or "", "rb") as file:
            return hashlib.blake2b(file.read(), digest_size=8).hexdigest()
    except OSError:
        return "no file"


def changed(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    """Return the names of modules that both have in different versions."""
    return sorted(name for name in old.keys() & new.keys() if old[name] != new[name])
