"""Bodies: what robots and targets have in common. An agent is a view of one row of its group's arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import mesa
import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.columns import unwritable
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.percept_of_one import PerceptOfOne, percept_of_one

if TYPE_CHECKING:
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.group import Group

Floats = npt.NDArray[np.float64]


def _ability(name: str, doc: str) -> Any:
    """Return a property of agents that reads and sets one element of an array of the group."""

    def get(agent: Body) -> float:
        return float(getattr(agent.group, name)[agent.row])

    def set_(agent: Body, value: float) -> None:
        agent.group.host.adjust_one(agent, name, value)

    return property(get, set_, doc=doc)


def _of_group(name: str, doc: str) -> Any:
    """Return a property of agents that belongs to their group and cannot be set on one agent."""

    def set_(agent: Body, value: Any) -> None:
        shown = value if isinstance(value, str) else checks.shown(value)
        raise AttributeError(
            f"{name}={shown}: belongs to the group {agent.group.name!r}; set group.{name} for all agents, or add a "
            "group for this one"
        )

    return property(lambda agent: getattr(agent.group, name), set_, doc=doc)


class Body(mesa.Agent):  # type: ignore[misc]
    """An agent in a world. `World.add` makes the agents of a group.

    The columns of its group are attributes too; see `Group.add_column`. The ``__init__`` of a subclass takes
    ``(self, model, group, row)`` and passes them to ``super().__init__``.

    Attributes
    ----------
    group : Group
        Its group.
    """

    team: ClassVar[str | None] = None

    def __init__(self, model: mesa.Model, group: Group, row: int) -> None:
        # Set before mesa registers the agent, so that `WorldHost.add` finds it if __init__ of a subclass fails.
        self.group, self._row = group, row
        super().__init__(model)

    @property
    def row(self) -> int:
        """Its row in the group's arrays; a ValueError after its removal."""
        if self._row < 0:
            raise ValueError(f"{self!r}: was removed from the world and has no state; use another agent")
        return self._row

    @row.setter
    def row(self, row: int) -> None:
        self._row = row

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.unique_id} of {self.group.name!r}>"

    @property
    def position(self) -> Floats:
        """Its position, shape (2,) [length]. A new one must be inside the arena."""
        place: Floats = unwritable(self.group.bodies.position[self.row])
        return place

    @position.setter
    def position(self, value: npt.ArrayLike) -> None:
        self.group.host.place(self, value)

    @property
    def pos(self) -> Floats | None:
        """mesa's name for `position`; None once the agent has been removed."""
        return None if self._row < 0 else self.position

    @pos.setter
    def pos(self, value: npt.ArrayLike | None) -> None:
        # mesa sets None for agents that are in none of its own spaces.
        if value is not None:
            self.position = value

    @property
    def heading(self) -> Floats:
        """Its direction, shape (2,): a unit vector. A new one is normalised."""
        vector: Floats = unwritable(self.group.bodies.heading[self.row])
        return vector

    @heading.setter
    def heading(self, value: npt.ArrayLike) -> None:
        try:
            vector = np.asarray(value, float)
        except (TypeError, ValueError, OverflowError):
            raise TypeError(f"heading={checks.shown(value)}: must be two finite numbers, not both 0") from None
        length = math.hypot(*vector) if vector.shape == (2,) else math.nan
        if not (math.isfinite(length) and length > 0):
            raise ValueError(f"heading={checks.shown(value)}: must be two finite numbers, not both 0")
        self.group.host.turn(self, vector / length)

    speed = _ability("speed", "The largest distance that it can move in a step [length].")
    turn_limit = _ability("turn_limit", "The largest angle that it can turn in a step [rad].")
    sensing_range = _ability("sensing_range", "Distance within which it senses targets [length].")
    awareness_range = _ability("awareness_range", "Distance within which it senses teammates [length].")

    policy = _of_group("policy", "The policy of its group. To give one agent another policy, add a group for it.")
    awareness = _of_group("awareness", "The degree of awareness of its group.")

    @property
    def percept(self) -> PerceptOfOne:
        """Its present percept."""
        self.group.host.perceive(self.group)
        return percept_of_one(self.group.percept, self.row)

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn [rad], distance [length]) for one step: the decision of its group's policy, unless overridden.

        Parameters
        ----------
        percept : PerceptOfOne
            Its percept. A subclass may change it: ``super().decide(percept._replace(speed=0.1), rng)``.
        rng : numpy.random.Generator
            The agent's random numbers for this tick.
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

    def sensed(self, channel: str) -> list[Any]:
        """Return the agents that it senses now in a channel of its group, without false detections.

        Parameters
        ----------
        channel : str
            "targets", "teammates", or a name given to `World.senses`.

        Raises
        ------
        KeyError
            If the group has no such channel.
        """
        relation = self._relation(channel)
        if relation is None and channel not in (TARGETS, TEAMMATES):
            have = ", ".join(map(repr, self.group.channels)) or "none"
            raise KeyError(f"{channel!r}: the group {self.group.name!r} has no such channel, but {have}")
        return relation.agents_sensed(self.row) if relation else []

    def _relation(self, channel: str) -> Relation | None:
        self.group.host.find_neighbours()
        return self.group.relations.get(channel)
