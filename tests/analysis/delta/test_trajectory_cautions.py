"""The unit of a record: what its motion and distances say about it, before any δ."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chance import fresh_seed, generator
from scipy import stats

from teamsight import CMOMMT, Box, Torus
from teamsight.analysis.delta import (
    TrajectoryWarning,
    delta_from_trajectories,
    read_trajectories,
    resample,
    trajectory_files,
    trajectory_notes,
)
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.stats import exceedance


def walk(unit: float = 1.0, samples: int = 400, robots: int = 6, step: float = 0.1) -> pd.DataFrame:
    """Robots that wander in a square of 4 ranges, in steps of a tenth of one; `unit` units are a range."""
    rng = generator()
    start = rng.uniform(0, 4, (1, robots, 2))
    place = np.abs((start + np.cumsum(rng.normal(0, step, (samples, robots, 2)), axis=0) + 4) % 8 - 4) * unit
    time, robot = np.mgrid[:samples, :robots]
    columns = {"time": time.astype(float), "robot": robot, "x": place[..., 0], "y": place[..., 1]}
    return pd.DataFrame({name: values.ravel() for name, values in columns.items()})


def test_the_right_unit_raises_no_doubt() -> None:
    walked = walk()
    report = delta_from_trajectories(walked, 1.0, risk=0.5)
    assert report.cautions == ()
    assert report.sentences()[0].startswith("δ = ")
    width, height = (walked[axis].max() - walked[axis].min() for axis in "xy")
    assert re.search(rf"ranges of 1: positions span {width:.3g} × {height:.3g}, .* covers 0\.1", report.notes[-1])


@pytest.mark.parametrize("window", [None, 50.0])
def test_robots_that_move_many_ranges_are_refused(window: float | None) -> None:
    with pytest.raises(
        ValueError,
        match=r"awareness_range=1: robots move 1\d\d ranges .*at most 10, .*give the range in the unit of the positions, "
        r"which span \d,\d+ × \d,\d+, or record at least every 0\.00[45]",
    ):
        delta_from_trajectories(walk(1000), 1.0, window=window)


def doubtful(record: pd.DataFrame, awareness_range: float, **given: float) -> DeltaReport:
    with pytest.warns(UserWarning, match="Check the unit") as caught:
        report = delta_from_trajectories(record, awareness_range, risk=0.5, **given)
    assert [str(one.message) for one in caught] == list(report.cautions)
    assert {one.category for one in caught} == {TrajectoryWarning}
    assert caught[0].filename == __file__
    assert report.sentences()[: len(report.cautions)] == list(report.cautions)
    assert str(report).startswith("Check the unit: ")
    assert "NoAwareness" not in str(report)
    return report


def test_windows_of_one_frame_need_no_motion_in_between() -> None:
    report = doubtful(walk(1000), 1.0, window=1.0)
    assert "robots move 1" in report.cautions[0]
    assert report.trials == 400


def test_robots_that_never_meet_are_doubted_before_delta_is_0() -> None:
    record = walk(5, step=0.01)
    apart = record.assign(x=record["x"] + 100 * record["robot"])
    report = doubtful(apart, 1.0)
    assert "no two robots were ever within the awareness range of 1 (the positions span" in report.cautions[0]
    assert report.delta == 0


def test_a_move_over_the_edge_of_a_torus_is_short() -> None:
    record = trajectory_files.check_trajectories(
        pd.DataFrame({"time": [0.0, 1, 0, 1], "robot": [1, 1, 2, 2], "x": [4.9, 4.9, -4.9, -4.9], "y": [-5.0, 5, 0, 5]})
    )
    grid = resample.make_grid(record)
    assert trajectory_notes.motion_of(record, grid, Torus(10, 10)).typical == pytest.approx(5)
    assert trajectory_notes.motion_of(record, grid, Box(10, 10)).typical == pytest.approx(7.5)


@pytest.mark.parametrize("unit", [0.1, 0.001])
def test_a_team_that_is_always_within_the_range_is_doubted(unit: float) -> None:
    report = doubtful(walk(unit), 1.0)
    assert "every robot always has all others within the awareness range of 1;" in report.cautions[0]
    assert report.delta == 5


def test_the_motion_counts_between_frames_if_these_are_farther_apart_than_samples() -> None:
    record = walk()
    with pytest.warns(TrajectoryWarning, match=r"robots move 1\d(\.\d)? awareness ranges"):
        delta_from_trajectories(record, 1.0, step=100.0, window=100.0)


def test_few_windows_of_slow_robots_do_not_count_as_independent() -> None:
    seed = fresh_seed()
    rng, size, share, wrong, repeats = np.random.default_rng(seed), 20, 0.95, 0, 400
    for _ in range(repeats):
        values = rng.normal(size=size)
        for window in range(1, size):
            values[window] = share * values[window - 1] + np.sqrt(1 - share**2) * values[window]
        risk = exceedance.supported_risk(exceedance.effective_number(values))
        wrong += stats.norm.sf(values.max()) > risk
    # 5 % is the aim and 7 % is found; 24 % without the correction for the mean. Six standard errors are 8 %.
    assert wrong / repeats < 0.15, seed


def test_groups_that_are_counted_as_one_team_are_named(tmp_path: Path) -> None:
    model = CMOMMT(robots=4, targets=3, radius=2.0, rng=1)
    model.recording.record_positions()
    model.run(30)
    mixed = model.recording.trajectory.rename(columns={"identity": "robot"})
    mixed.to_csv(tmp_path / "t.csv", index=False)
    for record in (mixed, read_trajectories(tmp_path / "t.csv")):
        with pytest.warns(TrajectoryWarning, match="Check the groups: all agents of robots, targets count as one team"):
            report = delta_from_trajectories(record, 1.0, risk=0.9)
        assert report.robots == 7
        assert report.sentences()[0] == report.cautions[0]
    assert delta_from_trajectories(mixed[mixed["group"] == "robots"], 1.0, risk=0.9).cautions == ()
    with pytest.warns(TrajectoryWarning, match=r"differs between runs, from 3 \(in 1\) to 4"):
        parted = delta_from_trajectories(mixed.assign(run=mixed["group"]), 1.0, risk=0.9)
    assert not any("groups" in caution for caution in parted.cautions)


@pytest.mark.parametrize(
    ("second", "metre", "word"),
    [
        (1.0, 1.0, ""),
        (1 / 86_400, 1.0, "too fast"),  # days of a spreadsheet
        (1e3, 1.0, "too slow"),  # milliseconds
        (1.0, 1e3, "too fast"),  # millimetres
    ],
)
def test_speeds_of_no_robot_are_a_note_since_the_number_is_right_in_any_units(second: float, metre: float, word: str) -> None:
    walked = walk(metre)
    report = delta_from_trajectories(walked.assign(time=0.1 * second * walked["time"]), metre, risk=0.5)
    assert report.cautions == ()
    said = [text for text in report.notes if text.startswith("Check the units")]
    assert len(said) == bool(word)
    assert all(word in text for text in said)
    # Times since 1970 have a unit that is known.
    now = walked.assign(time=(1.7e9 + 0.1 * walked["time"]) * 1e9)
    assert not any("units" in text for text in delta_from_trajectories(now, metre, risk=0.5).notes) or metre > 1


def test_degrees_are_doubted_once() -> None:
    walked = walk(1e-5)
    degrees = walked.assign(x=11.57 + walked["x"], y=48.14 + walked["y"])
    with pytest.warns(TrajectoryWarning, match="degrees of latitude"):
        report = delta_from_trajectories(degrees, 1e-5, risk=0.5)
    assert not any("units" in text for text in report.notes)
    # Metres about an origin, however few, are none.
    assert delta_from_trajectories(walked, 1e-5, risk=0.5).cautions == ()
