"""CMOMMT: the paper's model, robots that observe moving targets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Never

import numpy as np
import numpy.typing as npt

from teamsight.agents.attributes import (
    AwarenessLike,
    Given,
    Got,
    Numbers,
    PolicyLike,
    PresetName,
    RangeShape,
    SeedLike,
    Setting,
    refusing,
)
from teamsight.agents.awareness import Awareness, RingAwareness
from teamsight.agents.awareness.registry import awareness_named
from teamsight.agents.body import Robot, Target
from teamsight.agents.building import MOST_AGENTS
from teamsight.agents.channel import TARGETS
from teamsight.agents.decisions import EVERY_STEP, Cycle, CycleLike
from teamsight.agents.events.sources import sources_of
from teamsight.agents.group import Group
from teamsight.agents.presets import PRESETS
from teamsight.agents.resolve import awareness_of, checked_options, policy_of, shared_options
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.world import World
from teamsight.agents.world_data import FirstStates
from teamsight.core import checks
from teamsight.policies import Policy, Stationary
from teamsight.policies.percept_of_one import Rule
from teamsight.world.arena import Disc
from teamsight.world.limits import Limits, length
from teamsight.world.noise import Stream, stream_number, uniforms
from teamsight.world.placement import Starts

if TYPE_CHECKING:
    from teamsight.agents.events.sources import EventSource


class LiveSetting(Setting[Got, Given]):
    """A parameter of a model that is the attribute `name` of its group ``model.<group>``.

    ``resolve(model, value)`` returns the value for the group.
    """

    def __init__(self, group: str, name: str, resolve: Callable[[Any, Any], Any] = lambda model, value: value) -> None:
        def change(model: Any, parameter: str, value: Any) -> None:
            owner = getattr(model, group, None)
            if owner is None:
                raise AttributeError(f"{name}: belongs to {group}; set it after super().__init__(…)")
            setattr(owner, name, resolve(model, value))

        doc = f"``{group}.{name}``; a new value takes effect from the next step on."
        super().__init__(lambda model, parameter: getattr(getattr(model, group), name), change, doc)


class FixedSetting:
    """A parameter that cannot be changed.

    The error names the `cure`. The value is that of the model's attribute `source`, under the parameter's name; by
    default that with which the model was built.
    """

    def __init__(self, cure: str, source: str | None = None) -> None:
        self._cure, self._source = cure, source

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, model: Any, owner: type | None = None) -> Any:
        if model is None:
            return self
        built = model.settings.get(self._name)
        return built if self._source is None else getattr(getattr(model, self._source), self._name, built)

    def __set__(self, model: Any, value: Never) -> None:
        raise AttributeError(f"{self._name}={checks.shown(value)}: is fixed when the model is built; {self._cure}")


class CheckedNumbers(NamedTuple):
    """The settings that differ between runs of equal worlds; see the parameters of `CMOMMT`."""

    arena: Disc
    limits: Limits
    sensing_range: float
    awareness_range: float
    robot_speed: float
    target_speed: float


def checked_numbers(plan: Mapping[str, Any]) -> CheckedNumbers:
    """Return the arena, the ranges and the speeds of a plan.

    Raises
    ------
    TypeError, ValueError
        If one is not a number or outside its limits.
    """
    arena = Disc(length("radius", plan["radius"]))
    limits = Limits(arena)
    sensing, aware = (limits.range(name, plan[name]) for name in ("sensing_range", "awareness_range"))
    speeds = (limits.speed(name, plan[name]) for name in ("robot_speed", "target_speed"))
    return CheckedNumbers(arena, limits, sensing, aware, *speeds)


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
    return awareness_named(degree, {"delta": delta}) if isinstance(degree, str) else awareness_of(degree)


Floats = npt.NDArray[np.float64]

DEFAULTS: dict[str, Any] = {
    "robots": 10,
    "targets": 15,
    "radius": 5.0,
    "policy": "a-cmommt",
    "awareness": "pairwise",
    "delta": 16,
    "sensing_range": 1.0,
    "awareness_range": 1.0,
    "range_shape": "disc",
    "sensor": None,
    "robot_speed": 0.1,
    "target_speed": 0.075,
    "cycle": EVERY_STEP,
    "uniform_target_speed": False,
    "target_policy": "random-walk",
    "policy_options": {},
    "target_policy_options": {},
    "events": None,
}


class _Default:
    """A default value, told apart from the same value given by a user: a preset replaces what is not given."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __repr__(self) -> str:
        return repr(self.value)


