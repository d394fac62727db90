"""What a page shows of a world now: its scene and its frame."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.model import World
from teamsight.agents.outline import COLOURS, obstacles, walls
from teamsight.core.version import __version__
from teamsight.view.frame import ACTIVE, MOST_PART, OBSERVED, PRESENT, TURN, Frame, Links
from teamsight.view.scene import LinkList, Scene, SceneGroup, Slot


class Observer:
    def __init__(self, world: World, every: int, title: str) -> None:
        self._world, self._every, self.title = world, every, title
        self._slots: dict[int, int] = {}
        self._info: list[Slot] = []
        self.scene = self._scene()

    def _scene(self) -> Scene:
        world = self._world
        world.observed
        low, high = world.arena.bounds
        groups = []
        names: dict[str, bool] = {}
        for number, group in enumerate(world.groups):
            degree = group.awareness
            groups.append(SceneGroup(
                group.name, "robot" if group.team is not None else "target", COLOURS[number % len(COLOURS)], group.team,
                str(getattr(group.policy, "name", type(group.policy).__name__)), {"name": degree.name} | {
                    "delta": degree.delta for _ in "x" if hasattr(degree, "delta")}, {}))
            for row, agent in enumerate(group.agents):
                if agent.unique_id not in self._slots:
                    self._slots[agent.unique_id] = len(self._info)
                    self._info.append(None)
                self._info[self._slots[agent.unique_id]] = Slot(number, agent.unique_id, float(group.ranges[0][row]), float(group.ranges[1][row]), 2 * math.pi)
            for channel in group.channels.values():
                names[channel.name] = names.get(channel.name, False) or channel.counts
        line = lambda points: tuple((float(x), float(y)) for x, y in points)
        return Scene(
            self.title, type(world).__name__, __version__, world.seed_used, self._every,
            (float(low[0]), float(low[1]), float(high[0]), float(high[1])),
            tuple(map(line, walls(world.arena))), tuple(map(line, obstacles(world.arena))), None, tuple(groups),
            tuple(self._info), ("observed", "mean_neighbours", "max_neighbours"),
            tuple(LinkList(name, name, counts, False, 0.0) for name, counts in names.items()))

    def rescene(self) -> None:
        self.scene = self._scene()

    def frame(self) -> Frame:
        world, scene = self._world, self.scene
        series = np.array([world.observed, world.mean_neighbours, 0], np.float32)
        ids = [agent.unique_id for group in world.groups for agent in group.agents]
        if any(one not in self._slots for one in ids):
            self.rescene(); scene = self.scene
        n = len(self._info)
        x, y, heading, flags = (np.zeros(n, np.uint16) for _ in range(4))
        x0, y0, x1, y1 = scene.bounds
        slots = {group.number: np.array([self._slots[agent.unique_id] for agent in group.agents], np.intp) for group in world.groups}
        for group in world.groups:
            at = slots[group.number]
            p, h = group.bodies.position, group.bodies.heading
            x[at] = np.rint((p[:, 0] - x0) / (x1 - x0) * MOST_PART)
            y[at] = np.rint((p[:, 1] - y0) / (y1 - y0) * MOST_PART)
            heading[at] = np.rint(np.arctan2(h[:, 1], h[:, 0]) / (2 * np.pi) * TURN).astype(np.int64) % TURN
            flags[at] = PRESENT + ACTIVE * group.bodies.active
        lists: dict[str, list[Any]] = {one.name: [] for one in scene.links}
        most = 0
        for group in world.groups:
            for relation in group.relations.values():
                start, index = relation.true_lists
                counts = np.diff(start[: len(group) + 1])
                everyone = np.concatenate([slots[one.number] for one in relation.observed])
                seen = everyone[index[: start[len(group)]]]
                lists[relation.name].append((np.repeat(slots[group.number], counts), seen))
                if relation.name == TEAMMATES and len(counts):
                    most = max(most, int(counts.max()))
                if relation.counts:
                    flags[seen] |= OBSERVED
        series[2] = most
        links = []
        for one in scene.links:
            source = np.concatenate([np.zeros(0, np.intp), *(a for a, _ in lists[one.name])])
            target = np.concatenate([np.zeros(0, np.intp), *(b for _, b in lists[one.name])])
            order = np.argsort(source, kind="stable")
            links.append(Links(source[order].astype(np.uint16), target[order].astype(np.uint16)))
        return Frame(float(world.tick), series, x, y, heading, flags, tuple(links))
