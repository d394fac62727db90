"""How numba compiles an entry and the kernels in it; imported when the first one is compiled.

For each function numba also compiles a wrapper for the interpreter, and makes machine code of both. A kernel needs
neither, since an entry holds the code of all that it calls. That is a third of the time that an entry takes to compile.
"""

from __future__ import annotations

import ctypes
import gc
import re
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary, RuntimeLinker
from numba.core.compiler import Compiler, _LowerResult
from numba.core.compiler_machinery import register_pass
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering


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
        module = self._final_module
        # Before the optimiser puts the addresses of this process, such as those of functions of ctypes, into the code.
        self._finalize_dynamic_globals()
        for defined in (*module.functions, *module.global_variables):
            if not defined.is_declaration and not defined.name.startswith("cfunc."):
                defined.linkage = "internal"
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
    """What numba compiles a kernel with, as a part of entries and other kernels.

    Parameters
    ----------
    function : callable
        The kernel's Python function.
    variables : mapping
        Types of its variables.
    options : mapping
        As for `numba.njit`.
    """

    def __init__(self, function: Callable[..., Any], variables: Any, options: Any) -> None:
        super().__init__(function, variables, options, _CompilerOfParts)


def compiled(function: Callable[[int], int], options: Any) -> tuple[Any, int, tuple[str, bool, bytes] | None]:
    """Compile an entry.

    Parameters
    ----------
    function : callable
        Takes the address of a record and returns a status.
    options : mapping
        As for `numba.njit`.

    Returns
    -------
    owner : object
        What keeps the machine code.
    address : int
        Where it begins.
    code : (str, bool, bytes) or None
        The fields of `teamsight.core.kernel.cache.Code`, for other processes; None if the machine code holds an address
        of this one.

    Raises
    ------
    NumbaError
        If kernels call each other in a circle: their code could only be called in this process. Numba raises other
        errors for what it cannot compile.
    """
    # numba.cfunc would compile at once and use numba's own cache.
    owner: Any = CFunc(
        function, ((types.int64,), types.int64), locals={}, options=dict(options),
        pipeline_class=CompilerOfEntries,
    )  # fmt: skip
    # numba makes millions of objects that it keeps; to look for garbage among them takes a tenth of the time.
    is_collecting = gc.isenabled()
    gc.disable()
    try:
        owner.compile()
    finally:
        if is_collecting:
            gc.enable()
    library = owner._library
    module = library._final_module
    for variable in module.global_variables:
        if variable.name.startswith(RuntimeLinker.PREFIX):
            name = _last_name(variable.name)
            raise NumbaError(f"kernels call each other in a circle, by way of {name}(); use a loop")
    if library.has_dynamic_globals:
        return owner, owner.address, None
    called = [each.name for each in module.functions if each.is_declaration and not each.name.startswith("llvm.")]
    return owner, owner.address, (owner.native_name, not _are_known(called), library._get_compiled_object())


def _are_known(names: list[str]) -> bool:
    """Whether the process has functions of these names without numba's own, such as those of the C library."""
    try:
        process = ctypes.CDLL(None)
    except (OSError, TypeError):  # Windows has no such handle
        return not names
    return all(hasattr(process, name) for name in names)


def _last_name(mangled: str) -> str:
    """Return the name of a function from that of its symbol, which has the length before each part."""
    name, rest = "a kernel", mangled[mangled.index("_ZN") + 3 :]
    while met := re.match(r"\d+", rest):
        end = met.end() + int(met[0])
        name, rest = rest[met.end() : end], rest[end:]
    return name
