"""What is said while kernels are compiled."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Sensor
from teamsight.agents.engine.engine import kernels_needed
from teamsight.core.kernel import Entry, array_at, report
from teamsight.core.kernel import entry as kernel_entry
from teamsight.core.kernel.report import CompilationReport


class Kernel:
    """A kernel that is missing until it is compiled, here or elsewhere."""

    def __init__(self, missing: bool = True) -> None:
        self.missing = missing

    def is_missing(self) -> bool:
        return self.missing

    def compile(self, report: CompilationReport, name: str = "rule") -> None:
        report.begin(name)
        self.missing = False
        report.end(is_done=True)


class Line:
    """A line that remembers what it showed."""

    texts: list[str]

    def __init__(self) -> None:
        type(self).texts = []

    def show(self, text: str) -> None:
        self.texts.append(text)

    def close(self) -> None:
        self.texts.append("")


@pytest.fixture
def line(monkeypatch: pytest.MonkeyPatch) -> type[Line]:
    monkeypatch.setattr(report, "has_reader", lambda: True)
    monkeypatch.setattr(report, "StatusLine", Line)
    monkeypatch.setattr(report, "monotonic", lambda: 7.0)
    return Line


def test_without_a_terminal_one_line_comes_first_and_one_last(capsys: pytest.CaptureFixture[str]) -> None:
    said, kernels = CompilationReport(), [Kernel(), Kernel(missing=False), Kernel()]
    said.plan(lambda: kernels)
    kernels[0].compile(said)
    first = capsys.readouterr().err
    assert first.startswith("teamsight: compiling kernels")
    assert first.count("\n") == 1
    kernels[2].compile(said)
    assert capsys.readouterr().err == "teamsight: compiled 2 kernels in 0 s\n"


def test_a_terminal_shows_which_of_how_many(line: type[Line], capsys: pytest.CaptureFixture[str]) -> None:
    said, kernels = CompilationReport(), [Kernel() for _ in range(4)]
    kernels[0].compile(said, "before the plan")
    said.plan(lambda: kernels)
    kernels[1].compile(said, "rule")
    # Another process compiles the third.
    kernels[2].missing = False
    kernels[3].compile(said, "wall")
    start = "teamsight: compiling kernel"
    assert line.texts == [
        f"{start} 1, once per machine (0 s): before the plan", "",
        f"{start} 2 of 4, once per machine (0 s): rule", "",
        f"{start} 3 of 3, once per machine (0 s): wall", "",
    ]  # fmt: skip
    assert capsys.readouterr().err == "teamsight: compiled 3 kernels in 0 s\n"


def test_after_one_that_fails_the_next_world_counts_from_one(
    line: type[Line], capsys: pytest.CaptureFixture[str]
) -> None:
    said, kernels = CompilationReport(), [Kernel(), Kernel()]
    said.plan(lambda: kernels)
    kernels[0].compile(said)
    said.begin("wrong")
    said.end(is_done=False)
    other = Kernel()
    said.plan(lambda: [other])
    other.compile(said)
    assert line.texts == ["teamsight: compiling kernel 1 of 1, once per machine (0 s): rule", ""]
    assert capsys.readouterr().err == "teamsight: compiled 1 kernel in 0 s\n"


def test_below_a_progress_bar_there_is_one_line(
    line: type[Line], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said, kernels = CompilationReport(), [Kernel() for _ in range(3)]
    said.plan(lambda: kernels)
    kernels[0].compile(said)
    # A bar of the command line takes over the terminal.
    monkeypatch.setattr(report, "has_reader", lambda: False)
    kernels[1].compile(said)
    kernels[2].compile(said)
    notice, closing = capsys.readouterr().err.splitlines()
    assert notice.startswith("teamsight: compiling kernels")
    assert closing == "teamsight: compiled 3 kernels in 0 s"


def test_a_later_world_is_counted_anew(line: type[Line], capsys: pytest.CaptureFixture[str]) -> None:
    said = CompilationReport()
    for _ in range(2):
        kernel = Kernel()
        said.plan(lambda kernel=kernel: [kernel])
        kernel.compile(said)
        assert "kernel 1 of 1," in line.texts[0]
        assert capsys.readouterr().err == "teamsight: compiled 1 kernel in 0 s\n"


def test_a_kernel_that_cannot_be_compiled_leaves_no_line(line: type[Line], capsys: pytest.CaptureFixture[str]) -> None:
    said = CompilationReport()
    said.plan(lambda: [Kernel()])
    said.begin("wrong")
    said.end(is_done=False)
    assert line.texts[-1] == ""
    assert capsys.readouterr().err == ""


def run(address: int) -> int:
    array_at(address, 1, np.float64)[0] += 1.0
    return 0


def test_an_entry_knows_whether_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(tmp_path))
    said: list[Any] = []
    monkeypatch.setattr(kernel_entry, "announce", said.append)
    entry, row = Entry(run), np.zeros(1)
    assert entry.is_missing()
    entry(row.ctypes.data)
    assert not entry.is_missing()
    assert not Entry(run).is_missing()
    next(tmp_path.glob("*.kernel")).unlink()
    assert not entry.is_missing()
    assert Entry(run).is_missing()
    assert said == ["run"]


def test_the_kernels_of_a_world_are_those_that_its_steps_call(monkeypatch: pytest.MonkeyPatch) -> None:
    for awareness, sensor in (("pairwise", None), ("ring", None), ("pairwise", Sensor(missed=0.5))):
        model = CMOMMT(robots=2, targets=2, radius=2.0, awareness=awareness, sensor=sensor, rng=1)
        model._engine.is_bound = False
        called: list[Entry] = []
        address = Entry.address.fget
        monkeypatch.setattr(Entry, "address", property(lambda entry: (called.append(entry), address(entry))[1]))
        # Entries that run before remember where they are.
        for entry in (found := kernels_needed(model._data)()):
            monkeypatch.delitem(vars(entry), "_callable", raising=False)
        model.run(3)
        monkeypatch.undo()
        assert set(called) == set(found)


def test_the_list_of_kernels_does_not_keep_a_world() -> None:
    model = CMOMMT(robots=1, targets=1, rng=1)
    needed = kernels_needed(model._data)
    assert needed()
    model.close()
    del model
    gc.collect()
    assert needed() == []
