"""Status: numbers of runs and the time left, whatever the clock does; nothing is written."""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from made_parts import CODE, failed_part, fill, names, part, prepared, shards, study

from teamsight.analysis.studies.folder import progress
from teamsight.analysis.studies.folder.parts import PROGRESS
from teamsight.analysis.studies.folder.progress import Heartbeat, read_progress
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.results import open_study
from teamsight.analysis.studies.standing import Status, status
from teamsight.analysis.studies.study import Until

pytestmark = pytest.mark.short


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    found = Clock()
    monkeypatch.setattr(time, "monotonic", found)
    return found


def snapshot(folder: Path) -> dict[Path, tuple[bytes, int]]:
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file()}


def test_done_failed_and_missing_add_up(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    assert status(tmp_path) == Status(12, 0, 0, 12, 0, None, None, (), (), 0, {})
    first, second, *_ = shards(plan)
    folder.write({"runs": part(plan, first)}, names(plan, first))
    folder.write({"failed": failed_part(plan, second)}, names(plan, second))
    before = snapshot(tmp_path)
    assert status(tmp_path) == Status(12, 3, 3, 6, 0, None, None, (), (), 0, {})
    assert snapshot(tmp_path) == before


def test_runs_of_other_settings_do_not_count(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    for other in (study(robots=(7, 8)), study(replicates=7)):
        fill(folder, other.plan(), 100)
    assert status(tmp_path)[:4] == (21, 21, 0, 0)


def test_a_running_sweep_is_shown_with_the_time_left(tmp_path: Path, clock: Clock) -> None:
    folder = prepared(tmp_path, study(replicates=40))
    plan = folder.study.plan()
    with folder.lock(), folder.recorded(engine="local", workers=2, code="x") as heartbeat:
        heartbeat.update(0, 120)
        assert heartbeat.seconds_left is None
        runs = next(shards(plan, 20))
        folder.write({"runs": part(plan, runs)}, names(plan, runs))
        clock.now += 10
        heartbeat.update(20, 120, running=8, made=20)
        assert heartbeat.seconds_left == 50.0
        found = StudyFolder(tmp_path)
        now = status(tmp_path)
        assert now[:5] == (120, 20, 0, 100, 8)
        assert (now.rate, now.seconds_left) == (2.0, 50.0)
        ((holder, beat),) = now.sweeps
        assert beat is not None
        assert (holder.pid, beat.engine, beat.workers) == (os.getpid(), "local", 2)
    assert status(tmp_path)[3:] == (100, 0, None, None, (), (), 0, {})
    assert found.progress[0].has_ended


def test_shards_of_an_array_are_added_up(tmp_path: Path, clock: Clock) -> None:
    folder = prepared(tmp_path, study(replicates=40))
    one, two = StudyFolder(tmp_path), StudyFolder(tmp_path)
    with contextlib.ExitStack() as stack:
        heartbeats = []
        for number, each in enumerate((one, two), 1):
            stack.enter_context(each.lock((number, 2)))
            recorded = each.recorded(engine="a", workers=1, code="x", shard=(number, 2))
            heartbeats.append(stack.enter_context(recorded))
            heartbeats[-1].update(0, 60)
        clock.now += 2
        for heartbeat, made, running in zip(heartbeats, (2, 6), (3, 4), strict=True):
            heartbeat.update(made, 60, made=made, running=running)
        found = status(tmp_path)
    assert (found.rate, found.running, found.seconds_left) == (4.0, 7, 30.0)
    assert [each.holder.shard for each in found.sweeps] == ["1/2", "2/2"]
    assert folder.done().size == 0


def test_the_rate_is_that_of_the_last_minute(tmp_path: Path, clock: Clock) -> None:
    heartbeat = Heartbeat(tmp_path / "x")
    made = 0
    for second in range(60):
        clock.now += 5
        made += 1 if second < 30 else 50
        heartbeat.update(made, 100_000, made=made)
    assert heartbeat.last.rate == pytest.approx(10)


def test_heartbeats_are_written_once_a_second(tmp_path: Path, clock: Clock) -> None:
    heartbeat = Heartbeat(tmp_path / "x")
    for number in range(100):
        heartbeat.update(number, 1000, made=number)
        found = read_progress(tmp_path / "x")
        assert found is not None
        assert found.done == number // 16 * 16
        clock.now += 1 / 16


def test_heartbeats_of_a_slow_disk_are_rarer(
    tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    writes = []

    @contextlib.contextmanager
    def slow(path: Path) -> Iterator[io.BytesIO]:
        writes.append(clock.now)
        clock.now += 0.5
        yield io.BytesIO()

    monkeypatch.setattr(progress.files, "complete", slow)
    heartbeat = Heartbeat(tmp_path / "x")
    for number in range(1000):
        heartbeat.update(number, 1000)
        clock.now += 1
    assert 5 <= len(writes) <= 11


def test_jumps_of_the_clock_change_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    noise = random.Random(5)
    # The clock of the day goes back and forth by years; that of durations stands still for a while.
    monkeypatch.setattr(time, "time", lambda: noise.uniform(0, 4e9))
    ticks = iter(1000 + (count // 7) * 0.5 for count in range(10**9))
    monkeypatch.setattr(time, "monotonic", lambda: next(ticks))
    folder = prepared(tmp_path, study(replicates=40))
    plan = folder.study.plan()
    with folder.lock(), folder.recorded(engine="local", workers=2, code="x") as heartbeat:
        done = 0
        for runs in shards(plan, 10):
            folder.write({"runs": part(plan, runs)}, names(plan, runs))
            done += len(runs)
            for path in tmp_path.rglob("*"):
                os.utime(path, (noise.uniform(0, 4e9),) * 2)
            heartbeat.update(done, plan.runs, made=done, running=5)
            found = status(tmp_path)
            assert (found.done, found.missing) == (done, plan.runs - done)
            assert found.running <= found.missing
            assert found.seconds_left is None or 0 <= found.seconds_left < 1000
    assert status(tmp_path).missing == 0


@pytest.mark.parametrize(
    "content",
    ["", "{", "[]", "null", '{"pid": 1}', '{"rate": NaN}', "[" * 5000, "\x00"],
)
def test_a_heartbeat_that_cannot_be_read_is_none(tmp_path: Path, content: str) -> None:
    folder = prepared(tmp_path)
    (tmp_path / PROGRESS).write_text(content)
    with folder.lock():
        ((_, found),) = status(tmp_path).sweeps
        assert found is None


@pytest.mark.parametrize(("name", "value"), [("rate", -1.0), ("rate", "fast"), ("done", "3"), ("rate", float("inf"))])
def test_absurd_numbers_of_a_heartbeat_are_ignored(tmp_path: Path, name: str, value: object) -> None:
    heartbeat = Heartbeat(tmp_path / "x")
    heartbeat.update(1, 2)
    assert read_progress(tmp_path / "x") is not None
    (tmp_path / "x").write_text(json.dumps(json.loads((tmp_path / "x").read_text()) | {name: value}))
    assert read_progress(tmp_path / "x") is None


@pytest.mark.parametrize(("interval", "is_complete"), [(0.5, True), (0.001, False)])
def test_an_adaptive_study_needs_what_its_runs_say(tmp_path: Path, interval: float, is_complete: bool) -> None:
    folder = prepared(tmp_path, study(until=Until(interval)))
    fill(folder, study(replicates=200).plan(), 50)
    # It was interrupted between two rounds: the heartbeat does not know that more runs are needed.
    with folder.recorded(engine="local", workers=1, code="x") as heartbeat:
        heartbeat.update(600, 600)
    found = status(tmp_path)
    assert (found.done, found.missing == 0, found.planned == 600) == (600, is_complete, is_complete)


def test_runs_beyond_what_is_needed_are_planned_and_done(tmp_path: Path) -> None:
    """Runs that an earlier version of the study wanted are there, and each number counts them."""
    folder = prepared(tmp_path, study(until=Until(0.001, limit=50)))
    fill(folder, study(replicates=50).plan(), 50)
    folder.prepare(wider := study(until=Until(9.0)), wider.plan(), code=CODE, sources={})
    assert status(tmp_path)[:4] == (150, 150, 0, 0)
    opened = open_study(tmp_path)
    assert (opened.planned, opened.done, opened.failed, opened.missing) == (150, 150, 0, 0)


def test_a_damaged_part_is_named_and_its_runs_are_missing(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    victim = next((tmp_path / "runs").iterdir())
    victim.write_bytes(b"")
    found = status(tmp_path)
    assert (found.done, found.missing) == (9, 3)
    assert [(each.name, each.reason) for each in found.damaged] == [(victim.name, "is empty")]
