"""Errors of compilation in one line: the user's file and line, what is wrong, and the cure.

numba describes an error in many lines, most of them about its own functions. `explained` picks the innermost line of
the user's code and the relevant fact; numba's whole text remains the cause of the error.
"""

from __future__ import annotations

import builtins
import difflib
import dis
import importlib
import os
import random
import re
import types as python_types
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core.errors import NumbaError, UnsupportedBytecodeError

from teamsight.core.kernel.cache import enclosed, globals_of, is_library
from teamsight.core.kernel.parts import shown

#: The errors that numba raises for a kernel that it cannot compile.
COMPILE_ERRORS = (NumbaError, UnsupportedBytecodeError, AttributeError, NameError, NotImplementedError)

#: The arguments with which a template calls the kernel bound to each of its free names.
_ARGUMENTS = {
    "decision_kernel": "percept, arrays, noise, action",
    "sense_kernel": "view, parameters, sensed",
    "perceive_kernel": "scene, parameters, teammates, relayed",
    "situate_kernel": "scene, parameters, situation",
    "interaction_kernel": "bodies, state, parameters, noise, scores, turn",
    "confine": "x, y, step_x, step_y, heading_x, heading_y, size",
    "meet": "way_x, way_y, heading_x, heading_y, normal_x, normal_y, parameters",
    "carry": "turn, distance, speed, is_blocked, state, parameters",
}
#: What kernels return that return numbers.
_RETURNED = {
    "confine": "x, y, heading_x, heading_y",
    "meet": "way_x, way_y, heading_x, heading_y",
    "carry": "ahead, left, turn",
}

_LONGEST = 250
_NUMBA, _OURS = str(Path(numba.__file__).parent), str(Path(__file__).parents[2]) + os.sep
# numba colours its errors if colorama is installed, on no terminal too.
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_PLACES = re.compile(r'File "([^"]+)", line (\d+):|\bat (\S+) \((\d+)\)')


def explained(entry: Callable[..., Any], error: BaseException) -> str:
    """Return in one line where and why an entry cannot be compiled.

    Parameters
    ----------
    entry : callable
        The function behind the entry.
    error : BaseException
        The error that numba raised.
    """
    said = _COLOURS.sub("", str(error))
    text = " ".join(said.split())
    what, place = _what(entry, text)
    place = place or _place(said, entry) or _place_of_traceback(error, entry)
    if len(what) > _LONGEST:
        what = what[: _LONGEST - 1] + "…"
    if place is None:
        # It is where our code takes what the kernel returns.
        bound, name = _bound_kernel(entry)
        what += f"; {name}={_call(bound)} must return ({_RETURNED[name]})" if bound and name in _RETURNED else ""
    return f"{place or _first_kernel(entry)}: {what}"


def _what(entry: Callable[..., Any], text: str) -> tuple[str, str | None]:
    """Return what is wrong, and the place if the text does not contain it."""
    for pattern, rule in _RULES.items():
        if met := re.search(pattern, text):
            if isinstance(rule, str):
                return rule.format(*map(_simple, met.groups())), None
            return rule(entry, text, *met.groups())
    bare = re.sub(r"Failed in nopython mode pipeline \(step: [\w ]+\) ?", "", text)
    bare = re.split(r' During: | File "| Raised from', bare)[0]
    return f"its kernel cannot be compiled: {_simple(bare)}", None


Found = tuple[str, str | None]


def _undefined(entry: Callable[..., Any], text: str, name: str) -> Found:
    for function in _kernels_of(entry):
        if name in function.__globals__ or hasattr(builtins, name):
            continue
        for instruction in dis.get_instructions(function):
            if instruction.argval == name and "GLOBAL" in instruction.opname and instruction.positions:
                known = [*function.__code__.co_varnames, *function.__globals__, *dir(builtins)]
                place = shown(function.__code__.co_filename, instruction.positions.lineno or 0)
                return f"name '{name}' is not defined{_near(name, known)}", place
    return f"name '{name}' is not defined", None


def _arguments(entry: Callable[..., Any], text: str, problem: str) -> Found:
    called = re.search(r"resolving callee type: type\((?:CPUDispatcher|Part)\(<function (\S+) at", text)
    name = called[1] if called else "a kernel"
    bound, role = _bound_kernel(entry)
    # The call is in the template, so the kernel's signature is wrong.
    if bound and bound.__qualname__ == name and text.count("resolving callee type") == 1:
        what = f"the kernel {_call(bound)} is called as {bound.__name__}({_ARGUMENTS[role]}); give it these parameters"
        return what, _first_kernel(entry)
    callee = next((function for function in _kernels_of(entry) if function.__qualname__ == name), None)
    return f"{_call(callee) if callee else name} is called with other arguments than it takes: {problem}", None


def _call(function: python_types.FunctionType) -> str:
    code = function.__code__
    return f"{function.__name__}({', '.join(code.co_varnames[: code.co_argcount])})"


