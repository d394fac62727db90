"""The endings of recordings, and that of a film that Ctrl-C stops."""

from __future__ import annotations

import signal
import subprocess
from typing import Any

import pytest

from teamsight import CMOMMT
from teamsight.view import animation
from teamsight.view.replay import ENDINGS, check_ending


@pytest.mark.parametrize("ending", ENDINGS)
def test_known_endings_are_accepted_in_any_case(ending: str) -> None:
    assert check_ending(f"a.b{ending.upper()}") == ending


@pytest.mark.parametrize("given", [".htm", ".gfi", ".mp3", ".jpg", ".webm", "."])
def test_other_endings_are_refused(given: str) -> None:
    with pytest.raises(ValueError, match=rf"^run\{given}: must end in \.html, \.gif, \.mp4, \.png, .* give such a name"):
        check_ending(f"run{given}")


class _Half:
    """A pipe to which half of a picture is written when Ctrl-C comes."""

    def __init__(self, process: Any) -> None:
        self._process, self._pipe, self._written = process, process.stdin, 0

    def write(self, data: Any) -> None:
        parts = memoryview(data).cast("B")
        self._written += 1
        self._pipe.write(parts[: len(parts) // 2])
        if self._written == 3:
            signal.raise_signal(signal.SIGINT)
        self._pipe.write(parts[len(parts) // 2 :])

    def close(self) -> None:
        # What it would say before it is killed, if that is slow.
        self._pipe.close()
        self._process.wait()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._pipe, name)


def test_ctrl_c_leaves_no_lines_of_the_program_that_writes_films(monkeypatch: pytest.MonkeyPatch, capfd: Any) -> None:
    pytest.importorskip("imageio_ffmpeg")
    begun = subprocess.Popen

    def popen(*command: Any, **how: Any) -> Any:
        process = begun(*command, **how)
        if "rawvideo" in command[0]:
            process.stdin = _Half(process)
        return process

    model = CMOMMT(3, 3, rng=1)
    replay = model.record()
    model.run(10)
    replay.stop()
    monkeypatch.setattr(subprocess, "Popen", popen)
    with pytest.raises(KeyboardInterrupt):
        animation.rendered(replay.tracks, ".mp4")
    assert capfd.readouterr().err == ""
