"""A shard: its tables are those of `run_many` and of the library's recorders, and depend on its runs alone."""

from __future__ import annotations

import importlib
import io
import pickle
import re
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from teamsight import CMOMMT, Failures, run_many
from teamsight.analysis.studies import shard as same_code
from teamsight.analysis.studies.shard import Shard, ShardResult, ShardRun, SourceError, died, make_shard
from teamsight.analysis.studies.study import Record, Study
from teamsight.analysis.studies.sweep import Selection, common_of

HERE = Path(__file__).parent
GRID: dict[str, Any] = {"robots": [2, 5], "radius": [2.0, 3.5]}
FIXED: dict[str, Any] = {"targets": 3, "policy": "a-cmommt"}


@pytest.fixture(autouse=True)
def _path_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))


def shard_of(study: Study) -> Shard:
    """Return all runs of a study in one shard."""
    plan = study.plan()
    runs = tuple(
        ShardRun(f"{int(plan.ids[k]):016x}", replicate, plan.seed(k, replicate), plan.parameters(k))
        for k, replicate in Selection(plan, np.full(plan.settings, study.replicates))
    )
    return Shard(common_of(study, plan.types), runs)


def odd(name: str, measure: str = "summary", **given: Any) -> Study:
    model = "cmommt" if name == "cmommt" else f"odd_models:{name}"
    measure = measure if measure == "summary" else f"odd_models:{measure}"
    return Study(**{"model": model, "record": Record(measure), "steps": 5, "path": HERE, **given})


def table(result: ShardResult, kind: str = "runs") -> pd.DataFrame:
    return pq.read_table(io.BytesIO(result.parts[kind])).to_pandas()


@pytest.mark.short
def test_runs_are_those_of_run_many() -> None:
    study = Study(fixed=FIXED, axes=GRID, replicates=3, steps=20, seed=4)
    result = make_shard(shard_of(study))
    expected = run_many(FIXED | GRID, replicates=3, steps=20, rng=4)
    found = table(result).drop(columns="setting")
    assert (result.done, result.failed) == (12, ())
    keys = ["robots", "radius", "replicate"]
    pd.testing.assert_frame_equal(
        found.sort_values(keys, ignore_index=True)[list(expected)], expected.sort_values(keys, ignore_index=True)
    )
    assert [*found] == [*FIXED, *GRID, "replicate", "seed", "steps", *expected.columns[-3:]]


def test_the_bytes_depend_on_the_runs_alone() -> None:
    shard = shard_of(Study(fixed=FIXED, axes=GRID, steps=20, record=Record(steps=True, trajectories=7, events=True)))
    first = make_shard(shard)
    assert make_shard(pickle.loads(pickle.dumps(shard))).parts == first.parts
    # Each run alone, and in the other order, gives the same rows.
    apart = [table(make_shard(shard._replace(runs=(run,)))) for run in reversed(shard.runs)]
    pd.testing.assert_frame_equal(pd.concat(apart[::-1], ignore_index=True), table(first), check_exact=True)


def test_recorded_tables_are_those_of_the_library() -> None:
    fixed = {**FIXED, "events": Failures(8.0, 4.0)}
    study = Study(
        fixed=fixed, axes={"robots": [3, 4]}, steps=30, record=Record(steps=True, trajectories=7, events=True)
    )
    shard = shard_of(study)
    result = make_shard(shard)
    for run in shard.runs:
        world = CMOMMT(**{**study.plan().components(0), "robots": run.parameters["robots"]}, rng=run.seed)
        world.recording.record_positions(7)
        world.run(30)
        expected = {
            "steps": world.recording.history.reset_index(),
            "trajectories": world.recording.trajectory,
            "events": world.events,
        }
        for kind, frame in expected.items():
            found = table(result, kind)
            mine = found[found["setting"] == run.setting].drop(columns=["setting", "replicate"])
            assert len(frame)
            pd.testing.assert_frame_equal(
                mine.reset_index(drop=True), frame, check_dtype=False, check_exact=True
            )  # fmt: skip


