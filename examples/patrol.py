"""A patrol with charging: robots circle around their base and return when their battery is low; chargers are few."""

from __future__ import annotations

from teamsight import Batteries, ChargingPlaces, Disc, Failures, Robot, Target, World
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, SeekCharger, go

RADIUS = 3.0


@kernel
def _circle(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    base = percept.channels.chargers
    for i in range(len(percept.heading)):
        go(action, i, 0.0, 0.0, percept.speed[i])
        # Entries of a channel belong to robot i from start[i] on; robots that do not decide have none.
        for at in range(base.start[i], base.start[i + 1]):
            x, y, distance = base.offset[at, 0], base.offset[at, 1], base.distance[at] + 1e-9
            # Along the circle around the base, and towards the circle.
            inwards = distance - RADIUS
            go(action, i, (inwards * x + y) / distance, (inwards * y - x) / distance, percept.speed[i])


class Circle(CompiledPolicy):
    kernel, channels = _circle, ("chargers",)


def patrol(chargers: int) -> World:
    world = World(Disc(5), rng=1)
    robots = world.add(Robot, 12, policy=Circle())
    world.senses(robots, world.add(Target, 20, policy="random-walk", speed=0.02, name="intruders"))
    world.attach(Batteries(15, low_level=5), robots)
    world.attach(ChargingPlaces((0, 0), chargers, rate=0.25, policy=SeekCharger()), robots)
    world.attach(Failures(2_000, 100), robots)
    world.run(2_000)
    return world


for chargers in (1, 2, 4):
    world = patrol(chargers)
    log = world.events
    visits = log.assign(visit=log.groupby(["what", "agent"]).cumcount())
    times = visits.pivot_table(index=["agent", "visit"], columns="what", values="time")
    waits = (times["charging"] - times["queued"]).dropna()
    print(
        f"chargers: {chargers}; {world.observed_fraction:.0%} of the intruders observed; {len(waits)} times charged, "
        f"after {waits.mean():.0f} ticks in the queue; path: {world.path}"
    )
