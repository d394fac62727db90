"""The space of a world, with the names of mesa's spaces, as reads of the groups' arrays."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import compress
from random import Random
from typing import Any

import mesa
import numpy as np
import numpy.typing as npt
from mesa.agent import AgentSet
from scipy.spatial.distance import cdist

from teamsight.agents.attributes import Points
from teamsight.agents.body import Body
from teamsight.agents.world_data import WorldData
from teamsight.core import checks

Floats = npt.NDArray[np.float64]
Found = tuple[list[Body], Floats]


# mesa has no types for mypy, which would let every attribute pass; see `compat`.
MYPY = False
if MYPY:

    class _NewSpace: ...

    class _OldSpace: ...
else:
    from mesa.experimental.continuous_space import ContinuousSpace as _NewSpace
    from mesa.space import ContinuousSpace as _OldSpace


# mesa's drawing functions accept instances of one or both of these classes only. Their __init__ would make arrays of
# their own, and is not called; all that they define is overridden.
class WorldSpace(_NewSpace, _OldSpace):
    """A world's space for mesa: where the agents are, and who is near. It stores nothing, so it is never stale.

    Distances and directions are those of the arena: on a torus the shortest ones. Obstacles do not matter. Agents that
    are inactive have a place, but are not found near a point or an agent. Agents are in the order of
    groups. `World.space` makes it.

    Parameters
    ----------
    model : World
        The world.
    data : WorldData
        Its arena and groups.

    Attributes
    ----------
    ndims : int
        The number of dimensions, 2.
    """

    ndims = 2

    def __init__(self, model: mesa.Model, data: WorldData) -> None:
        self._model, self._data = model, data

    def __repr__(self) -> str:
        return f"<WorldSpace of {self._data.arena}: {len(self.active_agents)} agents>"

    @property
    def dimensions(self) -> Floats:
        """The least and the largest x, then y, of the box around the arena, shape (2, 2) [length]."""
        return np.stack(self._data.arena.bounds, axis=1)

    @property
    def size(self) -> Floats:
        """The sides of the box around the arena, shape (2,) [length]."""
        low, high = self._data.arena.bounds
        return high - low

    @property
    def center(self) -> Floats:
        """The centre of the box around the arena, shape (2,) [length]."""
        low, high = self._data.arena.bounds
        return (low + high) / 2

    @property
    def torus(self) -> bool:
        """Whether the arena repeats, along one axis at least."""
        return any(self._data.arena.period)

    @property
    def random(self) -> Random:
        """The generator of the model."""
        generator: Random = self._model.random
        return generator

    @property
    def active_agents(self) -> list[Body]:
        """The agents that are in the world now, in the order of groups."""
        return [agent for group in self._data.groups for agent in group]

    @property
    def agents(self) -> AgentSet:
        """The agents that are in the world now, as one of mesa's sets."""
        return AgentSet(self.active_agents, random=self.random)

    @property
    def agent_positions(self) -> Floats:
        """The positions of all agents now, shape (n, 2), read-only [length]."""
        positions = np.concatenate([np.empty((0, 2)), *(group.bodies.position for group in self._data.groups)])
        positions.flags.writeable = False
        return positions

    # mesa's drawing functions and agents read these three.
    @property
    def _agent_positions(self) -> Floats:
        return self.agent_positions

    @property
    def _agent_to_index(self) -> dict[Body, int]:
        return {agent: row for row, agent in enumerate(self.active_agents)}

    @property
    def _index_to_agent(self) -> dict[int, Body]:
        return dict(enumerate(self.active_agents))

    def calculate_difference_vector(self, point: Points, agents: Iterable[Body] | None = None) -> Floats:
        """Return the way from a point to each agent, shape (n, 2) [length].

        Parameters
        ----------
        point : array_like, shape (2,)
            A position [length].
        agents : iterable of Body, optional
            Agents of this world; by default all.
        """
        positions = self.agent_positions
        if agents is not None:
            positions = np.array([self._checked(agent).position for agent in agents]).reshape(-1, 2)
        return self._data.arena.displacement(_point("point", point), positions)

    def calculate_distances(self, point: Points, agents: Iterable[Body] | None = None, **metric: Any) -> Any:
        """Return the distances from a point to each agent, shape (n,) [length], and the agents.

        Parameters
        ----------
        point : array_like, shape (2,)
            A position [length].
        agents : iterable of Body, optional
            Agents of this world; by default all.
        **metric
            Arguments of `scipy.spatial.distance.cdist`, such as ``metric="cityblock"``, except on a torus.

        Returns
        -------
        tuple of ndarray and list of Body
        """
        among = self.active_agents if agents is None else list(agents)
        way = self.calculate_difference_vector(point, None if agents is None else among)
        if not metric:
            return np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2), among
        if self.torus:
            raise ValueError(f"{', '.join(metric)}: distances on a torus are Euclidean; leave it out")
        start = _point("point", point)
        return cdist(start[None], start + way, **metric)[0], among

    def get_agents_in_radius(self, point: Points, radius: float = 1) -> Found:
        """Return the agents within a radius of a point, in the order of groups, and their distances [length]."""
        return self._in_radius(point, radius, None)

    def get_k_nearest_agents(self, point: Points, k: int = 1) -> Found:
        """Return the `k` agents that are nearest to a point, or all if there are fewer, and their distances [length].

        The nearest is the first; of two at the same distance, the one that precedes in the order of groups.
        """
        return self._nearest(point, k, None)

    def get_neighbors_in_radius(self, agent: Body, radius: float = 1) -> Found:
        """Return the other agents within a radius of an agent, and their distances [length]."""
        return self._in_radius(self._checked(agent).position, radius, agent)

    def get_nearest_neighbors(self, agent: Body, k: int = 1) -> Found:
        """Return the `k` other agents that are nearest to an agent, or all if there are fewer, and their distances."""
        return self._nearest(self._checked(agent).position, k, agent)

    def _others(self, point: Points, agent: Body | None) -> tuple[Floats, list[Body]]:
        """Return the distances and the active agents, without one."""
        distances, agents = self.calculate_distances(point)
        is_active = np.concatenate([np.empty(0, bool), *(group.bodies.active for group in self._data.groups)])
        is_other = is_active & np.array([other is not agent for other in agents], bool)
        return distances[is_other], list(compress(agents, is_other))

    def _in_radius(self, point: Points, radius: float, agent: Body | None) -> Found:
        limit = checks.number("radius", radius, least=0.0)
        distances, agents = self._others(point, agent)
        is_near = distances <= limit
        return list(compress(agents, is_near)), distances[is_near]

    def _nearest(self, point: Points, k: int, agent: Body | None) -> Found:
        most = checks.count("k", k, least=0)
        distances, agents = self._others(point, agent)
        nearest = np.argsort(distances, kind="stable")[:most]
        return [agents[row] for row in nearest], distances[nearest]

    def in_bounds(self, point: Points) -> bool:
        """Whether a point is inside the arena; the wall itself is inside."""
        return bool(self._data.arena.contains(_point("point", point)))

    def torus_correct(self, point: Points) -> Floats:
        """Return a point moved into the arena along the axes that repeat, shape (2,) [length]."""
        place = _point("point", point)
        low, period = self._data.arena.bounds[0], np.array(self._data.arena.period, float)
        repeats = period > 0
        return np.where(repeats, low + np.mod(place - low, np.where(repeats, period, 1.0)), place)

    # The names of mesa's older ContinuousSpace.

    def get_neighbors(self, pos: Points, radius: float, include_center: bool = True) -> list[Body]:
        """Return the agents within a radius of a point; without `include_center` not those exactly at the point."""
        agents, distances = self.get_agents_in_radius(pos, radius)
        return agents if include_center else list(compress(agents, distances > 0))

    def get_heading(self, pos_1: Points, pos_2: Points) -> tuple[float, float] | Floats:
        """Return the shortest way from one point to another [length]: an array if `pos_1` is one, else a tuple."""
        way = self._data.arena.displacement(_point("pos_1", pos_1), _point("pos_2", pos_2))
        return way if isinstance(pos_1, np.ndarray) else (float(way[0]), float(way[1]))

    def get_distance(self, pos_1: Points, pos_2: Points) -> float:
        """Return the distance between two points [length]."""
        x, y = self._data.arena.displacement(_point("pos_1", pos_1), _point("pos_2", pos_2))
        return float(np.sqrt(x * x + y * y))

    def torus_adj(self, pos: Points) -> Floats:
        """Return a point moved into the arena along the axes that repeat; a ValueError if it is outside even so."""
        place = self.torus_correct(pos)
        if not self.in_bounds(place):
            arena = checks.shown(self._data.arena)
            raise ValueError(f"pos={checks.shown(pos)}: is outside the arena, {arena}; take a point inside")
        return place

    def out_of_bounds(self, pos: Points) -> bool:
        """Whether a point is outside the arena."""
        return not self.in_bounds(pos)

    def move_agent(self, agent: Body, pos: Points) -> None:
        """Set an agent's position; on a torus any point will do."""
        self._checked(agent).position = self.torus_adj(pos)

    def place_agent(self, agent: Body, pos: Points) -> None:
        """Set an agent's position. `World.add` adds agents; they always have one."""
        self.move_agent(agent, pos)

    def remove_agent(self, agent: Body) -> None:
        """Refuse: agents of a world always have a position."""
        raise TypeError(f"remove_agent({agent!r}): agents cannot leave the space alone; agent.remove() removes them")

    def _add_agent(self, agent: mesa.Agent) -> int:
        raise TypeError(f"{type(agent).__name__}: is not added by the space; use world.add with a subclass of Body")

    def _checked(self, agent: Body) -> Body:
        """Return an agent, if it belongs to this world."""
        if not (isinstance(agent, Body) and agent.group in self._data.groups):
            raise TypeError(f"agent={checks.shown(agent)}: must be an agent of this world, added with world.add")
        return agent


def _point(name: str, value: Points) -> Floats:
    """Return a point as an array, shape (2,)."""
    try:
        point = np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        point = np.empty(0)
    if point.shape != (2,) or not np.isfinite(point).all():
        raise ValueError(f"{name}={checks.shown(value)}: must be two finite numbers, such as (0.5, 1.0)")
    return point