@pytest.mark.short
def test_types_of_columns() -> None:
    study = odd("cmommt", "numbers", axes={"robots": [1, 2], "radius": [2, 3.5]}, replicates=2, fixed={"delta": 4})
    schema = pq.read_schema(io.BytesIO(make_shard(shard_of(study)).parts["runs"]))
    types = {field.name: field.type for field in schema}
    assert types == {
        "setting": pa.string(), "delta": pa.int64(), "robots": pa.int64(), "radius": pa.float64(),
        "replicate": pa.int64(), "seed": pa.int64(), "steps": pa.int64(), "observed": pa.float64(),
        "steps_made": pa.int64(), "is_even": pa.bool_(), "word": pa.string(), "perhaps": pa.float64(),
    }  # fmt: skip
    plain = pq.read_table(io.BytesIO(make_shard(shard_of(odd("cmommt", "plain"))).parts["runs"]))
    found = plain.select(["ticks", "is_even", "word", "nothing"])
    assert [field.type for field in found.schema] == [pa.float64(), pa.float64(), pa.string(), pa.float64()]
    assert found.to_pylist()[0]["word"] == "ü"


@pytest.mark.short
def test_a_run_that_raises_is_a_row_with_its_error() -> None:
    study = odd("raising", axes={"robots": [2, 1, 3]}, fixed={"bad": 1}, replicates=2)
    shard = shard_of(study)
    result = make_shard(shard)
    assert result.done == 4
    failed = table(result, "failed")
    runs = [run for run in shard.runs if run.parameters["robots"] == 1]
    assert list(failed["run"]) == [run.id for run in runs] == [name for name, _ in result.failed]
    assert list(failed["seed"]) == [run.seed for run in runs]
    error = "RuntimeError: no team of 1 in <object object at 0x…>"
    assert set(failed["error"]) == {error} == {text for _, text in result.failed}
    trace = failed["traceback"][0]
    assert "in raising" in trace
    assert "0x…" in trace
    assert [*failed] == ["run", "setting", "bad", "robots", "replicate", "seed", "steps", "error", "traceback"]


@pytest.mark.parametrize(
    ("model", "measure", "error"),
    [
        ("no_world", "summary", "model returned 2: must return a World"),
        ("leaving", "summary", "SystemExit: enough"),
        ("cmommt", "nested", "measure returned parts={'first': 1}: must be a number, a text, True, False or None; give its parts as columns"),
        ("cmommt", "taken", "measure returned 'replicate': the table has this column; take another name"),
    ],
)  # fmt: skip
def test_what_fails(model: str, measure: str, error: str) -> None:
    robots = [2] if model != "leaving" else [3]
    result = make_shard(shard_of(odd(model, measure, axes={"robots": robots})))
    assert [text[: len(error)] for _, text in result.failed] == [error]
    assert "runs" not in result.parts


def test_a_component_that_cannot_be_made_fails_its_runs_only() -> None:
    policies = ["a-cmommt", {"use": "teamsight.policies.handmade.a_cmommt:ACmommt", "no_such": 1}]
    result = make_shard(shard_of(Study(axes={"policy": policies}, fixed={"robots": 2, "targets": 2}, steps=3)))
    assert result.done == 1
    assert "no_such" in result.failed[0][1]


@pytest.mark.short
def test_missing_columns_are_null_and_two_types_are_refused() -> None:
    result = make_shard(shard_of(odd("cmommt", "other_columns", replicates=12)))
    found = table(result)
    assert set(found["a"]) == {1.0}
    assert (found["b"].isna() ^ found["c"].isna()).all()
    assert found["b"].isna().any()
    assert found["c"].isna().any()


def test_a_run_whose_measure_has_another_type_fails_alone() -> None:
    shard = shard_of(odd("cmommt", "other_types", replicates=12))
    result = make_shard(shard)
    assert result.done
    assert result.done + len(result.failed) == 12
    for _, error in result.failed:
        assert re.fullmatch(r"measure 'a' is a (text|number) in this run and a (text|number) in others; .*", error)
    # What other parts have decides before the first run of the shard does.
    others = {"text": "number", "number": "text"}[result.kinds["a"] or ""]
    again = make_shard(shard._replace(common=shard.common._replace(kinds={"a": others})))
    assert (again.done, again.kinds["a"]) == (len(result.failed), others)


