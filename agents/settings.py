"""The settings of `CMOMMT`. Nothing slow is imported here, so that commands show them at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias

from teamsight.agents.awareness.registry import AWARENESS, Delta
from teamsight.agents.presets import PRESETS
from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Flag, NonNegative, Panel
from teamsight.policies.registry import POLICIES
from teamsight.world.limits import Length
from teamsight.world.registry import CONTACTS, DRIVES, ContactName, DriveName

if TYPE_CHECKING:
    from teamsight.agents.attributes import AwarenessLike, PolicyLike, SeedLike
    from teamsight.agents.decisions import CycleLike
    from teamsight.agents.events.sources import EventSource
    from teamsight.agents.sensing.lidar import Lidar
    from teamsight.agents.sensing.sensor import Sensor
    from teamsight.world.contact import Contact
    from teamsight.world.drive import Drive

RangeShape: TypeAlias = Literal["disc", "square"]
ArenaShape: TypeAlias = Literal["disc", "square", "torus"]
PresetName: TypeAlias = Literal["touzet2000"]

#: Agents of a group.
MOST_AGENTS = 10_000_000


def _period(name: str, value: Any) -> Any:
    """Return a period; a cycle has checked itself."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return value
    return checks.number(name, value, least=1, most=1e12, cure="a robot decides at most once in each step")


def _options(name: str, value: Any) -> dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise TypeError(f"{name}={checks.shown(value)}: must be a mapping, such as {{'weights': 'shared'}}")
    return dict(value)


# Where the live page shows a setting. A page draws all agents, and more than 2,000 are slow.
_TEAM, _TARGETS, _WORLD = (Allowed(section=name) for name in ("Robots", "Targets", "World"))
_NUMBER = Annotated[int, Allowed(least=1, most=MOST_AGENTS, panel=Panel(1, 100, most=2000))]
_RANGE = Annotated[Length, Allowed(live=True, rewritten=True, panel=Panel(0.1, 5, 0.01, 100))]
_SPEED = Annotated[
    NonNegative,
    Allowed(live=True, rewritten=True, unit="length a step", label="speed", panel=Panel(0.005, 0.5, 0.001, 10)),
]
_BODY = Annotated[NonNegative, Allowed(unit="length", label="body radius", panel=Panel(0.01, 1, most=10))]
_OPTIONS = Annotated[Mapping[str, Any], Allowed(check=_options)]


