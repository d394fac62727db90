"""The page of recorded robots: what it says of a file, what it plays, and that bad input changes nothing."""

from __future__ import annotations

import json
import threading
import time
import warnings
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from teamsight.analysis.delta import delta_from_trajectories, read_trajectories
from teamsight.live import LivePage, recorded, watch, watch_trajectories
from teamsight.live.protocol import MOST_BYTES
from teamsight.live.recorded import Choice, RecordedTeam
from teamsight.view import Replay

_PATIENCE = 300.0  # seconds, against a hang


def table_of(robots: int = 4, frames: int = 200, step: float = 0.1, speed: float = 0.05, run: str | None = None) -> pd.DataFrame:
    """Return robots that walk at random in a square with a side of 4."""
    rng = np.random.default_rng(7)
    place = np.cumsum(rng.normal(0, speed, (frames, robots, 2)), axis=0) + rng.uniform(0, 4, (robots, 2))
    found = pd.DataFrame({
        "time": np.repeat(step * np.arange(frames), robots), "robot": np.tile(np.arange(robots), frames),
        "x": place[..., 0].ravel(), "y": place[..., 1].ravel(),
    })  # fmt: skip
    return found if run is None else found.assign(run=run)


def team_of(table: pd.DataFrame) -> RecordedTeam:
    return recorded.read_recorded("team.csv", content=table.to_csv(index=False).encode())


@pytest.fixture
def page(request: pytest.FixtureRequest, tmp_path: Any) -> Iterator[LivePage]:
    """A page that shows a file at first."""
    table_of().to_csv(tmp_path / "first.csv", index=False)
    made = watch_trajectories(tmp_path / "first.csv", 1.0, port=0, browser=False, wait=False, **getattr(request, "param", {}))
    yield made
    made.close()


def opened(page: LivePage, path: str = "recorded-socket", **how: Any) -> ClientConnection:
    base, _, query = page.url.partition("?")
    address = base.replace("http", "ws") + path + ("?" + query if query else "")
    return connect(address, **{"origin": base.rstrip("/"), "max_size": None, "proxy": None, **how})


def heard(socket: ClientConnection, kind: str) -> dict[str, Any]:
    """Read the next message, which must be of a kind."""
    found: dict[str, Any] = json.loads(socket.recv(timeout=_PATIENCE))
    assert found["type"] == kind, found.get("message", found["type"])
    return found


def send(socket: ClientConnection, content: bytes, name: str = "sent.csv") -> None:
    socket.send(json.dumps({"type": "file", "name": name, "size": len(content)}))
    heard(socket, "send")
    for at in range(0, len(content), MOST_BYTES):
        socket.send(content[at : at + MOST_BYTES])


# What is shown.


def test_the_answer_is_that_of_the_analysis_for_each_risk_and_range() -> None:
    table = table_of(robots=6)
    team = team_of(table)
    for reach, risk, window in [(1.0, 0.01, None), (1.0, 0.3, None), (2.0, 0.3, 1.5), (1.0, 0.3, 1.5)]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            wanted = delta_from_trajectories(table, reach, risk=risk, window=window)
        shown = team.answer(Choice(awareness_range=reach, risk=risk, window=window))
        answer, *_ = wanted.sentences()[len(wanted.cautions) :]
        assert shown["answer"] == answer
        assert shown["cautions"] == [*wanted.cautions, *wanted.advice]
        assert (f"δ = {shown['delta']}" in answer) == (shown["delta"] is not None) != ("is one observation" in answer)
        for row in shown["curve"]:
            assert row["probability"] == wanted.exceedance["probability"][row["delta"]]
            assert row["high"] == wanted.exceedance["high"][row["delta"]]


