"""The cache of compiled entries: one file each, verified before anything in it is used.

A file holds the line `_FORMAT`, a SHA-256 checksum, and what numba needs to load the machine code. The checksum covers
the key too, so that a truncated file and that of another entry are both detected. A file that cannot be read counts as
missing.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import pickle
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core import config
from numba.core.compiler import CompileResult
from numba.core.environment import _rebuild_env
from numba.core.serialize import dumps

from teamsight.core.kernel.cache_folder import cache_folder, read, write
from teamsight.core.kernel.digest import digest
from teamsight.core.kernel.parts import refuse_circles

_FORMAT = b"teamsight kernel 1\n"
_HEAD = len(_FORMAT) + hashlib.sha256().digest_size
# Settings of numba, beside its description of the processor, that change the machine code.
_SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT")
_PYTHON = f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')}"
# The most characters of a function's name in a file's name; file systems allow 255 bytes in all.
_LONGEST_NAME = 100


class KernelCache:
    """The cache for one function, with the interface that `numba.core.ccallback.CFunc` uses.

    Parameters
    ----------
    function : callable
        The function that is compiled.
    missing : callable
        Called with the function's name before it is compiled.
    """

    def __init__(self, function: Callable[..., Any], missing: Callable[[str], None]) -> None:
        self._name = function.__qualname__
        self._digest = digest(function)
        self._missing = missing

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return numba's compile result from the cache; None if it has to be compiled."""
        target.refresh()
        key, file = self._place(signature, target.codegen())
        data = read(file) if file else None
        if data is not None and data == _sealed(key, payload := data[_HEAD:]):
            # One that is intact but unreadable is compiled and replaced.
            with contextlib.suppress(Exception):
                return _rebuilt(target, payload)
        self._missing(self._name)
        return None

    def contains(self, signature: Any, target: Any) -> bool:
        """Whether the cache has a compile result; only loading it shows whether the file is intact."""
        _, file = self._place(signature, target.codegen())
        return file is not None and file.exists()

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep a compile result, if there is a cache folder."""
        refuse_circles(result.library)
        key, file = self._place(signature, result.codegen)
        if file is not None:
            # One that cannot be pickled is compiled by each process.
            with contextlib.suppress(Exception):
                write(file, _sealed(key, dumps(result._reduce())))

    def _place(self, signature: Any, codegen: Any) -> tuple[bytes, Path | None]:
        """Return the key of a compile result, and its file, if there is a cache folder."""
        settings = [getattr(config, name, None) for name in _SETTINGS]
        parts = self._digest, signature, codegen.magic_tuple(), settings, _PYTHON
        key, folder = repr(parts).encode(), cache_folder()
        name = re.sub(r"[^A-Za-z0-9._-]", "", self._name)[:_LONGEST_NAME]
        return key, folder / f"{name}-{hashlib.sha256(key).hexdigest()[:32]}.kernel" if folder else None


# numba imports the module in which a kernel was compiled, for names that machine code without the interpreter never
# looks up: any module does, and that one may be a script, which would run once more.
_ANY_MODULE = "builtins"


class _Reader(pickle.Unpickler):
    """Reads what numba needs to load machine code, but imports nothing for it."""

    def find_class(self, module: str, name: str) -> Any:
        if name == "_rebuild_env":
            return lambda _, constants, environment: _rebuild_env(_ANY_MODULE, constants, environment)
        return super().find_class(module, name)


def _rebuilt(target: Any, payload: bytes) -> Any:
    """Return a compile result from the content of a file."""
    library, description, *rest = _Reader(io.BytesIO(payload)).load()
    description.modname = _ANY_MODULE
    return CompileResult._rebuild(target, library, description, *rest)


def _sealed(key: bytes, payload: bytes) -> bytes:
    """Return the content of a file."""
    # The digest of the key has a fixed length, so that key and payload cannot be confused.
    return _FORMAT + hashlib.sha256(hashlib.sha256(key).digest() + payload).digest() + payload
