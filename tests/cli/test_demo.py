"""What somebody sees who has just installed teamsight: five lines, and two teams side by side."""

from __future__ import annotations

import inspect
import os
import webbrowser
from pathlib import Path

import pytest

from teamsight import CMOMMT, live
from teamsight.cli import demo, main
from teamsight.core import browsers


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


@pytest.fixture(autouse=True)
def _short_and_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo, "_STEPS", 4)
    monkeypatch.setattr(demo, "_GIF_STEPS", 6)
    monkeypatch.setattr(browsers, "has_browser", lambda: False)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A machine with a browser; the addresses that it was asked to open."""
    asked: list[str] = []
    monkeypatch.setattr(browsers, "has_browser", lambda: True)
    monkeypatch.setattr(webbrowser, "open", lambda address: asked.append(address) or True)
    return asked


def without_websockets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "find_spec", lambda name: None)


def test_alone_teamsight_says_in_five_lines_what_can_be_done(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = call(capsys)
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert len(lines) == 5
    assert lines[0].startswith("teamsight demo ")
    assert lines[-1].startswith("teamsight --help ")
    assert max(map(len, lines)) <= 80


def test_each_of_the_five_lines_is_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    for line in call(capsys)[1].splitlines():
        command = line.split("   ")[0].split()[1:]
        assert call(capsys, *command, "--help")[0] == 0, line


def test_the_help_still_lists_all_commands(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = call(capsys, "--help")
    assert status == 0
    assert all(f"\n  {command} " in out for command in ("demo", "run", "delta", "reproduce", "sweep", "learn"))


def test_without_a_browser_the_recording_is_written(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, out, err = call(capsys, "demo")
    place = tmp_path / "teamsight-demo.html"
    assert (status, err) == (0, "")
    assert out.splitlines()[:2] == ["the recording is in teamsight-demo.html", f"open it in a browser: {place.as_uri()}"]
    page = place.read_text(encoding="utf-8")
    assert "Blind to teammates" in page
    assert "Aware of teammates" in page


def test_both_teams_meet_the_same_targets(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    from teamsight.view.replay import Replay

    call(capsys, "demo", "--seed", "7")
    first, second = Replay.open(tmp_path / "teamsight-demo.html").tracks
    assert (first.scene.seed, second.scene.seed) == (7, 7)
    targets = [slot for slot in range(25) if first.scene.groups[first.scene.slots[slot].group].role == "target"]
    assert len(targets) == 15
    assert len(first.frames) == len(second.frames) == 5
    for one, other in zip(first.frames, second.frames, strict=True):
        assert (one.x[targets] == other.x[targets]).all()
        assert (one.y[targets] == other.y[targets]).all()


def test_the_same_seed_gives_the_same_recording(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name in ("a.html", "b.html"):
        assert call(capsys, "demo", "--record", name)[0] == 0
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_a_recording_replaces_a_recording_but_no_file_of_the_user(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert call(capsys, "demo")[0] == call(capsys, "demo", "--seed", "2")[0] == 0
    place = tmp_path / "teamsight-demo.html"
    place.write_text("<p>my own notes")
    status, out, err = call(capsys, "demo")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "teamsight-demo.html: " in err
    assert "--force" in err
    assert place.read_text() == "<p>my own notes"
    assert call(capsys, "demo", "--force")[0] == 0


@pytest.mark.parametrize("name", ["x.gif", "x.png"])
def test_a_recording_may_be_a_picture(capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str) -> None:
    status, out, _ = call(capsys, "demo", "--record", name)
    assert status == 0
    assert out.splitlines()[0] == f"the recording is in {name}"
    assert "browser" not in out
    assert (tmp_path / name).stat().st_size > 1_000


def test_an_unknown_ending_is_refused_before_the_work(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "_make_recording", lambda *given: pytest.fail("the work began"))
    status, _, err = call(capsys, "demo", "--record", "run.htm")
    assert (status, err.count("\n")) == (2, 1)
    assert ".html" in err
    assert list(tmp_path.iterdir()) == []


def test_without_the_extra_the_recording_is_opened(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, opened: list[str]
) -> None:
    without_websockets(monkeypatch)
    status, out, _ = call(capsys, "demo")
    assert status == 0
    assert opened == [(tmp_path / "teamsight-demo.html").as_uri()]
    assert "it is open in the browser" in out
    assert "pip install 'teamsight[live]'" in out


def test_a_browser_that_fails_leaves_the_address(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, opened: list[str]
) -> None:
    without_websockets(monkeypatch)

    def fail(address: str) -> bool:
        raise webbrowser.Error("could not locate runnable browser")

    monkeypatch.setattr(webbrowser, "open", fail)
    status, out, _ = call(capsys, "demo")
    assert status == 0
    assert "open it in a browser: file://" in out


@pytest.mark.parametrize("given", [["--no-browser"], ["--record", "own.html"]])
def test_a_recording_that_was_asked_for_is_not_opened(
    capsys: pytest.CaptureFixture[str], opened: list[str], given: list[str]
) -> None:
    status, out, _ = call(capsys, "demo", *given)
    assert (status, opened) == (0, [])
    assert "open it in a browser: file://" in out


def test_the_live_page_shows_both_teams_with_one_seed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, opened: list[str], tmp_path: Path
) -> None:
    asked: list[tuple[object, dict[str, object], dict[str, object]]] = []
    inspect.signature(live.watch).bind(CMOMMT, {}, rate=20, port=0, wait=True)
    monkeypatch.setattr(live, "watch", lambda model, given, **how: asked.append((model, given, how)))
    assert call(capsys, "demo", "--seed", "3")[0] == 0
    ((model, given, how),) = asked
    assert model is CMOMMT
    assert (given["seed"], given["policy"], given["awareness"]) == (3, "a-cmommt", "none")
    assert how.pop("beside") == {"policy": "a-cmommt", "awareness": "pairwise"}
    # A port that is in use does not stop the demo.
    assert how == {"rate": 20, "port": 0, "wait": True}
    assert list(tmp_path.iterdir()) == []


def test_wherever_the_recording_goes_it_is_one_line_and_no_file_of_the_user_changes(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "notes.html").write_text("my own notes")
    (tmp_path / "link.html").symlink_to("notes.html")
    os.mkfifo(tmp_path / "pipe.html")
    odd = ("notes.html", "link.html", "pipe.html", "here", "here/", "", " ", ".", "notes.html/x.html", "x", ".html", "x.HTML", "x.htm", "x.txt",
           "\0.html", "n" * 300 + ".html", "http://example.com/x.html", "~nobody-of-this-name/x.html", "\x1b[31mr.html", "a\nb.html")  # fmt: skip
    statuses = {}
    for name in odd:
        status, out, err = call(capsys, "demo", "--record", name)
        statuses[name] = status
        assert (status, err.count("\n")) in ((0, 0), (2, 1)), (name, status, err)
        assert (out == "") == (status == 2), name
        assert "Traceback" not in err
        assert (tmp_path / "notes.html").read_text() == "my own notes"
        assert (tmp_path / "link.html").is_symlink()
        assert (tmp_path / "pipe.html").is_fifo()
    assert [name for name, status in statuses.items() if status == 0] == ["x.HTML", "\x1b[31mr.html", "a\nb.html"]
