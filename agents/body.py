"""Bodies: what robots and targets have in common. An agent is a view of one row of its group's arrays."""

from __future__ import annotations

from functools import wraps
from types import FunctionType
from typing import TYPE_CHECKING, Any, ClassVar, Never

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import Kept, Points, PolicyLike, Setting, refusing, unwritable
from teamsight.agents.awareness.interface import Awareness
from teamsight.agents.channel import TARGETS, TEAMMATES, channel_of
from teamsight.agents.decisions import EVERY_STEP, Cycle, CycleLike
from teamsight.agents.mesa.bases import Agent
from teamsight.core import checks
from teamsight.core.card import shown
from teamsight.core.interrupts import deferred
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import PerceptOfOne, Rule, percept_of_one
from teamsight.world.arena import Arena

if TYPE_CHECKING:
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.group import Group

Floats = npt.NDArray[np.float64]


def checked_positions(arena: Arena, value: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Check positions; return them as an array of this shape. One position of shape (2,) may stand for all.

    Raises
    ------
    TypeError, ValueError
        If the shape is wrong, a number is not finite, or a position lies outside.
    """
    try:
        position = np.array(value, float)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"position={checks.shown(value)}: must be numbers of shape {shape}") from None
    if position.shape not in (shape, (2,)):
        raise ValueError(f"position: has the shape {position.shape}; it must be {shape}")
    inside = arena.contains(position) & np.isfinite(position).all(axis=-1)
    if not inside.all():
        wrong = position[~inside][0] if position.ndim == 2 else position
        raise ValueError(f"position={tuple(wrong.tolist())}: must be two finite numbers inside the arena, {arena}")
    return np.array(np.broadcast_to(position, shape))


def checked_headings(value: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Check directions; return them as unit vectors of this shape. One direction of shape (2,) may stand for all.

    Raises
    ------
    TypeError, ValueError
        If the shape is wrong, a number is not finite, or both numbers of a direction are 0.
    """
    cure = "must be two finite numbers, not both 0"
    try:
        vectors = np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"heading={checks.shown(value)}: {cure}") from None
    if vectors.shape not in (shape, (2,)):
        each = f"; or {shape[0]} of them, one for each agent" if len(shape) == 2 else ""
        raise ValueError(f"heading={checks.shown(value)}: {cure}{each}")
    lengths = np.hypot(vectors[..., 0], vectors[..., 1])
    wrong = ~(np.isfinite(lengths) & (lengths > 0))
    if wrong.any():
        shown = vectors[wrong][0].tolist() if vectors.ndim == 2 else value
        raise ValueError(f"heading={checks.shown(shown)}: {cure}")
    return np.array(np.broadcast_to(vectors / lengths[..., np.newaxis], shape))


def _ability(doc: str) -> Setting[float, float]:
    """Return an ability of an agent: one element of an array of its group."""
    return Setting(
        lambda agent, name: float(getattr(agent.group, name)[agent.row]),
        lambda agent, name, value: agent.group.host.adjust_one(agent, name, value),
        doc,
    )


def _refuse_of_group(agent: Any, name: str, value: Any) -> None:
    shown = value if isinstance(value, str) else checks.shown(value)
    raise AttributeError(
        f"{name}={shown}: belongs to the group {agent.group.name!r}; set group.{name} for all agents, or add a group "
        "for this one"
    )


class Team:
    """The team of an agent's group; read from a class, that of its groups by default."""

    def __init__(self, default: str | None) -> None:
        self._default = default

    def __get__(self, agent: Any, owner: type) -> str | None:
        team: str | None = self._default if agent is None else agent.group.team
        return team

    def __set__(self, agent: Any, value: Never) -> None:
        raise AttributeError(
            f"team={checks.shown(value)}: the group {agent.group.name!r} was added to a team; give the team "
            "when a group is added, as in world.add(…, team='rivals')"
        )


