"""What robots and targets have in common: a mesa agent that is a view of one row of its group's arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.agents.columns.read_only import unwritable
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.percept_of_one import PerceptOfOne, percept_of_one

if TYPE_CHECKING:
    from teamsight.agents.group import Group

Floats = npt.NDArray[np.float64]


def _of_group(agent: Body, name: str, value: Any) -> AttributeError:
    group = agent.group.name
    shown = value if isinstance(value, str) else checks.shown(value)
    return AttributeError(
        f"{name}={shown}: belongs to the group {group!r}; set group.{name} for all of it, or add a group for this agent"
    )


class Body(mesa.Agent):  # type: ignore[misc]
    """An agent with a body in the world. Groups make their agents; scripts read and move them.

    Its group's columns are attributes too; see `Group.add_column`. A subclass that has an ``__init__`` of its own takes
    ``(self, model, group, row)`` and hands them to ``super().__init__``.

    Attributes
    ----------
    group : Group
        The group that it belongs to.
    """

    team: ClassVar[str | None] = None

    def __init__(self, model: mesa.Model, group: Group, row: int) -> None:
        # Before mesa registers it: an agent whose class then fails is found by its group and taken out again.
        self.group, self._row = group, row
        super().__init__(model)

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
        place: Floats = unwritable(self.group.bodies.position[self.row])
        return place

    @position.setter
    def position(self, value: npt.ArrayLike) -> None:
        self.group.host.place(self, value)

    @property
    def pos(self) -> Floats | None:
        """mesa's name for `position`; None once the agent has left."""
        return None if self._row < 0 else self.position

    @pos.setter
    def pos(self, value: npt.ArrayLike | None) -> None:
        # mesa sets None where its own spaces do not hold an agent.
        if value is not None:
            self.position = value

    @property
    def heading(self) -> Floats:
        """Which way it faces, shape (2,): a unit vector. What is set is given this length."""
        vector: Floats = unwritable(self.group.bodies.heading[self.row])
        return vector

    @heading.setter
    def heading(self, value: npt.ArrayLike) -> None:
        try:
            vector = np.asarray(value, float)
        except (TypeError, ValueError, OverflowError):
            raise TypeError(f"heading={checks.shown(value)}: must be two finite numbers that are not both 0") from None
        length = math.hypot(*vector) if vector.shape == (2,) else math.nan
        if not (math.isfinite(length) and length > 0):
            raise ValueError(f"heading={checks.shown(value)}: must be two finite numbers that are not both 0")
        self.group.host.turn(self, vector / length)

    @property
    def speed(self) -> float:
        """The farthest that it can go a step [length]."""
        return float(self.group.bodies.speed[self.row])

    @speed.setter
    def speed(self, value: float) -> None:
        self.group.host.adjust_one(self, "speed", value)

    @property
    def turn_limit(self) -> float:
        """The farthest that it can turn a step [rad]."""
        return float(self.group.turn_limit[self.row])

    @turn_limit.setter
    def turn_limit(self, value: float) -> None:
        self.group.host.adjust_one(self, "turn_limit", value)

    @property
    def sensing_range(self) -> float:
        """How far it senses targets [length]."""
        return float(self.group.ranges[0][self.row])

    @sensing_range.setter
    def sensing_range(self, value: float) -> None:
        self.group.host.adjust_one(self, "sensing_range", value)

    @property
    def awareness_range(self) -> float:
        """How far it senses teammates [length]."""
        return float(self.group.ranges[1][self.row])

    @awareness_range.setter
    def awareness_range(self, value: float) -> None:
        self.group.host.adjust_one(self, "awareness_range", value)

    @property
    def policy(self) -> Any:
        """The policy of its group. One agent cannot have another: put it into a group of its own."""
        return self.group.policy

    @policy.setter
    def policy(self, value: Any) -> None:
        raise _of_group(self, "policy", value)

    @property
    def awareness(self) -> Any:
        """The degree of awareness of its group."""
        return self.group.awareness

    @awareness.setter
    def awareness(self, value: Any) -> None:
        raise _of_group(self, "awareness", value)

    @property
    def percept(self) -> PerceptOfOne:
        """What it knows now."""
        self.group.host.perceive(self.group)
        return percept_of_one(self.group.percept, self.row)

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn [rad], distance [length]) for one step; what its group's policy decides unless overridden.

        Parameters
        ----------
        percept : PerceptOfOne
            What it knows. A subclass may hand on a changed one, as in
            ``super().decide(percept._replace(speed=0.1), rng)``: the policy decides on what it is given.
        rng : numpy.random.Generator
            Its own random numbers for this tick.
        """
        return self.group.host.decide(self, percept, rng)

    def remove(self) -> None:
        """Remove the agent from the world. Idempotent."""
        if self._row < 0:
            return
        leave = super().remove
        with deferred():
            self.group.host.remove(self, leave)
            self._row = -1

    def _within(self, kind: str) -> list[Any]:
        self.group.host.look()
        relation = self.group.relations.get(kind)
        if relation is None:
            return []
        graph = relation.graph
        found = []
        for index in graph.identity[graph.start[self.row] : graph.start[self.row + 1]]:
            for group in reversed(relation.observed):
                if index >= relation.first[group.number]:
                    found.append(group.agents[index - relation.first[group.number]])
                    break
        return found
