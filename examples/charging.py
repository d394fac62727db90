"""A charging station with two places, a simpy.Resource: robots go there when they are low, and stop when empty."""

import numpy as np
import simpy

from teamsight import Body, Disc, Robot, Sensor, World
from teamsight.policies import PerceptOfOne, turn_to


class Rover(Robot):
    battery = 20.0

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        turn, distance = super().decide(percept, rng)
        if self.battery < 4.0:
            station = percept.channels.station
            turn, distance = turn_to(percept.heading, station.offset[0]), station.distance[0]
        self.battery -= min(distance, percept.speed, self.battery)
        return turn, distance if self.battery else 0.0


def charge(rover: Rover, world: World, places: simpy.Resource) -> simpy.events.ProcessGenerator:
    while True:
        yield world.clock.timeout(1)
        if rover.battery < 4.0 and rover.percept.channels.station.distance[0] < 0.1:
            with places.request() as place:
                yield place
                yield world.clock.timeout(20)
            rover.battery = 20.0


world = World(Disc(5), rng=1)
rovers = world.add(Rover, 16, policy="random-walk")
world.senses(rovers, world.add(Body, 1, policy="stationary", position=(0, 0)), as_="station", sensor=Sensor(range=10))
places = simpy.Resource(world.clock, capacity=2)
for rover in rovers:
    world.clock.process(charge(rover, world, places))
world.run(600)
print(f"{sum(not rover.battery for rover in rovers)} of 16 rovers are empty; path: {world.path}")
