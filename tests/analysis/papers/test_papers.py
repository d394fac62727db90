"""All papers: what each writes for a small plan, what is not replaced, and its command."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from teamsight.analysis.papers import PAPERS, kube_zhang1992
from teamsight.analysis.papers.reproduction import Paper, filled, judged
from teamsight.analysis.runs.executor import JobError
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.stats.paired import Interval
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, no_less, within
from teamsight.cli import main
from teamsight.cli.reproduce import command_of, plan_in

#: The papers with one table of runs and one page.
WITH_PAGES = [name for name in PAPERS if isinstance(PAPERS[name], Paper)]


@pytest.mark.parametrize("name", WITH_PAGES)
def test_a_paper_writes_its_files_and_replaces_no_others(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The network learns from fewer examples than that of the page; in a process it learns once from a seed.
    monkeypatch.setattr(kube_zhang1992, "_STEPS", 30)
    monkeypatch.setattr(kube_zhang1992, "_SIZES", (3,))
    paper: Any = PAPERS[name]
    plan = paper.plan(**paper.small)
    seen: list[float] = []
    found = paper.reproduce(plan, tmp_path, watch=lambda phase, done, total: seen.append(done / total), formats=("svg",))
    assert seen[-1] == 1.0
    assert {file.name for file in tmp_path.iterdir()} == set(paper.names(plan, tmp_path, ("svg",)))
    stored = pd.read_parquet(tmp_path / f"{paper.name}.parquet")
    assert stored.attrs[paper.name] == plan.conditions()
    assert stored["seed"].notna().all()
    text = (tmp_path / f"{paper.name}.md").read_text(encoding="utf-8")
    assert text.endswith(paper.text(found, plan))
    assert not {"{", "}"} & set(text)
    assert paper.summary(found, plan)
    other, in_vain = paper.plan(**{**paper.small, "seed": 99}), lambda *given: pytest.fail("worked in vain")
    with pytest.raises(ValueError, match="holds results of other settings; give --force"):
        paper.reproduce(other, tmp_path, watch=in_vain)
    (tmp_path / f"{paper.name}.md").write_text("mine", encoding="utf-8")
    with pytest.raises(ValueError, match=rf"{paper.name}\.md: holds something else; give --force"):
        paper.reproduce(plan, tmp_path, watch=in_vain)


def test_the_figures_of_touzet_are_not_replaced_by_those_of_other_settings(tmp_path: Path) -> None:
    paper, grid = PAPERS["touzet2000"], Grid((1, 3), (2.0, 3.0))
    settings: dict[str, Any] = {"figures": ("4", "9"), "runs": 1, "steps": 2, "grid": grid}
    plan = paper.plan(**settings)
    paper.reproduce(plan, tmp_path, formats=("svg",))
    names = {"figure-4.parquet", "figure-4-cells.parquet", "figure-4.svg", "figure-9.parquet", "figure-9.svg"}
    assert {file.name for file in tmp_path.iterdir()} == names
    stored = pd.read_parquet(tmp_path / "figure-4.parquet")
    assert stored.attrs.items() >= plan.conditions().items()
    others = {"seed": 99, "runs": 2, "steps": 3, "preset": "defaults", "grid": grid._replace(robots=(1, 2))}
    for name, value in others.items():
        other = paper.plan(**{**settings, name: value})
        with pytest.raises(ValueError, match="figure-4.parquet: holds results of other settings; give --force"):
            paper.reproduce(other, tmp_path, watch=lambda *given: pytest.fail("worked in vain"))


def test_papers_are_the_modules_with_one() -> None:
    assert next(iter(PAPERS)) == "touzet2000"
    assert "tan1993" in PAPERS
    assert not {"reproduction", "evolution"}.intersection(PAPERS)


@pytest.mark.parametrize("name", PAPERS)
def test_the_options_of_a_command_are_the_fields_of_the_plan(name: str) -> None:
    paper, settings = PAPERS[name], command_of(name).settings
    assert plan_in(settings(), paper) == paper.plan()
    coarse = plan_in(settings.read({"quick": True}, {}), paper)
    assert coarse == paper.plan(**paper.quick)
    given = plan_in(settings.read({"quick": True, "seed": "3", "runs": "9"}, {}), paper)
    assert given == paper.plan(**{**paper.quick, "seed": 3, "runs": 9})


def test_a_command_writes_says_and_resumes(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = ["--runs", "1", "--steps", "20", "--robots", "1", "--attractors", "1", "--workers", "1", "--out", str(tmp_path)]
    paper = PAPERS["balch_arkin1994"]
    plan = paper.plan(runs=1, steps=20, robots=(1,), attractors=(1,))
    kept = paper.checkpoint(tmp_path)
    key = next(plan.planned())[1].key
    kept.add({key: {"time": 7.0, "censored": False, "max_neighbours": 0}})
    with pytest.raises(SystemExit) as left:
        main(["reproduce", "balch_arkin1994", *line])
    assert not left.value.code
    assert "claims" in capsys.readouterr().out
    assert 7.0 in pd.read_parquet(tmp_path / "foraging.parquet")["time"].tolist()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (["tan193"], "command='tan193': unknown; did you mean 'tan1993'?"),
        (["tan1993", "--names", "1/1 dept 4"], "names='1/1 dept 4': unknown; did you mean '1/1 depth 4'?"),
        (["tan1993", "--steps", "3"], "steps"),
        (["mataric", "--judged", "7"], "judged=7: is none of the times"),
        (["kube_zhang1992", "--runs", "0"], "runs=0: must be at least 1"),
    ],
)
def test_wrong_options_are_named(capsys: pytest.CaptureFixture[str], line: list[str], message: str) -> None:
    with pytest.raises(SystemExit) as left:
        main(["reproduce", *line])
    assert (left.value.code, message in capsys.readouterr().err) == (2, True)


def test_rules_of_claims_follow_from_intervals() -> None:
    near, wide, below = Interval(0.0, -0.01, 0.01), Interval(0.0, -1.0, 1.0), Interval(-1.0, -1.1, -0.9)
    assert [within(one, 0.1) for one in (near, wide, below)] == [HOLDS, UNDECIDED, FAILS]
    assert [no_less(one, 0.1) for one in (near, wide, below)] == [HOLDS, UNDECIDED, FAILS]
    assert within(Interval(1.0, 0.9, 1.1), 0.1) == FAILS
    assert no_less(Interval(1.0, 0.9, 1.1), 0.1) == HOLDS
    verdicts = [judged("a claim", "recalled, not verified", "", one).verdict for one in (HOLDS, FAILS, UNDECIDED)]
    assert verdicts == ["agrees", "differs", UNDECIDED]


def test_a_template_is_filled() -> None:
    template = "\n# A title\n\nOne line\nand {number:.1f} more.\n\n{table}\n"
    assert filled(template, number=2, table="| a |\n| b |") == "# A title\n\nOne line and 2.0 more.\n\n| a |\n| b |\n"


#: A file of a paper; line 18 is where it judges its claims.
MINE = """\
from dataclasses import dataclass

