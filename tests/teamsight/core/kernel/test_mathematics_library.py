"""No kernel calls the mathematics library, whose results differ between its versions."""

from __future__ import annotations

import gc
import importlib
import math
import pkgutil
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import teamsight
from teamsight.core.kernel import Entry, array_at, cache

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads object files of Linux")

# Which copy and fill memory, and those of numba that raise an error. A processor without SSE4.1 also calls floor and rint,
# which are exact in every library.
_OTHERS = ("memcpy", "memmove", "memset", "numba_", "Py")

_SYMBOLS = 2  # the type of a section


def called(binary: bytes) -> Iterator[str]:
    """Yield the names of the functions that an object file (ELF, 64 bits) calls and does not have."""
    (at,) = struct.unpack_from("<Q", binary, 0x28)
    size, number = struct.unpack_from("<HH", binary, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", binary, at + k * size) for k in range(number)]
    for _, kind, _, _, first, length, link, _, _, step in sections:
        names = sections[link][4]
        for symbol in range(first, first + length, step) if kind == _SYMBOLS else ():
            name, _, _, section = struct.unpack_from("<IBBH", binary, symbol)
            if name and not section:
                yield binary[names + name : binary.index(b"\0", names + name)].decode()


def called_by(entry: Entry) -> list[str]:
    """Return what an entry calls that is neither in its code nor about memory or errors."""
    assert entry.address
    code = cache.KernelCache(entry.function).load()
    assert code is not None, entry.function
    return [name for name in called(code.binary) if not name.startswith(_OTHERS)]


def every_entry() -> list[Entry]:
    """Return those of all modules, worlds of commands, tasks, policies and degrees of awareness."""
    from teamsight.agents.awareness.interface import perceive_entry, situate_entry
    from teamsight.agents.awareness.registry import AWARENESS
    from teamsight.cli.warm import use_all
    from teamsight.policies import Avoiding, CompiledPolicy

    use_all(lambda done, total: None)
    for module in pkgutil.walk_packages(teamsight.__path__, "teamsight."):
        if not module.name.startswith(("teamsight.agents.mesa.visualisation", "teamsight.__main__")):
            importlib.import_module(module.name)
    made: list[Any] = [make(AWARENESS[name]()) for name in AWARENESS for make in (perceive_entry, situate_entry)]
    kinds: list[Any] = [CompiledPolicy]
    for kind in kinds:  # grows
        kinds += kind.__subclasses__()
        if hasattr(kind, "kernel") and kind.__module__.startswith("teamsight."):
            # Some need a memory, on which machine code does not depend.
            made.append(kind.entry(Avoiding("random-walk") if kind is Avoiding else object.__new__(kind)))
    return [one for one in gc.get_objects() if isinstance(one, Entry)]


def test_no_kernel_calls_it() -> None:
    # A process of its own, since other tests compile kernels that may.
    done = subprocess.run([sys.executable, __file__], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    number, *found = done.stdout.splitlines()
    assert int(number) > 80
    assert found == []


def entry_of(function: Callable[[float], float]) -> Entry:
    def run(address: int) -> int:
        numbers = array_at(address, 4, np.float64)
        for i in range(4):
            numbers[i] = function(numbers[i])
        return 0

    return Entry(run)


@pytest.mark.parametrize("function", [math.sin, math.exp, math.log, math.cosh, math.erf], ids=lambda one: one.__name__)
def test_a_kernel_that_does_is_noticed(
    function: Callable[[float], float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path))
    assert called_by(entry_of(function)) == [function.__name__]


if __name__ == "__main__":
    every = every_entry()
    print(len(every))
    for one in every:
        for name in called_by(one):
            print(f"{one.function.__qualname__} calls {name}")
