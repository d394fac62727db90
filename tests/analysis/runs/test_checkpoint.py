"""An interrupted command resumes where it was, with the same results."""

from __future__ import annotations

import importlib
import inspect
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.learning.explore import Exploration
from teamsight.analysis.papers import PAPERS, reproduction
from teamsight.analysis.papers.reproduction import PaperPlan
from teamsight.analysis.runs import checkpoint as module
from teamsight.analysis.runs import simulate
from teamsight.analysis.runs.checkpoint import Checkpoint, Codec
from teamsight.analysis.runs.experiment import Experiment, make_tables
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import OUTCOMES, Outcome, Run

EXPERIMENT = Experiment("walk", {"policy": "random-walk", "awareness": "none"}, ((3, 1.0), (4, 2.0), (5, 2.0)))
ONE = {("a",): Outcome(0.5, 3)}


def tables(kept: Checkpoint | None) -> pd.DataFrame:
    return make_tables([({}, [EXPERIMENT])], root=1, runs=4, steps=10, checkpoint=kept)[0]["walk"]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Run]:
    """Runs in the order in which they are made, each in a chunk of its own."""
    runs: list[Run] = []

    def make(run: Run, worlds: ReusedWorlds) -> Outcome:
        runs.append(run)
        if len(runs) == 8:
            raise KeyboardInterrupt
        return original(run, worlds)

    original = Run.make
    monkeypatch.setattr(Run, "make", make)
    monkeypatch.setattr(simulate, "_CHUNK", 1.0)
    return runs


def test_machines_that_share_a_folder_share_the_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs: list[Run] = []
    original = Run.make
    monkeypatch.setattr(Run, "make", lambda run, worlds: (runs.append(run), original(run, worlds))[1])
    # So many that each shard has some, whatever the digest of the code in their keys.
    whole = make_tables([({}, [EXPERIMENT])], root=1, runs=16, steps=10)[0]["walk"]
    runs.clear()
    kept, pool = Checkpoint(tmp_path / "kept", OUTCOMES), WorkerPool(1)

    def shard(number: int) -> pd.DataFrame:
        pool.shard = (number, 3)
        return make_tables([({}, [EXPERIMENT])], pool, root=1, runs=16, steps=10, checkpoint=kept)[0]["walk"]

    for number in (3, 1, 3):
        with pytest.raises(simulate.ShardsMissingError, match=rf"shard {number}/3 is made; \d+ of 48 parts are kept in "):
            shard(number)
    first = len(runs)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["kept.1-of-3", "kept.3-of-3"]
    # The last one finds all others.
    pd.testing.assert_frame_equal(shard(2), whole)
    assert len({run.key for run in runs}) == len(runs) == 48
    assert 0 < first < 48
    pool.shard = None
    again = make_tables([({}, [EXPERIMENT])], pool, root=1, runs=16, steps=10, checkpoint=kept)[0]["walk"]
    pd.testing.assert_frame_equal(again, whole)
    assert len(runs) == 48
    kept.check()
    (tmp_path / "kept.2-of-3").write_text("a letter")
    with pytest.raises(ValueError, match="kept.2-of-3: holds something else"):
        kept.check()
    (tmp_path / "kept.notes").write_text("a letter")
    kept.forget()
    assert [path.name for path in tmp_path.iterdir()] == ["kept.notes"]


def test_what_is_forgotten_is_so_in_every_shard(tmp_path: Path) -> None:
    for number, name in ((1, "a"), (2, "b")):
        Checkpoint(tmp_path / "kept", OUTCOMES, (number, 2)).add({(name,): Outcome(0.5, number)})
    kept = Checkpoint(tmp_path / "kept", OUTCOMES)
    assert kept.results([("a",), ("b",)]) == {("a",): Outcome(0.5, 1), ("b",): Outcome(0.5, 2)}
    kept.forget([("a",)])
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
    assert kept.results([("a",), ("b",)]) == {("b",): Outcome(0.5, 2)}


def test_a_command_resumes_after_an_interruption(tmp_path: Path, made: list[Run]) -> None:
    path = tmp_path / "kept"
    with pytest.raises(KeyboardInterrupt):
        tables(Checkpoint(path, OUTCOMES))
    assert Checkpoint(path).count() == 7
    with path.open("a") as file:
        file.write('\n["half a li')
    found = tables(Checkpoint(path, OUTCOMES))
    # The eighth run, which was interrupted, is made again.
    assert len(made) == 7 + 1 + 5
    pd.testing.assert_frame_equal(found, tables(None))
    kept = Checkpoint(path)
    assert kept.count() == 12
    kept.forget()
    assert not path.exists()
    kept.forget()


