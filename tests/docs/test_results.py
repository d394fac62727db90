"""A page of results and its tables equal what its command makes; a few rows of each table are made again."""

from __future__ import annotations

import math
import re
import runpy
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from teamsight.analysis import benchmark, ceilings
from teamsight.analysis.learning.curves import awareness_gains, make_curves
from teamsight.analysis.learning.diagnosis import diagnose_explorations, diagnosis_points
from teamsight.analysis.learning.diagnosis_figure import page as diagnosis_page
from teamsight.analysis.learning.plans import Curves, Diagnosis
from teamsight.analysis.papers import PAPERS, calibration, evolution, gathering, kube_zhang1992, unreliable
from teamsight.analysis.runs import files
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.stats.paired import Interval
from teamsight.policies.evolved import Evolved
from teamsight.policies.evolved import made as made_with

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def shipped(name: str) -> pd.DataFrame:
    return pd.read_parquet(DOCS / f"{name}.parquet")


def tables_in(text: str) -> list[str]:
    """Return the tables of a page of Markdown."""
    return re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)


def of_program(name: str) -> Callable[[str], Iterator[str]]:
    """Return what makes a page by a program of .ci."""
    return lambda text: iter([runpy.run_path(str(ROOT / ".ci" / name))["page"]()])


def of_papers(page: str, text: str) -> Iterator[str]:
    """Yield the tables of all papers with this page."""
    for name, paper in PAPERS.items():
        if getattr(paper, "page", "") == page:
            yield from of_paper(name, text)


def of_paper(name: str, text: str) -> Iterator[str]:
    """Yield the tables of a paper, made from its table of runs."""
    paper: Any = PAPERS[name]
    table, plan = shipped(f"{Path(paper.page).parent}/{paper.name}"), paper.plan()
    assert table.attrs[paper.name] == plan.conditions()
    *tables, claims = tables_in(paper.text(paper.restore(table), plan))
    # A page may leave a table out, but not the claims, and shows none otherwise.
    yield from (one for one in tables if one.splitlines()[0] in text)
    yield claims
    yield f"teamsight reproduce {name}"


def of_unreliable(text: str) -> Iterator[str]:
    points, plan = shipped("unreliable"), unreliable.Unreliability()
    assert points.attrs["unreliable"] == plan.conditions()
    for sweep in unreliable.SWEEPS:
        made = unreliable.sweep_table(points, sweep, plan).splitlines()
        # The file and the figure have the rest.
        yield "\n".join([made[0], made[1], *(row for row in made if row.startswith("| gain"))]) + "\n"
    yield "teamsight reproduce unreliable"


def written(page: str) -> str:
    """Return a page as it is written to a file."""
    with tempfile.TemporaryDirectory() as folder:
        files.write_page(f"{folder}/page.md", page)
        return Path(folder, "page.md").read_text(encoding="utf-8")


def of_calibration(text: str) -> Iterator[str]:
    yield written(calibration.SEARCH.text(shipped("calibration"), calibration.SEARCH.plan()))


def of_evolution(text: str) -> Iterator[str]:
    table = shipped("evolved")
    assert table.attrs["made"] == made_with()
    yield written(evolution.COMPARISON.text(table, evolution.Comparison()))


def of_ceilings(text: str) -> Iterator[str]:
    table = shipped("ceilings")
    yield from ceilings.tables(table)
    assert set(zip(table["robots"], table["radius"], strict=True)) == set(evolution.GRID.cells)
    for team in ("sharing", "clairvoyant"):
        found: dict[int, list[str]] = {}
        for robots, radius in ceilings.below(table, team):
            found.setdefault(robots, []).append(f"{radius:g}")
        cells = [f"N = {robots}, R = {', '.join(radii)}" for robots, radii in found.items()]
        yield f"- `{team}` at {'; '.join(cells)}\n"
    # The page of the policy has the same.
    kept = shipped("evolved")
    made = evolution.by_ceiling(table[table["team"] != "a-cmommt"].replace(ceilings.STRONGEST, evolution.STRONGEST))
    kept = kept[kept["part"] == "ceiling"][made.columns].reset_index(drop=True)
    pd.testing.assert_frame_equal(made, kept, check_dtype=False)


def of_learning(text: str) -> Iterator[str]:
    table = shipped("ceilings")
    where = [cell in Curves().scenarios for cell in zip(table["robots"], table["radius"], strict=True)]
    yield ceilings.tables(table[where])[0]


def of_imagined(text: str) -> Iterator[str]:
    program = runpy.run_path(str(ROOT / "benchmarks" / "imagined.py"))
    yield program["report"](shipped("imagined-worlds"))
    yield program["parts_table"](shipped("imagined-parts"))


