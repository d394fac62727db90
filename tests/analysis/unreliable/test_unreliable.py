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
from teamsight.analysis.runs.simulate import run_rows
from teamsight.analysis.stats import exceedance
from teamsight.analysis.unreliable import results
from teamsight.analysis.unreliable.page import page, sentences
from teamsight.analysis.unreliable.plan import Plan, time_to_failure
from teamsight.analysis.unreliable.points import RISK, changes, points
from teamsight.tasks import TASKS

SMALL = Plan(
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


def test_files_are_complete_and_resume(tmp_path: Path, table: pd.DataFrame) -> None:
    seen: list[float] = []
    again, found = results.make_results(SMALL, tmp_path, watch=lambda phase, done, total: seen.append(done / total))
    pd.testing.assert_frame_equal(again, table)
    assert (seen[0], seen[-1]) == (0.0, 1.0)
    names = ["unreliable-failures.png", "unreliable-periods.png", "unreliable-points.parquet"]
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted([*names, "unreliable.md", "unreliable.parquet"])
    stored = pd.read_parquet(tmp_path / "unreliable.parquet")
    pd.testing.assert_frame_equal(stored, table, check_like=True)
    assert stored.attrs["unreliable"] == SMALL.conditions()
    text = page(again, found, SMALL)
    assert all(line in text.replace("\n  ", " ") for line in sentences(again, found, "periods", SMALL))
    assert "A gain is over A-CMOMMT without awareness" in text.replace("\n", " ")
    with pytest.raises(ValueError, match="other settings"):
        results.check_results(Plan(runs=4), tmp_path)
    run_rows(SMALL.planned(), checkpoint=results.checkpoint_in(tmp_path))
    kept = results.checkpoint_in(tmp_path)
    # Runs that several conditions share are kept once.
    assert kept.count(run.key for _, run in SMALL.planned()) > kept.count() == 3 * 2 * 3 * 3


def test_panels_of_one_row_have_one_axis(table: pd.DataFrame) -> None:
    from teamsight.analysis.unreliable.figure import draw_on_canvas

    panels = draw_on_canvas(points(table, SMALL), "failures", SMALL).axes
    for row in (panels[:2], panels[2:4], panels[4:]):
        assert len(row) == 2
        assert row[0].get_ylim() == row[1].get_ylim()
    most = points(table, SMALL).query("sweep == 'failures'")["delta"].max()
    assert panels[4].get_ylim()[0] == 0.0
    assert panels[4].get_ylim()[1] > most


@pytest.mark.parametrize("name", ["graze", "push", "collect", "pursuit"])
def test_the_team_of_any_task_can_be_unreliable(name: str, tmp_path: Path) -> None:
    task: Any = TASKS[name]
    if callable(task.skilled):
        task = replace(task, skilled=partial(task.skilled, steps=100))
    plan = Plan(runs=3, steps=60, repair=5.0, availabilities=(1.0, 0.5), periods=(1, 4), task=task, seed=5)
    runs, found = results.make_results(plan, tmp_path)
    assert len(runs) == 3 * 2 * 4
    assert len(found) == 4
    assert set(task.metrics) <= set(runs)
    text = (tmp_path / results.PAGE).read_text(encoding="utf-8")
    assert f"{task.size} = {task.scenario[task.size]}: gain" in text
    assert task.objective.metric in text
    assert "A gain is over the same team without awareness" in text.replace("\n", " ")
    # A gain is positive where awareness is better, whether more or less of the objective is.
    for point in found.to_dict("records"):
        assert point["gain"] == pytest.approx(task.objective.sign * (point["aware"] - point["unaware"]))
    # Unreliable runs can be repeated from their rows.
    row = runs[(runs["sweep"] == "failures") & (runs["value"] == 0.5) & runs["aware"]].iloc[0]
    world = task.world(**plan.subject.parameters("skilled", True, {}), rng=int(row["seed"]))
    for group in of_team(world.groups, task.team):
        world.attach(Failures(5.0, 5.0), group)
    world.run(60)
    assert task.measure(world) == {metric: row[metric] for metric in task.metrics}


def test_censored_runs_count_as_their_length() -> None:
    plan = Plan(runs=2, steps=50, availabilities=(1.0,), periods=(1,), task="push", seed=1)
    runs = run_rows(plan.planned())
    assert np.isinf(runs["completion_time"]).all()
    assert (points(runs, plan)["aware"] == 50).all()


def test_scenarios_of_cmommt_are_fixed() -> None:
    with pytest.raises(ValueError, match="fixed; leave it out"):
        Plan(setting={"robots": 3}).conditions()
    with pytest.raises(ValueError, match="robts.*did you mean 'robots'"):
        Plan(task="graze", setting={"robts": 3}).conditions()
