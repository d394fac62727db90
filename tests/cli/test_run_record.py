"""``teamsight run --record``: the recording of the run that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from teamsight import CMOMMT
from teamsight.cli import main
from teamsight.view import Replay

RUN = ("run", "--robots", "4", "--targets", "3", "--steps", "60", "--seed", "1")


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


@pytest.mark.short
def test_the_run_is_recorded(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    place = tmp_path / "new" / "run.html"
    status, out, _ = call(capsys, *RUN, "--record", str(place), "--record-every", "20")
    assert status == 0
    assert out.splitlines()[-1] == f"recording in {place}"
    replay = Replay.open(place)
    assert [frame.time for frame in replay.frames] == [0, 20, 40, 60]
    world = CMOMMT(robots=4, targets=3, rng=1)
    world.run(60)
    wanted = np.concatenate([world.robots.position, world.targets.position])
    found = replay.frames[-1].positions(replay.scene.bounds)
    np.testing.assert_allclose(found, wanted, atol=1e-4)
    assert call(capsys, *RUN, "--record", str(place))[0] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--record", "run.htm"], "must end in .html, .gif, .mp4, .png"),
        (["--record-every", "5"], "has no effect without --record"),
        (["--record", "a.html", "--save", "./a.html"], "save=a.html: is the file of --record too"),
        (["--record", "a.html", "--record-every", "0"], "record_every=0"),
        (["--record", "a.gif", "--steps", "100000"], "at most 20,000; give --record-every 5"),
        (["--record", "a.html", "--steps", "9000000"], "at most 2,857,142; give --record-every 4"),
    ],
)
def test_what_cannot_be_recorded_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    run = RUN if "--steps" not in arguments else [text for text in RUN if text not in ("--steps", "60")]
    status, out, err = call(capsys, *run, *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_the_user_is_not_replaced_unless_forced(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    place = tmp_path / "run.html"
    place.write_text("a letter")
    status, out, err = call(capsys, *RUN, "--record", str(place))
    assert (status, out) == (2, "")
    assert "holds something else" in err
    assert call(capsys, *RUN, "--record", str(place), "--force")[0] == 0
    assert len(Replay.open(place)) == 61