def test_frames_have_positions_neighbours_and_times_of_the_record() -> None:
    table = table_of(robots=5, frames=50).query("not (robot == 3 and 1.0 < time < 3.0)")
    track = team_of(table).play(Choice(awareness_range=1.2))
    assert len(track.frames) == 50
    for k in (0, 20, 49):
        frame, now = track.frames[k], table[np.isclose(table["time"], 0.1 * k)]
        present = np.flatnonzero(frame.flags)
        assert present.tolist() == now["robot"].tolist()
        place = now[["x", "y"]].to_numpy()
        assert frame.positions(track.scene.bounds)[present] == pytest.approx(place, abs=1e-3)
        near = np.linalg.norm(place[:, None] - place[None], axis=-1) <= 1.2
        pairs = {(int(present[a]), int(present[b])) for a, b in zip(*np.nonzero(near), strict=True) if a != b}
        assert set(zip(frame.links[0].source.tolist(), frame.links[0].target.tolist(), strict=True)) == pairs
        assert frame.series[1] == max(near.sum(axis=1)) - 1
    # Robot 3 is away at frame 20, and back at the end.
    assert 3 not in np.flatnonzero(track.frames[20].flags)
    assert 3 in np.flatnonzero(track.frames[49].flags)
    assert track.scene.clock is not None
    assert track.scene.clock.step == pytest.approx(0.1)


def test_long_records_are_played_in_fewer_frames() -> None:
    track = team_of(table_of(frames=7001)).play(Choice())
    assert track.scene.every == 3
    assert [frame.time for frame in track.frames[:3]] == [0.0, 3.0, 6.0]


def test_it_says_what_it_understood() -> None:
    facts = dict(team_of(table_of()).facts())
    assert facts["Robots"] == "4: 0, 1, 2, 3"
    assert facts["Positions"] == "800"
    assert facts["Rate"].startswith("a position every 0.1 (10 a second, if times are seconds)")
    assert facts["Duration"].startswith("19.9, time 0 to 19.9")
    assert facts["Gaps"] == "none longer than 0.5"
    assert facts["Clocks"] == "robots start together"
    assert "if positions are in metres and times in seconds" in facts["Units"]


