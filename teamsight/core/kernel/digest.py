"""The digest of a kernel: of its code and of all that it calls, in any file.

numba's own cache does not notice an edit in another file, and would run the old physics.
"""

from __future__ import annotations

import hashlib
import types as python_types
from collections.abc import Callable, Iterator
from typing import Any

import llvmlite
import numba
import numpy as np

from teamsight.core.kernel.parts import FLAGS
from teamsight.core.kernel.uses import enclosed, globals_of, is_library


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
