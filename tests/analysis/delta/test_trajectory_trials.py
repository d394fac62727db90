"""δ from a record of many recordings: gaps are no time without neighbours, and recordings are not one long run."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chance import fresh_seed, generator
from scipy import stats

from teamsight.analysis import neighbour_graph
from teamsight.analysis.delta import (
    from_trajectories,
    resample,
    trajectory_files,
    trajectory_trials,
)
from teamsight.analysis.delta.report import DeltaReport, rounded_up
from teamsight.analysis.stats import exceedance

# Robots that are anywhere at each time move several ranges.
pytestmark = pytest.mark.filterwarnings("ignore::teamsight.analysis.delta.trajectory_notes.TrajectoryWarning")


def seed_of() -> int:
    return fresh_seed()


def recorded(
    seed: int,
    *,
    count: int = 208,
    robots: int = 5,
    samples: int = 14,
    gap: float = 7.0,
    side: float = 3.0,
    drift: bool = False,
) -> tuple[pd.DataFrame, np.ndarray]:
    """Return recordings of a team, a sample a time unit, and the largest degree in each.

    In each recording the robots begin anywhere, or with `drift` where they were; the times go on from one to the next.
    """
    rng = np.random.default_rng(seed)
    start = rng.uniform(0, side, (count, 1, robots, 2))
    steps = np.cumsum(rng.normal(0, 0.1, (count, samples, robots, 2)), axis=1)
    if drift:
        start[1:] = start[:1] + np.cumsum(steps[:-1, -1:], axis=0)
    place = np.abs((start + steps + side) % (2 * side) - side)
    near = np.hypot(*(place[:, :, :, None] - place[:, :, None]).transpose(4, 0, 1, 2, 3)) <= 1
    run, sample, robot = np.mgrid[:count, :samples, :robots]
    columns = {
        "run": run,
        "time": run * (samples - 1 + gap) + sample,
        "robot": robot,
        "x": place[..., 0],
        "y": place[..., 1],
    }
    record = pd.DataFrame({name: values.ravel() for name, values in columns.items()})
    return record, near.sum(axis=-1).max(axis=(1, 2)) - 1


def without_runs(record: pd.DataFrame) -> pd.DataFrame:
    return record.drop(columns="run")


def restarted(record: pd.DataFrame) -> pd.DataFrame:
    """The same recordings with a clock that starts at 0 in each."""
    return record.assign(time=record["time"] - record.groupby("run")["time"].transform("min"))


@pytest.mark.parametrize("form", [without_runs, restarted])
@pytest.mark.parametrize("window", [None, 14.0])
def test_the_stated_risk_is_the_share_of_recordings(form: Any, window: float | None) -> None:
    seed = seed_of()
    record, truth = recorded(seed)
    report = from_trajectories.delta_from_trajectories(form(record), 1.0, risk=0.1, window=window, max_gap=5.0)
    assert report.trials == 208, seed
    assert report.maxima["max_neighbours"].tolist() == truth.tolist(), seed
    shares = [(truth > delta).mean() for delta in range(5)]
    assert report.exceedance["probability"].tolist() == pytest.approx(shares), seed
    if form is restarted:
        assert report.independent == 208, seed
        low = stats.binomtest(int((truth > 1).sum()), 208).proportion_ci(0.9, method="exact").low
        assert report.exceedance["low"][1] == pytest.approx(low), seed


def unwrapped(report: DeltaReport) -> str:
    """Return the page of a report without line breaks."""
    return " ".join(report.to_markdown().split())


def test_without_a_column_of_runs_gaps_divide_and_the_report_says_so() -> None:
    record, _ = recorded(1, count=30)
    report = from_trajectories.delta_from_trajectories(without_runs(record), 1.0, risk=0.5)
    text = unwrapped(report)
    assert "29 gaps of 7 in which no robot has a sample divide the record into 30 pieces of 14" in text
    assert "Each piece is one trial" in text
    assert report.trial == "piece"
    assert report.over_time["run"].tolist() == np.repeat(np.arange(30), 14).tolist()
    assert report.over_time["robots"].min() == 5


def test_runs_have_names_and_need_no_order(tmp_path: Path) -> None:
    record, truth = recorded(2, count=12)
    names = np.array([f"2026-05-{day:02}" for day in range(1, 13)])
    mixed = restarted(record).sort_values(["time", "run", "robot"]).assign(run=lambda rows: names[rows["run"]])
    mixed.to_csv(tmp_path / "t.csv", index=False)
    mixed.to_parquet(tmp_path / "t.parquet")
    for file in ("t.csv", "t.parquet"):
        found = trajectory_files.read_trajectories(tmp_path / file)
        assert list(found.columns) == ["time", "robot", "x", "y", "run"]
        report = from_trajectories.delta_from_trajectories(found, 1.0, risk=0.5)
        assert report.maxima["run"].tolist() == names.tolist()
        assert report.maxima["max_neighbours"].tolist() == truth.tolist()
        assert "The record holds 12 runs of 14." in report.notes
        report.save(tmp_path / file.replace(".", "-"))
        assert "run" in pd.read_parquet(tmp_path / file.replace(".", "-") / "delta_over_time.parquet")


def test_nothing_is_interpolated_from_one_run_to_the_next() -> None:
    # One clock without a pause: the second run begins a step after the first has ended, elsewhere.
    rows = [(run, 3 * run + t, robot, 100 * run + robot, 0) for run in range(2) for t in range(3) for robot in range(2)]
    record = pd.DataFrame(rows, columns=["run", "time", "robot", "x", "y"])
    found = resample.neighbours_over_time(trajectory_files.check_trajectories(record), 1.5, step=0.5)
    assert found.over_time["time"].tolist() == [0, 0.5, 1, 1.5, 2, 3, 3.5, 4, 4.5, 5]
    assert found.over_time["run"].tolist() == [0] * 5 + [1] * 5
    assert found.over_time["max_degree"].tolist() == [1] * 10
    assert found.move == 0


def test_a_gap_within_a_run_holds_no_frames_but_the_run_is_one_trial() -> None:
    record, truth = recorded(3, count=12, samples=40)
    within = record["time"] % 46
    holed = restarted(record)[~within.between(15, 25).to_numpy()]
    report = from_trajectories.delta_from_trajectories(holed, 1.0, risk=0.5)
    assert (report.trial, report.trials) == ("run", 12)
    assert report.largest <= truth.max()
    assert any("12 gaps of 12 " in note and "into 24 pieces" in note for note in report.notes)
    windows = from_trajectories.delta_from_trajectories(holed, 1.0, risk=0.5, window=10.0).maxima
    assert ((windows["end"] < 15) | (windows["start"] > 25)).all()


def test_windows_are_those_found_piece_by_piece() -> None:
    seed = seed_of()
    rng = np.random.default_rng(seed)
    lengths = np.concatenate([[3, 29], rng.integers(1, 30, 13)])
    start = np.cumsum(lengths + 50)
    time = np.concatenate([first + np.arange(length) for first, length in zip(start, lengths, strict=True)])
    place = rng.uniform(0, 2, (len(time), 3, 2))
    rows = [(at, robot, *place[frame, robot]) for frame, at in enumerate(time) for robot in range(3)]
    record = pd.DataFrame(rows, columns=["time", "robot", "x", "y"])
    report = from_trajectories.delta_from_trajectories(record, 1.0, risk=0.5, window=7.0, step=1.0, max_gap=5.0)
    degree = report.over_time.set_index("time")["max_degree"]
    expected = []
    for first, length in zip(start, lengths, strict=True):
        for window in range(length // 7):
            own = first + 7 * window
            expected.append((own, own + 6, degree.loc[own : own + 6].max()))
    got = report.maxima[["start", "end", "max_neighbours"]].itertuples(index=False, name=None)
    assert list(got) == expected, seed
    assert f"{(lengths < 7).sum()} of 15 pieces are shorter than the window" in unwrapped(report), seed


def test_a_window_that_no_piece_holds_is_refused() -> None:
    record, _ = recorded(4, count=12)
    for form in (without_runs, restarted):
        with pytest.raises(
            ValueError, match=r"window=20: longer than the longest of 12 pieces, 14; give .* at most 14"
        ):
            from_trajectories.delta_from_trajectories(form(record), 1.0, window=20.0)
    with pytest.raises(ValueError, match=r"window=20: longer than the record, which spans 14; give .* at most 14"):
        from_trajectories.delta_from_trajectories(record[record["run"] == 3], 1.0, window=20.0)


@pytest.mark.parametrize(
    ("lengths", "runs", "window"),
    [
        ([400], False, 20),  # a twentieth
        ([200, 200], False, 20),
        ([20] * 10, False, None),  # recordings
        ([20] * 9, True, 9),
        ([5, 10, 20] * 4, True, None),  # runs are what their numbers say
        ([10] * 9 + [100], False, 9),  # one recording with dropouts: its pieces are no trials
        ([3] * 50 + [30], False, 3),  # half of the record is in pieces as long
    ],
)
def test_the_window_that_nobody_chose(lengths: list[int], runs: bool, window: int | None) -> None:
    start = np.cumsum([0, *lengths[:-1]]) + 50.0 * np.arange(len(lengths))
    time = np.concatenate([first + np.arange(length) for first, length in zip(start, lengths, strict=True)])
    run = np.repeat(np.arange(len(lengths)), lengths)
    record = pd.DataFrame({"time": np.tile(time, 2), "robot": np.repeat([1, 2], len(time)), "x": 0.0, "y": 0.0})
    if runs:
        record["run"] = np.tile(run, 2)
    grid = resample.make_grid(trajectory_files.check_trajectories(record), 1.0, 5.0)
    assert grid.length.tolist() == lengths
    assert trajectory_trials.window_frames(grid, None) == window


def test_short_pieces_and_empty_ones_are_no_recordings() -> None:
    record, truth = recorded(5, count=12)
    cut = record[~((record["run"] == 4) & (record["time"] % 20 > 3)) & ~((record["run"] == 7) & (record["robot"] > 0))]
    report = from_trajectories.delta_from_trajectories(without_runs(cut), 1.0, risk=0.5)
    assert report.maxima["max_neighbours"].tolist() == np.delete(truth, [4, 7]).tolist()
    assert "2 pieces with few robots present or short are left out" in unwrapped(report)
    # Who numbers the runs says that they are whole.
    assert from_trajectories.delta_from_trajectories(cut, 1.0, risk=0.5).trials == 11


def test_robots_that_are_named_anew_in_each_run_are_no_larger_team() -> None:
    record, truth = recorded(6, count=12)
    named = restarted(record).assign(robot=record["run"] * 100 + record["robot"])
    report = from_trajectories.delta_from_trajectories(named, 1.0, risk=0.5)
    assert (report.robots, report.largest) == (5, truth.max())
    assert not any("present" in note for note in report.notes)


def test_recordings_of_robots_that_stay_where_they_were_are_no_independent_trials() -> None:
    record, _ = recorded(seed_of(), count=100, drift=True)
    report = from_trajectories.delta_from_trajectories(without_runs(record), 1.0)
    assert report.trials == 100
    assert report.independent < 60
    still = record.assign(x=record["robot"] * 0.7, y=0.0)
    assert from_trajectories.delta_from_trajectories(without_runs(still), 1.0).independent == 1
    assert from_trajectories.delta_from_trajectories(still, 1.0).independent == 100


def test_effective_number_of_runs() -> None:
    rng = generator()
    runs, size, share = 3000, 10, 0.9
    run = np.repeat(np.arange(runs), size)
    walk = np.zeros((runs, size))
    walk[:, 0] = rng.normal(size=runs)
    for step in range(1, size):
        walk[:, step] = share * walk[:, step - 1] + math.sqrt(1 - share**2) * rng.normal(size=runs)
    lags = np.arange(1, size)
    theory = runs * size / (1 + 2 * np.sum((1 - lags / size) * share**lags))
    assert exceedance.effective_number(walk.ravel(), run=run) == pytest.approx(theory, rel=0.1)
    each = rng.normal(size=runs)
    assert exceedance.effective_number(np.repeat(each, size), run=run) == pytest.approx(runs, rel=0.01)
    assert exceedance.effective_number(each, run=np.arange(runs)) == runs
    assert exceedance.effective_number(np.sort(each), run=np.arange(runs)) == runs
    assert exceedance.effective_number(np.ones(runs * size), run=run) == runs
    assert exceedance.effective_number(np.ones(4), run=[1, 1, 1, 2]) == pytest.approx(16 / 10)
    noise = [exceedance.effective_number(rng.normal(size=400), errors=1.645) for _ in range(200)]
    # One in twenty is to be taken for correlated; 24 of 200 would be over four standard errors more.
    assert sum(number < 400 for number in noise) < 24


@pytest.mark.parametrize("trials", [1.0, 20.0, 208.0, 298.9])
def test_the_supported_risk_is_what_no_exceedance_shows(trials: float) -> None:
    risk = exceedance.supported_risk(trials)
    assert risk == pytest.approx(float(exceedance.bounds(0, trials)[1]))
    assert exceedance.trials_needed(risk) == math.ceil(trials - 1e-6)
    assert risk <= rounded_up(risk) <= risk * 1.01


def thrown(seed: int, frames: int, robots: int = 10) -> pd.DataFrame:
    """Robots that are anywhere at each time, so that all windows are independent."""
    place = np.random.default_rng(seed).uniform(0, 6, (frames, robots, 2))
    time, robot = np.mgrid[:frames, :robots]
    columns = {"time": time.astype(float), "robot": robot, "x": place[..., 0], "y": place[..., 1]}
    return pd.DataFrame({name: values.ravel() for name, values in columns.items()})


def test_advice_when_windows_are_too_few() -> None:
    seed = seed_of()
    record = thrown(seed, 1500)
    report = from_trajectories.delta_from_trajectories(record, 1.0, risk=0.02)
    assert not report.supported, seed
    assert (report.trials, report.trials_needed) == (20, 149), seed
    assert f"- δ = {report.delta} (point estimate), if the record is right" in unwrapped(report), seed
    text = unwrapped(replace(report, cautions=()))
    assert f"- δ = {report.supported_delta} for a risk of {rounded_up(report.supported_risk):g}, the smallest" in text, seed
    assert report.supported_delta == report.maxima["max_neighbours"].max() < 9, seed
    assert f"{1500 * 149 / report.independent:,.0f} instead of 1500" in text, seed
    assert f"about {1500 * (149 / report.independent - 1):,.0f} more frames" in text, seed
    stated = from_trajectories.delta_from_trajectories(record, 1.0, risk=rounded_up(report.supported_risk))
    assert stated.supported, seed
    assert stated.delta_safe == report.supported_delta, seed


def test_advice_when_all_trials_are_the_same() -> None:
    record = thrown(1, 100)
    still = record.assign(x=record["robot"] * 0.7, y=0.0)
    text = unwrapped(from_trajectories.delta_from_trajectories(still, 1.0, risk=0.02))
    assert "All windows are the same, so that they count as one: record while the robots move, or runs that" in text


@pytest.mark.parametrize(("met", "needed"), [(1, False), (30, True)])
def test_advice_when_all_teammates_were_met(met: int, needed: bool) -> None:
    """In some of 40 runs all of three robots are together, in the others far apart."""
    rows = [
        (run, t, robot, robot * (0.1 if run < met else 9), 0)
        for run in range(40)
        for t in (0, 1)
        for robot in (0, 1, 2)
    ]
    record = pd.DataFrame(rows, columns=["run", "time", "robot", "x", "y"])
    report = from_trajectories.delta_from_trajectories(record, 1.0, risk=0.01)
    text = unwrapped(report)
    high = rounded_up(report.exceedance["high"][1])
    assert f"in {met} of them some robot had all N − 1 = 2 teammates as neighbours" in text
    assert ("- δ = 2, which cannot be exceeded" in text and "too often for δ = 1" in text) is needed
    assert (f"- δ = 1 for a risk of {high:g}, the smallest" in text) is not needed
    assert report.to_png().startswith(b"\x89PNG")


def test_a_trajectory_of_several_runs() -> None:
    record, truth = recorded(8, count=6)
    found = neighbour_graph.over_trajectory(restarted(record), 1.0)
    assert found.columns[:2].tolist() == ["run", "time"]
    assert found.groupby("run")["max_degree"].max().tolist() == truth.tolist()
    one = neighbour_graph.over_trajectory(without_runs(record), 1.0)
    assert one["max_degree"].tolist() == found["max_degree"].tolist()


@pytest.mark.parametrize(("share", "bound"), [(0.0, False), (0.99, True)])
def test_no_more_independent_windows_than_frames(share: float, bound: bool) -> None:
    """Degrees that keep a share of their deviation from frame to frame, in 120 records of five windows."""
    rng, frames, repeats = generator(), 200, 120
    degree = rng.normal(size=(frames, repeats))
    for frame in range(1, frames):
        degree[frame] = share * degree[frame - 1] + math.sqrt(1 - share**2) * degree[frame]
    one = np.ones(1)
    grid = resample.Grid(0 * one, np.array([frames]), np.zeros(1, int), one[:0], 1.0, 5.0, 9, 1.0)
    lower = 0
    for values in degree.T:
        columns = {"run": 0, "time": np.arange(frames), "robots": 9, "mean_degree": values, "max_degree": np.rint(2 * values)}
        over_time = pd.DataFrame(columns)
        most = trajectory_trials.independent_frames(over_time, grid)
        free = trajectory_trials.trials(over_time, grid, 40).independent
        found = trajectory_trials.trials(over_time, grid, 40, most).independent
        assert found == min(free, most)
        lower += found < free
    # Of slow ones one record in eleven is found to have fewer; the chance that none of 120 is, is 1e-5.
    assert (lower > 0) is bound


def test_a_record_of_slow_robots_is_one_observation() -> None:
    rng = generator()
    place = rng.uniform(0, 4, (1, 6, 2)) + np.arange(100)[:, None, None] * rng.normal(0, 0.002, (1, 6, 2))
    time, robot = np.mgrid[:100, :6]
    columns = {"time": time.astype(float), "robot": robot, "x": place[..., 0], "y": place[..., 1]}
    record = pd.DataFrame({name: values.ravel() for name, values in columns.items()})
    report = from_trajectories.delta_from_trajectories(record, 2.0, risk=0.1)
    assert report.independent < 2
    first = report.sentences()[len(report.cautions)]
    assert first.startswith("This record is one observation, 20 windows (equivalent to 1.")
    assert f"its largest number of neighbours is {report.largest}" in first
    assert "confidence" not in first