def test_gaps_other_clocks_and_other_rates_are_named() -> None:
    table = table_of(robots=4, frames=400)
    gap = table.query("not 10 <= time < 15")
    assert dict(team_of(gap).facts())["Gaps"].startswith("1 in which no robot has a position (up to 5.1)")
    single = table.query("not (robot == 2 and 10 <= time < 15)")
    assert dict(team_of(single).facts())["Gaps"] == "1 of single robots (longest 5.1, robot 2)"
    other = table.assign(time=table["time"] + 7.0 * (table["robot"] == 1))
    assert dict(team_of(other).facts())["Clocks"] == "robot 1 starts 7 after the others (their median)"
    assert any(text.startswith("Check the clocks") for text in team_of(other).answer(Choice())["cautions"])
    slow = table[(table["robot"] != 3) | (np.arange(len(table)) // 4 % 4 == 0)]
    assert "(robot 3)" in dict(team_of(slow).facts())["Rate"]


@pytest.mark.parametrize(("factor", "unit"), [(1, "seconds"), (1e3, "milliseconds"), (1e9, "nanoseconds")])
def test_times_since_1970_are_recognised(factor: float, unit: str) -> None:
    table = table_of(step=0.25)
    facts = dict(team_of(table.assign(time=(1_780_000_000 + table["time"]) * factor)).facts())
    assert f"times look like {unit} since 1970 and begin on 2026-05-28" in facts["Units"]
    assert "(4 a second)" in facts["Rate"]


def test_names_are_short_and_text_and_marks_of_other_programs_do_no_harm() -> None:
    rows = "".join(f"{t},{robot},{t / 10},{t % 3}\r\n" for t in range(20) for robot in ("é", "n" * 200))
    content = f"\ufefftime,robot,x,y\r\n{rows}".encode()
    track = recorded.read_recorded("a.csv", content=content).play(Choice())
    assert [slot.name for slot in track.scene.slots] == ["é", f"{'n' * 39}…"]
    old = recorded.read_recorded("a.csv", content=content[3:].decode().encode("latin-1"))
    assert dict(old.facts())["Robots"].startswith("2: \ufffd, nnn")


def test_a_robot_whose_last_position_is_held_is_named() -> None:
    table = table_of()
    assert "Standing" not in dict(team_of(table).facts())
    lost = (table["robot"] == 2) & (table["time"] > 10)
    last = table[(table["robot"] == 2) & ~lost].iloc[-1]
    held = table.assign(x=table["x"].mask(lost, last["x"]), y=table["y"].mask(lost, last["y"]))
    assert dict(team_of(held).facts())["Standing"] == "robot 2 keeps exactly one position for 9.9: is it lost by the tracking?"
    # One that never moves is a charging place, or is switched off.
    still = table.assign(x=table["x"].mask(table["robot"] == 2, 1.0), y=table["y"].mask(table["robot"] == 2, 1.0))
    assert "Standing" not in dict(team_of(still).facts())


def test_columns_that_are_not_read_are_named() -> None:
    assert "Not read" not in dict(team_of(table_of()).facts())
    table = table_of().assign(z=3.0, type="rover").reset_index(names="")
    assert dict(team_of(table).facts())["Not read"] == "z, type"


@pytest.mark.parametrize("unit", [1e-6, 1e-5, 1e-3, 1.0, 1e5])
def test_a_guessed_range_is_a_round_number(unit: float) -> None:
    table = table_of()
    guess = team_of(table.assign(x=unit * table["x"], y=unit * table["y"])).guess
    assert len(f"{guess!r}".replace("0", "").replace(".", "").split("e")[0]) == 1


def test_a_guessed_range_is_called_a_guess() -> None:
    team = team_of(table_of())
    assert team.guess in (0.5, 1.0, 2.0)
    assert "is a guess" in team.answer(Choice())["cautions"][0]
    assert not any("guess" in text for text in team.answer(Choice(awareness_range=team.guess))["cautions"])


def test_a_record_of_one_observation_says_what_is_known_and_what_is_needed() -> None:
    team = team_of(table_of(speed=0.07))
    answer = team.answer(Choice(awareness_range=1.0, risk=0.01))
    assert answer["delta"] is None
    report = team.report(Choice(awareness_range=1.0, risk=0.01))
    assert report.time_needed == pytest.approx(report.recorded * report.trials_needed / report.independent)
    assert f"needs a record of about {report.time_needed:,.0f}, and this one has {report.recorded:.3g}" in answer["seen"]
    # Of robots that never move, more of the same says nothing.
    still = table_of(speed=0.0)
    assert "needs" not in team_of(still).answer(Choice(awareness_range=1.0))["seen"]
    assert team_of(table_of(6, speed=0.15)).answer(Choice(awareness_range=1.0, risk=0.4))["seen"] == ""


def test_speeds_of_no_robot_are_a_caution() -> None:
    table = table_of()
    for second, number in ((1.0, 0), (1 / 86_400, 1), (1e3, 1)):
        cautions = team_of(table.assign(time=table["time"] * second)).answer(Choice())["cautions"]
        assert sum(text.startswith("Check the units") for text in cautions) == number, second


# Time between positions, factor of lengths, the origin, and whether positions are whole numbers.
@pytest.mark.parametrize(
    ("second", "metre", "origin", "whole", "said"),
    [
        (0.04, 0.1, 0.0, False, ""), (0.04, 1.0, 50.0, False, ""), (1.0, 0.5, 0.0, False, ""), (0.5, 0.15, -3.0, False, ""),
        (10.0, 10.0, 0.0, False, ""), (1.0, 1.0, 0.0, True, ""), (30.0, 3.0, 0.0, True, ""), (0.1, 5.0, -40.0, False, ""),
        (40.0, 3.5, 0.0, False, "times are whole numbers 40 apart, taken as seconds"), (20.0, 2.0, 9.0, False, "milliseconds"),
        (0.15, 60.0, 300.0, False, "positions are numbers"), (0.1, 40.0, 600.0, True, "positions are whole numbers"), (1.0, 90.0, 0.0, True, "pixels"),
    ],
)  # fmt: skip
def test_units_that_look_like_others_are_a_caution(second: float, metre: float, origin: float, whole: bool, said: str) -> None:
    table = table_of(10, frames=200)
    place = table[["x", "y"]] * metre + origin
    table = table.assign(time=(10 * table["time"] * second).round(9), **(place.round() if whole else place))
    cautions = [text for text in team_of(table).answer(Choice())["cautions"] if text.startswith("Check the units")]
    assert len(cautions) == bool(said), cautions
    assert all(said in text and "in the units of the file too" in text for text in cautions)


def test_each_run_is_played_and_all_count() -> None:
    table = pd.concat([table_of(run="a"), table_of(robots=3, frames=80, run="b")])
    team = team_of(table)
    assert team.runs == ["a", "b"]
    assert [len(team.play(Choice(run=run)).frames) for run in (0, 1)] == [200, 80]
    assert "run b" in team.play(Choice(run=1)).scene.title


def test_a_saved_page_plays_and_holds_the_answer(tmp_path: Any) -> None:
    team = team_of(table_of())
    name, html = team.saved(Choice(awareness_range=1.0))
    assert name == "teamsight-team.html"
    (tmp_path / name).write_text(html)
    replay = Replay.open(tmp_path / name)
    assert len(replay) == 200
    assert replay.scene.clock is not None
    assert json.dumps(team.answer(Choice(awareness_range=1.0))["answer"])[1:-1] in html


# The server.


def test_the_first_file_is_shown_and_settings_act(page: LivePage) -> None:
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": ""}))
        assert heard(socket, "record")["name"] == "first.csv"
        first = heard(socket, "answer")
        assert first["choice"]["awareness_range"] == 1.0
        heard(socket, "track")
        chosen = {**first["choice"], "risk": 0.2}
        socket.send(json.dumps({"type": "choose", **chosen}))
        assert heard(socket, "answer")["choice"] == chosen
        # Another range has other links, so that its frames follow.
        socket.send(json.dumps({"type": "choose", **chosen, "awareness_range": 0.3}))
        heard(socket, "answer")
        assert heard(socket, "track")["scene"]["slots"][0]["awareness_range"] == 0.3
        socket.send(json.dumps({"type": "save"}))
        assert heard(socket, "recording")["name"] == "teamsight-first.html"


def test_a_file_is_sent_and_opened_by_its_key(page: LivePage) -> None:
    content = table_of(robots=7).to_csv(index=False).encode()
    assert len(content) > 3 * MOST_BYTES
    with opened(page) as socket:
        send(socket, content)
        key = heard(socket, "kept")["key"]
        assert dict(heard(socket, "record")["facts"])["Robots"].startswith("7:")
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": key}))
        assert heard(socket, "record")["name"] == "sent.csv"


def test_a_file_in_disorder_is_sorted_and_says_so(page: LivePage) -> None:
    with opened(page) as socket:
        for table, number in ((table_of(), 0), (table_of().iloc[::-1], 4 * 199)):
            send(socket, table.to_csv(index=False).encode())
            heard(socket, "kept")
            facts = dict(heard(socket, "record")["facts"])
            assert facts.get("Sorted by time", "times went back 0 times").startswith(f"times went back {number:,} times")
            assert "goes back" not in heard(socket, "answer")["answer"]
            heard(socket, "track")


def test_the_oldest_file_makes_room_but_not_the_first(page: LivePage) -> None:
    content = table_of(frames=20).to_csv(index=False).encode()
    keys = []
    with opened(page) as socket:
        for _ in range(recorded.MOST_KEPT + 1):
            send(socket, content)
            keys.append(heard(socket, "kept")["key"])
            for kind in ("record", "answer", "track"):
                heard(socket, kind)
        socket.send(json.dumps({"type": "open", "key": keys[0]}))
        assert "drop it on the page again" in heard(socket, "error")["message"]
        for key in (keys[1], ""):
            socket.send(json.dumps({"type": "open", "key": key}))
            for kind in ("record", "answer", "track"):
                heard(socket, kind)


_ROWS = "time,robot,x,y\n"
_BAD: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "the file is empty"),
    "nonsense": (b"hello\nthere, friend\n", "columns time, robot, x, y"),
    "columns": (b"t,robot,x,y\n0,1,2,3\n", "no column 'time'"),
    "near": (b"time,robot,X,y\n0,1,2,3\n", "rename 'X' to 'x'"),
    "header": (_ROWS.encode(), "no rows"),
    "picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(range(256)) * 40, "columns time, robot, x, y"),
    "one robot": ((_ROWS + "0,a,1,1\n1,a,1,2\n").encode(), "at least 2 robots"),
    "one time": ((_ROWS + "0,a,1,1\n0,b,1,2\n").encode(), "bad.csv: every robot has a single sample"),
    "blank": (b"\n\n  \n", "blank lines only"),
    "json": (b'[{"time": 0, "robot": 1, "x": 2, "y": 3}]', "bad.csv: is JSON; write a CSV"),
    "nan": ((_ROWS + "0,a,1,1\n0,b,2,\n1,a,1,1\n1,b,2,1\n").encode(), "y is missing in row 2"),
    "infinite": ((_ROWS + "0,a,1,1\n0,b,2,inf\n1,a,1,1\n1,b,2,1\n").encode(), "row 2"),
    "twice": ((_ROWS + "0,a,1,1\n0,a,1,1\n1,a,1,1\n1,b,2,1\n").encode(), "twice at time 0"),
    "dates": ((_ROWS + "2026-01-01,a,1,1\n2026-01-02,a,1,1\n").encode(), "must be a number"),
    "semicolons": (b"time;robot;x;y\n0;1;2;3\n", "separated by commas"),
    "binary": (bytes(range(256)) * 8, ""),
    "words": ((_ROWS + "0,a,left,1\n").encode(), "must be a number"),
}


