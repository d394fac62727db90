"""``teamsight run`` with failures: the event log, printed and written."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from teamsight import CMOMMT
from teamsight.agents.components import Failures
from teamsight.cli import main

FAILING = ("run", "--robots", "4", "--targets", "3", "--steps", "100", "--seed", "1", "--failures", "20", "--repair", "5.5")


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


def reference() -> pd.DataFrame:
    """Return the events of the same run in Python."""
    world = CMOMMT(robots=4, targets=3, events=Failures(20, 5.5), rng=1)
    world.run(100)
    return world.events


@pytest.mark.short
def test_the_log_of_a_run_is_printed_in_columns(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = call(capsys, *FAILING, "--events")
    log = reference()
    assert status == 0
    lines = out.splitlines()
    head = next(number for number, line in enumerate(lines) if line.split() == list(log.columns))
    shown = [line.split() for line in lines[head + 1 : head + 21]]
    assert shown == [
        [f"{row.time:.2f}", str(row.tick), row.what, row.group, str(row.agent), row.source]
        for row in log.head(20).itertuples()
    ]
    assert len({line.index("robots") for line in lines[head + 1 : head + 21]}) == 1
    assert len(log) > 20
    assert lines[-1] == f"{len(log)} events, of which the first 20 are shown"


def test_the_log_of_a_run_is_written(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    place = tmp_path / "new" / "events.parquet"
    status, out, _ = call(capsys, *FAILING, "--save-events", str(place))
    assert status == 0
    assert out.splitlines()[-1] == f"events in {place}"
    written = pd.read_parquet(place)
    assert written.attrs["failures"] == 20.0
    assert written.attrs["repair"] == 5.5
    pd.testing.assert_frame_equal(written, reference(), check_like=False)
    status, _, err = call(capsys, *FAILING[:-1], "7", "--save-events", str(place))
    assert status != 0
    assert "give --force" in err
    pd.testing.assert_frame_equal(pd.read_parquet(place), written)


def test_a_run_without_events_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(capsys, "run", "--steps", "3", "--events")[1].splitlines()[-1] == "0 events"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--repair", "5"], "repair=5: no robot fails; give --failures too, or leave --repair out"),
        (["--failures", "0"], "failures=0.0: must be a finite number, above 0"),
        (["--failures", "-3", "--repair", "x"], "repair='x': must be a number"),
        (["--failures", "1e-9", "--repair", "1e-9"], "failures=1e-09, repair=1e-09: make more than 1e+07 events; give longer times, or fewer steps"),
        (["--save", "a.parquet", "--save-events", "./a.parquet"], "save_events=a.parquet: is the file of --save too; give another place for one"),
    ],
)
def test_options_that_do_not_fit_are_refused_before_the_work(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = call(capsys, "run", *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert not list(tmp_path.iterdir())
