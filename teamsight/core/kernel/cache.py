"""The cache of compiled kernels: its folder, its files, and what is stored in them."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import io
import os
import pickle
import re
import secrets
import shutil
import stat
import sys
import tempfile
import types as python_types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import config
from numba.core.compiler import CompileResult
from numba.core.environment import _rebuild_env
from numba.core.serialize import dumps

from teamsight.core.checks import shown
from teamsight.core.kernel.parts import FLAGS, refuse_circles

#: The environment variable that names the folder.
VARIABLE = "TEAMSIGHT_CACHE_DIR"

_OTHERS_MAY_WRITE = stat.S_IWGRP | stat.S_IWOTH
# Links are not followed, and pipes do not block; Windows has neither flag.
_SAFELY = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)

def cache_folder() -> Path | None:
    """Return the folder of compiled kernels; None if none can be made.

    It is ``TEAMSIGHT_CACHE_DIR``, or else the user's cache folder. If others can write to it, or this user cannot, it
    is a folder of this user among the temporary files, or else one for this process only, removed when it ends.
    """
    return _choose(os.environ.get(VARIABLE) or None)


def read(file: Path) -> bytes | None:
    """Return the content of a file; None if it cannot be read, or others could have written it."""
    try:
        with open(file, "rb", buffering=0, opener=_open_own) as stream:
            return stream.read()
    except OSError:
        return None


def write(file: Path, data: bytes) -> None:
    """Write a file atomically: readers find the former content or this. Does nothing if that is impossible.

    Parameters
    ----------
    file : Path
        The file, replaced if it exists.
    data : bytes
        The content.
    """
    beside = file.with_name(f"{file.name}.{os.getpid()}-{secrets.token_hex(4)}.tmp")
    with contextlib.suppress(OSError):
        try:
            with open(beside, "xb", opener=lambda path, flags: os.open(path, flags, 0o600)) as stream:
                stream.write(data)
            beside.replace(file)
        finally:
            beside.unlink(missing_ok=True)


def _open_own(path: str, flags: int) -> int:
    descriptor = os.open(path, flags | _SAFELY)
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode) or _others_control(found):
        os.close(descriptor)
        raise PermissionError(path)
    return descriptor


def _is_own(found: os.stat_result) -> bool:
    # Windows has no such ids; it protects the user's folders by other means.
    return not hasattr(os, "geteuid") or found.st_uid == os.geteuid()


def _others_control(found: os.stat_result) -> str:
    """Return why others could change this file or folder; empty if they cannot."""
    if not _is_own(found):
        return f"belongs to another user (uid {found.st_uid})"
    if hasattr(os, "geteuid") and found.st_mode & _OTHERS_MAY_WRITE:
        return f"can be written to by other users (mode {stat.S_IMODE(found.st_mode):04o})"
    return ""


class _UnsafeError(OSError):
    """Raised for a folder that others control; the message says why."""


# Once for each value of the environment variable, so that a notice is printed once.
@cache
def _choose(named: str | None) -> Path | None:
    reasons = []
    try:
        return _ready(Path(named).expanduser().absolute()) if named else _ready(_default(), ours=True)
    except _UnsafeError as error:
        reasons.append(str(error))
    except (OSError, RuntimeError, ValueError) as error:
        # On some cluster nodes nothing of the user's is writable: print a notice only if the user named the folder.
        if named:
            reasons.append(f"{shown(named)} cannot be used ({getattr(error, 'strerror', None) or shown(str(error))})")
    folder, how_long = _temporary(reasons)
    if reasons:
        where = f"are kept in {_named(folder)}{how_long}" if folder else "are not kept"
        cure = f"set {VARIABLE} to a folder of your own that no other user can write to"
        print(f"teamsight: compiled kernels {where}: {' and '.join(reasons)}; {cure}", file=sys.stderr)
    return folder


def _default() -> Path:
    import platformdirs

    folder = Path(platformdirs.user_cache_dir("teamsight", appauthor=False)) / "kernels"
    if not folder.is_absolute():  # a user without a home has the cache folder "~/.cache"
        raise FileNotFoundError("the user has no home")
    return folder


def _temporary(reasons: list[str]) -> tuple[Path | None, str]:
    """Return a temporary folder, and a phrase on how long it is kept; add why it is not the usual one to `reasons`."""
    user = os.geteuid() if hasattr(os, "geteuid") else "user"
    try:
        return _ready(Path(tempfile.gettempdir()) / f"teamsight-{user}", follow=False), ""
    except OSError as error:
        reasons.append(error.strerror or str(error))
    try:
        folder = Path(tempfile.mkdtemp(prefix="teamsight-"))
    except OSError:
        return None, ""
    atexit.register(_remove, folder, os.getpid())
    return folder, " until this process ends"


def _ready(folder: Path, *, follow: bool = True, ours: bool = False) -> Path:
    """Make the folder if it is missing; raise an OSError unless this user, and no other, can write to it."""
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700, parents=True)
    found = folder.stat(follow_symlinks=follow)
    if not stat.S_ISDIR(found.st_mode):
        raise _UnsafeError(f"{_named(folder)} is not a folder")
    if ours and _is_own(found) and found.st_mode & _OTHERS_MAY_WRITE:
        # Made by an earlier version, where new folders are open to the user's group.
        folder.chmod(0o700)
        found = folder.stat()
    if control := _others_control(found):
        raise _UnsafeError(f"{_named(folder)} {control}")
    tempfile.TemporaryFile(dir=folder).close()
    return folder


def _named(folder: Path) -> str:
    """Return a folder's name for a notice: cut if it is long, and without control characters."""
    return shown(str(folder), 120).strip("'\"")


