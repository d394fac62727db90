"""The search over the open constants of lazy learning: what it chooses, and that the shipped table is its result."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from teamsight.agents.presets import PRESETS
from teamsight.analysis.calibration import lazy, lazy_page
from teamsight.analysis.calibration.lazy import AGAIN, CHOOSE, DEFAULTS, OPEN_CLAIMS, REPORT, SETTINGS, Size, Trial
from teamsight.analysis.calibration.lazy_constants import VALUES, Constants
from teamsight.analysis.calibration.search import Phase, assess
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE, SEEDS, memory_for, world_of
from teamsight.analysis.runs import files
from teamsight.analysis.runs.experiment import Grid
from teamsight.policies import LazyQ
from teamsight.policies.lazy.lazy_q import shipped

DOCS = Path(__file__).parents[3] / "docs"
FEW = Grid((5, 30), (2.0, 8.0))


@pytest.fixture(scope="module")
def small() -> pd.DataFrame:
    size = Size(drawn=12, memories=3, finalists=2, reported=2, reported_elsewhere=1, varied=1, steps=10)
    return lazy.search(size=size, grid=FEW)


def test_every_phase_is_there_and_what_chooses_does_not_report(small: pd.DataFrame) -> None:
    assert small.groupby("setting", sort=False).size().index.tolist() == [DEFAULTS, *SETTINGS]
    for setting in SETTINGS:
        elsewhere = small[small["setting"] == setting]
        assert elsewhere.groupby("phase", sort=False).size().to_dict() == {
            "memory": 3, "again": 4, "chosen": 4, "luck": 1,
        }  # fmt: skip
        for name in VALUES:
            assert elsewhere[name].unique().tolist() == [asdict(lazy.chosen_constants(small))[name]]
    assert small[small["setting"] == DEFAULTS].groupby("phase", sort=False).size().to_dict() == {
        "draw": 12, "memory": 3, "again": 4, "chosen": 4, "luck": 2,
        "vary": 1 + sum(len(values) - 1 for values in VALUES.values()),
    }  # fmt: skip
    choosing = small["phase"].isin(["draw", "memory", "again"])
    assert set(small.loc[choosing, "root"]) == {*CHOOSE, *AGAIN}
    assert set(small.loc[~choosing, "root"]) <= set(REPORT)
    assert not set(small.loc[choosing, "root"]) & set(REPORT)
    assert (small["root"] < 0).all()
    others = small["phase"].isin(["luck", "vary"])
    assert not set(small.loc[others, "memory"]) & set(small.loc[choosing, "memory"])


def test_the_draw_tries_each_value_of_a_constant_equally_often(small: pd.DataFrame) -> None:
    drawn = small[small["phase"] == "draw"]
    for name, values in VALUES.items():
        assert drawn[name].value_counts().to_dict() == dict.fromkeys(values, 12 // len(values))
    assert drawn["memory"].is_unique


def test_varying_changes_one_constant_at_a_time(small: pd.DataFrame) -> None:
    varied = small[small["phase"] == "vary"]
    chosen = asdict(lazy.chosen_constants(small))
    changed = pd.DataFrame({name: varied[name] != chosen[name] for name in VALUES}).sum(axis=1)
    assert sorted(changed) == [0] + [1] * (len(varied) - 1)


def assessed(row: pd.Series, phase: Phase) -> dict[str, object]:
    """Return a row of a table, made again."""
    trial = Trial(Constants(**{name: row[name] for name in VALUES}), int(row["memory"]), row["setting"])
    (again,) = assess(phase, [trial], lazy.candidate_of, measure=lazy.measures)
    return again


def test_a_trial_depends_on_itself_alone(small: pd.DataFrame) -> None:
    again = assessed(small.iloc[5], Phase("draw", FEW, CHOOSE, OPEN_CLAIMS, runs=1, steps=5))
    assert again == {name: small[name].iloc[5] for name in again}
    assert again["gain"] == pytest.approx(again[COOPERATIVE] - again[COLLECTIVE])
    assert again["holding"] == sum(again[name] for name in OPEN_CLAIMS)


@pytest.mark.parametrize(("phase", "steps"), [("draw", 300), ("chosen", 600)])
def test_a_row_of_the_shipped_table_is_what_the_search_makes(phase: str, steps: int) -> None:
    table = pd.read_parquet(DOCS / "lazy-search.parquet")
    row = table[table["phase"] == phase].iloc[-1]
    # The shipped table leaves out claims that are younger than it.
    claims = {name: claim for name, claim in OPEN_CLAIMS.items() if name in table}
    again = assessed(row, Phase(phase, lazy.GRID, (int(row["root"]),), claims, runs=1, steps=steps))
    assert claims
    assert again == {name: row[name] for name in again}


def trials(better: dict[str, object], by: float, noise: float = 0.1) -> pd.DataFrame:
    """Random trials of which those with a certain value are nearer to the paper."""
    rng = np.random.default_rng(1)
    rows = [{name: values[rng.integers(len(values))] for name, values in VALUES.items()} for _ in range(600)]
    table = pd.DataFrame(rows).assign(phase="draw", distance_from_paper=rng.normal(1.5, noise, 600))
    for name, value in better.items():
        table.loc[table[name] == value, "distance_from_paper"] -= by
    return table


def test_only_what_is_clearly_better_replaces_what_was_given() -> None:
    found = lazy.chosen_constants(trials({"scope": "alone", "k": 30, "distance": "full"}, by=0.2))
    assert (found.scope, found.k, found.distance) == ("alone", 30, "full")
    # Less than chance makes of it: one standard error is about 0.01.
    found = lazy.chosen_constants(trials({"scope": "alone", "k": 30}, by=0.002))
    assert (found.scope, found.k) == (Constants().scope, Constants().k)


def test_the_memory_with_most_claims_wins_and_of_equals_the_nearest() -> None:
    rows = [(1, 2, 0.5), (1, 2, 0.7), (2, 3, 0.9), (2, 3, 1.1), (3, 3, 0.8), (3, 3, 0.9)]
    again = pd.DataFrame(rows, columns=["memory", "holding", "distance_from_paper"]).assign(
        phase="again", setting=DEFAULTS
    )
    assert lazy.chosen_memory(again) == 3
    # What is best elsewhere is not asked.
    again.loc[again["memory"] == 3, "setting"] = SETTINGS[0]
    assert lazy.chosen_memory(again) == 2
    assert lazy.chosen_memory(again, SETTINGS[0]) == 3


def test_the_shipped_page_is_made_of_the_shipped_table(tmp_path: Path) -> None:
    table = pd.read_parquet(DOCS / "lazy-search.parquet")
    files.write_page(tmp_path / "lazy-search.md", lazy_page.page(table))
    assert (DOCS / "lazy-search.md").read_bytes() == (tmp_path / "lazy-search.md").read_bytes()


def test_the_defaults_are_what_the_search_chose() -> None:
    found = pd.read_parquet(DOCS / "lazy-search.parquet")
    assert lazy.chosen_constants(found) == Constants()
    seed = lazy.chosen_memory(found)
    assert shipped().settings["seed"] == seed
    assert shipped() == Constants().memory(seed)
    learner = LazyQ(shipped())
    for setting in SETTINGS:
        given = PRESETS[setting]
        seed = lazy.chosen_memory(found, setting)
        assert SEEDS[tuple(world_of(given).items())] == seed
        assert memory_for(given) == Constants().memory(seed, given)
        assert dict(memory_for(given).settings) == dict(Constants().memory(seed, given).settings)
    assert repr(learner) == repr(Constants().treatments(shipped())[COOPERATIVE]["policy"])