@pytest.mark.parametrize("name", _BAD)
def test_bad_files_are_refused_and_the_page_goes_on(page: LivePage, name: str) -> None:
    (content, reason), choice = _BAD[name], {}
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": ""}))
        for kind in ("record", "answer", "track"):
            choice = heard(socket, kind).get("choice", choice)
        socket.send(json.dumps({"type": "file", "name": "bad.csv", "size": len(content)}))
        if content:
            heard(socket, "send")
            for at in range(0, len(content), MOST_BYTES):
                socket.send(content[at : at + MOST_BYTES])
        said = heard(socket, "error")["message"]
        assert reason in said
        assert "\n" not in said
        assert "Traceback" not in said
        # The file of before is still that of this page.
        socket.send(json.dumps({"type": "choose", **choice, "risk": 0.5}))
        assert heard(socket, "answer")["robots"] == 4


@pytest.mark.parametrize(
    ("name", "size", "reason"),
    [
        ("picture.png", 100, "drop a .csv"),
        ("team.txt", 100, "rename it to .csv"),
        ("team.csv.gz", 100, "drop a .csv"),
        ("/etc/passwd", 100, "passwd: is not a CSV file"),
        ("big.csv", recorded.MOST_FILE + 1, "teamsight watch --trajectories"),
    ],
)
def test_other_and_larger_files_are_refused_before_they_are_sent(page: LivePage, name: str, size: int, reason: str) -> None:
    with opened(page) as socket:
        socket.send(json.dumps({"type": "file", "name": name, "size": size}))
        assert reason in heard(socket, "error")["message"]
        socket.send(b"time,robot\n")
        assert "before its name and size" in heard(socket, "error")["message"]


