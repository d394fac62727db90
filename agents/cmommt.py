"""CMOMMT: the paper's model, robots that observe moving targets."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Never, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import (
    AwarenessLike,
    Numbers,
    PolicyLike,
    SeedLike,
    Setting,
    refusing,
)
from teamsight.agents.awareness import Awareness, RingAwareness
from teamsight.agents.awareness.registry import awareness_named
from teamsight.agents.body import Robot, Target
from teamsight.agents.channel import TARGETS
from teamsight.agents.decisions import Cycle, CycleLike
from teamsight.agents.events.sources import sources_of
from teamsight.agents.group import Group
from teamsight.agents.presets import PRESETS
from teamsight.agents.resolve import awareness_of, policy_of, shared_options
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.settings import Settings
from teamsight.agents.world import World
from teamsight.agents.world_data import FirstStates
from teamsight.core import checks
from teamsight.core.component import built_from, declared, defaults_of
from teamsight.policies import Policy, Stationary
from teamsight.policies.percept_of_one import Rule
from teamsight.world.arena import Arena, Box, Disc, Torus
from teamsight.world.limits import Limits
from teamsight.world.noise import Stream, stream_number, uniforms
from teamsight.world.placement import Starts


def _live(group: str, name: str, resolve: Callable[[Any, Any], Any] = lambda model, value: value) -> Any:
    """Return a parameter of a model that is the attribute `name` of its group ``model.<group>``.

    ``resolve(model, value)`` returns the value for the group.
    """

    def change(model: Any, parameter: str, value: Any) -> None:
        owner = getattr(model, group, None)
        if owner is None:
            raise AttributeError(f"{name}: belongs to {group}; set it after super().__init__(…)")
        setattr(owner, name, resolve(model, value))

    doc = f"``{group}.{name}``; a new value takes effect from the next step on."
    return Setting(lambda model, parameter: getattr(getattr(model, group), name), change, doc)


_Fixed: TypeAlias = Setting[Any, Never]


def _fixed(cure: str, read: Callable[[Any, str], Any] = lambda model, name: model.settings.get(name)) -> Any:
    """Return a parameter that cannot be changed: by default it is as the model was built. The error has the cure."""

    def refuse(model: Any, name: str, value: Any) -> None:
        raise AttributeError(f"{name}={checks.shown(value)}: is fixed when the model is built; {cure}")

    return Setting(read, refuse, "It is fixed when the model is built.")


def _delta_of(model: Any, name: str) -> Any:
    """Return δ of the robots' degree, or that with which the model was built if it has none."""
    return getattr(model.awareness, name, model.settings.get(name))


def _arena_of(shape: str, radius: float) -> Arena:
    """Return a disc of a radius, or a square of the same area."""
    side = math.sqrt(math.pi) * radius
    return Disc(radius) if shape == "disc" else Torus(side, side) if shape == "torus" else Box(side, side)


class _Numbers(NamedTuple):
    """The arena, the ranges and the speeds of a plan, within the limits of the arena."""

    arena: Arena
    limits: Limits
    sensing_range: float
    awareness_range: float
    robot_speed: float
    target_speed: float

    @classmethod
    def of(cls, plan: Mapping[str, Any]) -> _Numbers:
        arena = _arena_of(plan["arena_shape"], plan["radius"])
        limits = Limits(arena)
        ranges = (limits.range(name, plan[name]) for name in ("sensing_range", "awareness_range"))
        return cls(
            arena, limits, *ranges, *(limits.speed(name, plan[name]) for name in ("robot_speed", "target_speed"))
        )


# Options of policies by name whose defaults are for robots.
_TARGET_OPTIONS = {"random-walk": {"turn_probability": 0.05}}


def target_policy_of(value: Any, options: Mapping[str, Any]) -> Any:
    """Return the policy of the targets: a name with its options, or an object."""
    defaults = _TARGET_OPTIONS.get(value, {}) if isinstance(value, str) else {}
    return policy_of(value, {**defaults, **options}, "target_policy")


