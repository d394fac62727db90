"""A correct script."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from teamsight import CMOMMT, Body, Disc, Robot, Study, Target, World, open_study
from teamsight.policies import ACmommt
from teamsight.policies.percept_of_one import PerceptOfOne


class Scout(Robot):
    """A robot with a battery."""

    model: World
    battery: float

    def __init__(self, model: World, load: float = 0.0) -> None:
        super().__init__(model)
        self.load = load

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        turn, distance = super().decide(percept, rng)
        self.battery -= distance
        return turn, min(distance, self.battery + self.load)


class Field(World):
    """A world of scouts."""

    def __init__(self, rng: int) -> None:
        super().__init__(Disc(5.0), rng=rng)
        self.scouts = self.add(Scout, 5, policy=ACmommt(), load=[1.0, 2.0, 3.0, 4.0, 5.0], team="scouts")
        self.beacons = self.add(Body, 2, policy="stationary", name="beacons")
        self.prey = self.add(Target, 3, policy=lambda percept, rng: (0.1, 0.1), speed=[0.1, 0.2, 0.3])
        self.scouts.add_column("battery", 1.0)
        self.senses(self.scouts, self.prey)


model = Field(rng=1)
first = model.scouts[0]
first.battery, first.speed, first.position = 2.0, 0.2, (0.0, 1.0)
some: list[Scout] = model.scouts[:2]
loads = [scout.load for scout in model.scouts]
model.scouts.policy = "a-cmommt"
model.scouts.speed = [0.1] * 5
model.adjust(model.scouts, speed=0.3, awareness="pairwise")
late: list[Scout] = model.scouts.add(2, battery=3.0, position=(0, 0))
model.run(3)
paper = CMOMMT(robots=5, preset="touzet2000", policy="centroid", rng=1)
paper.robots[0].speed = 1
paper.target_speed = 0.1
paper.policy = ACmommt()
model.scouts.speed = np.full(7, 0.1, np.float32)
model.scouts.speed = [np.float32(0.1)] * 7
places = [np.array([0.0, 1.0]), np.array([1.0, 0.0])]
model.scouts.add(2, load=0.0, battery=1.0, position=places, heading=[(0, 1), (1, 0)], speed=range(1, 3))
model.scouts.speed = model.scouts.columns["battery"]
chosen: list[Scout] = model.scouts[[0, 1]] + model.scouts[model.scouts.speed > 0]
print(len(model.agents.select(lambda agent: agent.speed > 0)), model.space.get_neighbors_in_radius(first, 1.0))
print(model.observed_fraction, model.steps, first.unique_id, first.observed_targets[0].group.name, first.team)
print(paper.robots.position.shape, paper.targets[0].is_observed, model.groups[0][0].heading, paper.recording.history)
axes = {"robots": [2, 3], "targets": [3, 4]}
study = Study(fixed={"policy": ACmommt(gain=0.5)}, axes=axes, steps=5, record={"steps": True})
listed = Study(model=CMOMMT, points={"robots": [1, 2]}, record={"steps": True}, until={"interval": 0.1, "limit": 60})
print(listed.settings, listed.as_dict()["steps"], study.plan().parameters(0)["robots"])
with TemporaryDirectory() as folder:
    table = study.run(folder, workers=1).frame
    results = open_study(Path(folder))
    print(table["observed_fraction"].mean(), results.summary("observed_fraction")["low"], results.missing, results.axes)
    print(results.plot(), results.study.replicates, results.is_complete, results.steps.columns)
