"""CMOMMT: the paper's task, cooperative observation of multiple moving targets, in a disc."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness import AWARENESS, Awareness, RingAwareness
from teamsight.agents.building import MOST_AGENTS
from teamsight.agents.group import Group
from teamsight.agents.live_setting import FixedSetting, LiveSetting
from teamsight.agents.model import World
from teamsight.agents.presets import PRESETS
from teamsight.agents.resolve import awareness_of, policy_of
from teamsight.agents.robot import Robot
from teamsight.agents.target import Target
from teamsight.core import checks
from teamsight.policies import POLICIES, ACmommt, Centroid, Evasive, RandomWalk, Stationary
from teamsight.policies.handmade.a_cmommt import OCCASIONS, WEIGHTS
from teamsight.policies.handmade.idle import BEHAVIOURS
from teamsight.world.arena import Disc
from teamsight.world.limits import Limits, length
from teamsight.world.noise import Stream, stream_number, uniforms

DEFAULTS: dict[str, Any] = {
    "robots": 10,
    "targets": 15,
    "radius": 5.0,
    "policy": "a-cmommt",
    "awareness": "pairwise",
    "delta": 16,
    "sensing_range": 1.0,
    "awareness_range": 1.0,
    "robot_speed": 0.1,
    "target_speed": 0.075,
    "uniform_target_speed": False,
    "target_policy": "random-walk",
    "search": "redraw",
    "search_when": "no-force",
    "weights": "nearest",
}

# Not None: a user who writes ``awareness=None`` means something, and is told what to write instead.
NOT_GIVEN: Any = type("NotGiven", (), {"__repr__": lambda self: "the default"})()

_TARGET_TURN_PROBABILITY = 0.05


class CMOMMT(World):
    """Robots that observe as many moving targets as they can, in a disc.

    Parameters
    ----------
    robots, targets : int
        How many; by default 10 and 15.
    radius : float
        Of the arena [sensing ranges]; 5.
    policy : str or Policy
        What the robots do: "a-cmommt", "centroid", "random-walk", "stationary", or an object. Stationary robots are
        spread over the arena; all others begin anywhere.
    awareness : str or Awareness
        What they perceive of teammates: "none", "ring", "pairwise", "shared", or an object; "pairwise".
    delta : int
        The sectors of "ring"; 16.
    sensing_range, awareness_range : float
        How far they sense targets and teammates; 1.
    robot_speed, target_speed : float
        The farthest each goes a step; 0.1 and 0.075.
    uniform_target_speed : bool
        Whether each target has a speed of its own, uniform between 0 and `target_speed`.
    target_policy : str or Policy
        "random-walk", which turns with a probability of 5 % a step, "evasive", or an object.
    search : {"redraw", "wander", "stay"}
        What a robot does that has nothing to follow, under "a-cmommt" and "centroid".
    search_when : {"no-force", "nothing-sensed"}
        When an "a-cmommt" robot has nothing to follow.
    weights : {"nearest", "shared", "per-teammate", "none"}
        How "a-cmommt" weighs targets that teammates may monitor; see `ACmommt`.
    preset : str, optional
        "touzet2000" sets what calibration found and the caller did not give.
    rng, seed : int, optional
        The seed; two names for one thing.

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
    *Source:* §4 and §5. *Departs:* the paper leaves open the speeds, the wall and the search; see docs/model.md.
    """

    def __init__(
        self,
        robots: int = NOT_GIVEN,
        targets: int = NOT_GIVEN,
        radius: float = NOT_GIVEN,
        policy: Any = NOT_GIVEN,
        awareness: Awareness | str = NOT_GIVEN,
        delta: int = NOT_GIVEN,
        sensing_range: float = NOT_GIVEN,
        awareness_range: float = NOT_GIVEN,
        robot_speed: float = NOT_GIVEN,
        target_speed: float = NOT_GIVEN,
        uniform_target_speed: bool = NOT_GIVEN,
        target_policy: Any = NOT_GIVEN,
        search: str = NOT_GIVEN,
        search_when: str = NOT_GIVEN,
        weights: str = NOT_GIVEN,
        preset: str | None = None,
        rng: int | None = None,
        seed: int | None = None,
    ) -> None:
        given = {name: value for name, value in locals().items() if name in DEFAULTS and value is not NOT_GIVEN}
        chosen = PRESETS[checks.choice("preset", preset, PRESETS)] if preset is not None else {}
        self.settings: dict[str, Any] = {**DEFAULTS, **chosen, **given}
        plan = self.settings
        rules = _policies(plan)
        degree = _awareness(plan)
        count = tuple(checks.count(name, plan[name], most=MOST_AGENTS) for name in ("robots", "targets"))
        checks.flag("uniform_target_speed", plan["uniform_target_speed"])
        arena = Disc(length("radius", plan["radius"]))
        # Here already, so that errors name the parameters of this model.
        self.limits = Limits(arena)
        sensing, aware = (self.limits.range(name, plan[name]) for name in ("sensing_range", "awareness_range"))
        robot_speed, _ = (self.limits.speed(name, plan[name]) for name in ("robot_speed", "target_speed"))
        super().__init__(arena, rng=rng, seed=seed)
        self._robots = self.add(
            Robot, count[0], policy=rules[0], awareness=degree, sensing_range=sensing, awareness_range=aware,
            speed=robot_speed, placement="spread" if isinstance(rules[0], Stationary) else "uniform",
        )  # fmt: skip
        self._targets = self.add(
            Target, count[1], policy=rules[1], speed=self._target_speeds(np.arange(count[1])),
            sensing_range=sensing,
        )  # fmt: skip
        self.senses(self.robots, self.targets)
        self._let_targets_sense()
        self._begin_to_collect()

    @property
    def robots(self) -> Group:
        """The robots."""
        return self._robots

    @property
    def targets(self) -> Group:
        """The targets."""
        return self._targets

    policy = LiveSetting("robots", "policy", lambda model, value: _robot_policy(model.settings | {"policy": value}))
    awareness = LiveSetting(
        "robots", "awareness", lambda model, value: _awareness(model.settings | {"awareness": value})
    )
    sensing_range = LiveSetting("robots", "sensing_range")
    awareness_range = LiveSetting("robots", "awareness_range")
    robot_speed = LiveSetting("robots", "speed")
    target_speed = LiveSetting("targets", "speed")
    radius = FixedSetting("build another")
    preset = FixedSetting("build another")
    seed = FixedSetting("begin anew with reset(rng)")
    delta = FixedSetting("give the robots another ring, as in model.awareness = RingAwareness(8)", "awareness")
    uniform_target_speed = FixedSetting("give the targets other speeds, as in model.target_speed = [0.1, 0.2]")
    search = FixedSetting("give the robots another policy, as in model.policy = ACmommt(idle='wander')", "policy")
    search_when = FixedSetting("give the robots another, as model.policy = ACmommt(idle_when='no-force')", "policy")
    weights = FixedSetting("give the robots another policy, as in model.policy = ACmommt(weights='shared')", "policy")

    @property
    def target_policy(self) -> Any:
        """``targets.policy``; targets that evade from now on sense robots too."""
        return self.targets.policy

    @target_policy.setter
    def target_policy(self, value: Any) -> None:
        self.targets.policy = _target_policy(self.settings | {"target_policy": value})
        self._let_targets_sense()

    def _let_targets_sense(self) -> None:
        if isinstance(self.targets.policy, Evasive):
            self.senses(self.targets, self.robots)

    def reset(self, rng: int | None = None) -> None:
        """Begin anew, also to collect; see `World.reset`."""
        super().reset(rng)
        self.targets.bodies.speed[:] = self._target_speeds(self.targets.bodies.member)
        self._begin_to_collect()

    def _target_speeds(self, member: npt.NDArray[np.int64]) -> Any:
        fastest = self.settings["target_speed"]
        if not self.settings["uniform_target_speed"]:
            return fastest
        return fastest * uniforms(self.key, stream_number(Stream.PLACEMENT, 1), 0, member, 4)[3]


def _policies(plan: dict[str, Any]) -> tuple[Any, Any]:
    """Return the policies of robots and of targets."""
    checks.choice("search", plan["search"], BEHAVIOURS)
    checks.choice("search_when", plan["search_when"], OCCASIONS)
    checks.choice("weights", plan["weights"], WEIGHTS)
    return _robot_policy(plan), _target_policy(plan)


def _robot_policy(plan: dict[str, Any]) -> Any:
    policy = plan["policy"]
    if isinstance(policy, str) and policy == "a-cmommt":
        policy = ACmommt(idle=plan["search"], idle_when=plan["search_when"], weights=plan["weights"])
    elif isinstance(policy, str) and policy == "centroid":
        policy = Centroid(idle=plan["search"])
    return policy_of(policy)


def _target_policy(plan: dict[str, Any]) -> Any:
    policy = plan["target_policy"]
    if isinstance(policy, str):
        checks.choice("target_policy", policy, POLICIES)
        if policy == "random-walk":
            policy = RandomWalk(turn_probability=_TARGET_TURN_PROBABILITY)
    return policy_of(policy, "target_policy")


def _awareness(plan: dict[str, Any]) -> Awareness:
    delta = RingAwareness(plan["delta"]).delta
    degree = plan["awareness"]
    if isinstance(degree, str) and AWARENESS.get(degree) is RingAwareness:
        return RingAwareness(delta)
    return awareness_of(degree)
