"""The cache of compiled entries: one file each, verified before anything in it is used.

A file holds the line `_FORMAT`, a SHA-256 checksum, and what numba needs to load the machine code. The checksum covers
the key too, so the file of another entry is noticed as a truncated one is. Whatever cannot be read counts as missing.
"""

from __future__ import annotations

import hashlib
import pickle
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core import config
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from teamsight.core.kernel.cache_folder import cache_folder, read, write
from teamsight.core.kernel.digest import digest

_FORMAT = b"teamsight kernel 1\n"
_CHECKSUM = hashlib.sha256().digest_size
# Settings of numba that change the machine code and are not in its description of the processor.
_SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT")
_PYTHON = f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')}"
# Of a file's name; file systems allow 255 bytes in all.
_LONGEST_NAME = 100


class KernelCache:
    """What `numba.core.ccallback.CFunc` asks of a cache, for one function.

    Parameters
    ----------
    function : callable
        The function that is compiled.
    compiler : str
        How it is compiled.
    missing : callable
        Called with the function's name when it is about to be compiled.
    """

    def __init__(self, function: Callable[..., Any], compiler: str, missing: Callable[[str], None]) -> None:
        self._name = function.__qualname__
        self._digest = digest(function, compiler)
        self._missing = missing

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return numba's compile result from the cache; None if it has to be compiled."""
        target.refresh()
        key = self._key(signature, target.codegen())
        file = self._file(key)
        payload = _verified(read(file), key) if file else None
        if payload is not None:
            try:
                return CompileResult._rebuild(target, *pickle.loads(payload))
            except Exception:  # intact, yet unreadable: compiled anew and replaced
                pass
        self._missing(self._name)
        return None

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep a compile result, if there is a place for it."""
        key = self._key(signature, result.codegen)
        file = self._file(key)
        if file is None:
            return
        try:
            payload = dumps(result._reduce())
        except Exception:  # it holds what cannot be pickled, and is compiled by each process
            return
        write(file, _FORMAT + _checksum(key, payload) + payload)

    def _key(self, signature: Any, codegen: Any) -> bytes:
        settings = [getattr(config, name, None) for name in _SETTINGS]
        parts = self._digest, signature, codegen.magic_tuple(), settings, _PYTHON
        return repr(parts).encode()

    def _file(self, key: bytes) -> Path | None:
        folder = cache_folder()
        name = re.sub(r"[^A-Za-z0-9._-]", "", self._name)[:_LONGEST_NAME]
        return folder / f"{name}-{hashlib.sha256(key).hexdigest()[:32]}.kernel" if folder else None


def _verified(data: bytes | None, key: bytes) -> bytes | None:
    """Return the payload of a file; None if the file is not what was written under this key."""
    head = len(_FORMAT) + _CHECKSUM
    if data is None or len(data) < head or not data.startswith(_FORMAT):
        return None
    payload = data[head:]
    return payload if data[len(_FORMAT) : head] == _checksum(key, payload) else None


def _checksum(key: bytes, payload: bytes) -> bytes:
    # The key has a fixed length here, so that no end of a key can be taken for the beginning of a payload.
    return hashlib.sha256(hashlib.sha256(key).digest() + payload).digest()
