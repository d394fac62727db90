"""Reproduction makes only what the plan's figures and claims read."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.papers.touzet2000 import PAPER, Touzet, experiments, repeated
from teamsight.analysis.papers.touzet2000.claims import CLAIMS, Claim, needed
from teamsight.analysis.papers.touzet2000.experiments import EXPERIMENTS, experiments_of
from teamsight.analysis.papers.touzet2000.figures import FIGURES
from teamsight.analysis.runs.grid import QUICK
from teamsight.analysis.runs.processes import WorkerPool

ROOT = Path(__file__).parents[4]
REPRODUCE_2 = """
import sys
from pathlib import Path
from teamsight.analysis.papers.touzet2000 import PAPER, Touzet
from teamsight.analysis.runs.processes import WorkerPool

with WorkerPool(1) as pool:
    PAPER.reproduce(Touzet(("2",), preset="defaults"), Path(sys.argv[1]), pool)
print(*sys.modules)
"""


@pytest.mark.short
def test_a_figure_in_closed_form_imports_neither_worlds_nor_policies(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", REPRODUCE_2, str(tmp_path)], capture_output=True, text=True, check=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    assert (tmp_path / "figure-2.parquet").exists()
    policies = tuple(f"teamsight.policies.{name}" for name in ("handmade", "memory", "lazy", "eager", "evolved"))
    others = ("teamsight.agents.world", "teamsight.world", "teamsight.analysis.learning", "mesa")
    assert [name for name in done.stdout.split() if name.startswith((*policies, *others))] == []


@pytest.mark.parametrize("name", FIGURES)
def test_only_the_runs_of_figure_11_explore(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def explored(*of: object) -> None:
        raise AssertionError("explored")

    monkeypatch.setattr(experiments, "exploration", explored)
    monkeypatch.setattr(experiments, "_learner", experiments._learner.__wrapped__)
    found = experiments_of(FIGURES[name].needs)
    assert {one.name for one in found} == set(FIGURES[name].needs)
    with pytest.raises(AssertionError, match="explored") if name == "11" else nullcontext():
        for one in found:
            next(one.rows({}, root=1, runs=1, steps=1, grid=QUICK))


def test_every_experiment_is_read_and_every_name_exists() -> None:
    drawn = {name for figure in FIGURES.values() for name in figure.needs}
    assert needed() | drawn == set(EXPERIMENTS)


def test_a_figure_alone_is_the_same_as_among_others(tmp_path: Path) -> None:
    grid = QUICK._replace(robots=(1, 5), radius=(2.0, 3.0))
    for figures in (("5",), ("4", "5", "6")):
        folder = tmp_path / "-".join(figures)
        folder.mkdir()
        with WorkerPool(1) as pool:
            PAPER.reproduce(Touzet(figures, 1, 3, preset="defaults", grid=grid), folder, pool)
    for kind in ("parquet", "png"):
        alone, among = ((tmp_path / folder / f"figure-5.{kind}").read_bytes() for folder in ("5", "4-5-6"))
        assert alone == among


def test_claims_near_their_limit_are_judged_under_the_seeds_that_follow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = []

    def tables(plan: Touzet, names: list[set[str]], *how: object) -> dict[str, dict[str, pd.DataFrame]]:
        given.append(plan.seed + int(str(how[-1])))
        assert names == [{"a-cmommt-small-arenas"}]
        share = 0.995 if given[-1] % 4 else 0.5
        runs = {"robots": [10], "radius": [1.0], "observed_fraction": [share]}
        return {"defaults": {"a-cmommt-small-arenas": pd.DataFrame(runs)}}

    monkeypatch.setattr(Claim, "is_near", lambda claim, tables, runs: claim is CLAIMS["acmommt-full"])
    monkeypatch.setattr(Touzet, "tables", tables)
    plan = Touzet(preset="defaults", grid=QUICK, seed=2000)
    with WorkerPool(1) as pool:
        shares = repeated(plan, pool, {"defaults": {}}, lambda *of: None, PAPER.checkpoint(tmp_path))
    assert given == list(range(2001, 2021))
    assert shares == {("defaults", "acmommt-full"): 0.75}