def test_a_file_that_is_longer_than_it_says_is_refused(page: LivePage) -> None:
    with opened(page) as socket:
        socket.send(json.dumps({"type": "file", "name": "a.csv", "size": 10}))
        heard(socket, "send")
        socket.send(b"x" * 20)
        assert "longer than it was said to be" in heard(socket, "error")["message"]


def test_the_name_of_a_file_opens_nothing(page: LivePage, tmp_path: Any) -> None:
    table_of(robots=9).to_csv(tmp_path / "other.csv", index=False)
    with opened(page) as socket:
        send(socket, table_of(robots=5).to_csv(index=False).encode(), str(tmp_path / "other.csv"))
        heard(socket, "kept")
        record = heard(socket, "record")
        assert record["name"] == "other.csv"
        assert dict(record["facts"])["Robots"].startswith("5:")
        heard(socket, "answer"), heard(socket, "track")
        socket.send(json.dumps({"type": "open", "key": str(tmp_path / "other.csv")}))
        assert "no longer" in heard(socket, "error")["message"]


@pytest.mark.parametrize(
    "message",
    [
        {"type": "choose", "awareness_range": 0, "range_shape": "disc", "risk": 0.1, "window": None, "run": 0},
        {"type": "choose", "awareness_range": 1, "range_shape": "ball", "risk": 0.1, "window": None, "run": 0},
        {"type": "choose", "awareness_range": 1, "range_shape": "disc", "risk": 2, "window": None, "run": 0},
        {"type": "choose", "awareness_range": 1, "range_shape": "disc", "risk": 0.1, "window": -1, "run": 0},
        {"type": "choose", "awareness_range": 1e-9, "range_shape": "disc", "risk": 0.1, "window": None, "run": 0},
        {"type": "choose", "awareness_range": 1, "range_shape": "disc", "risk": 0.1, "window": 1e9, "run": 0},
        {"type": "file", "name": 5, "size": 1},
        {"type": "read", "path": "/etc/passwd"},
        {"type": "run"},
    ],
)
def test_what_cannot_be_chosen_is_said(page: LivePage, message: dict[str, Any]) -> None:
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": ""}))
        for kind in ("record", "answer", "track"):
            heard(socket, kind)
        socket.send(json.dumps(message))
        heard(socket, "error")
        socket.send(json.dumps({"type": "save"}))
        heard(socket, "recording")


