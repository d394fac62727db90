"""The cache of compiled kernels: its folder, its files, and what is stored in them."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import importlib.util
import os
import platform
import re
import secrets
import shutil
import stat
import sys
import tempfile
import types as python_types
from collections.abc import Callable, Iterator
from enum import EnumType
from functools import cache, cached_property
from importlib.metadata import version
from operator import itemgetter
from pathlib import Path
from time import monotonic, sleep
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np

from teamsight.core import interrupts
from teamsight.core.checks import shown

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


_FORMAT = b"teamsight kernel 2\n"
_HEAD = len(_FORMAT) + hashlib.sha256().digest_size
# Settings of numba that change the machine code: the environment variable and the default of each.
_SETTINGS = {
    "OPT": ("NUMBA_OPT", "3"), "LOOP_VECTORIZE": ("NUMBA_LOOP_VECTORIZE", "1"),
    "SLP_VECTORIZE": ("NUMBA_SLP_VECTORIZE", "0"), "BOUNDSCHECK": ("NUMBA_BOUNDSCHECK", "None"),
    "DEBUGINFO_DEFAULT": ("NUMBA_DEBUGINFO", "0"),
}  # fmt: skip
_PYTHON = f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')}"
# The most characters of a function's name in a file's name; file systems allow 255 bytes in all.
_LONGEST_NAME = 100


class Code(NamedTuple):
    """The machine code of an entry.

    Attributes
    ----------
    name : str
        The name of its function.
    needs_numba : bool
        Whether it calls functions of numba.
    binary : bytes
        An object file.
    """

    name: str
    needs_numba: bool
    binary: bytes

    def load(self) -> tuple[Any, int]:
        """Return what keeps the code in memory, and the address of its function."""
        if self.needs_numba:
            # Its code generator makes its functions known.
            from numba.core.registry import cpu_target

            cpu_target.target_context.codegen()
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        target = llvm.Target.from_triple(llvm.get_process_triple())
        machine = target.create_target_machine(codemodel="jitdefault", jit=True)
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
        engine.add_object_file(llvm.ObjectFileRef.from_data(self.binary))
        engine.finalize_object()
        if not (address := engine.get_function_address(self.name)):
            raise ValueError(f"no function {self.name}")
        return engine, address


#: Kernels that come with a wheel, for all processors of a kind; ``.ci/ship_kernels.py`` makes them.
SHIPPED = Path(__file__).with_name("shipped")
#: The processor for which they are made, and what one must have to run them, by the kind of machine.
GENERIC = {
    "x86_64": ("x86-64-v3", ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")), "aarch64": ("generic", ()),
    "arm64": ("generic", ()),
}  # fmt: skip


# By which a user names another processor.
_NAMED = {"NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_ENABLE_AVX"}
# How long to wait for another process, which may have been stopped, and how long between two looks at it [s].
_PATIENCE, _PAUSE = 60.0, 0.02
# After which a line says so, once.
_SILENT = 2.0


class Place(NamedTuple):
    """A file of machine code, if there is a folder for it, and what it must be the code of."""

    key: bytes
    file: Path | None

    @classmethod
    def of(cls, folder: Path | None, function: Callable[..., Any], key: tuple[Any, ...]) -> Place:
        """Return the place of an entry in a folder."""
        name = re.sub(r"[^A-Za-z0-9._-]", "", function.__qualname__)[:_LONGEST_NAME]
        text = repr(key).encode()
        return cls(text, folder / f"{name}-{hashlib.sha256(text).hexdigest()[:32]}.kernel" if folder else None)

    def load(self, reader: Callable[[Path], bytes | None]) -> Code | None:
        """Return what the file holds; None if it is not there or damaged."""
        data = reader(self.file) if self.file is not None else None
        if data is None or data != _sealed(self.key, payload := data[_HEAD:]):
            return None
        name, needs_numba, binary = payload.split(b"\n", 2)
        return Code(name.decode(), needs_numba == b"1", binary)

    def save(self, code: Code) -> None:
        """Write the file, if there is a folder."""
        if self.file is not None:
            payload = b"%s\n%d\n%s" % (code.name.encode(), code.needs_numba, code.binary)
            write(self.file, _sealed(self.key, payload))


    @contextlib.contextmanager
    def turn(self) -> Iterator[None]:
        """Wait as long as another process compiles this entry; the lock of a process ends with it."""
        try:
            import fcntl

            if self.file is None:
                raise FileNotFoundError
            lock = self.file.with_suffix(".lock")
            descriptor = os.open(lock, os.O_CREAT | os.O_RDWR | _SAFELY, 0o600)
        except (ImportError, OSError):  # Windows, or no folder: each process compiles for itself
            yield
            return
        until, is_held = monotonic() + _PATIENCE, False
        try:
            while not is_held and monotonic() < until:
                try:
                    # Not flock, whose lock a forked process would keep.
                    fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    is_held = True
                except (BlockingIOError, PermissionError):
                    if interrupts.is_pending():
                        raise KeyboardInterrupt from None
                    if until - monotonic() < _PATIENCE - _SILENT:
                        _say_waiting()
                    sleep(_PAUSE)
                except OSError:  # a file system without locks
                    break
            yield
        finally:
            if is_held:
                with contextlib.suppress(OSError):
                    lock.unlink()
            os.close(descriptor)


@cache
def _say_waiting() -> None:
    print("teamsight: waiting for another process that compiles the same kernels", file=sys.stderr)


class KernelCache:
    """The machine code of one entry: as it came with the package, or in the cache of this machine.

    Parameters
    ----------
    function : callable
        The function that is compiled.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def load(self) -> Code | None:
        """Return the machine code; None if it has to be compiled."""
        # What came with the package belongs to whoever installed it.
        return self._shipped.load(_content) or self.kept.load(read)

    def contains(self) -> bool:
        """Whether there is a file; only loading it shows whether it is intact."""
        return any(place.file is not None and place.file.exists() for place in (self._shipped, self.kept))

    @property
    def kept(self) -> Place:
        """The place in the cache."""
        key = self._digest, _versions(), _target(), _settings(), _PYTHON
        return Place.of(cache_folder(), self._function, key)

    @cached_property
    def _digest(self) -> str:
        return digest(self._function)

    @cached_property
    def _shipped(self) -> Place:
        return shipped_place(self._function)