@dataclass(frozen=True)
class Settings(Component):
    """The settings of `CMOMMT`.

    Parameters
    ----------
    robots : int
        Number of robots.
    targets : int
        Number of targets.
    radius : float
        Radius of the arena.
    arena_shape : {"disc", "square", "torus"}
        Shape of the arena: a disc of this radius, or a square of the same area, with walls or, as a torus, without:
        what leaves on one side enters on the other. On a torus ranges are at most half of the side.
    policy : str or Policy
        Policy of the robots: a name, "module:Class", or an object. Stationary robots are spread over the arena; all
        others are placed uniformly.
    awareness : str or Awareness
        What robots perceive of teammates: a degree of awareness by name, or an object.
    delta : int
        Number δ of sectors of "ring", or of teammates of "nearest"; other degrees have none.
    sensing_range : float
        Distance within which robots and targets sense each other.
    awareness_range : float
        Distance within which two robots are neighbours.
    range_shape : {"disc", "square"}
        Shape of all ranges; see `World.add`.
    contact : Contact or {"pass", "stop", "slide"}
        What happens when bodies that have a radius meet; see `World`.
    drive : Drive or {"free", "differential", "car"}
        How robots carry out their actions; see `World.add`.
    robot_radius, target_radius : float
        Radius of the body of a robot, and of a target; by default they are points.
    sensor : Sensor, optional
        The sensor with which robots sense targets; by default exact. That of teammates is
        ``robots.sensors["teammates"]``.
    lidar : Lidar, optional
        A lidar that each robot has; by default none.
    robot_speed : float
        Largest distance of a robot's step.
    target_speed : float
        Largest distance of a target's step.
    uniform_target_speed : bool
        Whether each target has a speed of its own, uniform between 0 and the target speed.
    cycle : Cycle or float
        When robots sense and decide; a number is the period in ticks. Targets do so at every step.
    target_policy : str or Policy
        Policy of the targets; "random-walk" turns with a probability of 5 % in a step. Targets sense the robots if
        their policy declares that it needs ``"targets"``.
    policy_options : mapping of str to object, optional
        Options of a policy given by name: the parameters of its class, such as ``{"weights": "shared"}``.
    target_policy_options : mapping of str to object, optional
        The same for the policy of the targets.
    events : EventSource or list of EventSource, optional
        Event sources, such as ``Failures(500, 50)``, of which copies are attached to the robots, in this order. In a
        sweep, as by `run_many`, a list is several values; ``[[a, b]]`` is one, with both.
    preset : str, optional
        Values for what the paper leaves open: they replace defaults. Its policy options apply to a policy given by
        name, if it has them. See docs/calibration.md.
    rng, seed : int, optional
        Two names for the seed; see `World` for what else they may be.
    """

    robots: Annotated[_NUMBER, _TEAM] = 10
    targets: Annotated[_NUMBER, _TARGETS] = 15
    radius: Annotated[Length, _WORLD, Allowed(rewritten=True, panel=Panel(0.5, 30, 0.5, 200))] = 5.0
    _: KW_ONLY
    policy: Annotated[PolicyLike, _TEAM, Allowed(choices=POLICIES, live=True)] = "a-cmommt"
    awareness: Annotated[AwarenessLike, _TEAM, Allowed(choices=AWARENESS, live=True)] = "pairwise"
    delta: Annotated[
        Delta, _TEAM,
        Allowed(live=True, label="δ", panel=Panel(1, 64, most=360, only="awareness=ring,nearest")),
    ] = 16  # fmt: skip
    sensing_range: Annotated[_RANGE, _TEAM] = 1.0
    awareness_range: Annotated[_RANGE, _TEAM] = 1.0
    arena_shape: Annotated[ArenaShape, _WORLD] = "disc"
    range_shape: Annotated[RangeShape, _WORLD] = "disc"
    contact: Annotated[Contact | ContactName, _WORLD, Allowed(choices=CONTACTS)] = "pass"
    drive: Annotated[Drive | DriveName, _TEAM, Allowed(choices=DRIVES)] = "free"
    robot_radius: Annotated[_BODY, _TEAM] = 0.0
    target_radius: Annotated[_BODY, _TARGETS] = 0.0
    sensor: Sensor | None = None
    lidar: Lidar | None = None
    robot_speed: Annotated[_SPEED, _TEAM] = 0.1
    target_speed: Annotated[_SPEED, _TARGETS] = 0.075
    uniform_target_speed: Annotated[Flag, _TARGETS, Allowed(label="own speeds")] = False
    cycle: Annotated[
        CycleLike, _TEAM,
        Allowed(least=1, most=1e12, check=_period, unit="ticks", live=True, label="decide every",
                panel=Panel(1, 50, most=1000)),
    ] = 1.0  # fmt: skip
    target_policy: Annotated[
        PolicyLike, _TARGETS,
        Allowed(choices=POLICIES, live=True, label="policy",
                panel=Panel(names=("random-walk", "evasive", "stationary"))),
    ] = "random-walk"  # fmt: skip
    policy_options: Annotated[_OPTIONS, _TEAM] = field(default_factory=dict)
    target_policy_options: Annotated[_OPTIONS, _TARGETS] = field(default_factory=dict)
    events: EventSource | Sequence[EventSource] | None = None
    preset: Annotated[PresetName | None, _WORLD] = None
    rng: SeedLike = None
    seed: SeedLike = None
    #: The policy options that were given, without those of the preset.
    own_options: Mapping[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        """Return the settings for the values that were given: a preset replaces the defaults of the others.

        Raises
        ------
        TypeError, ValueError
            If a value is of the wrong type or outside its limits, or a name is unknown.
        """
        preset = values.get("preset")
        chosen = {} if preset is None else PRESETS[checks.choice("preset", preset, PRESETS)]
        own = _options("policy_options", values.get("policy_options"))
        options = {**chosen.get("policy_options", {}), **own}
        made = cls(**{**chosen, **values, "policy_options": options})
        object.__setattr__(made, "own_options", own)
        return made
