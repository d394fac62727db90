"""``teamsight ceilings``: one line for each team, with intervals and the share of the way; mistakes are named."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from teamsight.cli import main

SMALL = ["--robots", "2", "--targets", "3", "--radius", "1.5", "--steps", "30", "--runs", "2"]


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        main(["ceilings", *arguments, "--workers", "1"])
    return int(left.value.code or 0)


def test_each_team_has_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("random-walk", "a-cmommt", *SMALL) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("random-walk observes ")
    assert [line.split()[0] for line in lines[2:-1]] == [
        "random-walk", "a-cmommt", "sharing", "informed", "clairvoyant", "teleport",
    ]  # fmt: skip
    assert lines[1].split() == ["team", "observed", "[%]", "more", "[points]", "of", "the", "way", "its", "interval"]
    (teleport,) = [line for line in lines if line.startswith("teleport")]
    assert lines[0].endswith(f"no team observes more than {teleport.split()[1]} %")
    assert "'more' is than random-walk" in lines[-1]
    assert lines[6].endswith("100 %")


def test_a_policy_gets_the_degree_that_it_learned_with(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("ppo", "--ceilings", "informed", "--robots", "2", "--runs", "1", "--steps", "5") == 0
    assert "ppo" in capsys.readouterr().out


def test_a_grid_is_summed_up_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small = ["--robots", "2,3", "--targets", "3", "--radius", "1.5,2", "--steps", "30", "--runs", "1"]
    assert call("random-walk", "a-cmommt:gain=2", "--ceilings", "sharing", *small, "--out", str(tmp_path)) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[2:5]] == ["random-walk", "a-cmommt:gain=2", "sharing"]
    table = pd.read_parquet(tmp_path / "ceilings.parquet")
    assert table.groupby(["robots", "radius", "team"]).size().tolist() == [1] * 12
    assert table.attrs["root"] == 0
    assert (tmp_path / "images" / "ceilings.png").stat().st_size > 1000
    assert not (tmp_path / "ceilings.checkpoint").exists()


MINE = """
from dataclasses import dataclass
from typing import Annotated

from teamsight import Allowed
from teamsight.policies import Action, Policy

@dataclass(frozen=True)
class Drift(Policy):
    gain: Annotated[float, Allowed(least=0, most=1)] = 0.5

    def decide(self, percept, state, noise):
        return Action(percept.heading, percept.speed * self.gain), state
"""


def test_a_policy_of_ones_own_is_a_team(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "drifts_of_ceilings.py"
    file.write_text(MINE)
    names = [f"{file}:Drift", f"{file}:Drift:gain=1", "drifts_of_ceilings:Drift:gain=0.5"]
    assert call(*names, "--ceilings", "sharing", *SMALL) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[3:5]] == names[1:]
    assert lines[4].endswith(" +0.0 (+0.0 to +0.0)")
    assert not lines[3].endswith(" +0.0 (+0.0 to +0.0)")
    for wrong, message in (
        (f"{file}:Drift:gian=1", "did you mean 'gain'"), (f"{file}:Drift:gain=7", "gain=7"),
        (f"{file}:Drift:gain", "NAME=VALUE"), (f"{file}:Other", "has no 'Other'"),
        (f"{tmp_path}/no.py:Drift", "there is no file"), (str(file), "add the name in it"),
    ):  # fmt: skip
        assert call(wrong, *SMALL) != 0
        assert message in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a-cmomt"], "did you mean 'a-cmommt'"),
        (["a-cmommt:gian=1"], "has no option 'gian'"),
        (["--ceilings", "sharin"], "did you mean 'sharing'"),
        (["--robots", "0"], "robots=0"),
        (["--radius", "-1"], "radius=-1"),
        (["a-cmommt", "--runs", "0"], "runs=0"),
    ],
)
def test_mistakes_are_named(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(*arguments, "--steps", "5") != 0
    assert message in capsys.readouterr().err


def test_results_of_other_settings_are_replaced_with_force_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = ["random-walk", "--ceilings", "sharing", *SMALL, "--out", str(tmp_path)]
    assert call(*small) == 0
    before = (tmp_path / "ceilings.parquet").read_bytes()
    assert call(*small) == 0
    for other in (["--seed", "1"], ["--robots", "3"], ["--targets", "4"]):
        changed = [*small]
        place = changed.index(other[0]) if other[0] in changed else len(changed)
        changed[place : place + 2] = other
        assert call(*changed) == 2
        assert "results of other settings; give --force" in capsys.readouterr().err
    assert (tmp_path / "ceilings.parquet").read_bytes() == before
    assert call(*small, "--seed", "1", "--force") == 0
    assert pd.read_parquet(tmp_path / "ceilings.parquet").attrs["root"] == 1
