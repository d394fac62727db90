"""``teamsight benchmark``: shows the results that ship, enters a policy beside them, and names mistakes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from teamsight.analysis import benchmark
from teamsight.cli import main

CHASE = Path(__file__).resolve().parents[2] / "examples" / "enter.py"


@pytest.fixture(autouse=True)
def _few_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark, "QUICK", 2)
    monkeypatch.setattr(benchmark, "RUNS", 2)


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        main(["benchmark", *arguments, "--workers", "1"])
    return int(left.value.code or 0)


def test_without_a_policy_it_shows_the_results(capsys: pytest.CaptureFixture[str]) -> None:
    assert call() == 0
    lines = capsys.readouterr().out.splitlines()
    teams = [one.team for one in benchmark.Results.read().standings()]
    assert len(lines) == len(teams) + 1
    assert all(team in line for team, line in zip(teams, lines[1:], strict=True))


def test_its_tables_are_no_wider_than_a_terminal_and_the_answer_comes_first(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("teamsight.cli.show.Console.is_terminal", True)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    assert call("--policy", "random-walk", "--awareness", "none", "--quick") == 0
    lines = capsys.readouterr().out.splitlines()
    first = next(line for line in lines if "rank" in line)
    ranked = [one for one in benchmark.Results.read().standings() if one.rank]
    assert first.startswith(f"rank {len(ranked) + 1} of {len(ranked) + 1}: random-walk, yours observes ")
    tables = [line for line in lines if line.startswith((" 1", *benchmark.SCENARIOS))]
    assert len(tables) > len(benchmark.SCENARIOS)
    assert max(map(len, tables)) <= 80
    assert "a wider terminal also shows µs a step, transitions" in "\n".join(lines)


def test_a_policy_of_a_file_is_ranked_beside_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("--policy", f"{CHASE}:Chase", "--awareness", "none", "--quick") == 0
    lines = capsys.readouterr().out.splitlines()
    (own,) = [line for line in lines if "enter:Chase" in line and "Θ(0)" in line]
    assert 1 < int(own.split()[0]) < len(benchmark.ENTRANTS)
    for name in benchmark.SCENARIOS:
        assert any(line.startswith(f"{name} ") for line in lines)


def test_a_policy_that_ships_observes_what_the_file_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert call("--policy", "random-walk", "--policy.turn-probability", "0.05", "--awareness", "none", "--out", str(out)) == 0
    content = json.loads((out / "benchmark.json").read_text(encoding="utf-8"))
    mine, theirs = (content["teams"][name]["observed"] for name in ("random-walk, yours", "straight"))
    assert all(part == theirs[title][:2] for title, part in mine.items())
    assert {"benchmark.json", "images", "reference-results.md"} == {file.name for file in out.iterdir()}
    assert "`random-walk, yours`" in (out / "reference-results.md").read_text(encoding="utf-8")
    # The file is a reference for others.
    assert call("--reference", str(out / "benchmark.json")) == 0
    assert "random-walk, yours" in capsys.readouterr().out


def test_a_second_team_joins_the_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "two"):
        assert call("--policy", "random-walk", "--awareness", "none", "--name", name, "--out", str(tmp_path)) == 0
    assert {"one", "two"} <= benchmark.Results.read(tmp_path / "benchmark.json").teams.keys()


@pytest.mark.parametrize("counts", [[], ["many"], [10**9], None])
def test_a_damaged_reference_is_refused(counts: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content = json.loads(benchmark.REFERENCE.read_text(encoding="utf-8"))
    content["teams"]["evolved"]["observed"]["noise"] = counts
    (tmp_path / "b.json").write_text(json.dumps(content))
    assert call("--reference", str(tmp_path / "b.json")) == 2
    assert "its team 'evolved' is damaged" in capsys.readouterr().err


def test_a_team_that_ships_is_made_again(tmp_path: Path) -> None:
    assert call("--make", "straight", "--out", str(tmp_path)) == 0
    made, shipped = benchmark.Results.read(tmp_path / "benchmark.json").teams, benchmark.Results.read().teams
    assert list(made) == list(shipped)
    for name, part in shipped["straight"]["observed"].items():
        assert made["straight"]["observed"][name] == part[:2]
    assert made["evolved"] == shipped["evolved"]


def test_a_rule_for_one_robot_and_its_degree(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rule_of_mine.py").write_text("def still(percept, rng):\n    return 0.0, 0.0\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(benchmark, "RUNS", 1)
    assert call("--policy", "rule_of_mine.py:still", "--awareness", "ring", "--awareness.delta", "8", "--name", "mine") == 0
    out = capsys.readouterr().out
    assert "the policy decides in Python" in out
    assert any(line.split()[1:4] == ["mine", "Θ(1)", "24"] for line in out.splitlines())


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        (["--policy", "evolvd"], ["policy='evolvd': unknown; did you mean 'evolved'?"]),
        (["--policy", "pathlib:Path"], ["pathlib:Path"]),
        (["--policy", "none_such.py:Mine"], ["there is no file none_such.py"]),
        (["--policy", "a-cmommt", "--awareness", "rng"], ["awareness='rng': unknown; did you mean 'ring'?"]),
        (["--policy", "b-cmommt", "--awareness", "ring"], ["needs 'relayed'", "awareness='shared'", "n5-r3"]),
        (["--policy", "a-cmommt", "--policy.gain", "-1"], ["gain=-1"]),
        (["--policy", "a-cmommt", "--name", "evolved"], ["name='evolved': is a team of the results; give another name"]),
        (["--policy", "a-cmommt", "--name", "a|b"], ["name='a|b': must be one line of text"]),
        (["--name", "mine"], ["name=mine: is of a policy; give --policy"]),
        (["--quick"], ["quick=True: is of a policy"]),
        (["--make", "all"], ["make=all", "give --out"]),
        (["--make", "evolvd", "--out", "out"], ["make='evolvd': unknown; did you mean 'evolved'?"]),
        (["--policy", "evolved", "--quick", "--out", "out"], ["out=", "quick look"]),
        (["--reference", "no.json"], ["reference=no.json", "holds no results"]),
    ],
)
def test_mistakes_are_named(arguments: list[str], messages: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert call(*arguments) == 2
    err = capsys.readouterr().err
    assert all(message in err for message in messages), err


OWN = """
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.core.component import Allowed
from teamsight.policies import Action, Policy
from teamsight.policies.registry import POLICIES

