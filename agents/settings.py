"""Settings of groups and agents: typed attributes whose assignment goes to the host, which checks it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, Never, TypeVar, overload

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Awareness
from teamsight.agents.channel import Channel, Sensors
from teamsight.agents.decisions.cycle import EVERY_STEP, Cycle, CycleLike
from teamsight.agents.given import AwarenessLike, Numbers, PolicyLike
from teamsight.agents.host_protocol import Host
from teamsight.core import checks
from teamsight.policies.interface import Policy
from teamsight.policies.percept_of_one import Rule
from teamsight.world.bodies import Bodies
from teamsight.world.motion import limit_of_turn

Got = TypeVar("Got", covariant=True)
Given = TypeVar("Given", contravariant=True)

Floats = npt.NDArray[np.float64]

_set = object.__setattr__


class GroupSetting(Generic[Got, Given]):
    """A setting of a group. Setting it is an adjustment by `World.adjust`."""

    def __init__(self, name: str, get: Callable[[Any], Got], doc: str) -> None:
        self._name, self._get = name, get
        self.__doc__ = f"{doc} A new value takes effect as by `World.adjust`."

    @overload
    def __get__(self, group: None, owner: type) -> GroupSetting[Got, Given]: ...
    @overload
    def __get__(self, group: object, owner: type) -> Got: ...
    def __get__(self, group: Any, owner: type) -> Any:
        return self if group is None else self._get(group)

    def __set__(self, group: Any, value: Given) -> None:
        group.host.adjust(group, **{self._name: value})


class Settings:
    """The settings and arrays of a group, as users see them; `Group` derives from it."""

    bodies: Bodies
    channels: dict[str, Channel]
    host: Host

    # Type checkers would take it for leave to set anything.
    if not TYPE_CHECKING:

        def __setattr__(self, name: str, value: object) -> None:
            if name not in self.__dict__ and not name.startswith("_") and not hasattr(type(self), name):
                known = [one for one in dir(type(self)) if not one.startswith("_")]
                raise AttributeError(
                    f"{name}={checks.shown(value)}: a group has no such attribute; {checks.suggestion(name, known)}"
                    f"for a property of the agents use add_column({name!r}, …)"
                )
            _set(self, name, value)

    @property
    def sensors(self) -> Sensors:
        """The sensors by channel: ``robots.sensors["teammates"] = Sensor(field_of_view=2.0)``."""
        return Sensors(self.channels, self.host.set_sensor)

    @property
    def position(self) -> Floats:
        """The positions, shape (n, 2) [length]. To move an agent, set its own `position`."""
        return readonly(self.bodies.position)

    @property
    def heading(self) -> Floats:
        """The directions, shape (n, 2): unit vectors."""
        return readonly(self.bodies.heading)

    @property
    def identity(self) -> npt.NDArray[np.int64]:
        """The `unique_id` of each agent, shape (n,)."""
        return readonly(self.bodies.identity)

    @property
    def active(self) -> npt.NDArray[np.bool_]:
        """Whether each agent takes part, shape (n,). Set the `active` of one agent."""
        return readonly(self.bodies.active)

    policy: GroupSetting[Policy | Rule, PolicyLike] = GroupSetting(
        "policy", lambda group: group.rules[0], "The policy of all agents."
    )
    awareness: GroupSetting[Awareness, AwarenessLike] = GroupSetting(
        "awareness", lambda group: group.rules[1], "What they perceive of teammates."
    )
    sensing_range: GroupSetting[Floats, Numbers] = GroupSetting(
        "sensing_range", lambda group: readonly(group.ranges[0]),
        "Distance within which each senses targets, shape (n,) [length].",
    )  # fmt: skip
    awareness_range: GroupSetting[Floats, Numbers] = GroupSetting(
        "awareness_range", lambda group: readonly(group.ranges[1]),
        "Distance within which each senses teammates, shape (n,) [length].",
    )  # fmt: skip
    speed: GroupSetting[Floats, Numbers] = GroupSetting(
        "speed", lambda group: readonly(group.bodies.speed),
        "The largest distance that each can move in a step, shape (n,) [length].",
    )  # fmt: skip
    turn_limit: GroupSetting[Floats, Numbers] = GroupSetting(
        "turn_limit", lambda group: readonly(limit_of_turn(group.bodies.turn_cosine, group.bodies.turn_sine)),
        "The largest angle that each can turn in a step, shape (n,) [rad].",
    )  # fmt: skip
    cycle: GroupSetting[Cycle, CycleLike] = GroupSetting(
        "cycle", lambda group: group.timetable.cycle() if group.timetable else EVERY_STEP, "When they sense and decide."
    )


class Ability:
    """An ability of an agent: one element of an array of its group."""

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, agent: None, owner: type) -> Ability: ...
    @overload
    def __get__(self, agent: object, owner: type) -> float: ...
    def __get__(self, agent: Any, owner: type) -> Ability | float:
        return self if agent is None else float(getattr(agent.group, self._name)[agent.row])

    def __set__(self, agent: Any, value: float) -> None:
        agent.group.host.adjust_one(agent, self._name, value)


class CycleOfOne:
    """The cycle of an agent, one row of its group's timetable."""

    @overload
    def __get__(self, agent: None, owner: type) -> CycleOfOne: ...
    @overload
    def __get__(self, agent: object, owner: type) -> Cycle: ...
    def __get__(self, agent: Any, owner: type) -> CycleOfOne | Cycle:
        if agent is None:
            return self
        row, table = agent.row, agent.group.timetable
        return table.cycle([row]) if table else EVERY_STEP

    def __set__(self, agent: Any, value: CycleLike) -> None:
        agent.group.host.set_cycle(agent, value)


class PolicyOfOne:
    """The policy of an agent: that of its group, or its own."""

    @overload
    def __get__(self, agent: None, owner: type) -> PolicyOfOne: ...
    @overload
    def __get__(self, agent: object, owner: type) -> Policy | Rule: ...
    def __get__(self, agent: Any, owner: type) -> PolicyOfOne | Policy | Rule:
        if agent is None:
            return self
        policy: Policy | Rule = agent.group.policy_of(agent.row)
        return policy

    def __set__(self, agent: Any, value: PolicyLike) -> None:
        agent.group.host.set_policy(agent, value)


class OfGroup(Generic[Got]):
    """An attribute of an agent that belongs to its group and cannot be set on one agent."""

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, agent: None, owner: type) -> OfGroup[Got]: ...
    @overload
    def __get__(self, agent: object, owner: type) -> Got: ...
    def __get__(self, agent: Any, owner: type) -> Any:
        return self if agent is None else getattr(agent.group, self._name)

    # Of type Never, so that type checkers refuse every value too.
    def __set__(self, agent: Any, value: Never) -> None:
        given: Any = value
        shown = given if isinstance(given, str) else checks.shown(given)
        raise AttributeError(
            f"{self._name}={shown}: belongs to the group {agent.group.name!r}; set group.{self._name} for all agents, "
            "or add a group for this one"
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


def readonly(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a read-only view."""
    view = array.view()
    view.flags.writeable = False
    return view
