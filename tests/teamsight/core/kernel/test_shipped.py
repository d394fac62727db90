"""Kernels that come with a wheel: used where they fit the code, the processor and the settings, and nowhere else."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from teamsight.core.kernel import Entry, cache
from teamsight.core.kernel import entry as kernel_entry

MODULE = """
from teamsight.core.kernel import kernel

{above}@kernel
def more(number):
    return number + {step}

def run(number):
    return more(number)
"""


class Lab:
    """A module that changes, a package's folder of kernels, and a cache that is empty at first."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder, self.compiled, self._caches = folder, list[str](), 0
        self._monkeypatch = monkeypatch
        monkeypatch.setattr(cache, "SHIPPED", folder / "shipped")
        monkeypatch.setattr(kernel_entry, "announce", self.compiled.append)
        cache.SHIPPED.mkdir()

    def run(self, step: int = 7, above: str = "") -> Callable[[int], int]:
        """Return the function of the module, written and imported anew, for an empty cache."""
        self._caches += 1
        self._monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(self.folder / f"cache-{self._caches}"))
        (self.folder / "shipped_module.py").write_text(MODULE.format(step=step, above=above))
        sys.modules.pop("shipped_module", None)
        importlib.invalidate_caches()
        cache._source.cache_clear()
        found: Callable[[int], int] = importlib.import_module("shipped_module").run
        return found

    def ship(self) -> None:
        run = self.run()
        assert Entry(run)(1) == 8
        code = cache.KernelCache(run).kept.load(cache.read)
        assert code is not None
        cache.shipped_place(run).save(code)

    def check(self, compilations: int, run: Callable[[int], int], result: int = 8) -> None:
        self.compiled.clear()
        assert Entry(run)(1) == result
        assert len(self.compiled) == compilations


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Lab]:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(tmp_path))
    made = Lab(tmp_path, monkeypatch)
    made.ship()
    yield made
    sys.modules.pop("shipped_module", None)


def test_what_fits_is_used_and_an_edit_is_noticed(lab: Lab) -> None:
    lab.check(0, lab.run())
    lab.check(1, lab.run(step=9), 10)
    lab.check(1, lab.run(above="# another line\n"))
    lab.check(0, lab.run())


@pytest.mark.parametrize("damage", [lambda data: data[:-1], lambda data: data[:200] + b"x" + data[201:]])
def test_a_damaged_file_is_not_used(lab: Lab, damage: Callable[[bytes], bytes]) -> None:
    for file in cache.SHIPPED.iterdir():
        file.write_bytes(damage(file.read_bytes()))
    lab.check(1, lab.run())


@pytest.mark.parametrize(("name", "value"), [("NUMBA_CPU_NAME", "generic"), ("NUMBA_CPU_FEATURES", "")])
def test_who_names_another_processor_gets_code_for_it(
    lab: Lab, name: str, value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    lab.check(1, lab.run())


@pytest.mark.parametrize("generic", [{}, {"x86_64": ("x86-64-v3", ("no such feature",))}])
def test_other_processors_compile(lab: Lab, generic: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "GENERIC", generic)
    lab.check(1, lab.run())
