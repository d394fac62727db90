"""The sweeps over failure rates and sensing periods: paired worlds, points and files."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT
from teamsight.agents.components import Failures
from teamsight.agents.teammates import of_team
from teamsight.analysis.papers.unreliable import (
    PAPER,
    RISK,
    Unreliability,
    Unreliable,
    changes,
    draw,
    points,
    sentences,
    time_to_failure,
)
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats import exceedance
from teamsight.tasks import TASKS

SMALL = Unreliability(
    runs=3, steps=12, repair=5.0, availabilities=(1.0, 0.5), periods=(1, 4), scenarios=((4, 1.5), (3, 2.0)), seed=5
)


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return run_rows(SMALL.planned())


def test_every_run_can_be_repeated_from_its_row(table: pd.DataFrame) -> None:
    assert len(table) == 2 * 2 * 2 * 2 * 2 * 3
    for row in table[(table["policy"] == "evolved") & (table["replicate"] == 1)].itertuples():
        team = {"policy": "evolved", "awareness": "ring"} if row.aware else {"policy": "a-cmommt", "awareness": "none"}
        options = {"cycle": _cycle(row.value)} if row.sweep == "periods" and row.value > 1 else {}
        world = CMOMMT(robots=row.robots, targets=15, radius=row.radius, **team, **options, rng=row.seed)
        if row.sweep == "failures" and row.value < 1:
            world.attach(Failures(5.0, 5.0), world.robots)
        world.run(12)
        assert (world.observed_fraction, world.max_neighbours) == (row.observed_fraction, row.max_neighbours)


def _cycle(period: float) -> object:
    from teamsight import Cycle

    return Cycle(period, phase="random")


def test_all_conditions_of_a_scenario_meet_the_same_worlds(table: pd.DataFrame) -> None:
    for _, rows in table.groupby(["robots", "radius", "replicate"]):
        assert rows["seed"].nunique() == 1
    assert table["seed"].nunique() == 6
    # The first condition of both sweeps is the same team.
    first = [table[(table["sweep"] == sweep) & (table["value"] == 1.0)] for sweep in ("failures", "periods")]
    assert first[0]["observed_fraction"].tolist() == first[1]["observed_fraction"].tolist()


def test_availability_is_that_of_the_times() -> None:
    for availability in (0.5, 0.9):
        mean = time_to_failure(availability, 50.0)
        assert mean / (mean + 50.0) == pytest.approx(availability)


def test_points_are_paired_means_and_quantiles(table: pd.DataFrame) -> None:
    found = points(table, SMALL)
    assert len(found) == 2 * 2 * 2 * 2
    for point in found.to_dict("records"):
        rows = table
        for name in ("sweep", "value", "policy", "robots", "radius"):
            rows = rows[rows[name] == point[name]]
        aware, unaware = (
            100 * rows[rows["aware"] == which].sort_values("replicate")["observed_fraction"].to_numpy()
            for which in (True, False)
        )
        gain = aware - unaware
        assert point["gain"] == pytest.approx(gain.mean())
        # Student's t with 2 degrees of freedom: 4.303.
        wide = 4.302653 * gain.std(ddof=1) / np.sqrt(3)
        assert point["gain_high"] - point["gain"] == pytest.approx(wide, rel=1e-6, abs=1e-9)
        largest = rows[rows["aware"]]["max_neighbours"]
        assert (largest > point["delta"]).mean() <= RISK
        assert not point["supported"]
        assert point["delta_safe"] == point["robots"] - 1 == exceedance.curve(largest, point["robots"])["delta"].max()


def test_changes_are_paired_with_the_first_condition(table: pd.DataFrame) -> None:
    change, found = changes(table, "failures", SMALL), points(table, SMALL)
    assert len(change) == 4
    for row in change.to_dict("records"):
        of = found[
            (found["sweep"] == "failures") & (found["policy"] == row["policy"]) & (found["robots"] == row["robots"])
        ]
        gain = of.set_index("value")["gain"]
        assert row["change"] == pytest.approx(gain[0.5] - gain[1.0])
        assert row["low"] <= row["change"] <= row["high"]


def test_the_page_has_all_sentences_and_runs_that_conditions_share_are_kept_once(tmp_path: Path) -> None:
    found = PAPER.make(SMALL, None, lambda *given: None, PAPER.checkpoint(tmp_path))
    text = PAPER.text(found, SMALL)
    assert all(line in text.replace("\n  ", " ") for line in sentences(found, "periods", SMALL))
    assert "A gain is over A-CMOMMT without awareness" in text.replace("\n", " ")
    kept = PAPER.checkpoint(tmp_path)
    assert kept.count(run.key for _, run in SMALL.planned()) > kept.count() == 3 * 2 * 3 * 3


def test_panels_of_one_row_have_one_axis(table: pd.DataFrame) -> None:
    found = Unreliable(table, points(table, SMALL))
    panels = draw(found, SMALL, "failures").axes
    for row in (panels[:2], panels[2:4], panels[4:]):
        assert len(row) == 2
        assert row[0].get_ylim() == row[1].get_ylim()
    most = found.points.query("sweep == 'failures'")["delta"].max()
    assert panels[4].get_ylim()[0] == 0.0
    assert panels[4].get_ylim()[1] > most


@pytest.mark.parametrize("name", ["graze", "push", "pursuit"])
def test_the_team_of_any_task_can_be_unreliable(name: str, tmp_path: Path) -> None:
    task: Any = TASKS[name]
    if callable(task.skilled):
        task = replace(task, skilled=partial(task.skilled, steps=100))
    plan = Unreliability(runs=3, steps=60, repair=5.0, availabilities=(1.0, 0.5), periods=(1, 4), task=task, seed=5)
    runs, found = PAPER.reproduce(plan, tmp_path)
    assert len(runs) == 3 * 2 * 4
    assert len(found) == 4
    assert set(task.metrics) <= set(runs)
    text = (tmp_path / "unreliable.md").read_text(encoding="utf-8")
    assert f"{task.size} = {task.scenario[task.size]}: gain" in text
    assert task.objective.metric in text
    assert "A gain is over the same team without awareness" in text.replace("\n", " ")
    # A gain is positive where awareness is better, whether more or less of the objective is.
    for point in found.to_dict("records"):
        assert point["gain"] == pytest.approx(task.objective.sign * (point["aware"] - point["unaware"]))
    # Unreliable runs can be repeated from their rows.
    row = runs[(runs["sweep"] == "failures") & (runs["value"] == 0.5) & runs["aware"]].iloc[0]
    world = task.world(**plan.parameters("skilled", True, {}), rng=int(row["seed"]))
    for group in of_team(world.groups, task.team):
        world.attach(Failures(5.0, 5.0), group)
    world.run(60)
    assert task.measure(world) == {metric: row[metric] for metric in task.metrics}


def test_censored_runs_count_as_their_length() -> None:
    plan = Unreliability(runs=2, steps=50, availabilities=(1.0,), periods=(1,), task="push", seed=1)
    runs = run_rows(plan.planned())
    assert np.isinf(runs["completion_time"]).all()
    assert (points(runs, plan)["aware"] == 50).all()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"set": {"robots": 3}}, "fixed; leave it out"),
        ({"task": "graze", "set": {"robts": 3}}, "robts.*did you mean 'robots'"),
        ({"task": "graze", "policies": ("evolved",)}, "policies=evolved: the task graze has skilled; give these"),
        ({"policies": ("skilled",)}, "policies=skilled: the task cmommt has a-cmommt, evolved; give these"),
        ({"task": "grase"}, "task='grase': unknown; did you mean 'graze'"),
        ({"steps": 49}, "steps=49: must be at least 50, the longest sensing period; give more steps"),
        ({"repair": 0.0}, "repair=0.0: must be"),
    ],
)
def test_what_has_no_meaning_for_a_task_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Unreliability(**given)
