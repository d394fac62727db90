"""The numbers in the tables of docs/learning.md are those that its commands print."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd
import pytest

from teamsight.agents.awareness import AWARENESS
from teamsight.analysis.learning.curve_points import curve_points
from teamsight.analysis.learning.curves import Curves, make_curves
from teamsight.analysis.learning.explore import Exploration
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.cli import main

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "learning.md").read_text(encoding="utf-8")
# A number and its interval, as in "36.3 % (34.5 to 38.0)" of the page and "36.3 (34.5 to 38.0) %" of the command.
INTERVAL = re.compile(r"([-+]?\d+\.\d)(?: %| points| pp)? \(([-+]?\d+\.\d) to ([-+]?\d+\.\d)\)")


def numbers(text: str) -> list[tuple[float, ...]]:
    return [tuple(float(part) for part in found) for found in INTERVAL.findall(text.replace("−", "-"))]


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert not left.value.code
    return capsys.readouterr().out


def tables() -> list[list[str]]:
    """Return the tables of the page, each as its lines."""
    return [found.splitlines() for found in re.findall(r"(?:^\|.*\n)+", PAGE, re.MULTILINE)]


def test_the_evaluation_is_what_the_command_prints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    memory = str(tmp_path / "memory.safetensors")
    call(capsys, "learn", "explore", "--out", memory)
    printed = numbers(call(capsys, "learn", "evaluate", memory))
    (table,) = (lines for lines in tables() if any(numbers(line) for line in lines))
    assert len(printed) == 9
    assert numbers("\n".join(table)) == printed


@dataclass(frozen=True)
class FirstColumns(Curves):
    """The first points of the curves on the page, from the same explorations, which depend on the largest sample."""

    samples: tuple[int, ...] = (150, 600)

    def exploration(self, degree: str, memory: int) -> Exploration:
        return replace(super().exploration(degree, memory), runs=Curves().exploration(degree, memory).runs)


@pytest.mark.parametrize(("reward", "degree", "learners"), [
    ("own", "none", ("lazy", "tabular", "linear")),
    ("keep", "ring", ("tabular", "linear")),
])  # fmt: skip
def test_the_first_points_of_the_curves_are_made_again(reward: str, degree: str, learners: tuple[str, ...]) -> None:
    curves = FirstColumns(degrees=(degree,), learners=learners, reward=reward)
    with WorkerPool(1) as pool:
        points = curve_points(make_curves(curves, pool))
    own, keep = (lines for lines in tables() if "38,400" in lines[0])
    rows = own if reward == "own" else keep
    for learner in learners:
        begin = next(i for i, line in enumerate(rows) if line.startswith(f"| {learner} |"))
        row = next(line for line in rows[begin:] if f"| {AWARENESS[degree].order} |" in line)
        assert written(points, learner) == re.findall(r"\d+\.\d ± \d+\.\d", row)[:2]


def test_the_table_of_the_curves_is_that_of_the_shipped_points() -> None:
    points = pd.read_parquet(DOCS / "learning-curves.parquet")
    own = next(lines for lines in tables() if "38,400" in lines[0])
    learner, cells = "", 0
    for line in own[2:]:
        name, degree, *_ = (cell.strip() for cell in line.strip("|").split("|"))
        learner = name or learner
        shown = re.findall(r"\d+\.\d ± \d+\.\d", line)
        rows = points[points["learner"] == learner]
        if degree:
            number = next(key for key in AWARENESS if AWARENESS[key].order == degree)
            rows = rows[(rows["degree"] == number) & rows["transitions"].isin((150, 600, 2400, 9600, 38400))]
        assert written(rows, learner) == shown
        cells += len(shown)
    assert cells == 57


def written(points: pd.DataFrame, learner: str) -> list[str]:
    found = points[points["learner"] == learner].sort_values("transitions")
    return [
        f"{100 * mean:.1f} ± {50 * (high - low):.1f}"
        for mean, low, high in zip(found["mean"], found["low"], found["high"], strict=True)
    ]
