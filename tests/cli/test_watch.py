"""``teamsight watch``: its options, its errors, and how it ends."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from teamsight import CMOMMT
from teamsight.cli import main
from teamsight.cli.look import WatchSettings
from teamsight.cli.options import InputError
from teamsight.live import LivePage, watch

_MODEL = """
from teamsight import CMOMMT

def small(robots=3, seed=0):
    return CMOMMT(robots, seed=seed)
"""


def started(*arguments: str, folder: Path) -> subprocess.Popen[str]:
    """Start the command and read up to the address."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "teamsight", "watch", "--no-browser", *arguments], cwd=folder, env=environment, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def test_serves_until_ctrl_c(tmp_path: Path) -> None:
    (tmp_path / "my_worlds.py").write_text(_MODEL, encoding="utf-8")
    with started("--port", "0", "--model", "my_worlds:small", "--set", "robots=4", folder=tmp_path) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", url), process.stderr and process.stderr.read()
        assert b"<title>teamsight: small</title>" in urllib.request.urlopen(url).read()
        assert "Ctrl-C" in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate()
    assert (process.returncode, output, errors) == (0, "", "")


def test_a_port_in_use_is_one_line(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with started("--port", str(taken.getsockname()[1]), folder=tmp_path) as process:
            output, errors = process.communicate()
    assert (process.returncode, output) == (2, "")
    assert errors.count("\n") == 1
    assert "--port 0" in errors


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"beside": ("policy",)}, "beside='policy': must be NAME=VALUE"), ({"set": ("a=1", "a=2")}, "set='a=2': is given twice"),
        ({"treatment": "explore"}, "--treatment: is for a task; give --task NAME too"),
        ({"set": ("robots=3",)}, "give --robots"), ({"port": "70000"}, "port=70000: must be at most 65535"),
        ({"rate": "0"}, "rate=0"), ({"delta": "8"}, "delta=8: awareness 'pairwise' has no δ"),
        ({"every": "0"}, "every=0: must be at least 1"),
        # The command refuses what the page refuses.
        ({"robots": "3300"}, "robots=3300: must be at most 2000, as on the page"), ({"radius": "300"}, "at least 0.5 and at most 200, as on the page"),
        ({"robot_speed": "11"}, "robot_speed=11"), ({"beside": ("robots=3300",)}, "robots=3300: must be at most 2000"),
    ],
)  # fmt: skip
def test_wrong_options_are_refused(options: dict[str, object], said: str) -> None:
    with pytest.raises((InputError, ValueError), match=re.escape(said)):
        WatchSettings.read(options, {})


def test_a_model_that_is_not_found_is_answered_for_this_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["watch", "--no-browser", "--model", "nowhere_at_all:World"])
    said = capsys.readouterr().err
    assert "model='nowhere_at_all:World': there is no module 'nowhere_at_all'" in said
    assert "start in the folder of its file" in said
    assert "study" not in said


def test_values_of_parameters_are_read() -> None:
    settings = WatchSettings.read({"beside": ("policy=centroid", "robots=3", "robot_speed=0.2", "uniform_target_speed=true")}, {})
    assert settings.beside == {"policy": "centroid", "robots": 3, "robot_speed": 0.2, "uniform_target_speed": True}


_ROWS = "time,robot,x,y\n" + "".join(f"{t},{robot},{0.1 * t + robot},0\n" for t in range(40) for robot in (0, 1, 2))


def test_recorded_robots_are_served_until_ctrl_c(tmp_path: Path) -> None:
    (tmp_path / "team.csv").write_text(_ROWS, encoding="utf-8")
    given = ("--port", "0", "--trajectories", "team.csv", "--awareness-range", "1.5", "--risk", "0.2", "--window", "5")
    with started(*given, folder=tmp_path) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", url), process.stderr and process.stderr.read()
        assert b"<title>teamsight: team.csv</title>" in urllib.request.urlopen(url).read()
        assert "Ctrl-C" in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate()
    assert (process.returncode, errors) == (0, "")


def test_ctrl_c_that_comes_before_the_page_waits_is_no_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(LivePage, "wait", interrupted)
    with pytest.raises(SystemExit) as left:
        main(["watch", "--no-browser", "--port", "0", "--paused"])
    assert not left.value.code
    assert not capsys.readouterr().err
    served = watch(CMOMMT, port=0, browser=False, wait=True)
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(served.url)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (["--trajectories", "no.csv"], "no.csv: cannot be read"),
        (["--trajectories", "bad.csv"], "no column 'time'"),
        (["--trajectories", "team.csv", "--robots", "3"], "no effect on recorded positions; leave --robots out"),
        (["--trajectories", "team.csv", "--paused"], "no effect on recorded positions"),
        (["--trajectories", "team.csv", "--window", "1e9"], "window"),
        (["--risk", "0.1"], "needs --trajectories"),
        (["--sort"], "needs --trajectories"),
    ],
)
def test_what_recorded_robots_do_not_have_is_one_line(
    given: list[str], reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "team.csv").write_text(_ROWS, encoding="utf-8")
    (tmp_path / "bad.csv").write_text("t,robot,x,y\n0,1,2,3\n", encoding="utf-8")
    with pytest.raises(SystemExit) as error:
        main(["watch", "--no-browser", "--port", "0", *given])
    assert error.value.code == 2
    said = capsys.readouterr().err
    assert reason in said
    assert said.count("\n") == 1
