"""A job that fails stops no other one: the results of all others are kept, and the next call makes only what failed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from teamsight.analysis.runs.checkpoint import Checkpoint, is_in_shard
from teamsight.analysis.runs.executor import Executor, JobError, emitting
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import ShardsMissingError, run_all

sys.path.insert(0, str(Path(__file__).parent))
from faults import runs_of

REST = "; the other results are kept, and the same command makes only these again"


@pytest.fixture(scope="module", params=[1, 2])
def pool(request: pytest.FixtureRequest) -> Iterator[WorkerPool]:
    with WorkerPool(request.param) as pool:
        yield pool


def made(tmp_path: Path) -> set[str]:
    """Return which runs were made since this was asked last."""
    files = list(tmp_path.glob("made-*-*"))
    for file in files:
        file.unlink()
    return {file.name.removeprefix("made-") for file in files}


def check_recovers(tmp_path: Path, runs: list[Run], failed: int, pool: Executor | None, message: str) -> None:
    """Run into the faults in the folder, then remove them and make the same call again."""
    checkpoint = Checkpoint(tmp_path / "checkpoint")
    messages: list[str] = []
    with pytest.raises(JobError, match=message) as caught, emitting(messages.append):
        run_all(runs, pool, checkpoint=checkpoint)
    assert len(str(caught.value)) < 360
    assert [text.startswith("a job failed: ") for text in messages if not text.startswith("compiling")] == [True]
    keys = [run.key for run in runs]
    assert checkpoint.count(keys) == len(runs) - failed
    for fault in tmp_path.glob("*-[0-9]"):
        fault.unlink()
    made(tmp_path)
    found = run_all(runs, pool, checkpoint=checkpoint)
    assert len(made(tmp_path)) == failed
    assert found == run_all(runs)


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("raise", r"KeyError: 'robots: 3' \(in the run robots=3, targets=2, steps=3, rng=\d\)"),
        ("leave", r"SystemExit: away \(in the run robots=3, .*\)"),
        ("array", r"Object of type int64 is not JSON serializable \(in the run robots=3, .*\)"),
    ],
)
def test_all_other_jobs_are_made_and_only_those_that_failed_are_made_again(
    tmp_path: Path, pool: WorkerPool, fault: str, reason: str
) -> None:
    (tmp_path / f"{fault}-3").touch()
    check_recovers(tmp_path, runs_of(tmp_path, 2, 3, 4), 4, pool, f"^4 of 12 jobs failed, the first: {reason}{REST}$")


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("kill", r"3 workers ended with exit code -9 in the run robots=3, .*rng=\d; if memory ran out, use fewer workers"),
        ("lambda", ".*pickle.*lambda.* … .*picklable: define functions in a module, or give workers=1"),
        ("interrupt", r"KeyboardInterrupt"),
    ],
)
def test_a_job_that_no_worker_returns_takes_no_other_with_it(tmp_path: Path, fault: str, reason: str) -> None:
    (tmp_path / f"{fault}-3").touch()
    # That which fails is not among the first.
    runs = runs_of(tmp_path, 2, seeds=22) + runs_of(tmp_path, 3, seeds=1) + runs_of(tmp_path, 4, seeds=20)
    with WorkerPool(2) as pool:
        check_recovers(tmp_path, runs, 1, pool, f"^1 of 43 jobs failed, the first: {reason}{REST}$")


def test_where_nothing_is_kept_the_first_failure_stops_all(tmp_path: Path) -> None:
    (tmp_path / "raise-3").touch()
    with pytest.raises(JobError, match=r"^KeyError: 'robots: 3' \(in the run robots=3, targets=2, steps=3, rng=0\)$"):
        run_all(runs_of(tmp_path, 3, 4, seeds=300))
    assert not any(run.startswith("4-") for run in made(tmp_path))


def test_a_failure_that_all_jobs_share_stops_them(tmp_path: Path, pool: WorkerPool) -> None:
    for robots in (3, 4):
        (tmp_path / f"raise-{robots}").touch()
    checkpoint = Checkpoint(tmp_path / "checkpoint")
    with pytest.raises(JobError, match=r"^the first 10 of 600 jobs all failed, so no others were made: KeyError.*rng=\d+\)$"):
        run_all(runs_of(tmp_path, 3, 4, seeds=300), pool, checkpoint=checkpoint)
    assert not checkpoint.path.exists()
    # The others are in the hands of workers.
    assert 10 <= len(made(tmp_path)) < 600
    with pytest.raises(JobError, match=r"^all 8 jobs failed, the first: KeyError"):
        run_all(runs_of(tmp_path, 3, 4), pool, checkpoint=checkpoint)
    with pytest.raises(JobError, match=r"^KeyError: 'robots: 3' \(in the run"):
        run_all(runs_of(tmp_path, 3, seeds=1), pool, checkpoint=checkpoint)


def test_jobs_that_are_alike_and_fail_are_not_all_jobs(tmp_path: Path, pool: WorkerPool) -> None:
    """Those that are made first are from all over the list, not the alike ones with which it begins."""
    (tmp_path / "raise-2").touch()
    check_recovers(tmp_path, runs_of(tmp_path, 2, 3, seeds=20), 20, pool, "^20 of 40 jobs failed, the first: KeyError: 'robots: 2'")


def test_what_is_kept_shows_that_jobs_need_not_fail(tmp_path: Path, pool: WorkerPool) -> None:
    checkpoint = Checkpoint(tmp_path / "checkpoint")
    run_all(runs_of(tmp_path, 2), pool, checkpoint=checkpoint)
    for seed in (3, 4):
        (tmp_path / f"raise-{seed}").touch()
    check_recovers(tmp_path, runs_of(tmp_path, 2) + runs_of(tmp_path, 3, 4, seeds=20), 40, pool, "^40 of 44 jobs failed")


@pytest.mark.parametrize("fault", ["interrupt", "wrap"])
def test_an_interrupt_stops_at_once(tmp_path: Path, fault: str) -> None:
    (tmp_path / f"{fault}-3").touch()
    with pytest.raises(KeyboardInterrupt):
        run_all(runs_of(tmp_path, 3, 4, seeds=300), checkpoint=Checkpoint(tmp_path / "checkpoint"))
    assert made(tmp_path) == {"3-0"}


def test_each_shard_of_a_job_array_makes_its_other_jobs(tmp_path: Path) -> None:
    (tmp_path / "raise-3").touch()
    # So many that each shard has some that fail.
    runs, checkpoint = runs_of(tmp_path, 2, 3, 4, seeds=24), Checkpoint(tmp_path / "checkpoint")
    for number in (1, 2):
        own = [run for run in runs if is_in_shard(run.key, (number, 2))]
        failed = sum(run.parameters["robots"] == 3 for run in own)
        assert 0 < failed < len(own)
        with WorkerPool(1) as pool, pytest.raises(JobError, match=f"^{failed} of {len(own)} jobs failed, .*{REST}$"):
            pool.shard = number, 2
            run_all(runs, pool, checkpoint=checkpoint)
    assert checkpoint.count() == 48
    (tmp_path / "raise-3").unlink()
    made(tmp_path)
    with WorkerPool(1) as pool, pytest.raises(ShardsMissingError):
        pool.shard = 1, 2
        run_all(runs, pool, checkpoint=checkpoint)
    assert run_all(runs, checkpoint=checkpoint) == run_all(runs)