@refusing(
    identity="the world gives it; take another name for an attribute of your own",
    radius="give the radius when a group is added, as in world.add(…, radius=0.1)",
    bumps="it is counted",
    drive_state="its drive writes it in each step",
)
class Body(Agent):
    """An agent in a world: a mesa agent that has a place and moves. `World.add` and `Group.add` make agents.

    A new role is a subclass, or a group of these with a name. A subclass may override `decide`, to replace the policy
    of its group, or `step`, which is called before each step; then the model makes its steps one by one. Its
    ``__init__`` takes the model and whatever else it needs, calls ``super().__init__(model)``, and gets the further
    arguments of `add`. Place, speed and ranges are set before.

    The columns of its group are attributes too; see `Group.add_column`. For type checkers, declare those in the class
    (``battery: float``), and the model (``model: MyModel``).

    Parameters
    ----------
    model : World
        Its model.

    Attributes
    ----------
    team : str or None
        The team of its group: agents of one team are teammates. In a class, the team of its groups by default.
    group : Group
        Its group.

    Raises
    ------
    TypeError
        If an agent is made without `add`.
    """

    team: ClassVar[str | None] = Team(None)  # type: ignore[assignment]
    group: Group = Kept("add an agent to the other group, and remove this one")  # type: ignore[assignment]
    # A user's agents read attributes of their own model; a class that declares `model: MyModel` has them checked.
    model: Any
    _row: int

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        team = vars(cls).get("team")
        if "team" in vars(cls) and not isinstance(team, Team):
            cls.team = Team(team)  # type: ignore[assignment]
        if isinstance(own := vars(cls).get("step"), FunctionType):
            cls.step = _noted(own)  # type: ignore[method-assign]

    def __init__(self, model: Any) -> None:
        if "group" not in self.__dict__:
            name = type(self).__name__
            raise TypeError(
                f"{name}(…): agents belong to a group, which makes them; use world.add({name}, 1, policy=…), or "
                "group.add(1) for one more in a group"
            )
        super().__init__(model)
        self.group.bodies.identity[self._row] = self.unique_id

    @property
    def row(self) -> int:
        """Its row in the group's arrays; a ValueError after its removal."""
        if self._row < 0:
            raise ValueError(f"{self!r}: was removed from the world and has no state; use another agent")
        return self._row

    @row.setter
    def row(self, row: int) -> None:
        self._row = row

    @property
    def identity(self) -> int:
        """Its `unique_id`, as in the arrays of its group and in neighbour lists."""
        return self.unique_id

    def __repr__(self) -> str:
        # No number yet while it is made.
        number = vars(self).get("unique_id", "")
        is_inactive = self._row >= 0 and not self.group.bodies.active[self._row]
        return f"<{type(self).__name__} {number} of {self.group.name!r}{', inactive' if is_inactive else ''}>"

    def _repr_html_(self) -> str | None:
        from teamsight.agents.group_card import agent_html

        return shown(lambda: agent_html(self, self.group, self._row))

    @property
    def position(self) -> Floats:
        """Its position, shape (2,) [length]. A new one must be inside the arena."""
        place: Floats = unwritable(self.group.bodies.position[self.row])
        return place

    @position.setter
    def position(self, value: Points) -> None:
        self.group.host.place(self, value)

    @property
    def pos(self) -> Floats | None:
        """mesa's name for `position`; None once the agent has been removed."""
        return None if self._row < 0 else self.position

    @pos.setter
    def pos(self, value: Points | None) -> None:
        # mesa sets None for agents that are in none of its own spaces.
        if value is not None:
            self.position = value

    @property
    def heading(self) -> Floats:
        """Its direction, shape (2,): a unit vector. A new one is normalised."""
        vector: Floats = unwritable(self.group.bodies.heading[self.row])
        return vector

    @heading.setter
    def heading(self, value: Points) -> None:
        self.group.host.turn(self, checked_headings(value, (2,)))

    speed = _ability("The largest distance that it can move in a step [length].")
    turn_limit = _ability("The largest angle that it can turn in a step [rad].")
    sensing_range = _ability("Distance within which it senses targets [length].")
    awareness_range = _ability("Distance within which it senses teammates [length].")

    @property
    def radius(self) -> float:
        """The radius of its body [length]; it cannot be changed."""
        return float(self.group.bodies.radius[self.row])

    @property
    def bumps(self) -> int:
        """How often another body has come into its way, so that it could not go on; see `World`."""
        return int(self.group.bodies.bumps[self.row])

    @property
    def drive_state(self) -> dict[str, float]:
        """What its drive keeps of it, such as the speeds of its wheels; see `Drive.state`."""
        return {name: float(values[self.row]) for name, values in self.group.drive_state.items()}

    active: Setting[bool, bool] = Setting(
        lambda agent, _: bool(agent.group.bodies.active[agent.row]),
        lambda agent, _, active: agent.group.host.set_active(agent, active),
        "Whether it takes part. If not, it neither moves nor decides, senses nobody and is sensed by nobody.",
    )
    policy: Setting[Policy | Rule, PolicyLike] = Setting(
        lambda agent, _: agent.group.policy_of(agent.row),
        lambda agent, _, policy: agent.group.host.set_policy(agent, policy),
        "The policy of an agent: that of its group, or its own.",
    )
    cycle: Setting[Cycle, CycleLike] = Setting(
        lambda agent, _: agent.group.timetable.cycle([agent.row]) if agent.group.timetable else EVERY_STEP,
        lambda agent, _, cycle: agent.group.host.set_cycle(agent, cycle),
        "The cycle of an agent, one row of its group's timetable.",
    )
    # Of type Never, so that type checkers refuse every value too.
    awareness: Setting[Awareness, Never] = Setting(
        lambda agent, _: agent.group.awareness, _refuse_of_group, "The degree of awareness of its group."
    )

    @property
    def percept(self) -> PerceptOfOne:
        """Its present percept."""
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

    def step(self) -> None:
        """Called before each step of the world, if a subclass overrides it. It moves nobody: `World.step` does."""
        self.model._stepper.note_step_of(self)

    @property
    def neighbours(self) -> list[Body]:
        """The teammates within awareness range, whether or not the degree of awareness shows them."""
        relation = self._relation(TEAMMATES)
        return relation.agents(relation.graph.start, relation.graph.identity, self.row) if relation else []

    @property
    def observed_targets(self) -> list[Body]:
        """The agents that it senses as "targets"."""
        return self.sensed(TARGETS)

    @property
    def observers(self) -> list[Body]:
        """The agents that sense this one, except its teammates."""
        return self.group.host.observers_of(self)

    @property
    def is_observed(self) -> bool:
        """Whether it is sensed in a channel that counts in the observed fraction."""
        return bool(self.group.host.observers_of(self, counted=True))

    @property
    def situation(self) -> npt.NDArray[np.float32]:
        """The inputs of a learner, shape (width,): 16 target sectors and what the degree of awareness adds (§8)."""
        moment = self.group.host.find_neighbours()
        return np.array(self.group.perception.situate(self.group.awareness, moment)[self.row])

    def get_neighbors_in_radius(self, radius: float = 1) -> tuple[list[Any], Floats]:
        """Return the other agents within a radius, of all groups, and their distances [length]; mesa's method."""
        return self.group.host.space.get_neighbors_in_radius(self, radius)

    def get_nearest_neighbors(self, k: int = 1) -> tuple[list[Any], Floats]:
        """Return the `k` nearest other agents, of all groups, and their distances [length]; mesa's method."""
        return self.group.host.space.get_nearest_neighbors(self, k)

    def remove(self) -> None:
        """Remove the agent from the world.

        Raises
        ------
        ValueError
            If it was removed before; `pos` is None then.
        """
        if self._row < 0:
            raise ValueError(f"{self!r}: was removed already; test whether agent.pos is None before agent.remove()")
        leave = super().remove
        with deferred():
            self.group.host.remove(self, leave)
            self._row = -1

    def sensed(self, channel: str) -> list[Body]:
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
        if channel not in (TARGETS, TEAMMATES):
            channel_of(self.group, channel)
        relation = self._relation(channel)
        return relation.agents(*relation.true_lists, self.row) if relation else []

    def break_sensor(self, channel: str) -> None:
        """Put its sensor of a channel out of order: it senses nobody in that channel, from now until its repair.

        Parameters
        ----------
        channel : str
            "targets", "teammates", or a name given to `World.senses`.

        Raises
        ------
        KeyError
            If its group has no such channel.
        RuntimeError
            If called while a group decides.
        """
        self.group.host.switch(self, channel_of(self.group, channel).works, False, "break_sensor()", channel)

    def repair_sensor(self, channel: str) -> None:
        """Put its sensor of a channel in order again; see `break_sensor`."""
        self.group.host.switch(self, channel_of(self.group, channel).works, True, "repair_sensor()", channel)

    def sensor_works(self, channel: str) -> bool:
        """Return whether its sensor of a channel works; see `break_sensor`."""
        return bool(channel_of(self.group, channel).works[self.row])

    def _relation(self, channel: str) -> Relation | None:
        self.group.host.find_neighbours()
        return self.group.relations.get(channel)


def _noted(step: Any) -> Any:
    """Return a user's ``step`` of an agent, which notes who calls it."""

    @wraps(step)
    def noted(self: Body, *arguments: Any, **named: Any) -> Any:
        self.model._stepper.note_step_of(self)
        return step(self, *arguments, **named)

    return noted


class Robot(Body):
    """A robot of the team "robots", unless `World.add` names another team; see `Body`."""

    team: ClassVar[str | None] = "robots"


class Target(Body):
    """A target, on no team. To avoid robots it must sense them: ``world.senses(targets, robots)``."""
