"""The numbers in the tables of docs/learning-results.md are those that its commands print."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.learning.curves import BEST, crossings, mean_gains, pays_from
from teamsight.analysis.learning.evaluation import BY_HAND
from teamsight.analysis.learning.plans import Curves
from teamsight.cli import main

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "learning-results.md").read_text(encoding="utf-8")
LEARNERS = (*Curves.learners, BEST)
GAINS = pd.read_parquet(DOCS / "learning-curves.parquet")
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
    # Two of them also in the answer above the table.
    assert len(printed) == 21
    assert len(set(printed)) == 19
    text = " ".join(line for line in PAGE.splitlines() if not line.startswith("|"))
    shown = numbers(" ".join(text.split()))
    assert len(shown) == 3
    assert set(shown) <= set(printed)


def test_the_means_on_the_page_are_those_of_the_shipped_table() -> None:
    (lines,) = (lines for lines in tables() if "38,400" in lines[0] and "degree" in lines[0])
    samples = [int(found.replace(",", "")) for found in re.findall(r"[\d,]*\d", lines[0])]
    means = mean_gains(GAINS).set_index(["learner", "transitions"])
    learner, cells = "", 0
    for line in lines[2:]:
        name, degree, *shown = (cell.strip().replace("−", "-") for cell in line.strip("|").split("|"))
        learner = name or learner
        for transitions, cell in zip(samples, shown, strict=True):
            row = means.loc[(learner, transitions if learner in LEARNERS else 0)]
            if degree == "gain":
                expected = f"{100 * row['gain']:+z.1f} ± {50 * (row['high'] - row['low']):.1f}"
            else:
                expected = f"{100 * row['collective' if degree == 'Θ(0)' else 'cooperative']:.1f}"
            assert cell in (expected, ""), (learner, degree, transitions)
            cells += cell == expected
    assert cells == len(LEARNERS) * 3 * len(samples) + 2 + len(BY_HAND)


def test_the_crossings_on_both_pages_are_those_of_the_shipped_table() -> None:
    found = crossings(GAINS)
    page = " ".join(PAGE.split())
    single = found.dropna(subset="robots").groupby("learner")["crossing"]
    each = {str(learner): crossing.dropna() for learner, crossing in single}
    mean = {learner: mean_gains(rows)["crossing"].iloc[0] for learner, rows in found.groupby("learner")}
    assert (each["regression"] == mean["regression"]).all()
    assert len(each["regression"]) == len(Curves().scenarios)
    assert f"the fewest transitions tried, {mean['regression']:.0f}**, in every scenario" in page
    few, most = each["linear"].min(), each["linear"].max()
    said = f"pays from {mean['linear']:,.0f} transitions** on the mean, and from {few:,.0f} to {most:,.0f} in five of the six"
    assert said in page
    assert [len(each[learner]) for learner in ("linear", "tabular", "lazy")] == [5, 1, 0]
    (place,) = found.loc[each["tabular"].index, ["robots", "radius"]].to_numpy()
    assert f"For {place[0]:.0f} robots at R = {place[1]:.0f} it pays" in page
    for learner, rows in found.groupby("learner"):
        assert learner == BEST or f"10^{rows['log10_size'].iloc[0]:.1f}" in page
    results = " ".join((DOCS / "results.md").read_text(encoding="utf-8").split())
    for row in mean_gains(found).to_dict("records"):
        assert pays_from(row["crossing"], row["largest"]) in results, row["learner"]
    means = mean_gains(GAINS).set_index(["learner", "transitions"])
    best, unaware = means["gain"]["best"], means["collective"][[name for name in BY_HAND if "unaware" in name]].max()
    assert f"+{100 * (means['cooperative']['regression', 600] - unaware):.0f} over the best unaware team by hand" in results
    assert f"+{100 * best[40]:.0f} percentage points over the best learner without awareness" in results
    assert f"+{100 * best[600]:.0f} from 600" in results
