"""What a command line says twice is refused, and all that is wrong is reported at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight.cli.look import RunSettings
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


def test_a_parameter_of_a_task_that_is_not_given_is_refused_with_what_is_needed(capsys: pytest.CaptureFixture[str]) -> None:
    (unknown,) = call(capsys, "sweep", "--robots", "3")
    assert unknown.endswith("; with --task NAME, the parameters of the task are options too")


def test_a_missing_option_hides_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    robots, missing = call(capsys, "learn", "explore", "--robots", "0")
    assert robots == "teamsight: robots=0: must be at least 1"
    assert missing == "teamsight: Missing option '--out'; see teamsight learn explore --help"


def test_each_parameter_of_a_task_takes_several_values_in_a_sweep(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(capsys, "sweep", "--task", "pursuit", "--hunters", "2,two", "--prey", "1,x", "--out", "x") == [
        "teamsight: hunters='two': must be a whole number of at least 0",
        "teamsight: prey='x': must be a whole number of at least 0",
    ]


POLICY = """
from teamsight.policies import Policy

class Mine(Policy):
    def __init__(self, gain: float, on: bool = True):
        self.gain, self.on = gain, on

    def decide(self, percepts, rng):
        return 0.0, 0.0
"""
OWN = [
    (("--policy.gain", "x"), "policy.gain='x': must be a number"),
    (("--policy-options", "gain=x"), "policy.gain='x': must be a number"),
    (("--policy-options", "gain=1", "--policy-options", "on=maybe"), "policy.on='maybe': must be True or False"),
    ((), "policy='policy_of_a_command:Mine': needs gain; give policy_options={'gain': …}, on a command line --policy.gain"),
]  # fmt: skip


def test_each_way_to_an_option_of_a_users_policy_checks_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "policy_of_a_command.py").write_text(POLICY)
    monkeypatch.chdir(tmp_path)
    for line, message in OWN:
        assert call(capsys, "run", "--steps", "1", "--policy", "policy_of_a_command:Mine", *line) == [f"teamsight: {message}"]


def test_truth_may_be_written_as_python_does() -> None:
    (option,) = (one for name, one in RunSettings.options().items() if name == "uniform_target_speed")
    assert [option.parsed(text) for text in ("true", "True", "false", "False")] == [True, True, False, False]


def test_a_sweep_of_a_task_refuses_a_treatment_and_an_option_of_a_policy_before_it_begins(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    line = ("sweep", "--task", "cmommt", "--steps", "2", "--out", str(tmp_path / "out"))
    assert call(capsys, *line, "--set", "treatment=explor")[0].startswith("teamsight: treatment='explor': unknown; did you mean")
    assert call(capsys, *line, "--policy.gain", "0.5,0") == ["teamsight: policy.gain=0.0: must be a finite number, above 0"]
    assert not list(tmp_path.iterdir())


DRIVE = """
from dataclasses import dataclass

from teamsight import Drive
from teamsight.core.kernel import kernel

@kernel
def glide(turn, distance, speed, is_blocked, state, parameters):
    return parameters[0] * distance, 0.0, turn

@dataclass(frozen=True)
class Glider(Drive):
    share: float
    carry = glide
"""
AVOIDING = ("--policy", "teamsight.policies:Avoiding", "--robot-radius", "0.1")
COMPONENTS = [
    ((*AVOIDING, "--policy.policy", "a-cmommt", "--policy.policy.gain", "0.5"), ""),
    ((*AVOIDING, "--policy.policy", "a-cmomt"), "policy.policy='a-cmomt': unknown; did you mean 'a-cmommt'?"),
    ((*AVOIDING, "--policy.policy", "a-cmommt", "--policy.policy.gain", "0"), "policy.policy.gain=0.0: must be a finite number, above 0"),
    ((*AVOIDING, "--policy.margin", "0.5"), "Missing option '--policy.policy'"),
    (("--drive", "car", "--drive.steering-rate", "0.1"), ""),
    (("--drive", "drive_of_a_command:Glider", "--drive.share", "0.5"), ""),
    (("--drive", "drive_of_a_command:Glider"), "drive='drive_of_a_command:Glider': needs share; give drive.share too"),
    (("--drive", "drive_of_a_command:Glidr"), "drive='drive_of_a_command:Glidr': module 'drive_of_a_command' has no 'Glidr'; did you mean"),
    (("--contact", "teamsight.world.contact:Slide", "--robot-radius", "0.1"), ""),
    (("--contact", "drive_of_a_command:glide"), "contact='drive_of_a_command:glide': must be a Contact, or one of pass, stop, slide"),
]  # fmt: skip


def test_components_are_given_by_reference_and_with_their_own_options(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "drive_of_a_command.py").write_text(DRIVE)
    monkeypatch.chdir(tmp_path)
    for line, message in COMPONENTS:
        if message:
            (error,) = call(capsys, "run", "--steps", "2", *line)
            assert error.startswith(f"teamsight: {message}")
            continue
        with pytest.raises(SystemExit) as left:
            main(["run", "--steps", "2", "--robots", "3", *line])
        assert not left.value.code
        capsys.readouterr()