def degree_of(plan: Mapping[str, Any]) -> Awareness:
    """Return the degree of awareness of the robots; `delta` is that of a degree given by name."""
    # Checked for every degree, so that a wrong one is never ignored.
    delta = RingAwareness(plan["delta"]).delta
    degree = plan["awareness"]
    made = awareness_named(degree, {"delta": delta}) if isinstance(degree, str) else awareness_of(degree)
    made.check_team(plan["robots"], plan["robots"])
    return made


Floats = npt.NDArray[np.float64]

#: The default of each setting; see `Settings`.
DEFAULTS = {name: value for name, value in defaults_of(Settings).items() if name not in ("rng", "seed", "preset")}
#: The settings that a built world takes anew for its next run.
REWRITTEN = frozenset(name for name, one in declared(Settings).items() if one.allowed.rewritten)


@refusing(
    robots="build another model, or change their number with model.robots.add(5) and robot.remove()",
    targets="build another model, or change their number with model.targets.add(5) and target.remove()",
)
class CMOMMT(World):
    """Robots in a disc that observe as many moving targets as possible.

    Its parameters are the fields of `Settings`.

    Attributes
    ----------
    robots, targets : Group
        The two groups.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a name is unknown.

    Notes
    -----
    *Source:* §4 and §5. *Departs:* speeds, wall and idle behaviour are open in the paper; see docs/model.md.
    """

    @built_from(Settings)
    def __init__(self, settings: Settings) -> None:
        plan = self.settings = {name: value for name, value in vars(settings).items() if name in DEFAULTS}
        preset = {} if settings.preset is None else PRESETS[settings.preset].get("policy_options", {})
        policy = policy_of(plan["policy"], {**shared_options(plan["policy"], preset), **settings.own_options})
        moving = target_policy_of(plan["target_policy"], plan["target_policy_options"])
        degree = degree_of(plan)
        numbers = _Numbers.of(plan)
        for name in ("robot_radius", "target_radius"):
            numbers.limits.radius(name, plan[name])
        super().__init__(numbers.arena, contact=settings.contact, rng=settings.rng, seed=settings.seed)
        self._robots = self.add(
            Robot, settings.robots, policy=policy, awareness=degree, sensing_range=numbers.sensing_range,
            awareness_range=numbers.awareness_range, range_shape=settings.range_shape, speed=numbers.robot_speed,
            placement="spread" if isinstance(policy, Stationary) else "uniform", cycle=settings.cycle,
            radius=settings.robot_radius, drive=settings.drive, lidar=settings.lidar,
        )  # fmt: skip
        self._targets = self.add(
            Target, settings.targets, policy=moving, speed=self._target_speeds(np.arange(settings.targets)),
            sensing_range=numbers.sensing_range, range_shape=settings.range_shape, radius=settings.target_radius,
        )  # fmt: skip
        self.senses(self.robots, self.targets, sensor=settings.sensor)
        self._let_targets_sense()
        for source in sources_of(settings.events):
            self.attach(source, self.robots)
        self._stepper.begin_to_collect()

    @property
    def robots(self) -> Group[Robot]:
        """The robots."""
        return self._robots

    @property
    def targets(self) -> Group[Target]:
        """The targets."""
        return self._targets

    policy: Setting[Policy | Rule, PolicyLike] = _live(
        "robots", "policy",
        # A policy given by name takes the model's options that it has.
        lambda model, value: policy_of(value, shared_options(value, model.settings["policy_options"])),
    )
    awareness: Setting[Awareness, AwarenessLike] = _live(
        "robots", "awareness", lambda model, value: degree_of(model.settings | {"awareness": value})
    )
    sensing_range: Setting[Floats, Numbers] = _live("robots", "sensing_range")
    awareness_range: Setting[Floats, Numbers] = _live("robots", "awareness_range")
    robot_speed: Setting[Floats, Numbers] = _live("robots", "speed")
    target_speed: Setting[Floats, Numbers] = _live("targets", "speed")
    cycle: Setting[Cycle, CycleLike] = _live("robots", "cycle")
    radius: _Fixed = _fixed("build another model")
    arena_shape: _Fixed = _fixed("build another model")
    range_shape: _Fixed = _fixed("build another model")
    drive: _Fixed = _fixed("build another model")
    robot_radius: _Fixed = _fixed("build another model")
    target_radius: _Fixed = _fixed("build another model")
    lidar: _Fixed = _fixed("build another model")
    preset: _Fixed = _fixed("build another model")
    seed: _Fixed = _fixed("start again with reset(rng)")
    delta: _Fixed = _fixed("give the robots another degree, as in model.awareness = RingAwareness(8)", _delta_of)
    uniform_target_speed: _Fixed = _fixed("give the targets other speeds, as in model.target_speed = [0.1, 0.2]")
    policy_options: _Fixed = _fixed("give the robots another policy, as in model.policy = ACmommt(weights='shared')")
    target_policy_options: _Fixed = _fixed(
        "give the targets another policy, as in model.target_policy = RandomWalk(0.1)"
    )

    @property
    def sensor(self) -> Sensor:
        """The sensor with which robots sense targets: ``robots.sensors["targets"]``."""
        return self.robots.sensors[TARGETS]

    @sensor.setter
    def sensor(self, value: Sensor) -> None:
        self.robots.sensors[TARGETS] = value

    @property
    def target_policy(self) -> Policy | Rule:
        """``targets.policy``. Targets whose policy needs what they sense, sense robots."""
        return self.targets.policy

    @target_policy.setter
    def target_policy(self, value: PolicyLike) -> None:
        options = self.settings["target_policy_options"]
        self.targets.policy = target_policy_of(value, shared_options(value, options))
        self._let_targets_sense()

    def _let_targets_sense(self) -> None:
        policy = self.targets.policy
        if isinstance(policy, Policy) and "targets" in policy.needs:
            self.senses(self.targets, self.robots)

    def reset(self, rng: SeedLike = None) -> None:
        """Start again, and collect the present values; see `World.reset`."""
        super().reset(rng)
        self._draw_target_speeds()
        self._stepper.begin_to_collect()

    def _begin(self, seed: int, start: Starts, run: int, states: FirstStates) -> None:
        """Begin a run in the existing arrays; see `StateKeeper.begin`."""
        super()._begin(seed, start, run, states)
        self._draw_target_speeds()

    def _draw_target_speeds(self) -> None:
        if self.settings["uniform_target_speed"]:
            bodies = self.targets.bodies
            # Those that arrived later have the speeds that they were given.
            drawn = bodies.member < self.settings["targets"]
            bodies.speed[drawn] = self._target_speeds(bodies.member[drawn])

    def _take_numbers(self, plan: Mapping[str, Any]) -> None:
        """Set the arena, the ranges and the speeds with which the next run begins; an error changes nothing.

        The plan has the settings of `REWRITTEN`; all others are those of this model.
        """
        # As a new model keeps them: a speed of 0 is 0.0.
        plan = {name: declared(Settings)[name].checked(value) for name, value in plan.items()}
        numbers, lidar = _Numbers.of({**self.settings, **plan}), self.robots.lidar
        if lidar is not None:
            numbers.limits.range("lidar.range", lidar.range)
        self.settings.update(plan)
        self._data.arena = self._data.first_arena = numbers.arena
        self._data.limits = numbers.limits
        self._data.arena_size[:] = numbers.arena.size
        for group, speed in ((self.robots, numbers.robot_speed), (self.targets, numbers.target_speed)):
            group.members.speed[:] = speed
            group.members.sensing_range[:] = numbers.sensing_range
            group.founders = [one._replace(spacing=numbers.sensing_range) for one in group.founders]
        self.robots.members.awareness_range[:] = numbers.awareness_range
        # The width of cells is the range; bodies and rays meet the walls of the arena; and searches know its period.
        has_cells = any(relation.search.has_cells for relation in self._engine.relations)
        if has_cells or self._data.solid or lidar is not None or any(numbers.arena.period):
            self._engine.is_bound = False

    def _target_speeds(self, member: npt.NDArray[np.int64]) -> Any:
        fastest = self.settings["target_speed"]
        if not self.settings["uniform_target_speed"]:
            return fastest
        return fastest * uniforms(self._data.key, stream_number(Stream.PLACEMENT, 1), 0, member, 4)[3]


# For help(CMOMMT): the parameters stand where they are declared.
CMOMMT.__doc__ = inspect.cleandoc(CMOMMT.__doc__ or "").replace(
    "Its parameters are the fields of `Settings`.", inspect.cleandoc(Settings.__doc__ or "").partition("\n\n")[2]
)