def of_benchmark(text: str) -> Iterator[str]:
    yield written(benchmark.page(benchmark.Results.read()))


def of_diagnosis(text: str) -> Iterator[str]:
    found = tables_in(diagnosis_page(diagnosis_points(shipped("lazy-q")), Diagnosis().in_words()))
    # The page shows the first of the four tables, and rows of the third.
    made = {table.splitlines()[0]: table.splitlines() for table in found[:3:2]}
    shown = [table.splitlines() for table in tables_in(text)]
    assert [lines[0] for lines in shown] == list(made)
    assert min(map(len, shown)) > 5
    assert all(set(lines) <= set(made[lines[0]]) for lines in shown)
    yield from made


def of_gathering(text: str) -> Iterator[str]:
    cells = [_cell(row) for _, row in shipped("tasks/gathering-index").iterrows()]
    yield gathering.index_rows([cell for cell in cells if cell.size in (8, 30)])
    yield gathering.summary_table(gathering.judge(cells))
    further = [part["runs"].iloc[1:] for _, part in shipped("tasks/gathering-rounds").groupby(["task", "size"])]
    said = f"one or two rounds in every cell, {min(map(sum, further))} to {max(map(sum, further))} further runs"
    assert said in " ".join(text.split())
    yield "teamsight reproduce gathering"


def _cell(row: Any) -> gathering.Cell:
    """Return a cell from its row in the file, which has answers in place of the shortfalls."""
    answers = {"yes": Interval(0.0, 0.0, 0.0), "undecided": Interval(0.0, -math.inf, math.inf)}
    explore, skilled, saturation = (
        gathering.DeltaInterval(*(int(row[f"{name}_{part}"]) for part in ("delta", "low", "high")))
        for name in ("explore", "skilled", "saturation")
    )
    ratio, gain, skill = (Interval(row[name], row[f"{name}_low"], row[f"{name}_high"]) for name in ("ratio", "gain", "skill"))
    shortfall = {skilled.delta: answers[row["enough_at_skilled"]], explore.delta: answers[row["enough_at_explore"]]}
    given = {name: row[name] for name in ("objective", "tolerance", "censored", "too_few", "too_many", "crowded")}
    return gathering.Cell(
        row["task"], row["gathers"], row["size"], explore, skilled, ratio, saturation, shortfall, gain=gain, skill=skill,
        explored=shortfall[explore.delta], **given,
    )  # fmt: skip


#: What makes a whole page, and what makes the tables of another one, given its text.
WHOLE: dict[str, Callable[[str], Iterator[str]]] = {
    "commands": of_program("commands_page.py"),
    "settings": of_program("settings_page.py"),
    "calibration": of_calibration,
    "evolved": of_evolution,
    "reference-results": of_benchmark,
}
TABLES: dict[str, Callable[[str], Iterator[str]]] = {
    **{page: partial(of_papers, page) for paper in PAPERS.values() if (page := getattr(paper, "page", ""))},
    "lazy-q": of_diagnosis,
    "ceilings": of_ceilings,
    "learning-results": of_learning,
    "imagined-worlds": of_imagined,
    "unreliable": of_unreliable,
    "tasks/gathering": of_gathering,
}


@pytest.mark.parametrize("name", [*WHOLE, *TABLES])
def test_a_page_and_its_tables_equal_what_its_command_makes(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # No page says how often the network agrees, for which it would have to learn for a minute.
    monkeypatch.setattr(kube_zhang1992, "agreement_of", lambda seed: (0.0, 0.0))
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    parts = list((WHOLE | TABLES)[name](text))
    if name in WHOLE:
        assert parts == [text]
    for part in parts:
        assert part in text


@dataclass(frozen=True)
class FirstPoints(Curves):
    """The first points of the curves on the page, from the same explorations, which depend on the largest sample."""

    learners: tuple[str, ...] = ("linear",)
    samples: tuple[int, ...] = (40, 600)
    robots: tuple[int, ...] = (10,)
    radius: tuple[float, ...] = (3.0,)

    def exploration(self, memory: int, transitions: int | None = None) -> dict[str, Any]:
        return {**super().exploration(memory), "runs": Curves().exploration(memory)["runs"]}


def points_of_curves(table: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, pd.DataFrame]]:
    assert table.attrs["curves"] == Curves().conditions()
    point = ["learner", "transitions", "robots", "radius"]
    with WorkerPool(1) as pool:
        made = awareness_gains(make_curves(FirstPoints(), pool))
    made = made[made["learner"] == "linear"].dropna(subset="robots").set_index(point)
    assert len(made) == 2
    yield made, table.set_index(point).loc[made.index]


