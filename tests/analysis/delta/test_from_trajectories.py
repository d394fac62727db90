"""Recorded positions: what is refused and how, how frames are formed, and the δ that follows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chance import generator
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from teamsight.analysis.delta import from_trajectories, resample, trajectory_files
from teamsight.world.arena import Disc, Torus

GOOD = "time,robot,x,y\n0,a,0,0\n1,a,1,0\n0,b,0,1\n1,b,1,1\n"


def _write(folder: Path, text: str, name: str = "trajectories.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def _walk(robots: int, samples: int, rng: np.random.Generator, side: float = 4.0) -> pd.DataFrame:
    """Robots that wander in a square and are sampled all at times 0, 1, 2, …"""
    place = rng.uniform(0, side, (1, robots, 2)) + np.cumsum(rng.normal(0, 0.2, (samples, robots, 2)), axis=0)
    place = np.abs((place + side) % (2 * side) - side)
    time, robot = np.mgrid[:samples, :robots]
    columns = {"time": time.astype(float), "robot": robot, "x": place[..., 0], "y": place[..., 1]}
    return pd.DataFrame({name: values.ravel() for name, values in columns.items()})


@pytest.mark.parametrize("name", ["t.csv", "t.parquet", "t.pq", "t.CSV", "t.csv.gz"])
def test_both_kinds_of_file_hold_the_same(tmp_path: Path, name: str) -> None:
    given = _walk(5, 20, generator()).sample(frac=1).sort_values("time", kind="stable")
    given = given.assign(heading=0.0, robot="r" + given["robot"].astype(str))
    path = tmp_path / name
    if "csv" in name.lower():
        given.to_csv(path, index=False)
    else:
        given.to_parquet(path, index=False)
    seen: list[tuple[int, int]] = []
    found = trajectory_files.read_trajectories(path, progress=lambda done, total: seen.append((done, total)))
    assert list(found.columns) == ["time", "robot", "x", "y"]
    assert seen == [(0, 2), (1, 2), (2, 2)]
    plain = found.assign(robot=found["robot"].astype(str)).sort_values(["robot", "time"], ignore_index=True)
    expected = given[["time", "robot", "x", "y"]].sort_values(["robot", "time"], ignore_index=True)
    pd.testing.assert_frame_equal(plain, expected, check_dtype=False)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"trajectories\.csv: not a readable CSV file \(the file is empty\)"),
        ("\x89PNG\r\n\x1a\n\0\1,\3\n", r"not a readable CSV file \(it is not text\)"),
        ("time,robot,x,y\n", "no rows"),
        ("time,robot_id,x,y\n0,1,0,0\n", "no column 'robot'; found time, robot_id, x, y; rename 'robot_id' to 'robot'"),
        ("t,agent,x_m,pose.position.y\n0,1,0,0\n", "rename 't' to 'time', rename 'agent' to 'robot', rename 'x_m' to 'x', rename 'pose"),
        ("stamp,id,X [m],q\n0,1,0,0\n", "rename 'stamp' .*, rename 'id' .*, rename 'X .m.' to 'x'; needed are time, robot, x, y"),
        ("time,x0,y0,x1,y1\n0,1,0,0,1\n", "'x0' and 'x1' look like two robots in one row; give each its own row: time,robot,x,y"),
        ("time,robot0_x,robot0_y,robot1_x\n0,1,0,0\n", "'robot0_x' and 'robot1_x' look like two robots in one row"),
        ("header.stamp,pose.position.x,pose.orientation.x\n0,1,0\n", "rename 'pose.position.x' to 'x'; needed are"),
        ("0.0,robot_1,0,0\n", "the first row holds values, not names; begin with the row time,robot,x,y"),
        ('time,robot,x,y\n"0,1",1,0,0\n', "time='0,1' in row 1: must be a number, without commas, as in 1234.5"),
        ("Time,robot,X,y\n0,1,0,0\n", "no columns 'time', 'x'; .* rename 'Time' to 'time', rename 'X' to 'x'"),
        ("a,b\n0,1\n", "no columns 'time', 'robot', 'x', 'y'; found a, b; needed are time, robot, x, y"),
        ("time;robot;x;y\n0;1;0;0\n", "found time;robot;x;y; .*separated by commas"),
        ("time;robot;x;y\n0,0;1;0,5;0,5\n", "separate them by commas.*points, as in 0.5"),
        ("time,robot,x,y,x\n0,1,0,0,0\n", "column 'x' twice"),
        (GOOD + "2,a,abc,0\n", "x='abc' in row 5: must be a number"),
        (
            "time,robot,x,y\n2020-01-01 00:00:00,a,0,0\n",
            "time=2020-01-01 00:00:00 in row 1: must be a number .*since the first",
        ),
        (GOOD + "2,a,,0\n", "x is missing in row 5; leave out"),
        (GOOD + "2,a,0,inf\n", "y is inf in row 5"),
        (GOOD + "nan,a,0,0\n", "time is missing in row 5"),
        (GOOD + "2,,0,0\n", "robot is missing in row 5"),
        ("run,time,robot,x,y\n1,0,a,0,0\n,1,a,0,0\n", "run is missing in row 2; name a run in every row"),
        ("run,time,robot,x,y\n1.5,0,a,0,0\n", "run=1.5 in row 1: must be a whole number or text"),
        ("run,time,robot,x,y,run\n1,0,a,0,0,1\n", "column 'run' twice"),
        (
            "run,time,robot,x,y\n1,0,a,0,0\n2,0,a,0,0\n2,0,a,1,0\n",
            "robot 'a' of run 2 twice at time 0, in rows 2 and 3",
        ),
        (
            "run,time,robot,x,y\n1,9,a,0,0\n2,8,a,0,0\n2,7,a,1,0\n",
            "robot 'a' of run 2 goes back from time 8 in row 2 to 7 in row 3",
        ),
        ("time,robot,x,y\n0,1.5,0,0\n", "robot=1.5 in row 1: must be a whole number or text"),
        ("time,robot,x,y\n0,true,0,0\n0,false,0,0\n", "robot=True in row 1"),
        (GOOD + "1,a,5,5\n", "robot 'a' twice at time 1, in rows 2 and 5; keep one"),
        (GOOD + "0.5,b,5,5\n", "robot 'b' goes back from time 1 in row 4 to 0.5 in row 5; .*column run.*--sort"),
        ("time,robot,x,y\n0,7,0,0\n1,7,0,0\n", "only robot 7; a neighbour graph needs at least 2"),
        ("Format Version,1.23,Take Name,walk\n\n,,Rigid Body,Rigid Body\n", "export of motion capture .*docs/recorded.md"),
        ("Trajectories\n100\n,a:m1,,,b:m1,,\nFrame,Sub Frame,X,Y,Z,X,Y\n", "export of motion capture"),
        (GOOD + "2,a,0\n", "not a readable CSV file .*Expected 4 columns"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message) as error:
        trajectory_files.read_trajectories(_write(tmp_path, text))
    assert "\n" not in str(error.value)
    assert "trajectories.csv" in str(error.value)


def test_words_of_motion_capture_may_be_in_a_file(tmp_path: Path) -> None:
    text = GOOD.replace("y\n", "y,Take Name\n", 1).replace("\n", ",Rigid Body\n").replace("Name,Rigid Body", "Name", 1)
    assert len(trajectory_files.read_trajectories(_write(tmp_path, text))) == 4


def test_text_of_another_encoding_is_named(tmp_path: Path) -> None:
    content = GOOD.encode("utf-16")
    with pytest.raises(ValueError, match="is text in UTF-16; save it as UTF-8"):
        trajectory_files.read_trajectories("team.csv", content=content)
    (tmp_path / "team.csv").write_bytes(content)
    with pytest.raises(ValueError, match="is text in UTF-16; save it as UTF-8"):
        trajectory_files.read_trajectories(tmp_path / "team.csv")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.csv: cannot be read \(no such file\); check the path"):
        trajectory_files.read_trajectories(tmp_path / "none.csv")
    with pytest.raises(ValueError, match=r"unknown kind of file '.xlsx'; known are .csv"):
        trajectory_files.read_trajectories(tmp_path / "t.xlsx")
    for ending in ("txt", "tsv"):
        with pytest.raises(ValueError, match="if it is text separated by commas, rename it to .csv"):
            trajectory_files.read_trajectories(tmp_path / f"t.{ending}")
    with pytest.raises(ValueError, match="not a readable Parquet file"):
        trajectory_files.read_trajectories(_write(tmp_path, "no parquet", "t.parquet"))
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(ValueError, match="cannot be read"):
        trajectory_files.read_trajectories(tmp_path / "folder.csv")


def test_a_name_may_be_a_word_for_what_is_missing(tmp_path: Path) -> None:
    text = GOOD.replace(",a,", ",NA,")
    assert list(trajectory_files.read_trajectories(_write(tmp_path, text))["robot"].cat.categories) == ["NA", "b"]
    both = "run,time,robot,x,y\nNA,0,a,0,0\nNA,1,a,0,0\nNA,0,b,0,0\nN/A,0,NA,NA,NA\n"
    found = trajectory_files.read_trajectories(_write(tmp_path, both))
    assert [list(found[name].cat.categories) for name in ("run", "robot")] == [["NA", "N/A"], ["a", "b", "NA"]]
    # Beside numbers it is none.
    with pytest.raises(ValueError, match="robot is missing in row 1"):
        trajectory_files.read_trajectories(_write(tmp_path, "time,robot,x,y\n0,NA,0,0\n0,1,0,0\n1,1,0,0\n"))


def test_sorting_on_request(tmp_path: Path) -> None:
    path = _write(tmp_path, GOOD + "0.5,b,5,5\n")
    assert trajectory_files.read_trajectories(path, sort=True)["time"].tolist() == [0, 1, 0, 0.5, 1]
    with pytest.raises(ValueError, match="twice at time 1, in rows 2 and 5"):
        trajectory_files.read_trajectories(_write(tmp_path, GOOD + "1,a,5,5\n"), sort=True)


def test_a_data_frame_is_checked_too() -> None:
    record = _walk(3, 5, generator())
    with pytest.raises(ValueError, match="no column 'x'"):
        from_trajectories.delta_from_trajectories(record.drop(columns="x"), 1.0)
    with pytest.raises(ValueError, match="x='far' in row 2"):
        from_trajectories.delta_from_trajectories(record.assign(x=["0", "far", *["1"] * 13]), 1.0)


@given(
    samples=st.integers(2, 60),
    step=st.floats(0.01, 3.0),
    max_gap=st.floats(0.01, 3.0),
    runs=st.integers(1, 3),
    seed=st.integers(0, 2**32),
)
@settings(deadline=None)
def test_frames_are_what_a_search_by_hand_finds(
    samples: int, step: float, max_gap: float, runs: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    time = np.sort(rng.uniform(0, 10, (runs, 2, samples)), axis=2)
    run, robot, _ = np.mgrid[:runs, :2, :samples]
    flat = {"time": time, "robot": robot, "x": 2 * time + run, "y": np.ones_like(time), "run": run}
    record = trajectory_files.check_trajectories(pd.DataFrame({name: values.ravel() for name, values in flat.items()}))
    pieces = _pieces(time, max_gap)
    if max(len({who for _, who in piece}) for piece in pieces) < 2:
        with pytest.raises(
            ValueError, match=r"a single robot in each piece between gaps of more than .* longer max_gap"
        ):
            resample.make_grid(record, step, max_gap)
        return
    grid = resample.make_grid(record, step, max_gap)
    found = np.concatenate([block.position for block in resample.blocks(record, grid)])
    assert found.shape == (grid.frames, 2, 2)
    assert grid.robots == 2
    assert sorted(set(grid.run)) == list(range(runs))
    assert grid.start.tolist() == [piece[0][0] for piece in pieces]
    for piece, length in zip(pieces, grid.length, strict=True):
        assert length - 1 == pytest.approx((piece[-1][0] - piece[0][0]) / step, abs=1)
        assert length - 1 <= (piece[-1][0] - piece[0][0]) / step + 1e-5
    at_frame = grid.time()
    for frame, (at, number) in enumerate(zip(at_frame, np.repeat(grid.run, grid.length), strict=True)):
        own = time[number]
        for who in range(2):
            earlier, later = own[who][own[who] <= at], own[who][own[who] >= at]
            if len(earlier) and len(later) and later[0] - earlier[-1] <= max_gap:
                assert found[frame, who] == pytest.approx([2 * at + number, 1.0])  # a straight trajectory: x = 2t
            elif not len(earlier) or not len(later) or later[0] - earlier[-1] > max_gap * 1.001:
                near = np.abs(own[who] - at).min() <= step * 1e-5
                assert near or np.isnan(found[frame, who]).all()


def _pieces(time: np.ndarray, max_gap: float) -> list[list[tuple[float, int]]]:
    """Return the samples (time, robot) of each piece, found one by one; not where rounding decides."""
    pieces: list[list[tuple[float, int]]] = []
    for run in time:
        samples = sorted((at, who) for who in range(2) for at in run[who].tolist())
        for number, (at, who) in enumerate(samples):
            wait = at - samples[number - 1][0] if number else np.inf
            assume(abs(wait - max_gap) > 1e-7)
            if wait > max_gap:
                pieces.append([])
            pieces[-1].append((at, who))
    return pieces


def test_a_long_gap_is_absence_and_a_short_one_a_line() -> None:
    record = pd.DataFrame(
        {
            "time": [0.0, 1, 2, 12, 13, 0, 4, 8, 12, 13, 0, 13],
            "robot": list("aaaaabbbbbcc"),
            "x": [0.0, 1, 2, 12, 13, 5, 5, 5, 5, 5, 7, 7],
            "y": 0.0,
        }
    )
    record = trajectory_files.check_trajectories(record)
    grid = resample.make_grid(record, 1.0, 5.0)
    assert (grid.step, grid.max_gap, grid.frames) == (1.0, 5.0, 14)
    (block,) = resample.blocks(record, grid)
    x = block.position[..., 0]
    assert x[:3, 0].tolist() == [0, 1, 2]
    assert np.isnan(x[3:12, 0]).all()
    assert x[12:, 0].tolist() == [12, 13]
    assert (x[:, 1] == 5).all()
    assert x[[0, 13], 2].tolist() == [7, 7]  # at a sample a robot is present whatever the gaps
    assert np.isnan(x[1:13, 2]).all()


def test_a_gap_of_all_robots_holds_no_frames() -> None:
    record = pd.DataFrame(
        {"time": [0.0, 1, 2, 12, 13, 0, 13], "robot": list("aaaaabb"), "x": [0.0, 1, 2, 12, 13, 5, 5], "y": 0.0}
    )
    grid = resample.make_grid(trajectory_files.check_trajectories(record))
    assert (grid.step, grid.max_gap, grid.robots) == (1.0, 5.0, 2)
    assert grid.time().tolist() == [0, 1, 2, 12, 13]
    assert grid.gaps.tolist() == [10.0]


def test_on_a_torus_the_line_goes_over_the_edge() -> None:
    record = pd.DataFrame({"time": [0.0, 2, 0, 1, 2], "robot": list("aabbb"), "x": [4.5, -4.5, 4.6, 5, 4.6], "y": 0.0})
    found = resample.neighbours_over_time(
        trajectory_files.check_trajectories(record), 0.5, arena=Torus(10, 10), step=1.0
    )
    assert found.over_time["max_degree"].tolist() == [1, 1, 0]


def test_degrees_are_those_of_each_frame() -> None:
    record = _walk(20, 30, generator())
    found = resample.neighbours_over_time(trajectory_files.check_trajectories(record), 1.0)
    for row, (_, frame) in zip(found.over_time.itertuples(), record.groupby("time"), strict=True):
        tree = cKDTree(frame[["x", "y"]])
        degree = tree.query_ball_point(frame[["x", "y"]], 1.0, return_length=True) - 1
        assert (row.robots, row.max_degree) == (20, degree.max())
        assert row.mean_degree == pytest.approx(degree.mean())


def test_robots_without_a_position_are_not_there() -> None:
    record = _walk(8, 30, generator())
    gone = record.copy()
    away = gone["robot"].isin([1, 5]) & gone["time"].between(10, 14) | gone["time"].eq(20)
    gone.loc[away, ["x", "y"]] = np.nan
    found = resample.neighbours_over_time(trajectory_files.check_trajectories(gone), 1.0)
    for row, (time, frame) in zip(found.over_time.itertuples(), gone.groupby("time"), strict=True):
        there = frame[["x", "y"]].dropna().to_numpy()
        degree = cKDTree(there).query_ball_point(there, 1.0, return_length=True) - 1 if len(there) else np.zeros(1)
        assert row.time == time
        assert (row.robots, row.max_degree) == (len(there), degree.max())
    # At half steps a robot is absent on both sides of a sample without a position.
    finer = resample.neighbours_over_time(trajectory_files.check_trajectories(gone), 1.0, step=0.5)
    robots = finer.over_time.set_index("time")["robots"]
    assert robots[[9.0, 9.5, 10.0, 14.5, 15.0, 19.5, 20.0, 20.5]].tolist() == [8, 6, 6, 6, 8, 0, 0, 0]
    assert from_trajectories.delta_from_trajectories(gone, 1.0, window=5.0, risk=0.4).delta >= 0
    with pytest.raises(ValueError, match="no row has a position"):
        trajectory_files.check_trajectories(record.assign(x=np.nan, y=np.nan))


def test_bearings_are_of_fewer_frames_where_they_would_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    track = trajectory_files.check_trajectories(_walk(20, 64, generator()))
    whole = resample.neighbours_over_time(track, 1.0)
    with monkeypatch.context() as patched:
        # More than a quarter of them, and less than half.
        patched.setattr(resample, "_BEARINGS", len(whole.bearings.turn) // 3)
        thinned = resample.neighbours_over_time(track, 1.0)
    monkeypatch.setattr(resample, "_SAMPLES", 20 * 64 // 4)
    fourth = resample.neighbours_over_time(track, 1.0)
    assert 0 < len(thinned.bearings.turn) < len(whole.bearings.turn)
    for one, other in zip(thinned.bearings, fourth.bearings, strict=True):
        assert np.array_equal(one, other)
    assert thinned.over_time.equals(whole.over_time)


def test_report_from_trajectories(tmp_path: Path) -> None:
    record = _walk(12, 4000, generator())
    seen: list[tuple[int, int]] = []
    report = from_trajectories.delta_from_trajectories(
        record, 1.0, risk=0.2, window=10.0, progress=lambda done, total: seen.append((done, total))
    )
    degree = report.over_time["max_degree"].to_numpy()
    assert report.trials == 400
    assert report.maxima["max_neighbours"].tolist() == degree.reshape(400, 10).max(axis=1).tolist()
    assert 1 <= report.independent <= 400
    assert report.largest == degree.max()
    assert report.prediction is None
    assert report.predicted_delta is None
    assert seen[-1] == (4000, 4000)
    assert "windows" in str(report)
    assert "closed form" not in report.to_markdown()
    assert (tmp_path / "delta_over_time.parquet") in report.save(tmp_path)
    # Robots that turn at random see the others all around.
    met = report.ring[report.ring["samples"] > 2000]
    assert met["shown"].to_numpy() == pytest.approx(met["expected"].to_numpy(), abs=0.5)


def test_dependent_windows_count_for_less() -> None:
    slow = _walk(6, 2000, generator(), side=8.0)
    apart = from_trajectories.delta_from_trajectories(slow, 1.0, window=200.0)
    near = from_trajectories.delta_from_trajectories(slow, 1.0, window=2.0)
    assert near.trials == 1000
    assert near.independent < 500
    assert apart.trials == 10


def test_windows_with_few_robots_are_left_out() -> None:
    record = _walk(10, 100, generator())
    late = record[(record["time"] >= 20) | (record["robot"] < 3)]
    report = from_trajectories.delta_from_trajectories(late, 1.0, window=10.0)
    assert report.maxima["window"].tolist() == list(range(2, 10))
    assert "2 windows with few robots present are left out" in report.to_markdown()


def test_robots_that_never_move_are_one_trial() -> None:
    still = _walk(6, 1, generator())
    record = pd.concat([still.assign(time=float(time)) for time in range(100)])
    report = from_trajectories.delta_from_trajectories(record, 2.0, risk=0.5)
    assert report.independent == 1.0
    assert not report.supported
    assert report.delta_safe == 5
    assert report.maxima["max_neighbours"].nunique() == 1
    assert not report.ring["samples"].sum()  # no motion, no heading


def test_a_disc_allows_the_closed_form() -> None:
    report = from_trajectories.delta_from_trajectories(_walk(12, 100, generator()), 1.0, arena=Disc(3.0))
    assert report.prediction is not None
    assert len(report.prediction.at_least) == 12


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"awareness_range": 0.0}, "awareness_range=0"),
        ({"awareness_range": 6.0, "arena": Torus(10, 10)}, "range=6: on a torus"),
        ({"window": 1000.0}, "window=1e3|window=1000: longer than the record"),
        ({"window": 0.1}, "window=0.1: shorter than the time between frames"),
        ({"step": 1e-9}, "step=1e-09: the record spans"),
        ({"step": -1.0}, "step=-1"),
        ({"risk": 0.0}, "risk=0"),
    ],
)
def test_bad_numbers_are_named(given: dict[str, float], message: str) -> None:
    record = _walk(3, 20, generator())
    with pytest.raises(ValueError, match=message):
        from_trajectories.delta_from_trajectories(record, **({"awareness_range": 1.0} | given))


def test_single_samples_make_no_grid() -> None:
    record = pd.DataFrame({"time": [0.0, 1.0], "robot": [1, 2], "x": 0.0, "y": 0.0})
    with pytest.raises(ValueError, match="every robot has a single sample"):
        from_trajectories.delta_from_trajectories(record, 1.0)


@pytest.mark.parametrize("arena", [None, Torus(4.0, 4.0)])
def test_square_ranges_count_by_the_chebyshev_distance(arena: Torus | None) -> None:
    trajectories = _walk(9, 30, generator())
    found = from_trajectories.delta_from_trajectories(
        trajectories, 0.8, range_shape="square", arena=arena, window=5, risk=0.2
    )
    most = []
    for _, frame in trajectories.groupby("time"):
        place = frame[["x", "y"]].to_numpy()
        way = place[:, None] - place[None]
        if arena is not None:
            way -= 4.0 * np.rint(way / 4.0)
        most.append(((np.abs(way).max(axis=-1) <= 0.8).sum(axis=1) - 1).max())
    assert found.over_time["max_degree"].tolist() == most
    assert found.prediction is None
    assert any("Ranges are squares" in note for note in found.notes)
    disc = from_trajectories.delta_from_trajectories(trajectories, 0.8, arena=Disc(4.0), window=5, risk=0.2)
    assert disc.prediction is not None
    assert not any("squares" in note for note in disc.notes)
    with pytest.raises(ValueError, match="range_shape='round': unknown; known are disc, square"):
        from_trajectories.delta_from_trajectories(trajectories, 0.8, range_shape="round")
