"""Progress of a long run: where somebody can read it, and nowhere else."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import teamsight
from teamsight import CMOMMT, Disc, Robot, World
from teamsight.agents import stepping as progress
from teamsight.core import status_line

ROOT = Path(teamsight.__file__).resolve().parent.parent

SCRIPT = """
import os, signal, sys
from teamsight import CMOMMT
from teamsight.agents import stepping as progress
import teamsight.core.kernel.entry
teamsight.core.kernel.entry.announce = lambda name: None
progress.status_line.PATIENCE = 0.0
model = CMOMMT(robots=3, targets=3, radius=2.0, rng=1)
{before}
try:
    model.run({steps}{arguments})
except KeyboardInterrupt:
    print("interrupted")
print(model.tick, "rich" in sys.modules)
"""


def in_terminal(steps: int = 1_500_000, arguments: str = "", before: str = "") -> tuple[str, str]:
    """Run a script whose standard error is a terminal; return what is printed, and what the terminal got."""
    script = SCRIPT.format(steps=steps, arguments=arguments, before=before)
    ours, theirs = pty.openpty()
    environment = dict(os.environ, PYTHONPATH=str(ROOT), TERM="xterm", COLUMNS="80")
    process = subprocess.Popen(
        [sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE, stderr=theirs, text=True, cwd=ROOT,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    os.close(theirs)
    seen = b""
    while True:
        ready, _, _ = select.select([ours], [], [], 60)
        try:
            part = os.read(ours, 65536) if ready else b""
        except OSError:  # Linux, when the other side is closed
            part = b""
        if not part:
            break
        seen += part
    os.close(ours)
    out, _ = process.communicate()
    assert process.returncode == 0, seen.decode()
    return out, seen.decode()


def on_screen(seen: str) -> str:
    """Return what is left on the screen after carriage returns and erasures."""
    lines = seen.split("\n")
    return "\n".join(line.rsplit("\r\x1b[K", 1)[-1].strip("\r") for line in lines).strip()


def test_a_terminal_shows_the_steps_and_the_time_left_and_nothing_remains() -> None:
    out, seen = in_terminal()
    assert out.split() == ["1500000", "False"]
    done = [int(number.replace(",", "")) for number in re.findall(r"step ([\d,]+) of 1,500,000 \(\d+%\), \d+ s", seen)]
    assert done == sorted(done)
    assert len(done) > 1
    assert re.search(r"\d s left", seen)
    assert on_screen(seen) == ""


def test_a_run_that_says_so_shows_nothing() -> None:
    assert in_terminal(arguments=", progress=False", steps=600_000)[1] == ""


def test_ctrl_c_leaves_the_terminal_clean() -> None:
    # The signal arrives while the line is shown.
    before = "show = progress.RunProgress.show\nprogress.RunProgress.show = lambda *a: (show(*a), os.kill(os.getpid(), signal.SIGINT))"
    out, seen = in_terminal(before=before)
    assert out.startswith("interrupted")
    assert "step" in seen
    assert on_screen(seen) == ""


class Screen:
    """A notebook: what its cell shows now, and all that it showed."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def display(self, data: dict[str, str], *, raw: bool, display_id: bool) -> Screen:
        assert raw
        assert display_id
        return self.update(data, raw=raw)

    def update(self, data: dict[str, str], *, raw: bool) -> Screen:
        assert set(data) == {"text/plain", "text/html"}
        self.texts.append(data["text/plain"])
        return self


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> Iterator[Screen]:
    screen = Screen()
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=screen.display))
    monkeypatch.setattr(progress.status_line, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "_EVERY", 0.0)
    monkeypatch.setattr(status_line.multiprocessing, "parent_process", lambda: None)
    yield screen
    assert not progress.status_line.shown_lines


def slow(percept: Any, rng: Any) -> tuple[float, float]:
    return 0.0, 0.0


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_a_notebook_shows_the_same_without_widgets(notebook: Screen) -> None:
    world = World(Disc(1.0), rng=1)
    world.add(Robot, 1, policy=slow)
    world.run(3)
    assert [text.partition(",")[0] for text in notebook.texts] == [
        "step 0 of 3 (0%)", "step 1 of 3 (33%)", "step 2 of 3 (67%)", "",
    ]  # fmt: skip


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_a_run_within_a_run_does_not_show_its_own(notebook: Screen) -> None:
    world, other = World(Disc(1.0), rng=1), CMOMMT(robots=1, targets=1, radius=1.0, rng=1)
    world.add(Robot, 1, policy=lambda percept, rng: (other.run(1), (0.0, 0.0))[1])
    world.run(2)
    assert [text for text in notebook.texts if text and "of 2" not in text] == []


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_after_an_error_nothing_remains(notebook: Screen) -> None:
    def fail(percept: Any, rng: Any) -> tuple[float, float]:
        raise OSError("no rule")

    world = World(Disc(1.0), rng=1)
    world.add(Robot, 1, policy=fail)
    with pytest.raises(OSError, match="no rule"):
        world.run(2)
    assert notebook.texts[-1] == ""


def test_a_worker_shows_nothing(notebook: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(status_line.multiprocessing, "parent_process", lambda: object())
    CMOMMT(robots=1, targets=1, radius=1.0, rng=1).run(2)
    assert notebook.texts == []


def test_a_short_run_shows_nothing(notebook: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress.status_line, "PATIENCE", 600.0)
    CMOMMT(robots=1, targets=1, radius=1.0, rng=1).run(600)
    assert notebook.texts == []


def test_progress_is_true_or_false() -> None:
    model = CMOMMT(robots=1, targets=1, radius=1.0, rng=1)
    with pytest.raises(TypeError, match="progress=None.*True or False"):
        model.run(1, progress=None)  # type: ignore[arg-type]
    assert model.tick == 0


@pytest.mark.parametrize(
    ("duration", "text"), [(0.2, "0 s"), (59.4, "59 s"), (59.6, "1 min 0 s"), (3600.0, "1 h 0 min"), (7500, "2 h 5 min")]
)


def test_durations_are_said_as_people_do(duration: float, text: str) -> None:
    assert status_line.seconds(duration) == text