def shipped_place(function: Callable[..., Any]) -> Place:
    """Return the place of an entry among those that come with a wheel; without file if this machine cannot use them."""
    machine = platform.machine()
    processor, needed = GENERIC.get(machine, ("", ()))
    is_usual = _settings() == [default for _, default in _SETTINGS.values()] and not _NAMED & {*os.environ}
    if not SHIPPED.is_dir() or not processor or not is_usual:
        return Place(b"", None)
    has = llvm.get_host_cpu_features()
    if not all(has.get(one) for one in needed):
        return Place(b"", None)
    return Place.of(SHIPPED, function, (digest(function, _source_of), sys.platform, machine, processor))


def _content(file: Path) -> bytes | None:
    try:
        return file.read_bytes()
    except OSError:
        return None


@cache
def _versions() -> tuple[str, ...]:
    return tuple(version(package) for package in ("numba", "llvmlite", "numpy"))


def _target() -> tuple[str, ...]:
    """Return the processor that numba compiles for: this one, unless the user names another."""
    name = os.environ.get("NUMBA_CPU_NAME") or llvm.get_host_cpu_name()
    features = os.environ.get("NUMBA_CPU_FEATURES")
    return llvm.get_process_triple(), name, _features() if features is None else features


@cache
def _features() -> str:
    return f"{os.environ.get('NUMBA_ENABLE_AVX')} {llvm.get_host_cpu_features().flatten()}"


