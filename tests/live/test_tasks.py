"""The live page of a task: its scenario and its team are controls."""

from __future__ import annotations

from toy_tasks import GATHER

from teamsight.live.live_page import worlds_of
from teamsight.policies import Centroid, RandomWalk
from teamsight.tasks.model import TaskModel


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