def exploration_of_the_diagnosis(table: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, pd.DataFrame]]:
    # From the paper's 600 transitions; the action's effect is measured with the most transitions.
    made = diagnose_explorations(Diagnosis(samples=(600,), memories=1))
    made = made[made["quantity"].isin(("matches", "matches by chance", "approach", "rewarded"))]
    first = table[(table["memory"] == 0) & (table["transitions"] == 600)]
    yield made.reset_index(drop=True), first.reset_index(drop=True)


def setting_of_the_calibration(table: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, pd.DataFrame]]:
    row = table.iloc[[37]].reset_index(drop=True)
    # The shipped table leaves out claims that are younger than it.
    claims = {name: claim for name, claim in calibration.SCREEN.claims.items() if name in row}
    assert len(claims) > 10
    values = row.to_dict("records")[0]
    made = calibration.assess(
        calibration.SCREEN._replace(claims=claims), [{name: values[name] for name in calibration.PARAMETERS}]
    )
    yield pd.DataFrame(made), row[list(made[0])]


def cells_of_the_evolution(table: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, pd.DataFrame]]:
    (options, *_) = evolution.options_of(table[table["part"] == "screen"])
    how = {"options": options, "runs": table.attrs["runs"]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evolution, "GRID", Grid((10,), (4.0,)))
        made = evolution.by_cell(evolution.compare({"evolved": Evolved()}, root=evolution.TEST, **how))
    cell = table[(table["part"] == "cell") & (table["robots"] == 10) & (table["radius"] == 4.0)]
    yield made.reset_index(drop=True), cell[made.columns].reset_index(drop=True)
    general = table[table["part"] == "generalisation"]
    assert general["name"].tolist() == [one.name for one in evolution.VARIATIONS]
    for one in evolution.VARIATIONS:
        if one.name in ("N = 3", "square of the disc's area"):
            found = evolution.compare({"evolved": Evolved()}, root=evolution.GENERALISE, variations=(one,), **how)
            made = evolution.gains_by(found, "variation").reset_index(drop=True)
            yield made, general[general["name"] == one.name][made.columns].reset_index(drop=True)
    against = partial(evolution.compare, options=options)
    for part, made in evolution.of_adaptive_forces(Evolved(), against, how["runs"], lambda *done: None).items():
        yield made, table[table["part"] == part][made.columns].reset_index(drop=True)


def cell_of_ceilings(table: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, pd.DataFrame]]:
    # Planners are not made again: a last bit of a cosine can change a plan.
    teams = [ceilings.STRONGEST, "a-cmommt", "evolved"]
    how = {"runs": 2, "steps": evolution.STEPS, "seed": evolution.CEILING}
    cell = table[(table["robots"] == 10) & (table["radius"] == 4.0) & table["team"].isin(teams)]
    yield ceilings.compare([(10, 15, 4.0)], teams, **how), cell.reset_index(drop=True)


def cell_of_imagined_worlds(table: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, pd.DataFrame]]:
    program = runpy.run_path(str(ROOT / "benchmarks" / "imagined.py"))
    names = [program[name] for name in ("UNLEARNED", "DESIGNED", "EVOLVED", "STRONGEST")]
    world = "sensing range halved"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(program["experiments"].__globals__, "GRID", Grid((10,), (4.0,)))
        asked = [one for one in program["experiments"](world, {}, 0) if one.name in names]
    asked = [replace(one, replicates=2) for one in asked]
    made = program["make_tables"]([(program["WORLDS"][world], asked)], root=program["ROOT"], runs=1, steps=program["STEPS"])
    cell = (table["world"] == world) & (table["robots"] == 10) & (table["radius"] == 4.0) & (table["replicate"] < 2)
    for name in names:
        kept = table[cell & (table["team"] == name)]
        yield made[0][name][kept.columns[:-2]].reset_index(drop=True), kept[kept.columns[:-2]].reset_index(drop=True)


AGAIN: dict[str, Callable[[pd.DataFrame], Iterator[tuple[pd.DataFrame, pd.DataFrame]]]] = {
    "calibration": setting_of_the_calibration,
    "ceilings": cell_of_ceilings,
    "evolved": cells_of_the_evolution,
    "imagined-worlds": cell_of_imagined_worlds,
    "lazy-q": exploration_of_the_diagnosis,
    "learning-curves": points_of_curves,
}


@pytest.mark.rare
@pytest.mark.parametrize("name", AGAIN)
def test_rows_of_a_table_are_made_again(name: str) -> None:
    for made, kept in AGAIN[name](shipped(name)):
        # Equal but for rounding in the last bits of a cosine or a mean.
        pd.testing.assert_frame_equal(made, kept, check_dtype=False, check_exact=False, rtol=1e-9, atol=1e-12)
