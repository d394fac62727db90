"""A sweep makes what is missing and only that; its rows depend on the study alone."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import World, run_many
from teamsight.analysis.runs import checkpoint, processes, simulate
from teamsight.analysis.runs.executor import JobError
from teamsight.analysis.runs.processes import cores
from teamsight.analysis.studies import shard as same_code
from teamsight.analysis.studies import shard as shard_module
from teamsight.analysis.studies import sweep as sweeping
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.study import Record, Study
from teamsight.analysis.studies.sweep import Selection, sweep
from tests.analysis.studies.folders import FIXED, GRID, Engine, odd, parts, rows, same_rows, small


@pytest.fixture(autouse=True)
def _path_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))


def tiny_shards(monkeypatch: pytest.MonkeyPatch, runs: int = 1) -> None:
    """Make shards of so many runs."""
    monkeypatch.setattr(sweeping, "_MOST_RUNS", runs)


@pytest.mark.short
def test_rows_are_those_of_run_many(tmp_path: Path) -> None:
    summary = sweep(small(seed=9), tmp_path / "out")
    assert summary[1:7] == (12, 12, 12, 0, 0, ())
    expected = run_many(FIXED | GRID, replicates=3, steps=5, rng=9)
    keys = ["robots", "radius", "replicate"]
    found = rows(tmp_path / "out")[[*expected]].sort_values(keys, ignore_index=True)
    pd.testing.assert_frame_equal(found, expected.sort_values(keys, ignore_index=True), check_exact=True)


@pytest.mark.short
@pytest.mark.parametrize("size", [1, 2, 5])
def test_rows_do_not_depend_on_shards_nor_on_the_order_in_which_they_end(
    size: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = small(record=Record(steps=True, trajectories=2, events=True))
    sweep(study, tmp_path / "whole")
    tiny_shards(monkeypatch, size)
    engine = Engine()
    sweep(study, tmp_path / "out", executor=engine)
    assert max(len(shard.runs) for shard in engine.jobs) == size
    for kind in ("runs", "steps", "trajectories"):
        same_rows(tmp_path / "out", tmp_path / "whole", kind)


@pytest.mark.short
def test_shards_share_a_world_which_is_closed_after_the_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built, plain = [], World.__init__

    def build(world: World, *arguments: Any, **options: Any) -> None:
        plain(world, *arguments, **options)
        built.append(world)

    monkeypatch.setattr(World, "__init__", build)
    study = small()
    study.check()
    checked = len(built)
    sweep(study, tmp_path / "whole")
    whole = len(built) - checked
    tiny_shards(monkeypatch)
    sweep(study, tmp_path / "out")
    assert len(parts(tmp_path / "out")) == study.runs
    assert len(built) - checked - whole == whole
    assert all(world._stepper.is_closed for world in built)


@pytest.mark.short
@pytest.mark.parametrize("array", [2, 3, 20])
def test_shards_of_a_job_array(array: int, tmp_path: Path) -> None:
    sweep(small(), tmp_path / "whole")
    made = [sweep(small(), tmp_path / "out", shard=(part, array)) for part in (*range(array, 0, -1), 1)]
    assert [each.made for each in made][-1] == 0
    assert sum(each.made for each in made) == 12
    assert {each.missing for each in made} == {0}
    same_rows(tmp_path / "out", tmp_path / "whole")


@pytest.mark.short
def test_progress_counts_runs_before_their_shard_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shard_module, "_PERIOD", 0.0)
    seen: list[tuple[int, int, bool]] = []
    kept = StudyFolder(tmp_path / "out").done
    sweep(
        small(), tmp_path / "out", executor=(engine := Engine()),
        progress=lambda done, total, seconds_left: seen.append((done, kept().size, seconds_left is None)),
    )  # fmt: skip
    assert [len(shard.runs) for shard in engine.jobs] == [12]
    assert seen == [(0, 0, True), *((done, 0, False) for done in range(1, 13)), (12, 12, False)]


@pytest.mark.short
def test_an_error_of_the_progress_function_is_raised_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shard_module, "_PERIOD", 0.0)

    def show(done: int, total: int, seconds_left: float | None) -> None:
        if done:
            raise BrokenPipeError("nobody reads")

    with pytest.raises(BrokenPipeError, match="nobody reads"):
        sweep(small(), tmp_path / "out", progress=show)
    assert StudyFolder(tmp_path / "out").done().size == 12


@pytest.mark.short
def test_the_first_shards_leave_runs_for_all_workers(tmp_path: Path) -> None:
    """Whatever a slow measure makes of the expected time, which is that of CMOMMT without one."""
    sweep(small(replicates=20), tmp_path / "out", executor=(engine := Engine(size=2)))
    compiles, starts, first, *_ = engine.jobs
    assert compiles.runs
    assert not starts.runs
    assert len(first.runs) == 80 // (2 * 4)


@pytest.mark.parametrize(("runs", "array"), [((7, 4), 3), ((1, 100), 7), ((100, 1), 7), ((3, 2), 9)])
def test_shards_of_a_job_array_are_disjoint_and_about_equal(runs: tuple[int, int], array: int) -> None:
    settings, replicates = runs
    plan = Study(axes={"radius": [1.0 + 0.1 * k for k in range(settings)]}, replicates=replicates).plan()
    needed = np.full(settings, replicates)
    found = [list(Selection(plan, needed, (part, array))) for part in range(1, array + 1)]
    assert sorted(run for part in found for run in part) == sorted(Selection(plan, needed))
    sizes = [len(part) for part in found]
    assert max(sizes) - min(sizes) <= min(settings, array)
    by_setting = [list(Selection(plan, needed, (part, array), by_setting=True)) for part in range(1, array + 1)]
    homes = [{setting for setting, _ in part} for part in by_setting]
    assert sum(map(len, homes)) == settings == len(set().union(*homes))


@pytest.mark.short
def test_more_replicates_and_settings_add_parts_and_change_none(tmp_path: Path) -> None:
    sweep(small(replicates=2), tmp_path / "out")
    before = parts(tmp_path / "out")
    more = small(axes={**GRID, "robots": [1, 2, 5]}, replicates=3)
    summary = sweep(more, tmp_path / "out")
    assert (summary.made, summary.planned) == (18 - 8, 18)
    after = parts(tmp_path / "out")
    assert {name: after[name] for name in before} == before
    sweep(more, tmp_path / "whole")
    same_rows(tmp_path / "out", tmp_path / "whole")


@pytest.mark.short
def test_a_complete_study_starts_no_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep(small(), tmp_path / "out")
    monkeypatch.setattr("teamsight.analysis.runs.processes.WorkerPool", None)
    assert sweep(small(), tmp_path / "out", workers=2).made == 0


@pytest.mark.short
def test_a_changed_study_is_refused_with_the_difference(tmp_path: Path) -> None:
    sweep(small(), tmp_path / "out")
    before = parts(tmp_path / "out")
    with pytest.raises(ValueError, match="steps: 5 in the folder, 7 now"):
        sweep(small(steps=7), tmp_path / "out")
    assert parts(tmp_path / "out") == before


@pytest.mark.short
def test_changed_code_is_refused_unless_mixing_is_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep(small(), tmp_path / "out")
    monkeypatch.setattr(checkpoint, "code_digest", lambda *modules: "0123456789abcdef")
    same_code._check.cache_clear()
    more = small(replicates=4)
    with pytest.raises(ValueError, match="0123456789abcdef"):
        sweep(more, tmp_path / "out")
    assert sweep(more, tmp_path / "out", mixed_code=True).made == 4
    same_code._check.cache_clear()


def test_a_worker_with_other_code_ends_the_sweep_and_no_run_fails(tmp_path: Path) -> None:
    """The first shard reaches a worker that wants another version."""
    own = checkpoint.code_digest(*same_code.DECIDING)
    message = rf"worker: has version {own} of teamsight's code, the sweep has 0123; install the same"
    for size in (1, 2):  # with two workers, what compiles notices it first
        with pytest.raises(JobError, match=message):
            sweep(small(), tmp_path / "out", executor=Engine(code="0123", size=size))
    folder = StudyFolder(tmp_path / "out")
    assert (folder.done().size, folder.failed().size) == (0, 0)
    assert sweep(small(), tmp_path / "out").made == 12


@pytest.mark.short
def test_failed_runs_are_kept_and_made_again_only_on_demand(tmp_path: Path) -> None:
    study = odd("raising", axes={"robots": [1, 2]}, replicates=3)
    summary = sweep(study, tmp_path / "out")
    assert (summary.made, summary.done, summary.failed, summary.missing) == (6, 3, 3, 0)
    assert [text for _, text in summary.errors] == ["RuntimeError: no team of 1 in <object object at 0x…>"] * 3
    assert sweep(study, tmp_path / "out").made == 0
    again = sweep(study, tmp_path / "out", retry_failed=True)
    assert (again.made, again.done, again.failed) == (3, 3, 3)
    assert len(rows(tmp_path / "out", "failed")) == 3
    # A study itself can do what a sweep can.
    study.run(tmp_path / "out", shard=(1, 1), wait=True, mixed_code=True, retry_failed=True)
    assert StudyFolder(tmp_path / "out").sweeps[-1]["made"] == 3


@pytest.mark.short
def test_stopping_at_the_first_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tiny_shards(monkeypatch)
    study = odd("raising", axes={"robots": [1, 2, 3]}, replicates=3)
    summary = sweep(study, tmp_path / "out", on_error="stop")
    assert summary.failed == len(summary.errors) == 1
    assert summary.missing == 9 - summary.done - 1 > 0
    # What is there stays, and the same sweep goes on.
    assert sweep(study, tmp_path / "out").missing == 0


@pytest.mark.short
def test_a_run_in_which_workers_die_fails_and_the_others_of_its_shard_do_not(tmp_path: Path) -> None:
    study = small(replicates=50, axes={}, fixed={"robots": 3, "targets": 2})
    plan = study.plan()
    bad = plan.seed(0, 17)
    engine = Engine(lambda shard: any(run.seed == bad for run in shard.runs))
    summary = sweep(study, tmp_path / "out", executor=engine)
    assert (summary.done, summary.failed, summary.missing) == (49, 1, 0)
    failed = rows(tmp_path / "out", "failed").iloc[0]
    assert (failed["replicate"], failed["seed"]) == (17, bad)
    assert failed["error"] == "3 workers ended with exit code 7"
    # In pieces of an eighth: 50 runs, 7 runs, 1 run.
    assert sum(any(run.seed == bad for run in shard.runs) for shard in engine.jobs) == 3


@pytest.mark.short
def test_ctrl_c_keeps_what_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tiny_shards(monkeypatch, 2)
    seen: list[int] = []

    def interrupt(done: int, total: int, seconds_left: float | None) -> None:
        seen.append(done)
        if done == 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(small(), tmp_path / "out", progress=interrupt)
    assert seen == [0, 2, 4, 6]
    assert sweep(small(), tmp_path / "out").made == 6
    sweep(small(), tmp_path / "whole")
    same_rows(tmp_path / "out", tmp_path / "whole")


@pytest.mark.short
def test_an_interrupt_within_a_model_ends_the_sweep(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        sweep(odd("interrupting", axes={"robots": [2, 3]}), tmp_path / "out")
    # Without its lock.
    assert sweep(odd("interrupting", axes={"robots": [2, 3]}), tmp_path / "out", shard=(1, 2)).missing == 0


@pytest.mark.short
def test_odd_models_and_measures(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any) -> None:
    tiny_shards(monkeypatch)
    # A model of a user, and one that prints.
    assert sweep(odd("Own", axes={"robots": [1, 3], "radius": [2.0]}), tmp_path / "own").done == 2
    assert sweep(odd("printing", axes={"robots": [1, 3]}), tmp_path / "printing").done == 2
    assert capsys.readouterr().out.splitlines() == ["a world 1", "a world 3"]
    # A measure whose columns depend on the run.
    sweep(odd("cmommt", "other_columns", replicates=12), tmp_path / "columns")
    found = rows(tmp_path / "columns")
    assert (found["b"].isna() ^ found["c"].isna()).all()
    # A nested value.
    nested = sweep(odd("cmommt", "nested"), tmp_path / "nested")
    assert "parts={'first': 1}" in nested.errors[0][1]


def test_compilation_is_announced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulate, "_announced", False)
    lines: list[str] = []
    sweep(odd("compiling", replicates=3), tmp_path / "out", emit=lines.append)
    assert [line.split(":")[0] for line in lines] == ["compiling the simulation"]


@pytest.mark.short
def test_bad_arguments(tmp_path: Path) -> None:
    for given, message in (
        ({"on_error": "ignore"}, "on_error='ignore': .*continue"),
        ({"shard": (0, 2)}, "shard=0: must be at least 1"),
        ({"shard": (3, 2)}, "shard=3: must be at most 2"),
        ({"workers": 0}, "workers=0: must be at least 1"),
    ):
        with pytest.raises(ValueError, match=message):
            sweep(small(), tmp_path / "out", **given)  # type: ignore[arg-type]
        assert not parts(tmp_path)
    with pytest.raises(TypeError, match="takes no rng"):
        sweep(odd("without_seed"), tmp_path / "without")


@pytest.mark.short
def test_a_short_study_is_made_in_one_process_unless_workers_are_given(tmp_path: Path) -> None:
    assert processes.workers_for(sweeping.expected_seconds(small().plan(), 3)) == 1
    assert processes.workers_for(sweeping.expected_seconds(small().plan(), 10**6)) == cores()
    assert processes.workers_for(sweeping.expected_seconds(odd("Own").plan(), 1)) == cores()
    sweep(small(), tmp_path / "out", workers=None)
    assert '"engine": "in-process"' in (tmp_path / "out" / "sweeps.jsonl").read_text()


def test_the_first_shards_of_an_unknown_model_are_single_runs_and_later_ones_take_about_two_seconds() -> None:
    plan = odd("Own", axes={"robots": [2]}, replicates=1000).plan()
    common: Any = type("Common", (), {"model": "odd_models:Own"})
    shards = iter(sharder := sweeping.Sharding(plan, common, Selection(plan, np.array([1000])), 1))
    first = next(shards)
    assert len(first.runs) == 1
    sharder.measured(first, 0.02, 1)
    assert len(next(shards).runs) in (100, 101)
    # With several workers, the last ones are smaller.
    few = sweeping.Sharding(plan, common, Selection(plan, np.array([100])), 2, rate=first.cost / 0.02)
    sizes = [len(shard.runs) for shard in few]
    assert sizes[0] in (12, 13)
    assert sizes[-1] <= 5
    assert sum(sizes) == 100


def test_runs_that_fail_at_once_do_not_make_shards_that_take_long() -> None:
    plan = odd("Own", axes={"robots": [2]}, replicates=5000).plan()
    common: Any = type("Common", (), {"model": "odd_models:Own"})
    shards = iter(sharder := sweeping.Sharding(plan, common, Selection(plan, np.array([5000])), 1))
    sharder.measured(next(shards), 1e-4, 0)
    second = next(shards)
    assert len(second.runs) in (200, 201)
    # One of them has made all of the work.
    sharder.measured(second, 0.1, 1)
    third = next(shards)
    assert len(third.runs) in (20, 21)
    # Slower ones count at once.
    sharder.measured(third, 5.0, 10)
    assert len(next(shards).runs) in (4, 5)


@pytest.mark.short
def test_a_study_runs_itself_and_returns_its_results(tmp_path: Path) -> None:
    found = small().run(tmp_path / "out")
    assert found.is_complete
    assert len(found.frame) == 12
    assert '"engine": "in-process", "workers": 1' in (tmp_path / "out" / "sweeps.jsonl").read_text()


@pytest.mark.short
def test_a_changed_module_of_a_study_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Of two versions within a second and of equal size, the compiled one would be taken for both.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    module = tmp_path / "parts_of_a_study.py"
    module.write_text("def measure(world, steps):\n    return {'x': world.seed_used % 7}\n")

    def made(replicates: int) -> int:
        """Import the module anew, as another process would."""
        sys.modules.pop("parts_of_a_study", None)
        study = small(record=Record("parts_of_a_study:measure"), path=tmp_path, replicates=replicates)
        return sweep(study, tmp_path / "out").made

    assert made(1) == 4
    module.write_text(module.read_text().replace("% 7", "% 8"))
    with pytest.raises(ValueError, match="by another version of module 'parts_of_a_study'"):
        made(2)


def test_a_changed_file_that_runs_read_is_refused(tmp_path: Path) -> None:
    weights = tmp_path / "weights.npz"

    def made(scale: float, replicates: int) -> int:
        np.savez(weights, degree="ring", weight_0=np.full((2, 32), scale), bias_0=np.ones(2))
        fixed = {"policy": "ppo", "policy.file": str(weights), "awareness": "ring"}
        study = Study(axes={"robots": [1, 2]}, fixed=FIXED | fixed, replicates=replicates, steps=2)
        return sweep(study, tmp_path / "out").made

    assert made(1.0, 1) == 2
    assert made(1.0, 2) == 2
    with pytest.raises(ValueError, match=r"by another version of file .*weights\.npz"):
        made(2.0, 3)
