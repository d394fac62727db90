"""A script with typos."""
# ruff: noqa: B018

from teamsight import CMOMMT, Disc, Robot, Study, World, open_study

model = CMOMMT(robots=5, rng=1)
world = World(Disc(5.0), rng=1)
robots = world.add(Robot, 5, policy="centroid")
model.robots[0].sped = 1  # typo
print(robots[0].positon)  # typo
world.ad(Robot, 5)  # typo
for robot in robots:
    robot.headng = (1, 0)  # typo
model.observed_fracton  # typo
model.robots.polcy = "centroid"  # typo
robots[:2].positions  # typo
model.targets[0].is_observd  # typo
world.groups[0][0].sped  # typo
world.clock.att(3, print)  # typo
world.recording.histry  # typo
CMOMMT(robts=3)  # typo
CMOMMT(preset="touzet2001")  # typo
world.adjust(robots, sped=1)  # typo
world.add(Robot, "five", policy="centroid")  # typo
robots[0].speed = "fast"  # typo
world.add(Robot, 5, policy=3)  # typo
robots.awareness = 5  # typo
robots.speed = "fast"  # typo
model.target_speed = "slow"  # typo
world.add(Robot, 5, policy="centroid", speed="fast")  # typo
world.add(Robot, 5, policy="centroid", placement="spred")  # typo
robots.add(2, position="here")  # typo
robots[0].position = "here"  # typo
robots[0].identity = 5  # typo
world.tick = 3  # typo
world.agents.shufle_do("step")  # typo
world.space.get_neighbors_in_radus(robots[0])  # typo
Study(axis={"robots": [5, 10]})  # typo
Study(replicates="five")  # typo
Study(pairing="scenarios")  # typo
study = Study(axes={"robots": [5, 10]})
study.run("out", worker=2)  # typo
open_study("out").frames  # typo
open_study("out").sumary()  # typo