def test_a_detail_of_an_event_of_another_type_fails_its_run_alone() -> None:
    study = odd("cmommt", "logging_types", replicates=12, record=Record("odd_models:logging_types", events=True))
    result = make_shard(shard_of(study))
    assert 0 < result.done < 12
    assert all("detail 'what_it_was' of an event is" in error for _, error in result.failed)
    assert len(result.failed) == 12 - result.done


def test_a_detail_of_events_that_only_some_runs_have() -> None:
    study = odd("cmommt", "logging_at_times", replicates=12, record=Record("odd_models:logging_at_times", events=True))
    result = make_shard(shard_of(study))
    assert (result.done, result.failed, result.kinds["events/word"]) == (12, (), "text")
    words = table(result, "events")["word"]
    assert set(words.dropna()) == {"odd"}
    assert words.isna().any()


def test_details_of_events_have_one_type_in_all_parts() -> None:
    study = odd("cmommt", "logging", replicates=2, record=Record("odd_models:logging", events=True))
    events = pq.read_table(io.BytesIO(make_shard(shard_of(study)).parts["events"]))
    types = {field.name: field.type for field in events.schema}
    assert (types["steps"], types["share"], types["word"]) == (pa.float64(), pa.float64(), pa.string())
    assert (types["agent"], types["tick"]) == (pa.int64(), pa.int64())


@pytest.mark.short
def test_an_interrupt_ends_the_shard_but_fails_the_run_where_interrupts_are_ignored() -> None:
    shard = shard_of(odd("interrupting", axes={"robots": [2, 3]}))
    with pytest.raises(KeyboardInterrupt):
        make_shard(shard)
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        result = make_shard(shard)
    finally:
        signal.signal(signal.SIGINT, before)
    assert (result.done, [text for _, text in result.failed]) == (1, ["KeyboardInterrupt"])


@pytest.mark.short
def test_other_code_is_refused() -> None:
    shard = shard_of(odd("Own", axes={"robots": [2]}))
    own = shard.common.code
    with pytest.raises(SourceError, match=f"version {own} of teamsight's code, the sweep has 0123; install the same"):
        make_shard(shard._replace(common=shard.common._replace(code="0123")))
    assert "odd_models" in shard.common.sources
    digest = shard.common.sources["odd_models"]
    other = shard.common._replace(sources={"odd_models": "4567"})
    with pytest.raises(SourceError, match=f"version {digest} of module 'odd_models', the sweep has 4567; give all"):
        make_shard(shard._replace(common=other))


def test_the_digest_of_a_module_is_that_of_the_code_that_this_process_has(tmp_path: Path) -> None:
    sys.path.insert(0, str(tmp_path))
    module = tmp_path / "changing_part_of_a_study.py"
    module.write_text("x = 1\n")
    imported = importlib.import_module("changing_part_of_a_study")
    before = same_code.source_digests(["changing_part_of_a_study"])
    module.write_text("x = 2_000\n")
    with pytest.raises(ValueError, match=r"module 'changing_part_of_a_study' .* was edited after it was imported"):
        same_code.source_digests(["changing_part_of_a_study"])
    importlib.reload(imported)
    assert same_code.source_digests(["changing_part_of_a_study"]) != before
    assert same_code.source_digests(["no_such_part_of_a_study"]) == {"no_such_part_of_a_study": "no file"}


def test_runs_of_a_shard_that_no_worker_survived() -> None:
    shard = shard_of(Study(fixed=FIXED, axes=GRID))
    result = died(shard, "the worker ended")
    assert (result.done, len(result.failed)) == (0, 4)
    assert set(table(result, "failed")["error"]) == {"the worker ended"}


@pytest.mark.parametrize(
    ("measure", "error"),
    [("speechless", "SpeechlessError: (its message cannot be shown)"), ("exiting", "GeneratorExit"),
     ("ringing", r"red: \x1b[31m, bell: \x07"),
     ("half_a_character", r"measure returned the name 'a\ud800': has half a character, which no file can hold; leave it "
      "out"),
     ("unnamed", "measure returned the name '': must be a text, such as 'distance'")],
)  # fmt: skip
def test_whatever_a_measure_raises_or_names_is_a_failed_run(measure: str, error: str) -> None:
    result = make_shard(shard_of(odd("cmommt", measure, fixed={"robots": 2})))
    (row,) = table(result, "failed").to_dict("records")
    assert row["error"] == error
    assert row["traceback"].replace("\n", "").isprintable()