def _attribute(entry: Callable[..., Any], text: str, name: str, kind: str, module: str | None) -> Found:
    fields = getattr(entry.__globals__.get(kind), "_fields", None)
    if kind == "Channels":
        what = f'the policy declares no channels; declare channels = ("{name}",)'
        if declared := entry.__globals__.get("declared_channels"):
            said = f"the policy declares the channels {', '.join(declared)}, but not '{name}'{_near(name, declared)}"
            what = f'{said}; otherwise add "{name}" to its `channels`'
    elif fields:
        what = f"{kind} has no field '{name}'; it has {', '.join(fields)}"
    elif module == "numpy.random":
        what = f"kernels cannot use numpy.random.{name}; take random numbers from noise and declare draws"
    elif module:
        what = f"numba cannot compile {module}.{name}; write it with arithmetic, math or a loop"
    else:
        known = [part for part in dir(np.ndarray) if not part.startswith("_")] if kind == "array" else []
        what = f"{'an array' if kind == 'array' else kind} has no attribute '{name}'{_near(name, known)}"
    return what, None


def _no_function(entry: Callable[..., Any], text: str, module: str, name: str) -> Found:
    known = dir(importlib.import_module(module))
    return f"module '{module}' has no attribute '{name}'{_near(name, known)}", None


def _foreign(entry: Callable[..., Any], text: str, name: str, kind: str) -> Found:
    if name in _ARGUMENTS:
        what = f"the kernel is a plain {kind}; decorate it with @kernel from teamsight.core.kernel"
        return what, _first_kernel(entry)
    if kind == "function":
        what = f"'{name}' is a plain Python function; decorate it with @kernel or @inlined from teamsight.core.kernel"
        return what, None
    return f"'{name}' is of the type {kind}; kernels can use numbers, tuples of numbers, NumPy arrays and kernels", None


def _returned(entry: Callable[..., Any], text: str, types: str) -> Found:
    kinds = ", ".join(sorted(_simple(types).split(", ")))
    # numba lists them in any order: name the first line.
    places = re.findall(r'Return of: .*? location: File "([^"]+)", line (\d+)', text)
    what = f"the kernel returns values of different types ({kinds}); return one type everywhere"
    return what, next((shown(file, line) for line, file in sorted((int(line), file) for file, line in places)), None)


# What numba says, and what is wrong: a text, in which {0} is the pattern's first group, or a function of the groups.
_RULES: dict[str, str | Callable[..., Found]] = {
    r"name '(\w+)' is not defined": _undefined,
    r"Cannot bind 'args=.*? due to \"TypeError: (.*?)\"": _arguments,
    r"Unknown attribute '(\w+)' of type (\w+)\((?:<module '([\w.]+)')?": _attribute,
    r"module '([\w.]+)' has no attribute '(\w+)'": _no_function,
    r"Untyped [\w ]+ '(\w+)':? ?Cannot determine Numba type of <class '(.*?)'>": _foreign,
    r"Can't unify return type from the following types: (.*?) Return of:": _returned,
    r"Variable '(\w+)' is not defined": "variable '{0}' is used before it has a value",
    r"No definition for lowering (\w+)\(.*\)\.(\w+) =":
        "{0}.{1} cannot be replaced; write its elements, such as {1}[i] = x",
    r"Use of unsupported NumPy function '([\w.]+)'":
        "numba cannot compile {0}; write it with arithmetic, math or a loop",
    r"NRT required|Only accept returning of array passed":
        "the kernel makes or copies an array, a list or a string, which kernels cannot; write numbers one by one, as "
        "in action.heading[i, 0] = x, and keep tables in the policy's arrays (docs/policies.md)",
    r"No conversion from (.*?) to int64 for '\$\w*return_value":
        "the kernel returns {0}; it must return a whole number at its end",
    r"wrong tuple length .*?expected (\d+), got (\d+)": "{1} values are given where {0} are expected",
    r"Cannot unify (.*?) for '([\w.]+?)(?:\.\d+)?'":
        "'{1}' has different types ({0}) in different branches; give it one type",
    r"failed to unpack none": "the kernel returns nothing",
    r"cannot index (array\(.*?\)) with (\d+) indices": "an {0} is given {1} indices",
    r"Unsupported array index type (\S+) in": "an index has the type {0}; it must be a whole number, such as int(x)",
    r"Cannot modify readonly array":
        "the kernel writes into an array that is read-only; an interaction names in `writes` what it writes",
    r">>> getitem\((int\d+|uint\d+|float\d+|bool), ": "a number ({0}) is given an index",
    r">>> setitem\((array\(\w+, \dd, \w\)), .*?, (.*?)\) There are":
        "{1} cannot be written to elements of an {0}; write one number",
    r">>> (.*?) There are \d+ candidate": "numba cannot compile {0}: there is no such operation for these types",
}  # fmt: skip


def _simple(kinds: str) -> str:
    """Return type names in short, as in Python."""
    kinds = re.sub(r"Literal\[(\w+)\]\([^)]*\)", r"\1", kinds)
    kinds = re.sub(r"(?:Uni)?Tuple\([^()]*\)", "tuple", kinds)
    # Leave out the many fields of named tuples.
    for _ in range(3):
        kinds = re.sub(
            r"\b(Percept|PolicyArrays|PolicyState|Action|NeighbourList|Scene)\((?:[^()]|\([^()]*\))*\)", r"\1", kinds
        )
    kinds = re.sub(r"\barray\((\w+), (\d)d, \w\)", r"array(\1, \2d)", kinds)
    return kinds.replace("unicode_type", "str")


