"""A mixed team hunts: fast lions with a narrow view, wolves that know of each other, and prey that flee or do not.

Roles are groups, and channels say who senses whom. Each hunter is a process on the clock: it waits until prey is within
reach, and then rests. In between, all steps are made in compiled code.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from teamsight import Body, Box, Robot, Sensor, World
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, go


@kernel
def _flee(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    seen = percept.channels.hunters
    for i in range(len(percept.heading)):
        x, y = 0.0, 0.0
        for k in range(seen.start[i], seen.start[i + 1]):
            x, y = x - seen.offset[k, 0], y - seen.offset[k, 1]
        go(action, i, x, y, percept.speed[i] if x or y else 0.0)


class Flee(CompiledPolicy):
    kernel, channels = _flee, ("hunters",)


def hunt(world: World, hunter: Robot) -> Generator[Any, Any, None]:
    """Catch the first prey within reach, and rest; again and again."""
    while True:
        prey = yield world.until.contact(hunter, channel="reach")
        if prey in world.agents:                  # nobody else has caught it at the same tick
            prey.remove()
            world.log("caught", hunter)
            speed, hunter.speed = hunter.speed, 0.0
            yield world.clock.timeout(40)
            hunter.speed = speed


for policy in ("stationary", Flee()):
    world = World(Box(12, 12), rng=1)
    prey = world.add(Body, 30, policy=policy, speed=0.08, sensing_range=1.5, name="prey")
    lions = world.add(Robot, 3, policy="centroid", policy_options={"idle": "wander"}, team=None, speed=0.2,
                      turn_limit=0.5, sensing_range=2.5, name="lions")  # fmt: skip
    wolves = world.add(Robot, 5, policy="a-cmommt", awareness="ring", awareness_range=4.0, speed=0.1, name="wolves")
    for hunters, sensor in ((lions, Sensor(field_of_view=1.6)), (wolves, Sensor(missed=0.1))):
        world.senses(hunters, prey, sensor=sensor)
        world.senses(hunters, prey, as_="reach", sensor=Sensor(range=0.2))
        world.senses(prey, hunters, as_="hunters")
        for hunter in hunters:
            world.clock.process(hunt(world, hunter))
    world.run(500)
    caught = world.events[world.events.what == "caught"].group.value_counts()
    by_lions, name = caught.get("lions", 0), type(prey.policy).__name__
    print(f"{name}: {30 - len(prey)} of 30 caught, {by_lions} by lions; path: {world.path}")
