"""The parts of a kernel: the functions and values that it uses, and their digest."""

from __future__ import annotations

import hashlib
import re
import sys
import types as python_types
from collections.abc import Callable, Iterator
from functools import cached_property
from inspect import signature
from typing import Any, cast

import llvmlite
import numba
import numpy as np
from numba.core.codegen import JITCodeLibrary, RuntimeLinker
from numba.core.compiler import Compiler, _LowerResult
from numba.core.compiler_machinery import register_pass
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering

# fastmath stays off: it would break the checks for NaN and the equality of the two paths to the last bit.
FLAGS = {"nogil": True, "error_model": "numpy", "_nrt": False}


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code that others link, and that is not run by itself."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOfParts(NativeLowering):  # type: ignore[misc]
    _name = "teamsight_lowering_of_parts"

    def run_pass(self, state: Any) -> bool:
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = state.flags.no_cpython_wrapper = True
        changed = super().run_pass(state)
        description, helper, _, environment = state.cr
        # What callers find it by, of the type that numba asks for; nothing calls it.
        unique: list[None] = []
        key = unique.append
        state.targetctx.insert_user_function(key, description, [state.library])
        # Since numba 0.62.
        state.reload_init.extend(getattr(state.library, "_reload_init", ()))
        state.cr = _LowerResult(description, helper, cfunc=key, env=environment)
        return bool(changed)


class _CompilerOfParts(Compiler):  # type: ignore[misc]
    def define_pipelines(self) -> list[Any]:
        pipelines = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [
                (_LoweringOfParts if step is NativeLowering else step, name) for step, name in pipeline.passes
            ]
            pipeline.finalize()
        return list(pipelines)


class Part(CPUDispatcher):  # type: ignore[misc]
    """A kernel for entries and other kernels; from Python it runs too, compiled once more as a whole.

    Parameters
    ----------
    function : callable
        The kernel's Python function.
    types : mapping, optional
        Types of its variables.
    options : mapping, optional
        As for `numba.njit`.
    pipeline : type
        Numba's compiler.
    """

    def __init__(
        self, function: Callable[..., Any], types: Any = None, options: Any = None, pipeline: Any = _CompilerOfParts
    ) -> None:
        super().__init__(function, types or {}, dict(options or {}, nopython=True), pipeline)

    @cached_property
    def _whole(self) -> Callable[..., Any]:
        # Another function, since numba takes a call of the same one for recursion.
        part = self
        return cast(Callable[..., Any], numba.njit(**FLAGS)(lambda *arguments: part(*arguments)))

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Run it from Python."""
        bound = signature(self.py_func).bind(*arguments, **named)
        bound.apply_defaults()
        return self._whole(*bound.args)


def refuse_circles(library: Any) -> None:
    """Refuse an entry with kernels that call each other in a circle.

    The code of such kernels could only be called in the process that compiled it.

    Parameters
    ----------
    library : numba.core.codegen.CodeLibrary
        The code of the entry.

    Raises
    ------
    NumbaError
        With the first of them.
    """
    library._ensure_finalized()
    for variable in library._final_module.global_variables:
        if variable.name.startswith(RuntimeLinker.PREFIX):
            name = _last_name(variable.name)
            raise NumbaError(f"kernels call each other in a circle, by way of {name}(); use a loop")


def _last_name(mangled: str) -> str:
    """Return the name of a function from that of its symbol, which has the length before each part."""
    name, rest = "a kernel", mangled[mangled.index("_ZN") + 3 :]
    while met := re.match(r"\d+", rest):
        end = met.end() + int(met[0])
        name, rest = rest[met.end() : end], rest[end:]
    return name


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