def _near(name: str, known: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    return f"; did you mean '{near[0]}'?" if near else ""


def _kernels_of(entry: Callable[..., Any]) -> list[python_types.FunctionType]:
    """Return an entry and the Python functions of all kernels that it calls, the outermost first."""
    found: list[Any] = [entry]
    for function in found:  # grows
        called = dict.fromkeys(value.py_func for value in _used(function) if hasattr(value, "py_func"))
        found += [one for one in called if one not in found and not is_library(one.__module__)]
    return found


def _used(function: python_types.FunctionType) -> list[Any]:
    return [value for _, value in globals_of(function)] + enclosed(function)


def _is_inner(file: str, line: int, entry: Callable[..., Any]) -> bool:
    """Whether a place is in numba, or in the template around a kernel."""
    path = os.path.abspath(file)
    lines = [number for _, _, number in entry.__code__.co_lines() if number is not None]
    is_template = path == os.path.abspath(entry.__code__.co_filename) and min(lines) <= line <= max(lines)
    bound, name = _bound_kernel(entry)
    # Of numbers that a kernel returns it is our code that finds them wrong.
    is_ours = bound is not None and name in _RETURNED and _is_own(bound) and path.startswith(_OURS)
    return path.startswith(_NUMBA) or is_ours or (is_template and bound is not None)


def _place(text: str, entry: Callable[..., Any]) -> str | None:
    """Return the innermost place in the user's code that numba's text contains."""
    for met in _PLACES.finditer(text):
        file, line = met[1] or met[3], int(met[2] or met[4])
        if not _is_inner(file, line, entry):
            return shown(file, line)
    return None


def _place_of_traceback(error: BaseException, entry: Callable[..., Any]) -> str | None:
    """Return the innermost place in the user's code that numba was compiling when it raised the error."""
    found, trace = None, error.__traceback__
    while trace is not None:
        for name in ("inst", "constraint", "self", "lower"):
            location = getattr(trace.tb_frame.f_locals.get(name), "loc", None)
            file, line = getattr(location, "filename", None), getattr(location, "line", None)
            if isinstance(file, str) and isinstance(line, int) and not _is_inner(file, line, entry):
                found = shown(file, line)
                break
        trace = trace.tb_next
    return found


def _bound_kernel(entry: Callable[..., Any]) -> tuple[python_types.FunctionType | None, str]:
    """Return the function of the kernel that was bound to a template, and its name there, a key of `_ARGUMENTS`."""
    bound = ((getattr(one := entry.__globals__.get(name), "py_func", one), name) for name in _ARGUMENTS)
    found = [(one, name) for one, name in bound if isinstance(one, python_types.FunctionType)]
    # Of several, that of the user.
    return next((each for each in found if _is_own(each[0])), found[0] if found else (None, ""))


def _is_own(function: python_types.FunctionType) -> bool:
    return not function.__module__.startswith("teamsight.")


def _first_kernel(entry: Callable[..., Any]) -> str:
    """Return where the kernel of a template begins, or the entry's name if there is none."""
    function, _ = _bound_kernel(entry)
    return shown(function.__code__.co_filename, function.__code__.co_firstlineno) if function else entry.__qualname__


def refuse_random_numbers(function: Callable[..., Any]) -> None:
    """Refuse an entry if it, or a kernel that it calls, uses ``numpy.random`` or ``random``.

    Raises
    ------
    TypeError
        Naming file and line.
    """
    for kernel in _kernels_of(function):
        # Reading instructions takes long, and this runs for all.
        if "random" not in kernel.__code__.co_names and not any(map(_is_random, _used(kernel))):
            continue
        value: Any = None
        line = kernel.__code__.co_firstlineno
        for instruction in dis.get_instructions(kernel.__code__):
            line = (instruction.positions and instruction.positions.lineno) or line
            if instruction.opname == "LOAD_GLOBAL":
                value = kernel.__globals__.get(instruction.argval)
            elif instruction.opname in ("LOAD_ATTR", "LOAD_METHOD") and isinstance(value, python_types.ModuleType):
                value = getattr(value, instruction.argval, None)
            elif instruction.opname.startswith("LOAD_"):
                value = None
            else:
                continue
            if _is_random(value) and not isinstance(value, python_types.ModuleType):
                module = "random" if isinstance(value.__self__, random.Random) else "numpy.random"
                raise TypeError(
                    f"{shown(kernel.__code__.co_filename, line)}: kernels cannot use {module}.{value.__name__}; take "
                    "random numbers from noise and declare draws"
                )


def _is_random(value: Any) -> bool:
    """Return whether this is a module of random numbers, or a method of its hidden generator."""
    generator = getattr(value, "__self__", None)
    return value is random or value is np.random or isinstance(generator, (random.Random, np.random.RandomState))
