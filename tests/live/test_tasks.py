"""The live page of a task: its scenario and its team are controls."""

from __future__ import annotations

import numpy as np
import pytest
from toy_tasks import GATHER

from teamsight.live.live_page import worlds_of
from teamsight.policies import Centroid, RandomWalk
from teamsight.tasks.model import TaskModel
from teamsight.tasks.named import task_of
from teamsight.tasks.registry import TASKS
from teamsight.view.packing import from_raw


def test_scenario_and_team_are_controls() -> None:
    worlds, controls = worlds_of(TaskModel(GATHER), {"walkers": 4, "rng": 3}, {"treatment": "explore"})
    tracks = worlds.build(worlds.settings, worlds.seed)
    assert [len(track.world.groups[0]) for track in tracks] == [4, 4]
    assert [track.world.groups[0].policy for track in tracks] == [Centroid(), RandomWalk()]
    assert {track.world.seed_used for track in tracks} == {3}
    assert controls["walkers"].kind == "integer"
    assert set(controls["treatment"].choices) == {"explore", "skilled"}
    for track in tracks:
        track.world.close()


@pytest.mark.parametrize("name", TASKS)
def test_what_a_task_measures_can_be_charted(name: str) -> None:
    worlds, _ = worlds_of(TaskModel(task_of(name)), {"treatment": "explore", "rng": 1}, None)
    (track,) = worlds.build(worlds.settings, 1)
    worlds.replace([track], 1)
    worlds.run(30)
    metrics = task_of(name).measure(track.world)
    for metric, value in metrics.items():
        shown = metric.replace("_", " ") if metric != "observed_fraction" else "observed so far"
        assert track.measures[shown]() == value
        worlds.chart(shown, True)
    # What has not ended yet has no value on a chart.
    frame = from_raw(track.look(), track.scene)
    assert not np.isinf(frame.series).any()
    track.world.close()
