"""Work that was interrupted goes on where it was, and comes to the same."""

from __future__ import annotations

import zlib
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.runs import checkpoint
from teamsight.analysis.runs import simulate as runner
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.experiment import Experiment, Run
from teamsight.analysis.runs.simulate import Outcome, Request, make_tables
from teamsight.analysis.runs.workers import WorkerPool

EXPERIMENT = Experiment("walk", {"policy": "random-walk", "awareness": "none"}, ((3, 1.0), (4, 2.0), (5, 2.0)))


def tables(kept: Checkpoint | None) -> pd.DataFrame:
    with WorkerPool(1) as pool:
        return make_tables(pool, [Request({}, [EXPERIMENT])], root=1, runs=4, steps=10, unfinished=kept)[0]["walk"]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Run]:
    """Runs in the order in which they are made, each in a chunk of its own."""
    runs: list[Run] = []

    def simulate(run: Run) -> Outcome:
        if run.steps > 1:
            runs.append(run)
            if len(runs) == 8:
                raise KeyboardInterrupt
        return original(run)

    original = runner.simulate
    monkeypatch.setattr(runner, "simulate", simulate)
    monkeypatch.setattr(runner, "_CHUNK", 1.0)
    return runs


def test_it_goes_on_where_it_was(tmp_path: Path, made: list[Run]) -> None:
    path = tmp_path / "kept"
    with pytest.raises(KeyboardInterrupt):
        tables(Checkpoint(path))
    assert len(Checkpoint(path)) == 7
    with path.open("a") as file:
        file.write('\n["half a li')
    found = tables(Checkpoint(path))
    # The eighth, which was interrupted, is made again.
    assert len(made) == 7 + 1 + 5
    pd.testing.assert_frame_equal(found, tables(None))
    kept = Checkpoint(path)
    assert len(kept) == 12
    kept.forget()
    assert not path.exists()
    kept.forget()


def test_what_is_damaged_is_made_again(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    expected = tables(Checkpoint(path))
    lines = path.read_text().split("\n")[1:]
    path.write_text("\n".join([lines[0].replace("0.", "1.", 1), "what?", *lines[2:]]))
    assert len(Checkpoint(path)) == 12 - 2
    pd.testing.assert_frame_equal(tables(Checkpoint(path)), expected)


def test_what_other_code_has_left_is_not_believed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Checkpoint(tmp_path / "kept")
    kept.add({("a",): (0.5, 3)})
    assert Checkpoint(kept.path).outcomes([("a",), ("b",)]) == {("a",): (0.5, 3)}
    monkeypatch.setattr(checkpoint, "_simulation", lambda: "another")
    assert Checkpoint(kept.path).outcomes([("a",)]) == {}


def test_all_that_simulates_counts_as_code() -> None:
    names = {"/".join(file.parts[-2:]) for file in checkpoint.sources()}
    simulating = {"teamsight/core/kernel/entry.py", "agents/engine/loop.py", "world/motion.py", "policies/handmade/a_cmommt.py"}
    assert simulating | {"learned/constants.json", "data/lazy-600.safetensors"} <= names
    assert not any(name.startswith(("tests/", "analysis/", "cli/")) for name in names)


def test_lines_of_another_form_are_skipped_though_their_sum_is_right(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept")
    kept.add({("a",): (0.5, 3)})
    texts = ["", "[]", "1", '["x",1.0]', '[["x"],1.0,2]', '["x","y",2]', '["x",1.0,null]', "[" * 100_000]
    with kept.path.open("a") as file:
        file.writelines(f"\n{text}\t{zlib.crc32(text.encode()):08x}" for text in texts)
    assert Checkpoint(kept.path).outcomes([("a",)]) == {("a",): (0.5, 3)}
    assert len(Checkpoint(kept.path)) == 1


@pytest.mark.parametrize("content", ["", "\n", "\n\nnotes", "\n[1, 2]", '\n["my own list"]', "\n[[1]]"])
def test_what_is_not_ours_stays(content: str, tmp_path: Path) -> None:
    path = tmp_path / "kept"
    path.write_text(content)
    with pytest.raises(ValueError, match="holds something else; move it away"):
        Checkpoint(path).check()


def test_our_own_is_known_again_wherever_it_was_cut_off(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept")
    kept.add({("a",): (0.5, 3), ("b",): (0.25, 2)})
    whole = kept.path.read_bytes()
    for length in range(2, len(whole) + 1):
        kept.path.write_bytes(whole[:length])
        Checkpoint(kept.path).check()
