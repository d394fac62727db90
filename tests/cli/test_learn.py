"""``teamsight learn``: memories are never lost, work is never made twice, and errors are one line each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis import explore as exploring
from teamsight.cli import main
from teamsight.policies.lazy_memory import LazyMemory

SMALL = ["--robots", "3", "--targets", "5", "--radius", "1.5", "--steps", "20"]


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["learn", *arguments])
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


@pytest.fixture
def small(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A memory of 60 pairs."""
    file = tmp_path / "small.safetensors"
    assert call(capsys, "explore", "--out", str(file), *SMALL)[0] == 0
    return file


@pytest.mark.parametrize("command", ["explore", "evaluate", "figure"])
def test_the_help_of_each_command_shows_examples(capsys: pytest.CaptureFixture[str], command: str) -> None:
    status, out, _ = call(capsys, command, "--help")
    assert status == 0
    assert out.count(f"  teamsight learn {command}") >= 3


@pytest.mark.short
def test_explore_writes_the_pairs_of_its_settings(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    plan = exploring.Exploration(robots=3, targets=5, radius=1.5, steps=20)
    memory = LazyMemory.load(small)
    assert memory == exploring.explore(plan)
    assert dict(memory.settings) == plan.settings()
    status, out, err = call(capsys, "explore", "--out", str(small), *SMALL)
    assert (status, err) == (0, "")
    assert "holds these pairs already: 60 pairs" in out
    options = ["--distance", "full", "--robot-speed", "0.3", "--awareness", "ring", "--delta", "8"]
    assert call(capsys, "explore", "--out", str(small), *SMALL, *options, "--force")[0] == 0
    memory = LazyMemory.load(small)
    assert (memory.action[:, 1] == 1).all()
    assert (memory.settings["robot_speed"], memory.added) == (0.3, 8)


def test_a_file_of_other_settings_is_added_to_or_replaced_only_when_told(
    capsys: pytest.CaptureFixture[str], small: Path
) -> None:
    before = small.read_bytes()
    status, out, err = call(capsys, "explore", "--out", str(small), *SMALL, "--seed", "1")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "holds 60 pairs of seed=0 (here 1); give --append to add to it, --force to replace it" in err
    assert small.read_bytes() == before
    for _ in range(2):  # what is there already is not added twice
        status, out, _ = call(capsys, "explore", "--out", str(small), *SMALL, "--seed", "1", "--append")
        assert (status, len(LazyMemory.load(small))) == (0, 120)
    status, _, err = call(capsys, "explore", "--out", str(small), *SMALL, "--seed", "2")
    assert status == 2
    assert "holds 2 explorations, not this one alone" in err
    assert call(capsys, "explore", "--out", str(small), *SMALL, "--force")[0] == 0
    assert small.read_bytes() == before


def test_merging_takes_the_pairs_of_other_files(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    both = small.with_name("both.safetensors")
    status, out, _ = call(capsys, "explore", "--out", str(both), *SMALL, "--seed", "1", "--merge", str(small))
    assert status == 0
    assert "120 pairs" in out
    # What is in two files, or would be explored again, is in the memory once.
    again = small.with_name("again.safetensors")
    options = ["--merge", str(both), "--merge", str(small)]
    assert call(capsys, "explore", "--out", str(again), *SMALL, *options)[0] == 0
    assert again.read_bytes() == both.read_bytes()
    third = small.with_name("third.safetensors")
    call(capsys, "explore", "--out", str(third), *SMALL, "--seed", "2", "--merge", str(small))
    status, _, err = call(capsys, "explore", "--out", str(again), *SMALL, "--append", "--merge", str(third))
    assert (status, err.count("\n")) == (2, 1)
    assert "holds 2 explorations, of which 1 are in another memory too; merge the files" in err
    assert again.read_bytes() == both.read_bytes()
    other = small.with_name("none.safetensors")
    status, _, err = call(capsys, "explore", "--out", str(other), *SMALL, "--awareness", "none", "--merge", str(small))
    assert (status, err.count("\n")) == (2, 1)
    assert "explore both under the same degree of awareness" in err
    assert not other.exists()


def test_an_altered_file_is_neither_used_nor_replaced(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    content = bytearray(small.read_bytes())
    content[-1] ^= 1
    small.write_bytes(content)
    for arguments in (["explore", "--out", str(small), *SMALL], ["evaluate", str(small)]):
        status, out, err = call(capsys, *arguments)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert "was altered" in err
    assert small.read_bytes() == content


def test_ctrl_c_keeps_the_parts_that_are_done(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exploring, "_NUMBERS_A_PART", 60 * 75)
    file, parts = tmp_path / "many.safetensors", tmp_path / "many.safetensors.parts"
    arguments = ["explore", "--out", str(file), *SMALL, "--runs", "9"]
    explore_part, made = exploring._explore_part, []

    def interrupted(part: exploring.Part) -> LazyMemory | None:
        if len(made) == 4:
            raise KeyboardInterrupt
        made.append(part)
        return explore_part(part)

    monkeypatch.setattr(exploring, "_explore_part", interrupted)
    status, _, err = call(capsys, *arguments)
    assert (status, err.strip()) == (130, "teamsight: interrupted; every file written so far is complete")
    assert len(list(parts.iterdir())) == 4
    assert not file.exists()
    monkeypatch.setattr(exploring, "_explore_part", explore_part)
    meet = exploring.meet
    worlds: list[int] = []
    monkeypatch.setattr(exploring, "meet", lambda *given: (worlds.append(1), meet(*given))[1])
    assert call(capsys, *arguments)[0] == 0
    assert len(worlds) == 5
    assert len(LazyMemory.load(file)) == 540
    assert not parts.exists()


def test_evaluate_tells_the_learner_beside_the_collective_one_and_a_cmommt(
    capsys: pytest.CaptureFixture[str], small: Path
) -> None:
    saved = small.with_name("runs.parquet")
    options = ["--learner", "linear", "--runs", "4", "--steps", "30", "--radius", "2", "--save", str(saved)]
    status, out, err = call(capsys, "evaluate", str(small), *options)
    assert (status, err) == (0, "")
    table = pd.read_parquet(saved)
    means = table.groupby("policy")["observed_fraction"].mean()
    for name in ("cooperative", "collective", "A-CMOMMT", "random walk"):
        assert f"{100 * means[name]:.1f} (" in next(line for line in out.splitlines() if line.strip().startswith(name))
    assert len(table) == 16
    assert (table["robots"] == 3).all()
    assert table.attrs["memory"] == LazyMemory.load(small).digest
    more = 100 * (means["cooperative"] - means["A-CMOMMT"])
    assert f"{more:+.1f} (" in out
    assert call(capsys, "evaluate", str(small), "--runs", "1", "--steps", "5", "--learner", "tabular")[0] == 0


def test_figure_writes_its_picture_and_tables(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    options = ["--samples", "30,60", "--memories", "2", "--worlds", "1", "--steps", "5", "--workers", "1"]
    status, out, err = call(
        capsys, "figure", "--out", str(tmp_path), "--learners", "tabular, linear", "--robots", "2", *options
    )
    assert (status, err) == (0, "")
    assert "learning curves in" in out
    assert out.count("less Θ(0), from 60 pairs: ") == 6
    tables = {f"learning-curves{which}.parquet" for which in ("", "-points", "-gains")}
    assert {path.name for path in tmp_path.iterdir()} == {"learning-curves.png", *tables}
    points = pd.read_parquet(tmp_path / "learning-curves-points.parquet")
    assert points.attrs["curves"]["samples"] == [30, 60]
    assert np.isfinite(points["mean"]).all()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["evalute"], ["command='evalute': unknown; did you mean 'evaluate'?"]),
        (["explore"], ["Missing option '--out'"]),
        (["evaluate"], ["Missing argument 'MEMORY'"]),
        (["explore", "--out", "x", "--awareness", "rin", "--runs", "0"], ["awareness='rin': unknown; did you mean 'ring'", "runs=0"]),
        (["explore", "--out", "x", "--policy", "a-cmomt", "--radius", "-1"], ["policy='a-cmomt': unknown", "radius=-1.0: must be"]),
        (["explore", "--out", "x", "--distance", "ful", "--robot-speed", "0"], ["distance='ful': unknown; did you mean 'full'", "robot_speed=0.0: must be"]),
        (["explore", "--out", "x", "--distance", "full", "--policy", "centroid"], ["distance=full: is for random walkers, and centroid goes"]),
        (["evaluate", "none.safetensors"], ["none.safetensors: cannot be read (No such file or directory)"]),
        (["evaluate", "x", "--learner", "deep", "--gamma", "2"], ["learner='deep': unknown", "gamma=2.0: must be a finite number"]),
        (["evaluate", "x", "--gamma", "much", "--k", "0.5"], ["gamma='much': must be a number", "k=0.5: must be a whole"]),
        (["evaluate", "x", "--learner", "linear", "--k", "3"], ["k=3: linear matches no fixed number of pairs; leave it out"]),
        (["figure", "--samples", "10,many"], ["samples='10,many': must be whole numbers, as in 150,600"]),
        (["figure", "--learners", "lazy,lasy", "--reward", "ours"], ["learner='lasy': unknown; did you mean 'lazy'", "reward='ours': unknown"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_in_one_line_each(
    capsys: pytest.CaptureFixture[str], arguments: list[str], told: list[str]
) -> None:
    status, out, err = call(capsys, *arguments)
    assert (status, out) == (2, "")
    found = err.splitlines()
    assert len(found) == len(told)
    assert all(any(line.startswith(f"teamsight: {start}") for line in found) for start in told)


def test_a_memory_too_small_for_k_and_a_team_of_another_size_are_refused(
    capsys: pytest.CaptureFixture[str], small: Path
) -> None:
    status, _, err = call(capsys, "evaluate", str(small), "--k", "61")
    assert (status, err.count("\n")) == (2, 1)
    assert "k=61: the memory has only 60 pairs" in err
    pairwise = small.with_name("pairwise.safetensors")
    call(capsys, "explore", "--out", str(pairwise), *SMALL, "--awareness", "pairwise")
    status, _, err = call(capsys, "evaluate", str(pairwise), "--robots", "4", "--runs", "2", "--steps", "2")
    assert (status, err.count("\n")) == (2, 1)
    assert "reads 20 inputs" in err
