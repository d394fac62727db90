"""``teamsight demo`` as somebody sees it who has just installed teamsight: the live page, and the recording."""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import browsing
import pytest

import teamsight
from teamsight.cli import demo, main

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(teamsight.__file__).resolve().parents[1]
_PATIENCE = 300.0  # seconds; against a hang: a busy machine is slow, and kernels may have to be compiled


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The address of the recording that the demo writes."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo, "_STEPS", 40)
    with pytest.raises(SystemExit) as left:
        main(["demo", "--no-browser"])
    assert not left.value.code
    return (tmp_path / "teamsight-demo.html").as_uri()


@pytest.fixture
def program(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """``teamsight demo`` on a machine whose browser does nothing."""
    (tmp_path / "browser").write_text("#!/bin/sh\n")
    (tmp_path / "browser").chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "BROWSER": str(tmp_path / "browser"), "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "teamsight", "demo"]
    made = subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    yield made
    made.kill()
    made.communicate()


def address(program: subprocess.Popen[str]) -> str:
    """Return the address that the program prints first."""
    assert program.stdout
    until, said = time.monotonic() + _PATIENCE, ""
    while time.monotonic() < until and program.poll() is None:
        if select.select([program.stdout], [], [], 0.2)[0]:
            said += program.stdout.readline()
            if found := re.search(r"http://127\.0\.0\.1:\d+/\S*", said):
                return found[0]
    raise AssertionError(f"no address: {said!r}")


def wait_for_position(page: Page, least: int) -> None:
    shown = "least => window.teamsight?.view && window.teamsight.view.position >= least"
    page.wait_for_function(shown, arg=least, timeout=1_000 * _PATIENCE)


@pytest.mark.parametrize("size", [browsing.WIDE, browsing.PHONE], ids=["wide", "phone"])
def test_the_recording_plays_from_a_file(new_page: browsing.Pages, recording: str, size: tuple[int, int], shot) -> None:
    page = new_page(size=size)
    page.goto(recording)
    wait_for_position(page, 3)
    assert page.evaluate("teamsight.view.tracks.map(track => track.frames.length)") == [41, 41]
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    shot(page, f"demo-recording-{size[0]}")


def test_the_live_page_runs_until_ctrl_c(page: Page, program: subprocess.Popen[str], shot) -> None:
    page.goto(address(program))
    wait_for_position(page, 5)
    titles = page.evaluate("teamsight.view.tracks.map(track => track.scene.title)")
    assert ["awareness none" in title for title in titles] == [True, False]
    assert ["awareness pairwise" in title for title in titles] == [False, True]
    shot(page, "demo-live")
    page.close()
    program.send_signal(signal.SIGINT)
    _, err = program.communicate(timeout=_PATIENCE)
    assert "Traceback" not in err
    assert program.returncode in (0, 130)
