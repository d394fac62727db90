"""What robots and targets have in common: a mesa agent that is a view of one row of its group's arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.policies.interface import PerceptOfOne, percept_of_one

if TYPE_CHECKING:
    from teamsight.agents.group import Group
    from teamsight.agents.model import World

Floats = npt.NDArray[np.float64]


class Place(np.ndarray[Any, np.dtype[np.float64]]):
    """A row of an array that cannot be written to; ``agent.position += step`` makes a new one, which is then set."""

    def __iadd__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) + other

    def __isub__(self, other: Any) -> Any:  # type: ignore[misc]
        return np.asarray(self) - other


class Body(mesa.Agent):  # type: ignore[misc]
    """An agent with a body in the world. Groups make their agents; scripts read and move them.

    A subclass that has an ``__init__`` of its own takes ``(self, model, group, row)`` and hands them to
    ``super().__init__``.

    Attributes
    ----------
    group : Group
        The group that it belongs to.
    """

    team: ClassVar[str | None] = None

    model: World

    def __init__(self, model: World, group: Group, row: int) -> None:
        super().__init__(model)
        self.group, self._row = group, row

    @property
    def row(self) -> int:
        """Its row in the group's arrays; a ValueError once it has left the world."""
        if self._row < 0:
            raise ValueError(f"{self!r} has left the world: it has no place, and can do nothing; ask another agent")
        return self._row

    @row.setter
    def row(self, row: int) -> None:
        self._row = row

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.unique_id} of {self.group.name!r}>"

    @property
    def position(self) -> Floats:
        """Where it is, shape (2,) [length]. What is set must lie in the arena."""
        place: Floats = self.group.position[self.row].view(Place)
        return place

    @position.setter
    def position(self, value: npt.ArrayLike) -> None:
        self.model.place(self, value)

    @property
    def heading(self) -> Floats:
        """Which way it faces, shape (2,): a unit vector. What is set is given this length."""
        vector: Floats = self.group.heading[self.row].view(Place)
        return vector

    @heading.setter
    def heading(self, value: npt.ArrayLike) -> None:
        try:
            vector = np.asarray(value, float)
        except (TypeError, ValueError):
            raise TypeError(f"heading={value!r}: must be two finite numbers that are not both 0") from None
        length = math.hypot(*vector) if vector.shape == (2,) else math.nan
        if not (math.isfinite(length) and length > 0):
            raise ValueError(f"heading={value!r}: must be two finite numbers that are not both 0")
        self.group.bodies.heading[self.row] = vector / length
        self.model.refresh()

    @property
    def percept(self) -> PerceptOfOne:
        """What it knows now."""
        self.model.perceive(self.group)
        return percept_of_one(self.group.percept, self.row)

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn [rad], distance [length]) for one step; what its group's policy decides unless overridden.

        Parameters
        ----------
        percept : PerceptOfOne
            What it knows.
        rng : numpy.random.Generator
            Its own random numbers for this tick.
        """
        action = self.model.policy_decision(self.group)
        x, y = action.heading[self.row]
        ahead, left = percept.heading
        turn = math.atan2(y * ahead - x * left, x * ahead + y * left) if x or y else 0.0
        return turn, float(action.distance[self.row])

    def remove(self) -> None:
        """Leave the world; to do so twice is to do so once."""
        if self._row < 0:
            return
        super().remove()
        self.model.forget(self.group, self)
        self._row = -1

    def _within(self, kind: str) -> list[Any]:
        self.model.look()
        relation = self.group.relations.get(kind)
        if relation is None:
            return []
        graph = relation.graph
        found = []
        for index in graph.index[graph.start[self.row] : graph.start[self.row + 1]]:
            for group in reversed(relation.observed):
                if index >= relation.first[group.number]:
                    found.append(group.agents[index - relation.first[group.number]])
                    break
        return found
