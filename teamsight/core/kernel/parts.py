"""Kernels as parts of an entry: numba makes no machine code of their own for them, until Python calls one.

For each function numba also compiles a wrapper for the interpreter, and makes machine code of both. A kernel needs
neither, since an entry holds the code of all that it calls. That is a third of the time that an entry takes to compile.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cached_property
from inspect import signature
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
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

    def _optimize_functions(self, ll_module: Any) -> None:
        """Leave it to the entry."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOfParts(NativeLowering):  # type: ignore[misc]
    _name = "teamsight_lowering_of_parts"

    def run_pass(self, state: Any) -> bool:
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = True
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


class _Whole(JITCodeLibrary):  # type: ignore[misc]
    """The code of an entry as one function; numba would make two, and a call of one by the other at each call."""

    def add_ir_module(self, module: Any) -> None:
        if module.name == "cfunc_wrapper":
            for function in module.functions:
                for instruction in (one for block in function.blocks for one in block.instructions):
                    if isinstance(instruction, ir.CallInstr):
                        instruction.attributes.discard("noinline")
        super().add_ir_module(module)

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and not function.name.startswith("cfunc."):
                function.linkage = "internal"
        super()._optimize_final_module()


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOfEntries(NativeLowering):  # type: ignore[misc]
    _name = "teamsight_lowering_of_entries"

    def run_pass(self, state: Any) -> bool:
        state.library = _Whole(state.targetctx.codegen(), state.func_id.func_qualname)
        # As numba does with a library of its own: without it the machine code could not be kept.
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class CompilerOfEntries(Compiler):  # type: ignore[misc]
    """Numba's compiler, with another way to machine code."""

    lowering = _LoweringOfEntries

    def define_pipelines(self) -> list[Any]:
        pipelines = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [
                (self.lowering if step is NativeLowering else step, name) for step, name in pipeline.passes
            ]
            pipeline.finalize()
        return list(pipelines)


class _CompilerOfParts(CompilerOfEntries):
    lowering = _LoweringOfParts


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


F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Mark a function as a kernel: compiled with the first entry that uses it, never at import."""
    return cast(F, Part(function, options=FLAGS))


def inlined(function: F) -> F:
    """Mark a small kernel that is always compiled into its caller, so that loops around it can use SIMD lanes."""
    return cast(F, Part(function, options=dict(FLAGS, forceinline=True)))


def plain(function: F) -> F:
    """Return the Python function behind a kernel."""
    return cast(F, getattr(function, "py_func", function))