from teamsight.analysis.papers.reproduction import Paper, PaperPlan, judged
from teamsight.analysis.plot.kinds import panels
from teamsight.analysis.runs.run import Run, outcome

@dataclass(frozen=True)
class Plan(PaperPlan):
    runs: int = 2
    def planned(self):
        for seed in range(self.runs):
            yield {"seed": seed, "robots": 2}, Run({"robots": 2, "targets": 2}, seed, 3, measure)

def measure(world, steps):
    return outcome(world, steps)

def judge(table, claim, name):
    return judged(claim, "ours", f"{table[name].mean():.2f}", "holds")

def verdicts(table, plan):
    claims = ("teams observe", "observed_fraction"), ("few are near", "max_neighbours")
    return [judge(table, claim, name) for claim, name in claims]

def draw(table, plan):
    figure, axes = panels("title", "subtitle", ("one",), x="x", y="y")
    axes[0].plot(table["seed"], table["robots"])
    return figure

PAPER = Paper(
    plan=Plan, name="mine", template="{claims}\\n\\n{number} claims, {plan.runs} runs", verdicts=verdicts, figures={"mine": draw},
    values=lambda table, plan: {"least": table["seed"].min()}, quick={"runs": 1},
)
"""


def paper_of(folder: Path, text: str) -> Any:
    """Return the paper in a file of this text."""
    (folder / "mine.py").write_text(text)
    spec = importlib.util.spec_from_file_location("mine", folder / "mine.py")
    assert spec is not None
    assert spec.loader is not None
    sys.modules["mine"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules["mine"])
    return sys.modules["mine"].PAPER  # type: ignore[attr-defined]


COLUMNS = "; known are seed, robots, observed_fraction, max_neighbours$"


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ('"max_neighbours")', '"max_neighbour")', r", line 18: claims: KeyError: 'max_neighbour' \(claim 'few are near'\)" + COLUMNS),
        ('table["robots"])', 'table["robot"])', ", line 26: figure 'mine': KeyError: 'robot'" + COLUMNS),
        ('table["seed"].min', 'table["sed"].min', ", line 31: values of the page: KeyError: 'sed'" + COLUMNS),
        ("{number}", "{numbers}", ": template: KeyError: 'numbers'; known are plan, claims, number, least$"),
        ('"targets": 2}', '"targets": targets}', ", line 12: runs: NameError: name 'targets' is not defined$"),
        ("return outcome(world, steps)", "return outcome(world)", ", line 15: runs: all 2 jobs failed, the first: outcome.. missing 1"),
        ("return [judge", "raise ValueError(7) or [judge", ", line 22: claims: 7$"),
        # Wrong values of a user are no mistake of the paper.
        ('yield {"seed"', 'raise ValueError("runs=2: must be odd")\n            yield {"seed"', "^runs=2: must be odd$"),
        ('{"robots": 2, "targets": 2}', '{"robots": 0.5}', r"^all 2 jobs failed, the first: robots=0.5: must be a whole"),
    ],
)  # fmt: skip
def test_mistakes_of_an_author_name_the_file(tmp_path: Path, right: str, wrong: str, message: str) -> None:
    assert MINE.count(right) == 1
    paper = paper_of(tmp_path, MINE.replace(right, wrong))
    if not message.startswith("^"):
        message = f"^{tmp_path / 'mine.py'}{message}"
    with pytest.raises((ValueError, JobError), match=message):
        paper.reproduce(paper.plan(), tmp_path, formats=("svg",))


def test_a_paper_without_mistakes_is_reproduced(tmp_path: Path) -> None:
    paper = paper_of(tmp_path, MINE)
    paper.reproduce(paper.plan(), tmp_path, formats=("svg",))
    assert "2 claims, 2 runs" in (tmp_path / "mine.md").read_text()


def test_mistakes_in_the_quick_plan_are_found_without_it(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="^quick='run': unknown; did you mean 'runs'"):
        paper_of(tmp_path, MINE.replace('quick={"runs"', 'quick={"run"'))
    paper = PAPERS["balch_arkin1994"]
    wrong = replace(paper, quick={"runs": 0})
    with pytest.raises(ValueError, match=r"balch_arkin1994.py: quick: runs=0: must be at least 1"):
        plan_in(command_of("balch_arkin1994").settings(), wrong)
