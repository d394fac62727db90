"""What no machine can make is refused with its count, its limit and the cure, before any work, on one line of bounded length."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight.analysis.runs.executor import JobError
from teamsight.cli import main
from teamsight.cli.exits import lines, one_line

EXPLORE = ["learn", "explore", "--out", "x"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([*EXPLORE, "--steps", "1000000000"], ["steps=1000000000: must be at most 10000000"]),
        ([*EXPLORE, "--steps", "10000000", "--runs", "10"], ["steps=10000000, runs=10: makes 5.0e+08 transitions of 75 numbers, 150 GB, at most 5 GB; reduce"]),
        ([*EXPLORE, "--awareness", "shared", "--robots", "1000"], ["makes 1.2e+05 transitions of 32011 numbers, 15.4 GB"]),
        (["run", "--steps", "1000000000000"], ["steps=1000000000000: must be at most 10000000; make more runs"]),
        (["run", "--steps", "1" + "0" * 400], ["steps=(about 10^400): must be at most 10000000"]),
        (["run", "--steps", "9" * 10_000], ["steps='999999999999999999999999999999'… (10000 characters): must be a whole number"]),
        (["run", "--robots", "1000000", "--radius", "5"], ["robots=1000000, targets=15, radius=5: makes about 4.0e+10 neighbours per step, at most 2e+08 fit in memory; give fewer"]),
        (["run", "--robots", "20000", "--radius", "100", "--awareness", "relayed"], ["makes about 4.0e+08 neighbours per step, at most 2e+08 fit in memory; give fewer robots, or another degree"]),
        (["run", "--robots", "1000", "--targets", "1000", "--radius", "1", "--awareness", "shared"], ["makes about 1.0e+09 neighbours per step"]),
        (["run", "--radius", "1e9"], ["radius=1e+09: must be from 0.001 to 1e+08 sensing ranges"]),
        (["run", "--radius", "1e-6"], ["radius=1e-06: must be from 0.001 to 1e+08 sensing ranges"]),
        (["run", "--radius", "1e-320"], ["radius=9.99989e-321: must be from 1e-09 to 1e+09; choose another unit"]),
        (["run", "--awareness-range", "1e155"], ["awareness_range=1e+155: must be from 1e-09 to 1e+09"]),
        (["run", "--seed", "1" + "0" * 400], ["seed=(about 10^400): must be at most 9223372036854775807"]),
        (["delta", "--risk", "1e-320"], ["risk=1e-320: must be a finite number, at least 1e-09 and at most 1"]),
        (["delta", "--risk", "1e-8"], ["risk=1e-08: needs 10 / risk = 1.0e+09 runs, at most 1000000; give a risk of at least 1e-05, or --runs"]),
        (["delta", "--runs", "1000000000"], ["runs=1000000000: must be at most 1000000"]),
        (["reproduce", "--workers", "100000"], ["workers=100000: must be at most "]),
        (["reproduce", "--runs", "1000000"], ["runs=1000000: must be at most 1000"]),
        (["learn", "evaluate", "x", "--workers", "100000", "--runs", "1e9"], ["runs=1000000000: must be at most 1000000", "workers=100000: must be at most "]),
        (["learn", "figure", "--samples", "100,10000000000"], ["samples=10000000000: must be at most 10000000"]),
        (["learn", "figure", "--samples", ",".join(map(str, range(1, 300)))], ["samples: are 299 values, at most 100; leave some out"]),
        (["learn", "figure", "--memories", "1000", "--worlds", "1000"], ["memories=1000, worlds=1000, 6 scenarios, 11 samples: makes 5.4e+08 rows, at most 2e+06"]),
    ],
)  # fmt: skip
def test_what_is_too_much_is_refused_with_its_count(
    arguments: list[str], message: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    found = err.splitlines()
    assert (left.value.code, out, len(found)) == (2, "", len(message)), err
    assert all(any(part in line for line in found) for part in message), err
    assert all(len(line) < 400 for line in found)
    assert list(tmp_path.iterdir()) == []


def test_the_cure_of_too_many_steps_is_not_given_for_too_few(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["run", "--steps", "0"])
    assert capsys.readouterr().err == "teamsight: steps=0: must be at least 1\n"


@pytest.mark.short
def test_a_long_error_keeps_its_beginning_and_its_cure() -> None:
    described = "a worker ended with exit code -9 in " + "array([0.1, 0.2]), " * 10_000 + "; the cure"
    for error in (JobError(described), ValueError(described), RuntimeError(described), MemoryError(described)):
        (line,) = lines(error)
        assert len(line) < 380
        assert "exit code -9" in line
    assert lines(ValueError(described))[0].endswith("; the cure")
    assert one_line("a\nb \x1b[2J \udcff é δ") == "a b \\x1b[2J \\udcff é δ"