def _settings() -> list[str]:
    """Return numba's settings; it reads its environment variables when it is imported, and scripts may change them."""
    config = sys.modules.get("numba.core.config")
    if config is None:
        return [os.environ.get(variable, default) for variable, default in _SETTINGS.values()]
    values = [getattr(config, name) for name in _SETTINGS]
    return [str(getattr(value, "_raw_value", value)) for value in values]


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
    names = list(dict.fromkeys(names_in(function.__code__)))
    found = [(name, function.__globals__[name]) for name in names if name in function.__globals__]
    met = set()
    for name, value in found:  # grows
        yield name, value
        if isinstance(value, python_types.ModuleType) and not is_library(value.__name__) and value not in met:
            met.add(value)
            found += [(part, getattr(value, part)) for part in names if hasattr(value, part)]


def digest(
    function: Callable[..., Any], of_code: Callable[[python_types.CodeType], Iterator[bytes]] | None = None
) -> str:
    """Return a digest of a function's code, of all kernels that it calls and of all constants that it uses.

    Parameters
    ----------
    function : callable
        The function of an entry.
    of_code : callable, optional
        Yields what identifies the code of a function; by default its bytecode, which is that of a version of Python.
    """
    of_code = of_code or _code_parts
    hasher = hashlib.blake2b(_compiler(of_code), digest_size=16)
    for part in _parts(function, set(), of_code):
        hasher.update(part)
    return hasher.hexdigest()


@cache
def _compiler(of_code: Callable[[python_types.CodeType], Iterator[bytes]]) -> bytes:
    """Return a digest of the code that compiles, and of all intrinsics."""
    hasher = hashlib.blake2b()
    for name in ("compiler", "generators"):
        module = f"{__package__}.{name}"
        # Read, not imported: that would import numba.
        loader: Any = getattr(importlib.util.find_spec(module), "loader", None)
        for part in of_code(loader.get_code(module)):
            hasher.update(part)
    return hasher.digest()


def _source_of(code: python_types.CodeType) -> Iterator[bytes]:
    yield f"{code.co_name} {code.co_firstlineno}".encode()
    yield _source(code.co_filename)


@cache
def _source(file: str) -> bytes:
    return hashlib.blake2b(_content(Path(file)) or file.encode()).digest()


def _parts(value: Any, met: set[int], of_code: Callable[[Any], Iterator[bytes]]) -> Iterator[bytes]:
    if getattr(value, "is_intrinsic", False):
        yield repr((value.__name__, value.identity)).encode()
        return
    if (options := getattr(value, "targetoptions", None)) is not None:
        # Such as whether the kernel is inlined.
        yield repr(sorted(options.items())).encode()
    value = getattr(value, "py_func", value)
    # The function that generates the machine code of an intrinsic of numba or of a user.
    value = getattr(value, "_defn", value)
    if isinstance(value, np.ndarray):
        # Its text leaves out what is in the middle.
        yield f"{value.dtype} {value.shape}".encode() + value.tobytes()
        return
    if isinstance(value, tuple):
        # Their text, too, leaves out digits and the middle of arrays.
        yield f"{type(value).__name__} {getattr(value, '_fields', '')} {len(value)}".encode()
        for one in value:
            yield from _parts(one, met, of_code)
        return
    if isinstance(value, EnumType):
        yield repr(list(value)).encode()
        return
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
    yield from of_code(value.__code__)
    for used in enclosed(value):
        yield from _parts(used, met, of_code)
    # Versions of Python number the names differently.
    for name, used in sorted(globals_of(value), key=itemgetter(0)):
        yield name.encode()
        yield from _parts(used, met, of_code)


def _code_parts(code: python_types.CodeType) -> Iterator[bytes]:
    yield code.co_code
    for constant in code.co_consts:
        if isinstance(constant, python_types.CodeType):
            yield from _code_parts(constant)
        else:
            yield repr(constant).encode()
    yield repr(code.co_names).encode()