@pytest.mark.parametrize("page", [{"token": "abcdefgh"}], indirect=True)
def test_the_socket_needs_the_token_and_the_origin(page: LivePage) -> None:
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": ""}))
        heard(socket, "record")
    base = page.url.partition("?")[0]
    for url, origin in [
        (base + "recorded-socket", base.rstrip("/")),
        (base + "recorded-socket?token=abcdefgh", "http://evil.example"),
    ]:
        with pytest.raises(InvalidStatus) as error:
            connect(url.replace("http", "ws"), origin=origin, proxy=None)
        assert error.value.response.status_code == 403


def test_without_worlds_there_is_no_socket_for_them(page: LivePage) -> None:
    with pytest.raises(InvalidStatus) as error:
        opened(page, "socket")
    assert error.value.response.status_code == 404


def test_the_page_of_a_world_takes_files_too() -> None:
    with watch(parameters={"robots": 2, "targets": 2}, running=False, port=0, browser=False, wait=False) as live:
        with opened(live) as socket:
            socket.send(json.dumps({"type": "open", "key": ""}))
            heard(socket, "empty")
            send(socket, table_of().to_csv(index=False).encode())
            heard(socket, "kept")
        with opened(live, "socket") as socket:
            assert json.loads(socket.recv(timeout=_PATIENCE))["type"] == "scene"


def announce(socket: ClientConnection, size: int, name: str = "sent.csv") -> None:
    socket.send(json.dumps({"type": "file", "name": name, "size": size}))