def _remove(folder: Path, maker: int) -> None:
    if os.getpid() == maker:  # not in a process forked from it
        shutil.rmtree(folder, ignore_errors=True)


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


_LIBRARIES = {*sys.stdlib_module_names, "llvmlite", "numba", "numpy"} - {"__main__"}


def is_library(module: str | None) -> bool:
    """Return whether a module changes with its version only, and accesses arrays through numba's own code only."""
    return (module or "").partition(".")[0] in _LIBRARIES


def names_in(code: python_types.CodeType) -> Iterator[str]:
    """Yield the global names and attributes in a function's code, and in that of the functions inside it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, python_types.CodeType):
            yield from names_in(constant)


def enclosed(function: python_types.FunctionType) -> list[Any]:
    """Return the values of the variables that a function uses from functions around it."""
    return [cell.cell_contents for cell in function.__closure__ or ()]


def globals_of(function: python_types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Yield the globals that a function uses, and the attributes of modules, as in ``forces.attract``."""
    names = list(names_in(function.__code__))
    for name in names:
        if name not in function.__globals__:
            continue
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, python_types.ModuleType) and not is_library(value.__name__):
            yield from ((part, getattr(value, part)) for part in names if hasattr(value, part))


def digest(function: Callable[..., Any]) -> str:
    """Return a digest of a function's code, of all kernels that it calls and of all constants that it uses."""
    hasher = hashlib.blake2b(digest_size=16)
    flags = sorted(FLAGS.items())
    hasher.update(f"{numba.__version__} {llvmlite.__version__} {np.__version__} {flags}".encode())
    for part in _parts(function, set()):
        hasher.update(part)
    return hasher.hexdigest()


def _parts(value: Any, met: set[int]) -> Iterator[bytes]:
    if (options := getattr(value, "targetoptions", None)) is not None:
        # Such as whether the kernel is inlined.
        yield repr(sorted(options.items())).encode()
    value = getattr(value, "py_func", value)
    # The function that generates the machine code of an intrinsic.
    value = getattr(value, "_defn", value)
    if not isinstance(value, python_types.FunctionType):
        # Of a NamedTuple class kernels use the fields; an object, such as the layout of a record, shows what it holds.
        fields = getattr(value, "_fields", None) if isinstance(value, type) else None
        yield repr(fields if fields else value if not isinstance(value, python_types.ModuleType) else "").encode()
        return
    if id(value) in met:
        return
    met.add(id(value))
    if is_library(value.__module__):
        yield f"{value.__module__}.{value.__qualname__}".encode()
        return
    yield value.__qualname__.encode()
    yield repr((value.__defaults__, value.__kwdefaults__)).encode()
    yield from _code_parts(value.__code__)
    for used in enclosed(value):
        yield from _parts(used, met)
    for name, used in globals_of(value):
        yield name.encode()
        yield from _parts(used, met)


def _code_parts(code: python_types.CodeType) -> Iterator[bytes]:
    yield code.co_code
    for constant in code.co_consts:
        if isinstance(constant, python_types.CodeType):
            yield from _code_parts(constant)
        else:
            yield repr(constant).encode()
    yield repr(code.co_names).encode()
