"""Faults that every tracking system has: the report names them, and states no confidence."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from chance import generator

from teamsight import Torus
from teamsight.analysis.delta import TrajectoryWarning, delta_from_trajectories
from teamsight.analysis.delta.report import DeltaReport

RUNS, SAMPLES, ROBOTS = 30, 30, 6


@pytest.fixture(scope="module")
def sound() -> pd.DataFrame:
    """Return runs of robots that wander in a square of 3 ranges, each with its own phase of sampling."""
    rng = generator()
    place = rng.uniform(0, 3, (RUNS, 1, ROBOTS, 2)) + np.cumsum(rng.normal(0, 0.1, (RUNS, SAMPLES, ROBOTS, 2)), axis=1)
    place = np.abs((place + 3) % 6 - 3)
    run, time, robot = np.mgrid[:RUNS, :SAMPLES, :ROBOTS]
    columns = {"run": run, "time": time + rng.uniform(0, 0.9, ROBOTS), "robot": robot, "x": place[..., 0], "y": place[..., 1]}
    return pd.DataFrame({name: values.ravel() for name, values in columns.items()})


def clocks(record: pd.DataFrame) -> pd.DataFrame:
    return record.assign(time=record["time"] + 3.0 * (record["robot"] == 2))


def many_clocks(record: pd.DataFrame) -> pd.DataFrame:
    return record.assign(time=record["time"] + 3.0 * record["robot"])


def absent(record: pd.DataFrame) -> pd.DataFrame:
    """Each robot is lost for a time, in which the others are recorded."""
    start = 5 + (record["run"] * 7 + record["robot"] * 5) % 14
    return record[(record["time"] < start) | (record["time"] > start + 9)]


def unequal(record: pd.DataFrame) -> pd.DataFrame:
    return record[(record["run"] % 3 != 0) | (record["robot"] < 4)]


def jump(record: pd.DataFrame) -> pd.DataFrame:
    at = (record["run"] == 7) & (record["robot"] == 3) & record["time"].between(20, 21)
    return record.assign(x=record["x"].mask(at, 8.0))


def recorded(record: pd.DataFrame) -> DeltaReport:
    return delta_from_trajectories(record, 1.0, risk=0.1)


@pytest.fixture(scope="module")
def truth(sound: pd.DataFrame) -> DeltaReport:
    return recorded(sound)


def renamed(record: pd.DataFrame) -> pd.DataFrame:
    """Every second sample of a robot has its name in capitals: it is its own neighbour."""
    name = "robot" + record["robot"].astype(str)
    return record.assign(robot=name.mask((record["robot"] == 2) & (record["time"] // 1 % 2 == 0), "ROBOT2 "))


def never_there(record: pd.DataFrame) -> pd.DataFrame:
    gone = record["robot"] == 4
    return record.assign(x=record["x"].mask(gone), y=record["y"].mask(gone))


FAULTS: list[tuple[Callable[[pd.DataFrame], pd.DataFrame], str]] = [
    (clocks, r"Check the clocks: the first .* more than 2 apart in 30 of 30 .*robot 2 of run 0 starts [23]\.?\d* after"),
    (many_clocks, r"Check the clocks: .*robot [05] of run 0 starts \d\.?\d* (after|before)"),
    (absent, r"Check the tracking: 6\d(\.\d)? % of the robots are present at a time, fewer than 95 %"),
    (unequal, r"Check the robots: their number differs between runs, from 4 \(in 10\) to 6 \(in 20\)"),
    (renamed, r"Check the names: '(ROBOT2 |robot2)' and '(ROBOT2 |robot2)' count as two robots"),
    (never_there, r"Check the tracking: never a position of 4; δ is that of the other robots"),
    (jump, r"Check the tracking: 2 steps of more than 10 medians; .*robot 3 of run 7 before time 2[01]"),
]


def test_a_sound_record_has_no_fault_and_a_confidence(sound: pd.DataFrame, truth: DeltaReport) -> None:
    assert truth.cautions == ()
    assert " with 95% confidence: exceeded in at most 10 % " in truth.sentences()[0]
    # A tenth of the samples may be missing: the robots move on in a line.
    assert recorded(sound[sound.index % 10 != 4]).cautions == ()
    # Pauses of all robots are no absence.
    assert recorded(sound[~sound["time"].between(10, 17)]).cautions == ()
    one = sound[sound["run"] == 0].drop(columns="run")
    assert delta_from_trajectories(one, 1.0, risk=0.9).cautions == ()


@pytest.mark.parametrize(("fault", "caution"), FAULTS)
def test_a_fault_is_named_and_no_confidence_stated(
    sound: pd.DataFrame, truth: DeltaReport, fault: Callable[[pd.DataFrame], pd.DataFrame], caution: str
) -> None:
    with pytest.warns(TrajectoryWarning, match=caution):
        report = recorded(fault(sound))
    if fault in (absent, unequal):
        # Such a fault hides neighbours, so that δ would be too small; wrong clocks show those of other times.
        assert report.maxima["max_neighbours"].mean() < truth.maxima["max_neighbours"].mean()
    first = report.sentences()[len(report.cautions)]
    assert first.startswith(f"δ = {report.delta} (point estimate), if the record is right: ")
    assert not any("confidence" in sentence for sentence in report.sentences()[: len(report.cautions) + 1])
    assert "confidence" not in str(report).split("How often")[0]
    assert "unknown: see the caution" in str(report._repr_html_())


def test_a_fault_of_few_runs_is_that_of_a_robot_which_joins(sound: pd.DataFrame) -> None:
    late = (sound["run"] < 10) & (sound["robot"] == 1) & (sound["time"] < 5)
    assert recorded(sound[~late]).cautions == ()
    # Nor is it a fault that a robot has not come yet, if the record says so.
    gone = sound["time"].lt(4) & sound["robot"].eq(1) & sound["run"].mod(2).eq(0)
    assert recorded(sound.assign(x=sound["x"].mask(gone), y=sound["y"].mask(gone))).cautions == ()


def test_pieces_that_are_trials_are_looked_at_one_by_one(sound: pd.DataFrame) -> None:
    pieces = sound.assign(time=sound["time"] + 100 * sound["run"]).drop(columns="run")
    assert recorded(pieces).cautions == ()
    with pytest.warns(TrajectoryWarning, match=r"differs between pieces, from 4 \(in 10\) to 6 \(in 20\)"):
        recorded(unequal(sound.assign(time=pieces["time"])).drop(columns="run"))
    with pytest.warns(TrajectoryWarning, match=r"apart in 30 of 30 recordings; robot 2 starts [23]"):
        recorded(clocks(pieces))


def test_robots_that_stand_still_but_for_noise_may_set_off(sound: pd.DataFrame) -> None:
    rng = generator()
    still = sound[sound["run"] == 0].drop(columns="run")
    still = still.assign(x=still["robot"] * 0.7 + rng.normal(0, 1e-3, len(still)), y=0.3 * (still["time"] > 20))
    assert recorded(still).cautions == ()


def test_the_edge_of_a_torus_is_no_step() -> None:
    time, robot = np.mgrid[:40, :2]
    x = (0.3 * time + robot + 5) % 10 - 5
    record = pd.DataFrame({"time": time.ravel() * 1.0, "robot": robot.ravel(), "x": x.ravel(), "y": 0.5 * robot.ravel()})
    with pytest.warns(TrajectoryWarning, match=r"2 steps of more than 10 medians; the longest, 9\.7 instead of 0\.3"):
        recorded(record)
    assert not any("steps" in caution for caution in delta_from_trajectories(record, 2.0, arena=Torus(10, 10)).cautions)