def test_damaged_entries_are_made_again(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    expected = tables(Checkpoint(path, OUTCOMES))
    lines = path.read_bytes().split(b"\n")
    # Lines: empty, header, content, header, content, …
    lines[2] = lines[2].replace(b"0.", b"1.", 1)
    lines[3] = b"what?"
    path.write_bytes(b"\n".join(lines))
    assert Checkpoint(path).count() == 12 - 2
    pd.testing.assert_frame_equal(tables(Checkpoint(path, OUTCOMES)), expected)


def test_entries_of_other_code_are_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Checkpoint(tmp_path / "kept", OUTCOMES)
    kept.add(ONE)
    assert kept.results([("a",), ("b",)]) == ONE
    assert (kept.count([("a",), ("b",)]), kept.count()) == (1, 1)
    monkeypatch.setattr(module, "code_digest", lambda *modules: "0123456789abcdef")
    assert kept.results([("a",)]) == {}
    assert (kept.count([("a",)]), kept.count()) == (0, 0)


def test_entries_of_other_code_do_not_outlive_the_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Checkpoint(tmp_path / "kept", OUTCOMES)
    kept.add(ONE)
    monkeypatch.setattr(module, "code_digest", lambda *modules: "0123456789abcdef")
    kept.add(ONE | {("b",): Outcome(0.25, 1)})
    kept.forget(ONE)
    assert kept.results([("a",), ("b",)]) == {("b",): Outcome(0.25, 1)}
    kept.forget([("b",)])
    assert not kept.path.exists()


def test_the_code_that_decides_every_run_is_digested() -> None:
    names = {"/".join(file.parts[-2:]) for file in module.sources()}
    assert {"kernel/entry.py", "core/checks.py", "engine/loop.py", "world/motion.py", "handmade/a_cmommt.py"} <= names
    assert {"runs/run.py", "data/lazy-600.safetensors", "data/evolved.json"} <= names
    assert not any(name.startswith(("tests/", "cli/", "paper/", "plot/", "foraging/plan.py")) for name in names)


def plans() -> Iterator[Any]:
    """Yield the plan of every paper that describes its runs one by one."""
    for paper in PAPERS.values():
        if paper.plan.planned is not PaperPlan.planned:
            yield paper.plan()


def test_the_module_of_every_measure_in_use_decides_its_runs() -> None:
    """And so does what it imports."""
    runs = [next(plan.planned())[1] for plan in plans()]
    assert len(runs) >= 5
    for run in (*runs, Exploration().all_runs[0], Run({}, 1, 1)):
        home = run.measure if inspect.isfunction(run.measure) else type(run.measure)
        found = module.sources(*module.modules_of(run.measure, run.model))
        assert Path(inspect.getfile(home)) in found, run.measure
        assert not any("figure" in file.name or "page" in file.name for file in found)
        assert run.code in run.key
    imported = module.sources("teamsight.analysis.papers.tan1993")
    assert Path(str(reproduction.__file__)) in imported


def test_an_edit_of_what_a_measure_imports_makes_another_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "measures_beside.py").write_text("STEPS = 1\n")
    text = "def measured(world, steps):\n    from measures_beside import STEPS\n    return {'steps': STEPS}\n"
    (tmp_path / "measures_of_a_test.py").write_text(text)
    measure = importlib.import_module("measures_of_a_test").measured
    before = Run({}, 1, 1, measure).key
    module.code_digest.cache_clear()
    assert Run({}, 1, 1, measure).key == before
    (tmp_path / "measures_beside.py").write_text("STEPS = 2\n")
    module.code_digest.cache_clear()
    assert Run({}, 1, 1, measure).key != before


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"1", b'["x",1.0]', b"[[1.0],2]", b"[1.0,null]", b"[1,2]", b"[" * 100_000]
)
def test_entries_of_another_form_are_ignored_though_their_checksum_is_right(content: bytes, tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept", OUTCOMES)
    Checkpoint(kept.path, Codec(bytes, bytes)).add({("b",): content})
    kept.add(ONE)
    assert kept.results([("a",), ("b",)]) == ONE


def test_content_may_be_any_bytes(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept", Codec(bytes, bytes))
    contents = {
        ("a",): b'\n["0123456789abcdef0123456789abcdef",9,"01234567"]\n',
        ("b",): b"",
        ("c",): bytes(range(256)),
    }
    kept.add(contents)
    assert kept.results(contents) == contents


@pytest.mark.parametrize("length", [10**6, 10**14])
def test_a_header_that_promises_too_much_hides_no_later_entry(length: int, tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept", OUTCOMES)
    kept.path.write_bytes(b'\n["%s",%d,"%08x"]\n[0.25,1' % (b"0" * 32, length, zlib.crc32(b"")))
    kept.add(ONE)
    assert kept.results(ONE) == ONE


@pytest.mark.parametrize("content", ["", "\n", "\n\nnotes", "\n[1, 2]", '\n["my own list"]', "\n[[1]]"])
def test_other_files_stay(content: str, tmp_path: Path) -> None:
    path = tmp_path / "kept"
    path.write_text(content)
    with pytest.raises(ValueError, match="holds something else; move it away"):
        Checkpoint(path).check()


def test_a_checkpoint_is_recognised_wherever_it_was_cut_off(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept")
    kept.add({("a",): [0.5, 3], ("b",): [0.25, 2]})
    whole = kept.path.read_bytes()
    for length in range(2, len(whole) + 1):
        kept.path.write_bytes(whole[:length])
        Checkpoint(kept.path).check()


def test_json_returns_floats_to_the_last_bit(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept")
    values = np.random.default_rng(1).random(100).tolist()
    kept.add({("a",): values})
    assert kept.results([("a",)])[("a",)] == values
