"""The progress of many runs: one line in a notebook, removed in any case, and none where none is wanted."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from teamsight import Study, run_many
from teamsight.analysis.runs import progress_line
from teamsight.core import status_line

SMALL: dict[str, Any] = {"robots": 2, "targets": 2, "radius": 1.5}


@pytest.fixture
def texts(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """What the cell of a notebook shows, one after the other."""
    shown: list[str] = []
    cell = SimpleNamespace(update=lambda data, raw: shown.append(data["text/plain"]))

    def display(data: dict[str, str], **how: Any) -> Any:
        shown.append(data["text/plain"])
        return cell

    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=display))
    monkeypatch.setattr(status_line, "PATIENCE", 0.0)
    monkeypatch.setattr(progress_line, "_EVERY", 0.0)
    monkeypatch.setattr(status_line.multiprocessing, "parent_process", lambda: None)
    yield shown
    assert not status_line.shown_lines


def run_batch(**how: Any) -> None:
    run_many(SMALL, steps=5, replicates=4, rng=1, **how)


def run_study(**how: Any) -> None:
    Study(fixed=SMALL, steps=5, replicates=4).run("out", **how)


@pytest.mark.parametrize("work", [run_batch, run_study])
def test_one_line_shows_how_far_it_is_and_is_removed(
    work: Any, texts: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    work()
    assert texts[-1] == ""
    lines = [text for text in texts if "of the runs" in text]
    assert lines
    assert lines[0].startswith("0% of the runs, 0 s")
    # It is done when it is removed, and a second call begins anew.
    assert lines[-1].startswith("100% of the runs")


@pytest.mark.parametrize("how", [False, lambda *progress: None])
@pytest.mark.parametrize("work", [run_batch, run_study])
def test_it_shows_none_where_none_is_wanted(
    how: Any, work: Any, texts: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    work(progress=how)
    assert not any("of the runs" in text for text in texts)


def fail(world: Any, steps: int) -> Any:
    raise RuntimeError("of the user")


def test_an_error_leaves_no_line(texts: list[str]) -> None:
    with pytest.raises(Exception, match="of the user"):
        run_batch(measure=fail)
    assert texts[-1] == ""
    run_batch()
    assert texts[-1] == ""


def test_runs_within_a_batch_leave_the_line_to_it(texts: list[str]) -> None:
    run_batch(measure=long_run)
    assert any("of the runs" in text for text in texts)
    assert not any(text.startswith("step ") for text in texts)


def long_run(world: Any, steps: int) -> dict[str, float]:
    for _ in range(3):
        world.run(steps)
    return {"seen": world.observed_fraction}


@pytest.mark.parametrize("wrong", [1, "yes", None])
def test_what_is_no_progress_is_refused(wrong: Any, tmp_path: Path) -> None:
    for work in (lambda: run_many(SMALL, progress=wrong), lambda: Study(fixed=SMALL).run(tmp_path / "s", progress=wrong)):
        with pytest.raises(TypeError, match=f"progress={wrong!r}: must be a function.*False for none"):
            work()
    assert not (tmp_path / "s").exists()
