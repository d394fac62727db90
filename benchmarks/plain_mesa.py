"""CMOMMT under A-CMOMMT as a mesa user would write it: agents in a ContinuousSpace, rules in plain Python.

The model is that of ``teamsight.CMOMMT()`` by default: pairwise awareness, ``weights="nearest"``, ``idle="redraw"``,
tracks of lost targets, a disc whose wall reflects. It is written to be easy to read, and as fast as that allows: one
query of the space for each robot and step, few NumPy calls on few numbers. Run it alone to see its speed:

    python benchmarks/plain_mesa.py
"""

from __future__ import annotations

import math
import time
from typing import Any

import mesa
from mesa.experimental.continuous_space import ContinuousSpace, ContinuousSpaceAgent

REACH = 1.0
ROBOT_SPEED, TARGET_SPEED = 0.1, 0.075
TURN_PROBABILITY = 0.05
DO1, DO2, DO3, PREDICTIVE = 0.154, 0.308, 1.0, 1.154
DR1, DR2 = 0.481, 0.769
DECAY, OLDEST, TRACKS = 10.0, 50, 16

Vector = tuple[float, float]


def repulsion(distance: float) -> float:
    """Return the force of a teammate."""
    if distance < DR1:
        return -1.0
    return (distance - DR2) / (DR2 - DR1) if distance < DR2 else 0.0


def attraction(distance: float) -> float:
    """Return the force of a target."""
    if distance < DO1:
        return distance / DO1 - 1.0
    if distance < DO2:
        return (distance - DO1) / (DO2 - DO1)
    if distance <= DO3:
        return 1.0
    return (PREDICTIVE - distance) / (PREDICTIVE - DO3) if distance < PREDICTIVE else 0.0


class Body(ContinuousSpaceAgent):
    """What can move, and turns back at the wall."""

    def __init__(self, model: PlainCMOMMT) -> None:
        super().__init__(model.space, model)
        distance, angle = model.radius * math.sqrt(self.random.random()), math.tau * self.random.random()
        self.position = (distance * math.cos(angle), distance * math.sin(angle))
        self.heading = self.any_heading()
        self.moved = (0.0, 0.0)
        self.distance = 0.0

    def any_heading(self) -> Vector:
        """Return a random direction."""
        angle = math.tau * self.random.random()
        return math.cos(angle), math.sin(angle)

    def move(self) -> None:
        """Go ahead; the wall reflects the path and the heading."""
        x, y = old_x, old_y = self.position.tolist()
        heading_x, heading_y = self.heading
        step_x, step_y = self.distance * heading_x, self.distance * heading_y
        square = self.model.radius**2
        for _ in range(8):
            if (x + step_x) ** 2 + (y + step_y) ** 2 <= square:
                break
            a = step_x * step_x + step_y * step_y
            b = x * step_x + y * step_y
            c = min(x * x + y * y - square, 0.0)
            share = min(max((math.sqrt(max(b * b - a * c, 0.0)) - b) / a, 0.0), 1.0)
            x, y = x + share * step_x, y + share * step_y
            length = math.hypot(x, y)
            normal_x, normal_y = x / length, y / length
            rest_x, rest_y = (1 - share) * step_x, (1 - share) * step_y
            outward = 2 * (rest_x * normal_x + rest_y * normal_y)
            step_x, step_y = rest_x - outward * normal_x, rest_y - outward * normal_y
            turned = 2 * (heading_x * normal_x + heading_y * normal_y)
            heading_x, heading_y = heading_x - turned * normal_x, heading_y - turned * normal_y
        else:
            # Along the wall: stay on it.
            step_x = step_y = 0.0
        x, y = x + step_x, y + step_y
        self.position = (x, y)
        self.heading = heading_x, heading_y
        self.moved = x - old_x, y - old_y


class Target(Body):
    """Goes straight on and now and then turns."""

    def __init__(self, model: PlainCMOMMT) -> None:
        super().__init__(model)
        self.distance = TARGET_SPEED

    def decide(self) -> None:
        """Turn with a small probability."""
        if self.random.random() < TURN_PROBABILITY:
            self.heading = self.any_heading()


class Track:
    """Where a robot expects a target, relative to itself."""

    __slots__ = ("age", "step_x", "step_y", "x", "y")

    def __init__(self, x: float, y: float) -> None:
        self.x, self.y = x, y
        self.step_x = self.step_y = 0.0
        self.age = 0


