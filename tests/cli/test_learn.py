"""``teamsight learn``: memories are never lost, work is never made twice, and errors are one line each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.analysis.learning import explore as exploring
from teamsight.analysis.learning.plans import Curves
from teamsight.analysis.runs import simulate
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.cli import main
from teamsight.policies import GroupForces
from teamsight.policies.memory import LazyMemory

WORLD = {"robots": 3, "targets": 5, "radius": 1.5}
SMALL = ["--robots", "3", "--targets", "5", "--radius", "1.5", "--steps", "20"]


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["learn", *arguments])
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


@pytest.fixture
def small(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A memory of 60 transitions."""
    file = tmp_path / "small.safetensors"
    assert call(capsys, "explore", "--out", str(file), *SMALL)[0] == 0
    return file


@pytest.mark.parametrize("command", ["explore", "evaluate", "figure", "diagnose"])
def test_the_help_of_each_command_shows_examples(capsys: pytest.CaptureFixture[str], command: str) -> None:
    status, out, _ = call(capsys, command, "--help")
    assert status == 0
    assert out.count(f"  teamsight learn {command}") >= 3


@pytest.mark.short
def test_explore_writes_the_transitions_of_its_settings(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    plan = exploring.Exploration(world=WORLD, steps=20)
    memory = LazyMemory.load(small)
    assert memory == exploring.explore(plan)
    assert dict(memory.settings) == plan.settings()
    status, out, err = call(capsys, "explore", "--out", str(small), *SMALL)
    assert (status, err) == (0, "")
    assert "already holds these transitions: 60 transitions" in out
    options = ["--distance", "full", "--robot-speed", "0.3", "--awareness", "ring", "--delta", "8"]
    assert call(capsys, "explore", "--out", str(small), *SMALL, *options, "--force")[0] == 0
    memory = LazyMemory.load(small)
    assert (memory.action[:, 1] == 1).all()
    assert (memory.settings["robot_speed"], memory.added) == (0.3, 8)


def test_a_file_of_other_settings_is_added_to_or_replaced_only_when_reported(
    capsys: pytest.CaptureFixture[str], small: Path
) -> None:
    before = small.read_bytes()
    status, out, err = call(capsys, "explore", "--out", str(small), *SMALL, "--seed", "1")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "holds 60 transitions of seed=0 (here 1); give --append to add to it, --force to replace it" in err
    assert small.read_bytes() == before
    for _ in range(2):  # what is there already is not added twice
        status, out, _ = call(capsys, "explore", "--out", str(small), *SMALL, "--seed", "1", "--append")
        assert (status, len(LazyMemory.load(small))) == (0, 120)
    status, _, err = call(capsys, "explore", "--out", str(small), *SMALL, "--seed", "2")
    assert status == 2
    assert "holds 2 explorations, not this one alone" in err
    assert call(capsys, "explore", "--out", str(small), *SMALL, "--force")[0] == 0
    assert small.read_bytes() == before


def test_adding_wins_over_replacing(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    options = ["explore", "--out", str(small), *SMALL, "--seed", "1", "--append", "--force"]
    assert call(capsys, *options)[0] == 0
    assert len(LazyMemory.load(small)) == 120
    small.write_text("no memory")
    assert call(capsys, *options)[0] == 0
    assert len(LazyMemory.load(small)) == 60


def test_an_evaluation_does_not_replace_its_memory(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    before = small.read_bytes()
    (small.parent / "link").symlink_to(small.parent, target_is_directory=True)
    for place in (small, small.parent / "link" / small.name):
        status, _, err = call(capsys, "evaluate", str(small), "--runs", "1", "--save", str(place), "--force")
        assert status == 2
        assert "is the memory file, which would be overwritten; give another place" in err
        assert small.read_bytes() == before


def test_merging_takes_the_transitions_of_other_files(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    both = small.with_name("both.safetensors")
    status, out, _ = call(capsys, "explore", "--out", str(both), *SMALL, "--seed", "1", "--merge", str(small))
    assert status == 0
    assert "120 transitions" in out
    # What is in two files, or would be explored again, is in the memory once.
    again = small.with_name("again.safetensors")
    options = ["--merge", str(both), "--merge", str(small)]
    assert call(capsys, "explore", "--out", str(again), *SMALL, *options)[0] == 0
    assert again.read_bytes() == both.read_bytes()
    third = small.with_name("third.safetensors")
    call(capsys, "explore", "--out", str(third), *SMALL, "--seed", "2", "--merge", str(small))
    status, _, err = call(capsys, "explore", "--out", str(again), *SMALL, "--append", "--merge", str(third))
    assert (status, err.count("\n")) == (2, 1)
    assert "holds 2 explorations, of which 1 are also in another memory; merge the files" in err
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


def test_ctrl_c_keeps_the_runs_that_are_finished(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exploring, "_LONG", 60)
    monkeypatch.setattr(simulate, "_CHUNK", 1.0)
    file, kept = tmp_path / "many.safetensors", tmp_path / "many.safetensors.checkpoint"
    arguments = ["explore", "--out", str(file), *SMALL, "--runs", "9", "--workers", "1"]
    record, made = exploring.record_run, []

    def interrupted(*given: object) -> object:
        if len(made) == 4:
            raise KeyboardInterrupt
        made.append(1)
        return record(*given)

    monkeypatch.setattr(exploring, "record_run", interrupted)
    status, _, err = call(capsys, *arguments)
    message = f"240 of 540 transitions are kept in {kept}; the same command continues from there"
    assert (status, err.strip()) == (130, f"teamsight: interrupted; {message}")
    assert not file.exists()
    worlds: list[int] = []
    monkeypatch.setattr(exploring, "record_run", lambda *given: (worlds.append(1), record(*given))[1])
    assert call(capsys, *arguments)[0] == 0
    assert len(worlds) == 5
    assert len(LazyMemory.load(file)) == 540
    assert not kept.exists()
    # Without a finished run nothing is kept, and the message says so.
    monkeypatch.setattr(exploring, "record_run", interrupted)
    status, _, err = call(capsys, *arguments, "--force", "--seed", "1")
    assert (status, err.strip()) == (
        130,
        "teamsight: interrupted; nothing was kept, since no part of the exploration was finished",
    )
    assert not kept.exists()


def test_what_stands_in_the_place_of_the_checkpoint_stays(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exploring, "_LONG", 60)
    file, place = tmp_path / "mine.safetensors", tmp_path / "mine.safetensors.checkpoint"
    place.write_text("thesis")
    status, _, err = call(capsys, "explore", "--out", str(file), *SMALL, "--runs", "3")
    assert (status, "mine.safetensors.checkpoint: holds something else" in err) == (2, True)
    # A short exploration has no checkpoint.
    assert call(capsys, "explore", "--out", str(file), *SMALL)[0] == 0
    assert place.read_text() == "thesis"
    place.unlink()
    # The entries of another exploration stay, whatever is explored next.
    plan = exploring.Exploration(world=WORLD, steps=20, runs=3, seed=1)
    checkpoint = Checkpoint(place, exploring.TRANSITIONS)
    exploring.explore(plan, checkpoint=checkpoint)
    for runs in ("1", "3"):
        assert call(capsys, "explore", "--out", str(file), *SMALL, "--force", "--runs", runs, "--workers", "1")[0] == 0
    assert checkpoint.count(plan.keys) == 3
    assert checkpoint.count() == 3


def test_memories_that_cannot_be_merged_are_refused_before_the_work(
    capsys: pytest.CaptureFixture[str], small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exploring, "explore", lambda *given, **further: pytest.fail("explored in vain"))
    pairwise = ["--awareness", "pairwise"]
    other = small.with_name("other.safetensors")
    for arguments in (["--out", str(small), "--append"], ["--out", str(other), "--merge", str(small)]):
        status, _, err = call(capsys, "explore", *arguments, *SMALL, *pairwise)
        assert (status, err.count("\n")) == (2, 1)
        assert (
            "RingAwareness(delta=16) with 16 + 16 inputs, and an exploration of PairwiseAwareness() with 16 + 4" in err
        )


def test_speeds_are_those_of_the_exploration_and_reported(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    fast, both = small.with_name("fast.safetensors"), small.with_name("both.safetensors")
    call(capsys, "explore", "--out", str(fast), *SMALL, "--robot-speed", "0.5")
    tests = ["--runs", "1", "--steps", "3", "--learner", "linear"]
    assert "robot_speed = 0.5" in call(capsys, "evaluate", str(fast), *tests)[1]
    assert "robot_speed = 0.1" in call(capsys, "evaluate", str(small), *tests)[1]
    _, out, _ = call(capsys, "explore", "--out", str(both), *SMALL, "--seed", "1", "--merge", str(fast))
    assert "note: robot_speed differs between the explorations: 0.5, 0.1" in out
    out = call(capsys, "evaluate", str(both), *tests)[1]
    assert "robot_speed differs between the explorations: 0.5, 0.1" in out
    assert "robot_speed = 0.1" in out


def test_what_stands_at_out_is_named_with_its_cure(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = tmp_path / "text.safetensors"
    text.write_text("no memory at all")
    status, _, err = call(capsys, "explore", "--out", str(text), *SMALL)
    assert (status, err.count("\n")) == (2, 1)
    assert err.endswith("; give --force to replace it, or another file\n")
    for force in ([], ["--force"]):
        status, _, err = call(capsys, "explore", "--out", str(tmp_path), *SMALL, *force)
        assert (status, err.count("\n")) == (2, 1)
        assert f"out={tmp_path}: is a folder; give a file" in err
    assert call(capsys, "explore", "--out", str(text), *SMALL, "--force")[0] == 0


def test_evaluate_learns_from_a_sample(capsys: pytest.CaptureFixture[str], small: Path) -> None:
    tests = ["--runs", "1", "--steps", "3"]
    status, out, _ = call(capsys, "evaluate", str(small), "--sample", "25", *tests)
    assert (status, "\nregression on 25 transitions, reward keep\n" in out) == (0, True)
    assert "cmommt: robots = 3, targets = 15, radius = 3.0" in out
    assert "1 world of 3 steps" in out
    status, _, err = call(capsys, "evaluate", str(small), "--sample", "61", *tests)
    assert (status, "sample=61: the memory has only 60 transitions" in err) == (2, True)


def test_ctrl_c_reports_what_is_kept_of_curves(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from teamsight.analysis.learning import curves

    kept = tmp_path / "learning-curves.checkpoint"
    options = ["--samples", "30", "--memories", "1", "--worlds", "1", "--steps", "3", "--workers", "1", "--robots", "2"]
    command = ["figure", "--out", str(tmp_path), "--learners", "lazy,tabular,linear,regression", *options]
    learnt_rows, made = curves._learnt_rows, []

    def interrupted(job: curves.CurveJob) -> list[dict[str, object]]:
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(job)
        return learnt_rows(job)

    def stop(job: curves.CurveJob) -> list[dict[str, object]]:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(curves, "_learnt_rows", interrupted)
        status, _, err = call(capsys, *command)
        message = f"3 of 5 parts are kept in {kept}; the same command continues from there"
        assert (status, err.strip()) == (130, f"teamsight: interrupted; {message}")
        patch.setattr(curves, "_designed_rows", stop)
        status, _, err = call(capsys, *command, "--seed", "1")
        message = "nothing was kept, since no part of the curves was finished"
        assert (status, err.strip()) == (130, f"teamsight: interrupted; {message}")
    assert Checkpoint(kept).count() == 3
    assert call(capsys, *command)[0] == 0
    assert not kept.exists()


def test_results_of_other_settings_are_replaced_only_when_reported(
    capsys: pytest.CaptureFixture[str], small: Path, tmp_path: Path
) -> None:
    saved = tmp_path / "runs.parquet"
    tests = ["evaluate", str(small), "--steps", "3", "--learner", "linear", "--save", str(saved)]
    for runs, further, expected in (("1", [], 0), ("1", [], 0), ("2", [], 2), ("2", ["--force"], 0)):
        status, _, err = call(capsys, *tests, "--runs", runs, *further)
        assert status == expected
    assert len(pd.read_parquet(saved)) == 20
    saved.write_text("not a table")
    status, _, err = call(capsys, *tests, "--runs", "1")
    assert (status, "holds something else; give --force" in err) == (2, True)
    command = [
        "figure",
        "--out",
        str(tmp_path),
        "--learners",
        "linear,linear",
        "--worlds",
        "1",
        "--steps",
        "3",
        "--workers",
        "1",
    ]
    command += ["--samples", "20", "--robots", "2"]
    picture = tmp_path / "learning-curves.png"
    picture.write_text("my own")
    assert call(capsys, *command, "--memories", "1")[0] == 2
    assert picture.read_text() == "my own"
    picture.unlink()
    for memories, further, expected in (("1", [], 0), ("1", [], 0), ("2", [], 2), ("2", ["--force"], 0)):
        assert call(capsys, *command, "--memories", memories, *further)[0] == expected
    gains = pd.read_parquet(tmp_path / "learning-curves-gains.parquet")
    assert gains.attrs["curves"]["learners"] == ["linear"]


def test_a_quick_figure_is_small_where_nothing_was_given() -> None:
    from teamsight.cli.learn import FigureSettings

    quick, whole = (FigureSettings.read({"worlds": "7", "quick": quick}, {}).part(Curves) for quick in (True, False))
    assert (quick.samples, quick.memories, quick.worlds) == ((150, 600, 2400), 4, 7)
    assert (len(whole.samples), whole.memories, whole.worlds) == (11, 24, 7)


def test_a_table_that_would_be_too_large_is_refused_with_a_cure_of_the_command_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    shared = tmp_path / "shared.safetensors"
    call(capsys, "explore", "--out", str(shared), "--robots", "5", *SMALL[2:], "--awareness", "shared")
    status, _, err = call(capsys, "evaluate", str(shared), "--learner", "tabular", "--runs", "1")
    assert (status, err.count("\n")) == (2, 1)
    assert "a table of 3^" in err
    assert "use a degree that adds fewer inputs, or a learner without a table: LinearQ or LazyQ" in err


def test_a_degree_that_shows_no_teammates_is_refused_by_the_regression_with_a_cure(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    shared = tmp_path / "shared.safetensors"
    call(capsys, "explore", "--out", str(shared), *SMALL, "--awareness", "shared")
    status, out, err = call(capsys, "evaluate", str(shared), "--runs", "1")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "the 32 inputs of its degree of awareness, 'shared', do not show where teammates are" in err
    assert "(--awareness ring), use another learner (--learner linear)" in err


def test_robots_that_learn_nothing_are_reported_once(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    few = tmp_path / "few.safetensors"
    call(capsys, "explore", "--out", str(few), "--robots", "1", "--targets", "1", "--radius", "9", "--steps", "1")
    status, out, err = call(capsys, "evaluate", str(few), "--runs", "1", "--steps", "3", "--workers", "1")
    assert (status, "regression on 1 transition, reward keep" in out) == (0, True)
    note = "note: LazyRegression: robots will go straight on, since keep_reward is 0 for all 1 transitions; explore longer"
    assert " ".join(err.split()).count(note) == 1


def test_the_reward_is_that_of_the_learner_unless_one_is_given(
    capsys: pytest.CaptureFixture[str], small: Path, tmp_path: Path
) -> None:
    tests = ["--runs", "1", "--steps", "3", "--workers", "1"]
    for options, shown in (
        ([], "regression on 60 transitions, reward keep\n"),
        (["--learner", "linear"], "linear on 60 transitions, reward own, discount 0.7\n"),
        (["--reward", "team"], "regression on 60 transitions, reward team\n"),
        (["--learner", "linear", "--reward", "alone", "--discount", "0.2"], "linear on 60 transitions, reward alone, discount 0.2\n"),
    ):
        saved = tmp_path / "runs.parquet"
        status, out, _ = call(capsys, "evaluate", str(small), *tests, *options, "--save", str(saved), "--force")
        assert (status, f"\n{shown}" in out) == (0, True)
        assert f"reward {pd.read_parquet(saved).attrs['reward']}" in shown


def test_learn_alone_shows_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = call(capsys)
    assert (status, err) == (0, "")
    assert "  teamsight learn explore --out" in out
    for summary in ("record their transitions.", "and measure how much", "the gain from awareness."):
        assert out.count(summary) == 1


def test_evaluate_reports_the_learner_beside_the_collective_one_and_a_cmommt(
    capsys: pytest.CaptureFixture[str], small: Path
) -> None:
    saved = small.with_name("runs.parquet")
    options = ["--learner", "linear", "--runs", "4", "--steps", "30", "--radius", "2", "--save", str(saved)]
    status, out, err = call(capsys, "evaluate", str(small), *options)
    assert (status, err) == (0, "")
    table = pd.read_parquet(saved)
    means = table.groupby("policy")["observed_fraction"].mean()
    for name in ("cooperative", "collective", "A-CMOMMT", "evolved", "random walk"):
        assert f"{100 * means[name]:.1f} (" in next(line for line in out.splitlines() if line.strip().startswith(name))
    assert len(table) == 40
    assert "cooperative better by" in out
    assert table.attrs["scenario"]["robots"] == 3
    assert table.attrs["memory"] == LazyMemory.load(small).digest
    more = 100 * (means["cooperative"] - means["A-CMOMMT"])
    assert f"{more:+.1f} (" in out
    assert call(capsys, "evaluate", str(small), "--runs", "1", "--steps", "5", "--learner", "tabular")[0] == 0


def test_figure_writes_its_picture_and_tables(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    options = ["--samples", "30,60", "--memories", "2", "--worlds", "1", "--steps", "5", "--workers", "1"]
    status, out, err = call(
        capsys, "figure", "--out", str(tmp_path), "--learners", "tabular, linear", "--robots", "4,2", *options
    )
    assert (status, err) == (0, "")
    assert "learning curves in" in out
    # Two learners, and the best.
    answer, titles, *rows, _ = (line.split() for line in out.splitlines())
    assert " ".join(answer).startswith("best learner, mean of all scenarios: awareness ")
    assert " ".join(titles).endswith("Θ(1) minus Θ(0) from 60 [points]")
    assert [row[0] for row in rows if row[1] == "all"] == ["tabular", "linear", "best"]
    assert sum(row[:2] == ["2", "5"] for row in rows) == sum(row[:2] == ["4", "3"] for row in rows) == 3
    tables = {f"learning-curves{which}.parquet" for which in ("", "-gains", "-crossings")}
    assert {path.name for path in tmp_path.iterdir()} == {"learning-curves.png", *tables}
    gains = pd.read_parquet(tmp_path / "learning-curves-gains.parquet")
    assert gains.attrs["curves"]["samples"] == [30, 60]
    assert gains.attrs["curves"]["robots"] == [2, 4]
    assert np.isfinite(gains.loc[gains["transitions"] > 0, "gain"]).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["evalute"], ["command='evalute': unknown; did you mean 'evaluate'?"]),
        (["explore"], ["Missing option '--out'"]),
        (["evaluate"], ["Missing argument 'MEMORY'"]),
        (["explore", "--out", "x", "--awareness", "rin", "--runs", "0"], ["awareness='rin': unknown; did you mean 'ring'", "runs=0"]),
        (["explore", "--out", "x", "--policy", "a-cmomt", "--radius", "-1"], ["policy='a-cmomt': unknown", "radius=-1.0: must be"]),
        (["explore", "--out", "x", "--distance", "ful", "--robot-speed", "-1"], ["distance='ful': unknown; did you mean 'full'", "robot_speed=-1.0: must be"]),
        (["explore", "--out", "x", "--distance", "full", "--policy", "centroid"], ["distance=full: applies to the policy random-walk only, and policy=centroid; leave --distance out"]),
        (["evaluate", "none.safetensors"], ["none.safetensors: cannot be read (No such file or directory)"]),
        (["evaluate", "x", "--learner", "deep", "--discount", "2"], ["learner='deep': unknown", "discount=2.0: must be a finite number"]),
        (["evaluate", "x", "--discount", "much", "--k", "0.5"], ["discount='much': must be a number", "k=0.5: must be a whole"]),
        (["evaluate", "x", "--discount", "0.3"], ["discount=0.3: regression uses immediate rewards only; leave it out"]),
        (["evaluate", "x", "--k", "3"], ["k=3: regression matches no fixed number of transitions; leave it out"]),
        (["evaluate", "x", "--learner", "linear", "--k", "3"], ["k=3: linear matches no fixed number of transitions; leave it out"]),
        (["evaluate", "x", "--learner", "sheppard", "--reward", "keep"], ["reward=keep: sheppard learns while it acts"]),
        (["figure", "--learners", "sheppard", "--reward", "own", "--k", "5"], ["k=5: sheppard matches no fixed number of transitions; leave it out"]),
        (["figure", "--learners", "regression", "--discount", "0.9"], ["discount=0.9: regression uses immediate rewards only; leave it out"]),
        (["diagnose", "--learners", "regression", "--discount", "0.9"], ["discount=0.9: regression uses immediate rewards only; leave it out"]),
        (["figure", "--k", "200"], ["k=200: must be at most 128"]),
        (["figure", "--k", "20", "--samples", "10,15"], ["k=20: lazy matches so many transitions, but the memory has only 15"]),
        (["explore", "--out", "x", "--awareness", "none", "--delta", "8"], ["delta=8: awareness 'none' has no δ; leave"]),
        (["explore", "--out", "x", "--delta", "100000"], ["delta=100000: must be at most 10000; it is a number of sectors"]),
        (["figure", "--samples", "10,many"], ["samples='many': must be a whole number"]),
        (["figure", "--robots", "5,2.5"], ["robots=2.5: must be a whole number"]),
        (["figure", "--radius", "3,wide"], ["radius='wide': must be a number"]),
        (["figure", "--radius", "1,2,3,4,5,6,7"], ["radius: are 7 values, at most 6"]),
        (["diagnose", "x", "--memories", "2"], ["memories=2: with MEMORY nothing is explored; leave --memories out"]),
        (["diagnose", "none.safetensors"], ["none.safetensors: cannot be read (No such file or directory)"]),
        (["diagnose", "--samples", "5"], ["samples=5: fewer than the 10 transitions that eq. 1 matches"]),
        (["diagnose", "--samples", "10,many"], ["samples='many': must be a whole number"]),
        (["diagnose", "--learners", "sheppard"], ["learner=sheppard: moves at random now and then, and learns meanwhile; leave it out"]),
        (["diagnose", "--samples", "10000000000"], ["samples=10000000000: must be at most 10000000"]),
        (["figure", "--learners", "lazy,lasy", "--reward", "ours"], ["learners='lasy': unknown; did you mean 'lazy'", "reward='ours': unknown"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_in_one_line_each(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: list[str]
) -> None:
    status, out, err = call(capsys, *arguments)
    assert (status, out) == (2, "")
    found = err.splitlines()
    assert len(found) == len(message)
    assert all(any(line.startswith(f"teamsight: {start}") for line in found) for start in message)


def test_a_memory_too_small_for_k_and_a_team_of_another_size_are_refused(
    capsys: pytest.CaptureFixture[str], small: Path
) -> None:
    status, _, err = call(capsys, "evaluate", str(small), "--learner", "lazy", "--k", "61")
    assert (status, err.count("\n")) == (2, 1)
    assert "k=61: lazy matches so many transitions, but the memory has only 60" in err
    pairwise = small.with_name("pairwise.safetensors")
    call(capsys, "explore", "--out", str(pairwise), *SMALL, "--awareness", "pairwise")
    status, _, err = call(capsys, "evaluate", str(pairwise), "--robots", "4", "--runs", "2", "--steps", "2")
    assert (status, err.count("\n")) == (2, 1)
    assert "robots=4: awareness 'pairwise' gives 22 inputs in a team of 4, but the memory has 20" in err


def test_diagnose_explores_or_takes_samples_of_a_memory(
    capsys: pytest.CaptureFixture[str], small: Path, tmp_path: Path
) -> None:
    options = ["--k", "3", "--learners", "lazy", "--workers", "1"]
    for given, samples, count in (
        (["--memories", "2", "--samples", "20,30"], [20, 30], 2),
        ([str(small)], [60], 1),
        ([str(small), "--samples", "40"], [40], 1),
    ):
        folder = tmp_path / f"{len(given)}-{count}"
        status, out, err = call(capsys, "diagnose", *given, *options, "--out", str(folder))
        assert (status, err) == (0, "")
        assert f"diagnosis in {folder} after" in out
        assert {path.name for path in folder.iterdir()} == {"diagnosis.md", "diagnosis.parquet", "diagnosis.png"}
        table = pd.read_parquet(folder / "diagnosis.parquet")
        assert table["transitions"].unique().tolist() == table.attrs["diagnosis"]["samples"] == samples
        assert table["memory"].nunique() == count
        assert f"| matches | 32 | {samples[0]} |" in (folder / "diagnosis.md").read_text()
    status, _, err = call(capsys, "diagnose", str(small), "--samples", "20,61")
    assert status == 2
    assert err.startswith("teamsight: samples=61: the memory has only 60 transitions; give smaller samples")


def test_ctrl_c_reports_what_is_kept_of_a_diagnosis(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from teamsight.analysis.learning import diagnosis

    kept = tmp_path / "diagnosis.checkpoint"
    options = ["--samples", "20", "--k", "3", "--memories", "2", "--learners", "lazy", "--workers", "1"]
    command = ["diagnose", "--out", str(tmp_path), *options]
    rows, made = diagnosis._rows, []

    def interrupted(*given: object) -> object:
        if made:
            raise KeyboardInterrupt
        made.append(given)
        return rows(*given)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(diagnosis, "_rows", interrupted)
        status, _, err = call(capsys, *command)
        message = f"1 of 2 explorations are kept in {kept}; the same command continues from there"
        assert (status, err.strip()) == (130, f"teamsight: interrupted; {message}")
        status, _, err = call(capsys, *command, "--seed", "1")
        message = "nothing was kept, since no exploration was finished"
        assert (status, err.strip()) == (130, f"teamsight: interrupted; {message}")
    assert call(capsys, *command)[0] == 0
    assert not kept.exists()


def test_imagine_writes_constants_that_a_policy_loads(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    memory, out = tmp_path / "memory.safetensors", tmp_path / "constants.json"
    assert call(capsys, "explore", "--out", str(memory), "--runs", "4")[0] == 0
    plan = ["--generations", "2", "--population", "4", "--robots", "3", "--radius", "2,3", "--steps", "20"]
    line = ["imagine", str(memory), "--out", str(out), *plan, "--workers", "1"]
    status, shown, _ = call(capsys, *line)
    assert (status, "turn_probability = " in shown, f"constants in {out}" in shown) == (0, True, True)
    assert GroupForces.load(out) != GroupForces()
    before = out.read_bytes()
    assert call(capsys, *line)[0] == 0
    assert out.read_bytes() == before
    status, _, err = call(capsys, *line, "--seed", "1")
    assert (status, "holds results of other settings" in err, "--force" in err) == (2, True, True)


def test_imagine_says_what_it_cannot_learn_from(capsys: pytest.CaptureFixture[str], small: Path, tmp_path: Path) -> None:
    status, _, err = call(capsys, "imagine", str(small), "--out", str(tmp_path / "constants.json"))
    assert (status, "memory: " in err, "explore longer" in err) == (2, True, True)
    assert not (tmp_path / "constants.json").exists()