class Stay(Policy):
    def __init__(self, {options}):
        self.given = gain

    def decide(self, percept, state, noise):
        count = noise.shape[1]
        assert self.given == 2, self.given
        return Action(np.zeros((count, 2)), np.zeros(count)), state

@dataclass(frozen=True)
class Wrap(Policy):
    inner: Annotated[Any, Allowed(choices=POLICIES)] = "centroid"
    draws: int = 0

    def decide(self, percept, state, noise):
        assert self.inner.turn_probability == 0.25, self.inner
        count = len(percept.sensing_range)
        return Action(np.zeros((count, 2)), np.zeros(count)), state
"""


@pytest.mark.parametrize("options", ["gain", "gain=1", "gain: float = 1.0"])
def test_options_of_a_plain_class_are_options(
    options: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    name = f"stay_{len(options)}"
    file = tmp_path / f"{name}.py"
    file.write_text(OWN.replace("{options}", options).replace("noise.shape[1]", "len(percept.sensing_range)"))
    assert call("--policy", f"{file}:Stay", "--policy.gain", "2", "--awareness", "none", "--quick") == 0
    assert f"{name}:Stay" in capsys.readouterr().out


def test_options_of_a_policy_within_a_policy_are_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "wrapping.py"
    file.write_text(OWN.replace("{options}", "gain"))
    nested = ["--policy.inner", "random-walk", "--policy.inner.turn-probability", "0.25"]
    assert call("--policy", f"{file}:Wrap", *nested, "--awareness", "none", "--quick") == 0
    assert "wrapping:Wrap" in capsys.readouterr().out


def test_a_file_whose_name_is_none_of_a_module_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "2-my-policy.py"
    file.write_text("")
    assert call("--policy", f"{file}:Mine", "--quick") == 2
    assert "'2-my-policy' is no module name; rename it, for example to _2_my_policy.py" in capsys.readouterr().err


def test_an_error_of_the_policy_says_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "raising_late.py"
    file.write_text("def rule(percept, rng):\n    return {}[0]\n\ndef far(percept, rng):\n    return float('nan'), 0.0\n")
    assert call("--policy", f"{file}:rule", "--awareness", "none", "--quick") == 2
    assert f"{file.name}:2; TEAMSIGHT_TRACEBACK=1 shows how it came there)" in capsys.readouterr().err
    # What the package refuses says why; the place is its own.
    assert call("--policy", f"{file}:far", "--awareness", "none", "--quick") == 2
    assert "TEAMSIGHT_TRACEBACK" not in capsys.readouterr().err
