"""How numba compiles an entry and the kernels in it; imported when the first one is compiled.

For each function numba also compiles a wrapper for the interpreter, and makes machine code of both. A kernel needs
neither, since an entry holds the code of all that it calls. That is a third of the time that an entry takes to compile.
"""

from __future__ import annotations

import ctypes
import gc
import re
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from llvmlite import ir
from numba import config, types
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary, RuntimeLinker
from numba.core.compiler import Compiler, _LowerResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering

from teamsight.core.kernel.cache import digest


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code that others link, and that is not run by itself."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Leave it to the entry."""

    def finalize(self) -> None:
        """Leave it to the entry to link and to optimise."""
        self._finalized = True

    def own_module(self) -> Any:
        """Return its code alone."""
        return super()._get_module_for_linking()

    def _get_module_for_linking(self) -> Any:
        """Return its code with that of all that it calls, for functions that numba compiles in its own way."""
        module = self.own_module().clone()
        _link(module, self._linking_libraries)
        return module


def _link(module: Any, libraries: list[Any]) -> list[Any]:
    """Add the code of libraries, and of all parts that they call, to a module; return them."""
    every = list(libraries)
    for library in every:  # grows
        is_part = isinstance(library, _Part)
        module.link_in(library.own_module() if is_part else library._get_module_for_linking(), preserve=True)
        every += [one for one in library._linking_libraries if is_part and one not in every]
    return every


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

    def finalize(self) -> None:
        """Link each part once; numba would link those of each part with it, and optimise them there."""
        for library in _link(self._final_module, self._linking_libraries):
            # Since numba 0.62.
            getattr(self, "_reload_init", set()).update(getattr(library, "_reload_init", ()))
        self._linking_libraries.clear()
        super().finalize()

    def _optimize_final_module(self) -> None:
        module = self._final_module
        for defined in (*module.functions, *module.global_variables):
            # Addresses of this process, such as those of functions of ctypes, remain, so that they are found later.
            if not defined.is_declaration and not defined.name.startswith(("cfunc.", "numba.dynamic.globals")):
                defined.linkage = "internal"
        # Numba would first inline, to find what it can drop of counting references, which kernels have not.
        manager: Any = self._codegen._module_pass_manager()
        if isinstance(manager, tuple):  # since numba 0.62
            manager, builder = manager
            manager.run(module, builder)
        else:
            manager.run(module)

    def _finalize_final_module(self) -> None:
        # Not for numba's engine: by their names it would find functions that the optimiser has changed for this entry.
        self._finalize_dynamic_globals()
        self._finalized = True

    def binary(self) -> bytes:
        """Return its machine code as an object file."""
        return bytes(self._codegen._tm.emit_object(self._final_module))


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOfEntries(NativeLowering):  # type: ignore[misc]
    _name = "teamsight_lowering_of_entries"

    def run_pass(self, state: Any) -> bool:
        state.library = _Whole(state.targetctx.codegen(), state.func_id.func_qualname)
        return bool(super().run_pass(state))


class EntryCompiler(Compiler):  # type: ignore[misc]
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


class _PartCompiler(EntryCompiler):
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
        super().__init__(function, variables, options, _PartCompiler)
        self._made_of = ""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile it once for all constants that it is called with; numba would compile it for each of them."""
        if self._made_of != (found := digest(self.py_func)):
            # Of globals that have changed since; the entry would be kept under the digest of the new ones.
            self._reset_overloads()
            self._made_of = found
        named = {name: types.unliteral(kind) for name, kind in kws.items()}
        try:
            return super().get_call_template(tuple(map(types.unliteral, args)), named)
        except NumbaError:
            # Some need the constant, such as the index of a tuple of several types, or the length for `scratch`.
            with suppress(NumbaError):
                return super().get_call_template(args, kws)
            raise


@global_compiler_lock  # type: ignore[untyped-decorator]
def compiled(function: Callable[[int], int], options: Any) -> tuple[str, bool, bytes, bool]:
    """Compile an entry.

    Parameters
    ----------
    function : callable
        Takes the address of a record and returns a status.
    options : mapping
        As for `numba.jit`.

    Returns
    -------
    name, needs_numba, binary
        See `teamsight.core.kernel.cache.Code`.
    is_portable : bool
        Whether the machine code holds no address of this process.

    Raises
    ------
    NumbaError
        If kernels call each other in a circle, or numba is set to compile nothing. Numba raises other errors for what
        it cannot compile.
    """
    if config.DISABLE_JIT:
        raise NumbaError("numba compiles nothing, because NUMBA_DISABLE_JIT is set; unset it")
    # numba.cfunc would compile at once and use numba's own cache.
    compiler: Any = CFunc(
        function, ((types.int64,), types.int64), locals={}, options=dict(options), pipeline_class=EntryCompiler
    )
    # numba makes millions of objects that it keeps; to look for garbage among them takes a tenth of the time.
    is_collecting = gc.isenabled()
    gc.disable()
    try:
        result = compiler._compile_uncached()
        result.library._ensure_finalized()
    finally:
        if is_collecting:
            gc.enable()
    library = result.library
    module = library._final_module
    for variable in module.global_variables:
        if variable.name.startswith(RuntimeLinker.PREFIX):
            name = _last_name(variable.name)
            raise NumbaError(f"kernels call each other in a circle, by way of {name}(); use a loop")
    called = [each.name for each in module.functions if each.is_declaration and not each.name.startswith("llvm.")]
    name = result.fndesc.llvm_cfunc_wrapper_name
    return name, not _are_known(called), library.binary(), not library.has_dynamic_globals


def _are_known(names: list[str]) -> bool:
    """Whether the process has functions of these names without numba's own, such as those of the C library."""
    try:
        process = ctypes.CDLL(None)
    except (OSError, TypeError):  # Windows has no such handle
        return not names
    # Intel's, if it is installed, is in a library that numba loads.
    return all(hasattr(process, name) and not name.startswith("__svml") for name in names)


def _last_name(mangled: str) -> str:
    """Return the name of a function from that of its symbol, which has the length before each part."""
    name, rest = "a kernel", mangled[mangled.index("_ZN") + 3 :]
    while met := re.match(r"\d+", rest):
        end = met.end() + int(met[0])
        name, rest = rest[met.end() : end], rest[end:]
    return name