_DEFAULT: dict[str, Any] = {name: _Default(value) for name, value in DEFAULTS.items()}


@refusing(
    robots="build another model, or change their number with model.robots.add(5) and robot.remove()",
    targets="build another model, or change their number with model.targets.add(5) and target.remove()",
)


class CMOMMT(World):
    """Robots in a disc that observe as many moving targets as possible.

    Parameters
    ----------
    robots, targets : int
        The numbers of robots and targets; by default 10 and 15.
    radius : float
        The radius of the arena [length]; by default 5.
    policy : str or Policy
        The policy of the robots: a name, by default "a-cmommt", or an object. Stationary robots are spread over the
        arena; all others are placed uniformly.
    awareness : str or Awareness
        What they perceive of teammates: "none", "ring", "nearest", "pairwise" (the default), "shared", or an
        object.
    delta : int
        The number of sectors of "ring", or of teammates of "nearest"; by default 16.
    sensing_range, awareness_range : float
        Distances within which they sense targets and teammates [length]; by default 1.
    range_shape : {"disc", "square"}
        The shape of all ranges; see `World.add`.
    sensor : Sensor, optional
        The sensor with which robots sense targets; by default exact. That of teammates is
        ``robots.sensors["teammates"]``.
    robot_speed, target_speed : float
        The largest distance of a step [length]; by default 0.1 and 0.075.
    uniform_target_speed : bool
        Whether each target has a speed of its own, uniform between 0 and `target_speed`.
    cycle : Cycle or float
        When robots sense and decide; a number is a period [ticks]. By default at every step, as targets do.
    target_policy : str or Policy
        The policy of the targets: "random-walk" (the default), which turns with a probability of 5 % in a step,
        "evasive", or another. Targets sense the robots if their policy declares that it needs ``"targets"``.
    policy_options, target_policy_options : mapping of str to object, optional
        The options of a policy given by name: the parameters of its class, such as ``{"weights": "shared"}``.
    events : EventSource or list of EventSource, optional
        Event sources, such as ``Failures(500, 50)``, of which copies are attached to the robots, in this order. In a
        sweep, as by `run_many`, a list is several values; ``[[a, b]]`` is one, with both.
    preset : str, optional
        "touzet2000" sets parameters that are not given to the values chosen by calibration. Its policy options apply to
        a policy given by name, if it has them.
    rng, seed : int, optional
        Two names for the seed; see `World` for what else they may be.

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

    def __init__(
        self,
        robots: int = _DEFAULT["robots"],
        targets: int = _DEFAULT["targets"],
        radius: float = _DEFAULT["radius"],
        *,
        policy: PolicyLike = _DEFAULT["policy"],
        awareness: AwarenessLike = _DEFAULT["awareness"],
        delta: int = _DEFAULT["delta"],
        sensing_range: float = _DEFAULT["sensing_range"],
        awareness_range: float = _DEFAULT["awareness_range"],
        range_shape: RangeShape = _DEFAULT["range_shape"],
        sensor: Sensor | None = _DEFAULT["sensor"],
        robot_speed: float = _DEFAULT["robot_speed"],
        target_speed: float = _DEFAULT["target_speed"],
        uniform_target_speed: bool = _DEFAULT["uniform_target_speed"],
        cycle: CycleLike = _DEFAULT["cycle"],
        target_policy: PolicyLike = _DEFAULT["target_policy"],
        policy_options: Mapping[str, Any] = _DEFAULT["policy_options"],
        target_policy_options: Mapping[str, Any] = _DEFAULT["target_policy_options"],
        events: EventSource | Sequence[EventSource] | None = _DEFAULT["events"],
        preset: PresetName | None = None,
        rng: SeedLike = None,
        seed: SeedLike = None,
    ) -> None:
        values: dict[str, Any] = {
            "robots": robots, "targets": targets, "radius": radius, "policy": policy, "awareness": awareness,
            "delta": delta, "sensing_range": sensing_range, "awareness_range": awareness_range,
            "range_shape": range_shape, "sensor": sensor,
            "robot_speed": robot_speed, "target_speed": target_speed, "uniform_target_speed": uniform_target_speed,
            "cycle": cycle,
            "target_policy": target_policy, "policy_options": policy_options,
            "target_policy_options": target_policy_options, "events": events,
        }  # fmt: skip
        given = {name: value for name, value in values.items() if not isinstance(value, _Default)}
        chosen = PRESETS[checks.choice("preset", preset, PRESETS)] if preset is not None else {}
        options = checked_options(given.pop("policy_options", None))
        target_options = checked_options(given.pop("target_policy_options", None), "target_policy")
        self.settings: dict[str, Any] = {**DEFAULTS, **chosen, **given}
        plan = self.settings
        preset_options = plan["policy_options"]
        plan["policy_options"], plan["target_policy_options"] = {**preset_options, **options}, target_options
        rules = (
            policy_of(plan["policy"], shared_options(plan["policy"], preset_options) | options),
            target_policy_of(plan["target_policy"], target_options),
        )
        degree = degree_of(plan)
        count = tuple(checks.count(name, plan[name], most=MOST_AGENTS) for name in ("robots", "targets"))
        checks.flag("uniform_target_speed", plan["uniform_target_speed"])
        numbers = checked_numbers(plan)
        super().__init__(numbers.arena, rng=rng, seed=seed)
        self._robots = self.add(
            Robot, count[0], policy=rules[0], awareness=degree, sensing_range=numbers.sensing_range,
            awareness_range=numbers.awareness_range, range_shape=plan["range_shape"], speed=numbers.robot_speed,
            placement="spread" if isinstance(rules[0], Stationary) else "uniform", cycle=plan["cycle"],
        )  # fmt: skip
        self._targets = self.add(
            Target, count[1], policy=rules[1], speed=self._target_speeds(np.arange(count[1])),
            sensing_range=numbers.sensing_range, range_shape=plan["range_shape"],
        )  # fmt: skip
        self.senses(self.robots, self.targets, sensor=plan["sensor"])
        self._let_targets_sense()
        for source in sources_of(plan["events"]):
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

    policy = LiveSetting[Policy | Rule, PolicyLike](
        "robots", "policy", lambda model, value: model._robot_policy(value)
    )
    awareness = LiveSetting[Awareness, AwarenessLike](
        "robots", "awareness", lambda model, value: degree_of(model.settings | {"awareness": value})
    )
    sensing_range = LiveSetting[Floats, Numbers]("robots", "sensing_range")
    awareness_range = LiveSetting[Floats, Numbers]("robots", "awareness_range")
    robot_speed = LiveSetting[Floats, Numbers]("robots", "speed")
    target_speed = LiveSetting[Floats, Numbers]("targets", "speed")
    cycle = LiveSetting[Cycle, CycleLike]("robots", "cycle")
    radius = FixedSetting("build another model")
    range_shape = FixedSetting("build another model")
    preset = FixedSetting("build another model")
    seed = FixedSetting("start again with reset(rng)")
    delta = FixedSetting("give the robots another degree, as in model.awareness = RingAwareness(8)", "awareness")
    uniform_target_speed = FixedSetting("give the targets other speeds, as in model.target_speed = [0.1, 0.2]")
    policy_options = FixedSetting("give the robots another policy, as in model.policy = ACmommt(weights='shared')")
    target_policy_options = FixedSetting("give the targets another policy, as in model.target_policy = RandomWalk(0.1)")

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

    def _robot_policy(self, value: Any) -> Any:
        """Return a policy for the robots; a policy given by name takes the model's options that it has."""
        return policy_of(value, shared_options(value, self.settings["policy_options"]))

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

        The plan has all settings; only the numbers of `checked_numbers` may differ from those of this model.
        """
        numbers = checked_numbers(plan)
        self.settings.update(plan)
        self._data.arena, self._data.limits = numbers.arena, numbers.limits
        self._data.arena_size[:] = numbers.arena.size
        for group, speed in ((self.robots, numbers.robot_speed), (self.targets, numbers.target_speed)):
            group.members.speed[:] = speed
            group.members.sensing_range[:] = numbers.sensing_range
            group.founders = [one._replace(spacing=numbers.sensing_range) for one in group.founders]
        self.robots.members.awareness_range[:] = numbers.awareness_range
        self._engine.adapt()

    def _target_speeds(self, member: npt.NDArray[np.int64]) -> Any:
        fastest = self.settings["target_speed"]
        if not self.settings["uniform_target_speed"]:
            return fastest
        return fastest * uniforms(self._data.key, stream_number(Stream.PLACEMENT, 1), 0, member, 4)[3]