def test_files_that_come_are_limited_in_sum_and_idle_ones_give_way(page: LivePage, monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(recorded, "time", SimpleNamespace(monotonic=lambda: now))
    part = recorded.MOST_FILE
    assert recorded.MOST_COMING == 2 * part == 64 * 2**20
    with opened(page) as one, opened(page) as two, opened(page) as three:
        for socket in (one, two):
            announce(socket, part)
            heard(socket, "send")
        announce(three, 2**20)
        said = heard(three, "error")["message"]
        assert "sent.csv: has 1.0 MiB, and other pages are sending 64.0, at most 64 in all" in said
        # A page that begins again has its own room.
        announce(one, part)
        heard(one, "send")
        now = 61.0
        one.send(b"time,")
        # The server has taken it.
        one.send(json.dumps({"type": "nothing"}))
        heard(one, "error")
        announce(three, 2**20)
        heard(three, "send")
        two.send(b"time,")
        two.send(b"time,")
        assert "so late (60 s) that others have its room" in heard(two, "error")["message"]
        # That is said once, and the page can begin again when there is room.
        announce(two, part)
        assert "other pages are sending 33.0" in heard(two, "error")["message"]
    with opened(page) as two:
        send(two, table_of(3).to_csv(index=False).encode())
        heard(two, "kept")


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """Let each count go on, without an end, until nobody waits for it; and note its steps."""
    found = SimpleNamespace(began=threading.Event(), ended=threading.Event(), counts=0, is_holding=True)
    report = RecordedTeam.report

    def counting(team: RecordedTeam, choice: Choice, progress: Any = lambda done, total: None) -> Any:
        found.counts += 1
        found.began.set()
        try:
            while found.is_holding:
                progress(0, 1)
                time.sleep(0.001)
        finally:
            found.ended.set()
        return report(team, choice, progress)

    monkeypatch.setattr(RecordedTeam, "report", counting)
    yield found
    found.is_holding = False


def test_a_count_ends_with_its_page_and_the_next_one_has_its_turn(page: LivePage, held: SimpleNamespace) -> None:
    with opened(page) as other:
        with opened(page) as gone, opened(page) as waiting:
            gone.send(json.dumps({"type": "open", "key": ""}))
            assert held.began.wait(_PATIENCE)
            # Both wait for their turn; one of them is closed before it comes.
            waiting.send(json.dumps({"type": "open", "key": ""}))
            waiting.send(json.dumps({"type": "nothing"}))
            heard(waiting, "error")
            other.send(json.dumps({"type": "open", "key": ""}))
            other.send(json.dumps({"type": "nothing"}))
            heard(other, "error")
            waiting.close()
            assert held.counts == 1
            assert not held.ended.is_set()
        assert held.ended.wait(_PATIENCE)
        held.is_holding = False
        for kind in ("record", "answer", "track"):
            heard(other, kind)
        assert held.counts == 2
    end = time.monotonic() + _PATIENCE
    while page._server._desk.pages:
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_count_ends_where_its_page_opens_another_file(page: LivePage, held: SimpleNamespace) -> None:
    content = table_of(3).to_csv(index=False).encode()
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": ""}))
        assert held.began.wait(_PATIENCE)
        # What is set meanwhile is of the file before; the newest of each kind is answered.
        for risk in (0.1, 0.2):
            chosen = {"awareness_range": 1.0, "range_shape": "disc", "risk": risk, "window": None, "run": 0}
            socket.send(json.dumps({"type": "choose", **chosen}))
        send(socket, content)
        assert held.ended.wait(_PATIENCE)
        held.is_holding = False
        heard(socket, "kept")
        assert heard(socket, "record")["name"] == "sent.csv"
        assert heard(socket, "answer")["robots"] == 3
        heard(socket, "track")


def test_closing_the_server_ends_a_count(page: LivePage, held: SimpleNamespace) -> None:
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": ""}))
        assert held.began.wait(_PATIENCE)
        page.close()
    assert held.ended.wait(_PATIENCE)


def test_it_closes_while_it_counts(page: LivePage, monkeypatch: pytest.MonkeyPatch) -> None:
    began, end = threading.Event(), threading.Event()

    def facts(team: RecordedTeam) -> list[tuple[str, str]]:
        began.set()
        end.wait(_PATIENCE)
        return []

    monkeypatch.setattr(RecordedTeam, "facts", facts)
    with opened(page) as socket:
        socket.send(json.dumps({"type": "open", "key": ""}))
        assert began.wait(_PATIENCE)
        page.close()
        assert not page._server.is_alive()
    end.set()


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ({"awareness_range": -1.0}, "awareness_range"),
        ({"risk": 0.0}, "risk"),
        ({"range_shape": "ball"}, "range_shape"),
        ({"host": "0.0.0.0"}, "token"),
    ],
)
def test_settings_are_checked_before_anything_is_served(how: dict[str, Any], reason: str) -> None:
    with pytest.raises((TypeError, ValueError), match=reason):
        watch_trajectories(None, port=0, browser=False, wait=False, **how)


def test_a_file_in_memory_is_read_as_one_on_disk(tmp_path: Any) -> None:
    place = tmp_path / "team.csv"
    table_of().to_csv(place, index=False)
    pd.testing.assert_frame_equal(read_trajectories(place), read_trajectories("x.csv", content=place.read_bytes()))


def test_more_robots_than_can_all_be_neighbours_are_refused() -> None:
    rows = "".join(f"{time},{robot},0,0\n" for time in (0, 1) for robot in range(2_001))
    with pytest.raises(ValueError, match="2,001 robots, and a page draws at most 2,000; give it to teamsight delta"):
        recorded.read_recorded("many.csv", content=f"time,robot,x,y\n{rows}".encode())
