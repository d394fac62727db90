"""What a command line says twice is refused, and all that is wrong is reported at once."""

from __future__ import annotations

import pytest

from teamsight.cli.main import main

TWICE = [
    (("run", "--robots", "3", "--robots", "4"), "robots: is given 2 times, as --robots 3 and --robots 4"),
    (("run", "--awareness", "ring", "--awareness.delta", "1", "--delta", "16"), "--awareness.delta: is given as --delta too"),
    (("run", "--policy.gain", "1", "--policy-options", "gain=2"), "--policy.gain: is given by --policy-options too"),
    (("run", "--task", "cmommt", "--treatment", "explore", "--set", "treatment=skilled"), "set=treatment: is given as --treatment too"),
    (("learn", "explore", "--task", "cmommt", "--awareness", "ring", "--set", "awareness=none", "--out", "x"), "set=awareness: is given as --awareness too"),
    (("learn", "explore", "--distance", "full", "--policy.random-distance", "--out", "x"), "distance=full: is given as the option random_distance"),
    (("sweep", "--task", "pursuit", "--prey", "1", "--set", "prey=2", "--out", "x"), "set=prey: is given as --prey too"),
    (("plot", "x", "--across", "policy"), "across=policy: has no effect without --minus"),
]  # fmt: skip


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    """Return what is wrong with a command line."""
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    assert (left.value.code, out) == (2, "")
    return err.splitlines()


@pytest.mark.parametrize(("line", "message"), TWICE)
def test_what_is_given_twice_is_refused(capsys: pytest.CaptureFixture[str], line: tuple[str, ...], message: str) -> None:
    (error,) = call(capsys, *line)
    assert error.startswith(f"teamsight: {message}")


def test_an_unknown_option_hides_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    robots, task, unknown = call(capsys, "run", "--task", "pursiut", "--prey", "3", "--robots", "two")
    assert robots == "teamsight: robots='two': must be a whole number of at least 1"
    assert task.startswith("teamsight: task='pursiut': unknown; did you mean 'pursuit'?")
    assert unknown.startswith("teamsight: No such option '--prey'")
    assert unknown.endswith("; see teamsight run --help")


def test_a_missing_option_hides_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    robots, missing = call(capsys, "learn", "explore", "--robots", "0")
    assert robots == "teamsight: robots=0: must be at least 1"
    assert missing == "teamsight: Missing option '--out'; see teamsight learn explore --help"


def test_each_parameter_of_a_task_takes_several_values_in_a_sweep(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(capsys, "sweep", "--task", "pursuit", "--hunters", "2,two", "--prey", "1,x", "--out", "x") == [
        "teamsight: hunters='two': must be a whole number of at least 0",
        "teamsight: prey='x': must be a whole number of at least 0",
    ]