class Robot(Body):
    """Follows targets that no teammate is nearer to, and keeps away from teammates."""

    def __init__(self, model: PlainCMOMMT) -> None:
        super().__init__(model)
        self.targets: list[tuple[Target, float, float, float]] = []
        self.teammates: list[tuple[float, float, float]] = []
        self.tracks: dict[Target, Track] = {}

    def look(self) -> None:
        """See who is within range."""
        self.targets, self.teammates = [], []
        agents, distances = self.get_neighbors_in_radius(REACH)
        if not agents:
            return
        offsets = self.space.calculate_difference_vector(self.position, agents)
        for agent, (x, y), distance in zip(agents, offsets.tolist(), distances.tolist(), strict=True):
            if isinstance(agent, Target):
                self.targets.append((agent, x, y, distance))
            else:
                self.teammates.append((x, y, distance))

    def decide(self) -> None:
        """Follow the sum of all forces; go in a random direction where there is none."""
        x = y = 0.0
        for mate_x, mate_y, distance in self.teammates:
            if 0.0 < distance < DR2:
                force = repulsion(distance) / distance
                x, y = x + force * mate_x, y + force * mate_y
        for _, target_x, target_y, distance in self.targets:
            force = self.pull(target_x, target_y, distance)
            x, y = x + force * target_x, y + force * target_y
        if self.targets or self.tracks:
            self.update_tracks()
            for track in self.tracks.values():
                if track.age:
                    force = self.pull(track.x, track.y, math.hypot(track.x, track.y)) * math.exp(-track.age / DECAY)
                    x, y = x + force * track.x, y + force * track.y
        length = math.hypot(x, y)
        if length > 1e-9:
            self.heading = x / length, y / length
            self.distance = min(length, 1.0) * ROBOT_SPEED
        else:
            self.heading = self.any_heading()
            self.distance = ROBOT_SPEED

    def pull(self, x: float, y: float, distance: float) -> float:
        """Return the force of a target over its distance; 0 if a teammate is nearer to it."""
        force = attraction(distance)
        if not force or not distance:
            return 0.0
        square = distance * distance
        for mate_x, mate_y, _ in self.teammates:
            if (x - mate_x) ** 2 + (y - mate_y) ** 2 < square:
                return 0.0
        return force / distance

    def update_tracks(self) -> None:
        """Match what is remembered with what is seen, and forget what should be in sight or is far or old."""
        moved_x, moved_y = self.moved
        for track in self.tracks.values():
            track.x += track.step_x - moved_x
            track.y += track.step_y - moved_y
            track.age += 1
        for target, x, y, _ in self.targets:
            seen = self.tracks.get(target)
            if seen is None:
                if len(self.tracks) < TRACKS:
                    self.tracks[target] = Track(x, y)
            else:
                seen.step_x += (x - seen.x) / seen.age
                seen.step_y += (y - seen.y) / seen.age
                seen.x, seen.y, seen.age = x, y, 0
        lost = [
            target
            for target, track in self.tracks.items()
            if track.age and (not REACH < math.hypot(track.x, track.y) < PREDICTIVE or track.age > OLDEST)
        ]
        for target in lost:
            del self.tracks[target]


class PlainCMOMMT(mesa.Model):
    """Robots that observe as many moving targets as they can, in a disc.

    Parameters
    ----------
    robots, targets : int
        How many.
    radius : float
        Of the arena [sensing ranges].
    rng : int
        The seed.
    """

    def __init__(self, robots: int = 15, targets: int = 15, radius: float = 5.0, rng: int = 1) -> None:
        super().__init__(rng=rng)
        self.radius = radius
        self.space = ContinuousSpace(
            [[-radius, radius], [-radius, radius]], random=self.random, n_agents=robots + targets
        )
        self.robots = [Robot(self) for _ in range(robots)]
        self.targets = [Target(self) for _ in range(targets)]
        self.datacollector = mesa.DataCollector(
            model_reporters={"observed": observed_fraction, "max_neighbours": largest_degree}
        )
        self.agents_by_type[Robot].do("look")

    def step(self) -> None:
        """Let everybody decide, then move, then look; and write down what that led to."""
        self.agents.do("decide")
        self.agents.do("move")
        self.agents_by_type[Robot].do("look")
        self.datacollector.collect(self)


def observed_fraction(model: PlainCMOMMT) -> float:
    """Return the share of targets that at least one robot sees."""
    return len({entry[0] for robot in model.robots for entry in robot.targets}) / len(model.targets)


def largest_degree(model: PlainCMOMMT) -> int:
    """Return the largest number of teammates that any robot has within range."""
    return max(len(robot.teammates) for robot in model.robots)


def main() -> None:
    """Print the speed at the paper's size, and what was observed."""
    model: Any = PlainCMOMMT()
    begin = time.process_time()
    for _ in range(2000):
        model.step()
    seconds = time.process_time() - begin
    table = model.datacollector.get_model_vars_dataframe()
    print(f"{2000 / seconds:,.0f} world-steps a second; observed {table.observed.mean():.3f}", end=", ")
    print(f"largest degree {table.max_neighbours.max()}")


if __name__ == "__main__":
    main()
