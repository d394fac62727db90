"""A controller decides on a robot's own readings as a world does, to the last bit, and bears late and missing ones."""

from __future__ import annotations

import copy
import math
import pickle
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import (
    CMOMMT,
    Car,
    Controller,
    Detections,
    DifferentialDrive,
    Drive,
    Lidar,
    Relayed,
    Robot,
    Target,
    Torus,
    World,
)
from teamsight.agents.awareness.degrees import NearestAwareness, RingAwareness
from teamsight.agents.recording.explore import explore
from teamsight.core.kernel import inlined, kernel
from teamsight.policies import ACmommt, Action, Avoiding, CompiledPolicy, LazyQ, Percept, Policy, RandomWalk
from teamsight.policies.percept_of_one import turn_to

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one:UserWarning")


class Remote(Policy):
    """Asks one controller for each robot."""

    def __init__(self, policy: Any, awareness: Any, seed: int, **options: Any) -> None:
        self.made: dict[str, Any] = {"policy": policy, "awareness": awareness, "seed": seed, **options}
        self.controllers: list[Controller] = []

    def detections(self, percept: Percept, row: int) -> dict[str, Any]:
        """What the robot of a row is given."""
        return {name: Detections.of(getattr(percept, name), row) for name in ("targets", "teammates")}

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        team = percept.identity.tolist()
        for row, identity in enumerate(team[len(self.controllers) :]):
            names: dict[str, Any] = {name: getattr(percept, name)[row] for name in ("sensing_range", "awareness_range", "speed")}
            self.controllers.append(Controller(**self.made, identity=identity, team=team, member=row, **names))
        action = Action(np.zeros((len(team), 2)), np.zeros(len(team)))
        for row, controller in enumerate(self.controllers):
            relayed = {
                one: Relayed(Detections.of(percept.targets, team.index(one)), percept.heading[team.index(one)])
                for one in Detections.of(percept.teammates, row).identity.tolist()  # type: ignore[union-attr]
            }
            action.heading[row], action.distance[row] = controller.decide(
                **self.detections(percept, row), heading=percept.heading[row], moved=percept.moved[row],
                relayed=relayed if self.made["awareness"] == "shared" else None, tick=int(percept.time[0]),
            )[:0:-1]  # fmt: skip
        return action, state


def turn_and_go(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    """A rule for one robot."""
    way = percept.targets.offset.sum(axis=0) + rng.normal(size=2)
    return turn_to(percept.heading, way), 0.1 * rng.random()


class Slow(Policy):
    """A policy in Python with a state."""

    draws = 1

    def start(self, size: int) -> Any:
        return np.zeros(size)

    def decide(self, percept: Percept, state: Any, noise: Any) -> Any:
        state = state + 0.01 * percept.targets.degree + 0.001 * noise[0]
        return Action(np.zeros((len(state), 2)), np.minimum(state, 0.1)), state


CASES = [
    *((policy, awareness) for policy in ("a-cmommt", "p-cmommt") for awareness in ("none", "ring", "pairwise", "shared")),
    ("random-walk", "none"), ("evolved", "nearest"), ("evolved", "shared"), ("b-cmommt", "shared"), ("centroid", "ring"),
    (ACmommt(idle="wander", target_tracks=3), RingAwareness(4)), (ACmommt(), NearestAwareness(1)),
    (turn_and_go, "none"), (Slow(), "pairwise"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("policy", "awareness"), CASES, ids=lambda one: one if isinstance(one, str) else getattr(one, "__name__", type(one).__name__)
)
def test_it_decides_as_a_world(policy: Any, awareness: Any) -> None:
    plan: dict[str, Any] = {"robots": 7, "targets": 30, "radius": 3.5, "sensing_range": 1.2, "rng": 11}
    world = CMOMMT(policy=policy, awareness=awareness, **plan)
    world.run(70)
    steered = CMOMMT(policy=Remote(policy, awareness, 11), awareness="pairwise", **plan)
    steered.run(70)
    assert np.array_equal(world.robots.bodies.position, steered.robots.bodies.position)
    assert np.array_equal(world.targets.bodies.position, steered.targets.bodies.position)


@pytest.mark.parametrize("awareness", ["ring", "nearest", "pairwise", "shared"])
def test_a_learner_reads_the_inputs_of_a_world(awareness: str) -> None:
    plan: dict[str, Any] = {"robots": 5, "targets": 10, "radius": 2.5, "awareness": awareness, "rng": 1}
    memory = explore(CMOMMT(policy=RandomWalk(random_distance=True), **plan), 60)
    world = CMOMMT(policy=LazyQ(memory), **plan)
    steered = CMOMMT(policy=Remote(LazyQ(memory), awareness, 1), **plan | {"awareness": "pairwise"})
    for one in (world, steered):
        one.run(30)
    assert np.array_equal(world.robots.bodies.position, steered.robots.bodies.position)


@pytest.mark.short
def test_it_decides_in_another_group_and_arena_as_there() -> None:
    places = []
    for policy in ("random-walk", Remote("random-walk", "none", 4, group=2)):
        world = World(Torus(6, 6), rng=4)
        world.add(Target, 3, policy="random-walk")
        world.add(Robot, 2, policy="random-walk", team=None)
        robots = world.add(Robot, 5, policy=policy, awareness="pairwise")
        world.run(30)
        places.append(robots.bodies.position.copy())
    assert np.array_equal(places[0], places[1])


@pytest.mark.parametrize("drive", [DifferentialDrive(0.1, 0.01), Car(0.1, 0.6, 0.2, 0.02)], ids=lambda one: type(one).__name__)
def test_its_wheels_do_as_in_a_world(drive: Drive) -> None:
    plan: dict[str, Any] = {"robots": 5, "targets": 15, "radius": 3.0, "drive": drive, "rng": 5}
    world, remote = CMOMMT(**plan), Remote("a-cmommt", "pairwise", 5, drive=drive)
    steered = CMOMMT(**plan | {"policy": remote})
    for one in (world, steered):
        one.run(40)
    assert np.array_equal(world.robots.bodies.position, steered.robots.bodies.position)
    assert [one.drive_state for one in remote.controllers] == [robot.drive_state for robot in world.robots]


def test_without_odometry_it_has_gone_as_its_wheels_do() -> None:
    controllers = [Controller(turn_and_go, speed=0.2, drive=DifferentialDrive(0.2, 0.01)) for _ in range(2)]
    here, heading = np.zeros(2), np.array([1.0, 0.0])
    for _ in range(10):
        one, other = controllers[0].decide(), controllers[1].decide(heading=heading, moved=here)
        assert one.heading == pytest.approx(other.heading, abs=1e-12)
        left, right = controllers[0].drive_state.values()
        turn, length = (right - left) / 0.2, (left + right) / 2
        cosine, sine = math.cos(turn / 2), math.sin(turn / 2)
        chord = length * (sine / (turn / 2) if turn else 1.0)
        here = chord * np.array([cosine * heading[0] - sine * heading[1], sine * heading[0] + cosine * heading[1]])
        cosine, sine = math.cos(turn), math.sin(turn)
        heading = np.array([cosine * heading[0] - sine * heading[1], sine * heading[0] + cosine * heading[1]])
        assert controllers[1].drive_state == pytest.approx(controllers[0].drive_state, abs=1e-12)


def test_what_was_blocked_begins_at_rest_and_a_lower_speed_holds() -> None:
    robot = Controller(lambda percept, rng: (0.0, 1.0), speed=0.2, drive=DifferentialDrive(0.2, 0.02))
    for _ in range(5):
        robot.decide()
    assert robot.drive_state["left"] == pytest.approx(0.1)
    robot.decide(blocked=True)
    assert robot.drive_state["left"] == pytest.approx(0.02)
    robot.speed = 0.01
    robot.decide()
    assert robot.drive_state["left"] == pytest.approx(0.01)


class Polar(Remote):
    """Gives distances and bearings."""

    def detections(self, percept: Percept, row: int) -> dict[str, Any]:
        found = {}
        for name, seen in super().detections(percept, row).items():
            bearing = [turn_to(percept.heading[row], offset) for offset in seen.offset]
            found[name] = Detections(seen.distance.tolist(), bearing, seen.identity.tolist())
        return found


def test_distances_and_bearings_are_as_good_as_offsets() -> None:
    plan: dict[str, Any] = {"robots": 6, "targets": 9, "radius": 3.0, "awareness": "pairwise", "rng": 2}
    exact, polar = (CMOMMT(policy=kind("a-cmommt", "pairwise", 2), **plan) for kind in (Remote, Polar))
    for world in (exact, polar):
        world.run(10)
    assert polar.robots.bodies.position == pytest.approx(exact.robots.bodies.position, abs=1e-9)


class Unnamed(Remote):
    """Knows who is a target and who a teammate, but not which."""

    def detections(self, percept: Percept, row: int) -> dict[str, Any]:
        found = super().detections(percept, row)
        return {name: seen._replace(identity=None) for name, seen in found.items()}


@pytest.mark.parametrize("policy", ["a-cmommt", "evolved"])
def test_targets_of_unknown_identity_are_kept_apart_by_where_they_are(policy: str) -> None:
    # Few of them, which never come near each other, are known again at every decision.
    plan: dict[str, Any] = {"robots": 1, "targets": 2, "radius": 6.0, "awareness": "pairwise", "rng": 5}
    named, unnamed = (CMOMMT(policy=kind(policy, "pairwise", 5), **plan) for kind in (Remote, Unnamed))
    for world in (named, unnamed):
        world.robots[0].position = (0.0, 0.0)
        world.targets[0].position, world.targets[1].position = (0.7, 0.0), (-3.0, 0.0)
        world.run(40)
        assert world.observed_fraction > 0
    assert unnamed.robots.bodies.position == pytest.approx(named.robots.bodies.position, abs=1e-12)


def controller(policy: Any = "centroid", awareness: Any = "pairwise", **options: Any) -> Controller:
    given = {"identity": 2, "team": (1, 2, 5), "sensing_range": 2.0, "awareness_range": 3.0, "speed": 0.5}
    return Controller(policy, awareness, **given | options)  # type: ignore[arg-type]


@pytest.mark.short
def test_a_late_reading_is_moved_by_the_way_gone_since() -> None:
    # Straight towards a target at (1, 1): the robot goes a step to the left meanwhile.
    robot = controller()
    robot.decide(Detections(), Detections(), heading=0.0)
    command = robot.decide(Detections([math.sqrt(2)], [math.pi / 4], tick=0), heading=math.pi / 2, moved=(0.0, 1.0))
    assert command.heading == pytest.approx((1.0, 0.0))
    assert command.turn == pytest.approx(-math.pi / 2)


@pytest.mark.short
def test_a_missing_reading_is_the_last_one_until_it_is_too_old() -> None:
    robot = controller(ACmommt(idle="stay", target_tracks=0), patience=2)
    assert robot.decide(Detections([1.0], [0.0]), heading=0.0).distance > 0
    for _ in range(2):
        assert robot.decide(heading=0.0, moved=(0.0, 0.0)).distance > 0
    assert robot.decide(heading=0.0, moved=(0.0, 0.0)).distance == 0
    # An empty one says that nobody is there.
    assert robot.decide(Detections([1.0], [0.0])).distance > 0
    assert robot.decide(Detections()).distance == 0


@pytest.mark.short
def test_what_is_given_may_change_afterwards() -> None:
    robot, distance = controller(ACmommt(idle="stay", target_tracks=0)), np.array([1.0])
    first = robot.decide(Detections(distance, [0.5]), heading=0.0)
    distance[0] = 50.0
    assert robot.decide(heading=0.0, moved=(0.0, 0.0)) == first


@pytest.mark.short
def test_without_odometry_it_has_gone_as_it_was_commanded() -> None:
    one, other = controller("random-walk", seed=3), controller("random-walk", seed=3)
    heading, command = 0.7, one.decide(heading=0.7)
    assert other.decide(heading=0.7) == command
    for _ in range(20):
        heading += command.turn
        step = command.distance * math.cos(heading), command.distance * math.sin(heading)
        command = one.decide(heading=heading, moved=step)
        assert other.decide().heading == pytest.approx(command.heading, abs=1e-12)


@pytest.mark.short
def test_commands_keep_the_limits() -> None:
    robot = controller("centroid", turn_limit=0.2)
    command = robot.decide(Detections([1.9], [2.0]), heading=0.0)
    assert command.turn == 0.2
    assert 0 <= command.distance <= 0.5
    assert command.heading == pytest.approx((math.cos(2.0), math.sin(2.0)))


@pytest.mark.short
@given(st.lists(st.tuples(st.floats(0, 4), st.floats(-7, 7)), max_size=40))
@settings(max_examples=30)
def test_what_is_out_of_range_is_ignored_and_any_number_fits(bodies: list[tuple[float, float]]) -> None:
    near = [body for body in bodies if body[0] <= 2.0]
    all_of, those_near = (
        controller(ACmommt(target_tracks=0, weights="none")).decide(
            Detections([d for d, _ in chosen], [b for _, b in chosen], range(len(chosen))), heading=0.0
        )
        for chosen in (bodies, near)
    )
    assert all_of == those_near


@pytest.mark.short
def test_reset_begins_anew() -> None:
    robot = controller("a-cmommt", "shared")

    def decide() -> list[Any]:
        sent = {5: Relayed(Detections([1.0], [0.3], [9]), 0.5)}
        seen = Detections([1.5, 1.0], [0.2, 2.0], [7, 8]), Detections([2.5], [1.0], [5])
        return [robot.decide(*seen, heading=0.1 * k, relayed=sent) for k in range(6)]

    first = decide()
    robot.reset()
    assert decide() == first
    assert len({command.heading for command in first}) > 1


@pytest.mark.short
def test_what_is_accepted_can_be_used_again() -> None:
    # Two teammates at most, one of them out of range now, and in range when the robot has gone.
    robot = controller()
    with pytest.raises(ValueError, match="teammates: 3 are seen, and the team has 2 others"):
        robot.decide(None, Detections([1.0, 3.1, 3.2], [0.0] * 3), heading=0.0)
    with pytest.raises(ValueError, match="teammates: 77 is not one of"):
        robot.decide(None, Detections([3.1], [0.0], [77]), heading=0.0)
    robot.decide(None, Detections([1.0, 3.1], [0.0] * 2), heading=0.0)
    robot.decide(heading=0.0, moved=(0.5, 0.0))


@pytest.mark.short
def test_the_newest_reading_counts_whenever_it_arrives() -> None:
    robot = controller(ACmommt(idle="stay", target_tracks=0), patience=3)
    for now, tick in enumerate((0, 1, 0, 1, 0)):
        command = robot.decide(Detections([1.0], [float(tick)], tick=min(tick, now)), heading=0.0, moved=(0.0, 0.0), tick=now)
    assert command.turn == pytest.approx(1.0)
    # Only what is too old is nothing.
    command = robot.decide(Detections([1.0], [0.0], tick=0), heading=0.0, moved=(0.0, 0.0), tick=5)
    assert command.distance == 0.0


@pytest.mark.short
def test_the_last_message_of_a_teammate_counts_until_it_is_too_old() -> None:
    robot = controller(lambda percept, rng: (0.0, 0.1 * len(percept.relayed.distance)), "shared", patience=2)

    def distance(sent: Relayed | None = None, seen: Detections = Detections([2.5], [0.5], [5])) -> float:  # noqa: B008
        relayed = None if sent is None else {5: sent}
        return robot.decide(Detections(), seen, heading=0.0, moved=(0.0, 0.0), relayed=relayed).distance

    two = Detections([1.0, 1.2], [0.5, 0.0], [8, 9])
    assert [distance(Relayed(two, 0.0)), distance(), distance(), distance()] == [0.2, 0.2, 0.2, 0.0]
    with pytest.raises(ValueError, match=r"relayed\[5\].targets.tick=9: must be at most 4"):
        distance(Relayed(two._replace(tick=9), 0.0))
    # One that is too old already, one that is late, an older one after it, and a newer one.
    late = [two._replace(tick=1), two._replace(tick=4), Detections(tick=3), Detections()]
    assert [distance(Relayed(one, 0.0)) for one in late] == [0.0, 0.2, 0.2, 0.0]
    # Of a teammate that is not seen, or not known, nothing is known.
    assert distance(Relayed(two, 0.0), Detections()) == distance(Relayed(two, 0.0), Detections([2.5], [0.5])) == 0.0


@pytest.mark.short
@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_goes_on_by_itself(copied: Any) -> None:
    robot, twin = controller("a-cmommt", "ring"), controller("a-cmommt", "ring")
    readings = [Detections([1.0 + 0.1 * k], [0.4 * k], [4 + k % 2]) for k in range(8)]
    for one in (robot, twin):
        for reading in readings[:4]:
            one.decide(reading, heading=0.0)
    other = copied(robot)
    robot.decide(Detections([0.2], [-2.0], [4]), heading=1.0)
    assert [other.decide(one, heading=0.0) for one in readings[4:]] == [twin.decide(one, heading=0.0) for one in readings[4:]]
    assert repr(other) == "Controller(ACmommt, 'ring', identity=2, tick=7)"


@inlined
def _write_first_number(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    action.heading[0, 0] = arrays.parameters[0]
    action.heading[0, 1] = 0.0
    action.distance[0] = percept.channels.beacons.distance[0]


@dataclass(frozen=True)
class Broken(CompiledPolicy):
    """Goes in no direction, by the distance of a beacon."""

    first: float
    kernel = _write_first_number
    channels = ("beacons",)


@pytest.mark.short
def test_what_a_kernel_writes_is_checked_and_channels_have_no_limit() -> None:
    far = Detections([0.25], [0.0])._replace(distance=[40.0])
    for first, message in ((math.nan, "must be finite"), (3.0, "length")):
        with pytest.raises(ValueError, match=message):
            controller(Broken(first)).decide(beacons=far)
    # At its full speed, since the beacon is far away.
    command = controller(Broken(-1.0)).decide(beacons=far, heading=0.0)
    assert command[1:] == (0.5, (-1.0, 0.0))
    assert command.turn == pytest.approx(math.pi)


class Uneven(Policy):
    """Robots that begin with different states, and fail at times."""

    fails = False

    def start(self, size: int) -> Any:
        return 0.1 * np.arange(size)

    def decide(self, percept: Percept, state: Any, noise: Any) -> Any:
        if self.fails:
            raise RuntimeError("no decision")
        with pytest.raises(ValueError, match="read-only"):
            percept.heading[:] = 0.0
        return Action(np.zeros((1, 2)), state + 0.001 * percept.targets.identity.sum()), state


@pytest.mark.short
def test_a_robot_begins_with_its_own_state_and_an_error_changes_nothing() -> None:
    policy = Uneven()
    robot = controller(policy, jump=0.04)
    assert robot.decide().distance == pytest.approx(0.1)
    assert robot.decide(Detections([1.0], [0.0]), heading=0.0).distance == 0.5
    named = robot._unnamed
    policy.fails = True
    with pytest.raises(RuntimeError, match="no decision"):
        robot.decide(Detections([0.95], [0.0]), heading=0.0, moved=(0.05, 0.0))
    policy.fails = False
    robot.decide(Detections([0.95], [0.0]), heading=0.0, moved=(0.05, 0.0))
    assert [one[0] for one in robot._unnamed] == [one[0] for one in named]


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"targets": [1.0, 2.0]}, r"targets=\[1.0, 2.0\]: must be Detections"),
    ({"targets": Detections([1.0], [0.0, 1.0])}, "targets: has 1 distances and 2 bearings"),
    ({"targets": Detections([-1.0], [0.0])}, "targets: has the distance -1.0"),
    ({"targets": Detections([math.nan], [0.0])}, r"targets.distance=\[nan\]: must be finite; leave out what was not measured"),
    ({"targets": Detections([1.0], [math.inf])}, r"targets.bearing=\[inf\]: must be finite"),
    ({"targets": Detections([1.0], [0.0], [1.5])}, r"targets.identity=\[1.5\]: must be whole numbers"),
    ({"targets": Detections([1.0], [0.0], ["a"])}, r"targets.identity=\['a'\]: must be a list of numbers"),
    ({"targets": Detections([1.0], [0.0], [1, 2])}, "1 bodies, 1 distances and 2 identities"),
    ({"targets": Detections(offset=[1.0, 2.0])}, "targets.offset=1.0: must be two finite numbers"),
    ({"targets": Detections(tick=9)}, "targets.tick=9: must be at most 1"),
    ({"teammates": Detections([1.0], [0.0], [2])}, "teammates: 2 is the robot itself"),
    ({"teammates": Detections([1.0], [0.0], [9])}, "teammates: 9 is not one of 1, 5"),
    ({"teammates": Detections([1.0, 1.0], [0.0, 1.0], [5, 5])}, "teammates: 5 is seen twice"),
    ({"teammates": Detections([1.0] * 3, [0.0] * 3)}, "teammates: 3 are seen, and the team has 2 others"),
    ({"heading": (1.0, 1.0)}, "heading=.*must be a unit vector"),
    ({"heading": math.nan}, "heading=nan"),
    ({"moved": (1.0, math.nan)}, "moved=.*must be two finite numbers"),
    ({"moved": 1.0}, "moved=1.0: must be two finite numbers"),
    ({"moved": "north"}, "moved='north': must be two finite numbers"),
    ({"tick": 2**63}, "tick=9223372036854775808"),
    ({"relayed": [Relayed(Detections(), 0.0)]}, "relayed=.*must be a mapping"),
    ({"tick": 0}, "tick=0: must be at least 1"),
    ({"targets": Detections([1.0, 1.0], [0.0, 1.0], [3, 3])}, "targets.identity=.*has a target twice"),
    ({"targets": Detections([1.0], [0.0], [2**31])}, "targets.identity=.*up to 2147483647"),
    ({"targets": Detections([10**400], [0.0])}, "targets.distance=.*must be a list of numbers"),
    ({"targets": Detections(offset=3.0)}, "targets.offset=3.0: must be a list of pairs"),
    ({"relayed": {5: Relayed(Detections([1.0], [0.0]), 0.0)}}, r"relayed\[5\].targets: have no identities"),
    ({"relayed": {9: Relayed(Detections(), 0.0)}}, r"relayed\[9\]: must be of a teammate, one of 1, 5"),
    ({"relayed": {5: Detections()}}, r"relayed\[5\]=.*must be Relayed"),
    ({"beacons": Detections()}, "beacons: is no channel that policy=.* reads"),
]


@pytest.mark.short
@pytest.mark.parametrize(("readings", "message"), WRONG, ids=lambda value: str(value)[:60])
def test_wrong_readings_are_refused_and_change_nothing(readings: dict[str, Any], message: str) -> None:
    first: dict[str, Any] = {"targets": Detections([1.0], [0.3], [4]), "heading": 0.0}
    next_one: dict[str, Any] = {"targets": Detections([1.2], [0.3], [4]), "heading": 0.1}
    robot, other = controller("a-cmommt"), controller("a-cmommt")
    for one in (robot, other):
        one.decide(**first)
    with pytest.raises((TypeError, ValueError), match=message):
        robot.decide(**readings)
    assert robot.decide(**next_one) == other.decide(**next_one)


@pytest.mark.short
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"identity": 3}, "identity=3: must be one of the team, 1, 2, 5"),
        ({"team": (1, 2, 2)}, "team=.*each once"),
        ({"team": ()}, "team="), ({"team": 3}, "team=3: must be a list"), ({"team": (1, 2**40)}, "team=1099511627776"),
        ({"patience": 10**30}, "patience="), ({"identity": "2"}, "identity='2'"),
        ({"sensing_range": 0.0}, "sensing_range=0"),
        ({"speed": -1.0}, "speed=-1"),
        ({"turn_limit": 90.0}, "turn_limit=90"),
        ({"policy": "b-cmommt", "awareness": "ring"}, "needs 'relayed', which awareness 'ring' does not deliver"),
        ({"policy": "a-cmomt"}, "did you mean 'a-cmommt'"),
        ({"awareness": "rings"}, "did you mean 'ring'"),
    ],
)  # fmt: skip
def test_a_wrong_controller_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        controller(**options)


@pytest.mark.short
def test_it_imports_no_simulator() -> None:
    code = """
import sys
from teamsight import Controller, Detections
Controller("a-cmommt", "shared").decide(Detections([0.5], [0.1]))
print([name for name in ("mesa", "pandas", "simpy", "scipy", "networkx", "matplotlib") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.strip() == "[]"


class Sensing(Remote):
    """Gives bodies with all that the policy reads of them, and distances."""

    columns = ("moved_x", "moved_y", "radius", "speed")

    def detections(self, percept: Percept, row: int) -> dict[str, Any]:
        seen = {
            name: Detections.of(getattr(percept, name), row, columns=percept.columns) for name in ("targets", "teammates")
        }
        return seen | ({"lidar": percept.lidar[row]} if percept.lidar.shape[1] else {})


@kernel
def _rove(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        x, y = percept.heading[i, 0], percept.heading[i, 1]
        turn = percept.lidar[i, 3] - percept.lidar[i, 1] + 0.1 * noise[0, i]
        action.heading[i, 0], action.heading[i, 1] = x - turn * y, y + turn * x
        length = math.sqrt(action.heading[i, 0] ** 2 + action.heading[i, 1] ** 2)
        action.heading[i, 0] /= length
        action.heading[i, 1] /= length
        action.distance[i] = min(percept.speed[i], 0.5 * percept.lidar[i, 2])


class Roving(CompiledPolicy):
    """Goes where it is free."""

    kernel = _rove
    draws = 1
    rays = 5


class Roves(Policy):
    """The same in Python."""

    draws = 1
    rays = 5

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        return Roving().decide(percept, Roving().start(len(percept.heading)), noise)[0], state


def _crowd(policy: Any, **more: Any) -> CMOMMT:
    return CMOMMT(
        12, 6, 2.5, policy=policy, robot_radius=0.2, target_radius=0.1, contact="stop", sensing_range=1.2,
        awareness_range=1.5, rng=6, **more,
    )  # fmt: skip


@pytest.mark.parametrize(
    "policy",
    [Avoiding("a-cmommt", targets=True), Avoiding("random-walk"), Avoiding(Slow(), targets=True), Avoiding(turn_and_go)],
    ids=["both", "teammates", "numpy", "function"],
)
@pytest.mark.parametrize("awareness", ["pairwise", "shared"])
def test_it_avoids_as_in_a_world(policy: Avoiding, awareness: str) -> None:
    world = _crowd(policy, awareness=awareness)
    steered = _crowd(Sensing(policy, awareness, 6, radius=0.2), awareness="pairwise")
    plain = _crowd(policy.policy, awareness=awareness)
    for one in (world, steered, plain):
        one.run(50)
    assert np.array_equal(world.robots.bodies.position, steered.robots.bodies.position)
    assert not np.array_equal(world.robots.bodies.position, plain.robots.bodies.position)


@pytest.mark.parametrize("policy", [Roving(), Roves(), Avoiding(Roving())], ids=["kernel", "numpy", "avoiding"])
def test_it_reads_a_lidar_as_in_a_world(policy: Any) -> None:
    lidar = Lidar(5, 1.0, 3.0, range_noise=0.05)
    world = _crowd(policy, lidar=lidar)
    steered = _crowd(Sensing(policy, "pairwise", 6, radius=0.2, lidar=lidar), lidar=lidar)
    for one in (world, steered):
        one.run(50)
    assert np.array_equal(world.robots.bodies.position, steered.robots.bodies.position)


def test_displacements_follow_from_two_detections() -> None:
    read: list[Any] = []

    class Reads(Policy):
        columns = ("moved_x", "moved_y", "radius", "speed")
        needs = ("identities",)

        def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
            read.append([[float(column[one]) for column in percept.columns] for one in (4, 2, 30)])
            return Action(np.zeros((1, 2)), np.zeros(1)), state

    robot = Controller(Reads(), "pairwise", identity=4, team=(2, 4), radius=0.3, speed=0.2, awareness_range=9, sensing_range=9)
    near: dict[str, Any] = {"heading": 0.0, "moved": (0.1, 0.0)}
    unknown = [0.0, 0.0, math.nan, math.nan]
    robot.decide(Detections([1], [0], [30]), Detections([2], [0], [2]), **near)
    assert read[-1] == [[0.1, 0.0, 0.3, 0.2], [0.0, 0.0, 0.3, 0.2], pytest.approx(unknown, nan_ok=True)]
    # The teammate has kept its distance, so it has moved as far as the robot; the other has moved to the left as well.
    robot.decide(Detections(offset=[(1, 0.5)], identity=[30], radius=0.5), Detections([2], [0], [2]), **near)
    moved = [[0.1, 0.0, 0.3, 0.2], [0.1, 0.0, 0.3, 0.2], [0.1, 0.5, 0.5, math.nan]]
    assert read[-1] == [pytest.approx(one, nan_ok=True) for one in moved]
    # Two ticks later; what has not arrived is as before.
    robot.decide(None, Detections([2.4], [0], [2], radius=[0.4], speed=0.7), tick=3, **near)
    assert read[-1][1:] == [pytest.approx([0.25, 0.0, 0.4, 0.7]), pytest.approx(moved[2], nan_ok=True)]
    robot.decide(Detections(), Detections(offset=[(2.4, 0)], identity=[2], moved=[(0.05, 0.02)]), **near)
    assert read[-1][1:] == [[0.05, 0.02, 0.3, 0.2], pytest.approx([math.nan] * 4, nan_ok=True)]


def test_distances_are_kept_until_they_are_too_old() -> None:
    read: list[Any] = []

    def rule(percept: Any, rng: Any) -> tuple[float, float]:
        read.append(percept.lidar.tolist())
        return 0.0, 0.0

    robot = Controller(rule, lidar=Lidar(3, 2.0), patience=2)
    robot.decide()
    for rays in ([0.5, math.inf, 7], None, None, None):
        robot.decide(lidar=rays)
    assert read == [[2.0] * 3, *[[0.5, 2.0, 2.0]] * 3, [2.0] * 3]
    robot.decide(lidar=[1, 1, 1])
    robot.reset()
    robot.decide()
    assert read[-1] == [2.0] * 3


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"lidar": [1.0]}, "lidar=.*: must be 3 distances, one for each ray"),
        ({"lidar": [1.0, -1.0, 1.0]}, "must be at least 0; give inf where a ray meets nothing"),
        ({"lidar": [1.0, math.nan, 1.0]}, "must be at least 0; give inf"),
        ({"teammates": Detections([1], [0], [1], moved=[(1, 2), (3, 4)])}, r"teammates\.moved: has 2 .* there are 1"),
        ({"teammates": Detections([1], [0], [1], radius=[-1])}, r"teammates\.radius=\[-1\]: must be 1 numbers, at least 0, one a body"),
        ({"targets": Detections([1], [0], radius=0.2)}, "targets: a body with a radius has no identity"),
        ({"targets": Detections([1], [0], [2**30])}, "reads bodies by identity, up to 1,000,000; number them from 0"),
    ],
)
def test_wrong_readings_of_bodies_and_rays_change_nothing(given: Any, message: str) -> None:
    robot = Controller(Avoiding("a-cmommt"), "pairwise", team=(0, 1), radius=0.1, lidar=Lidar(3))
    robot.decide(lidar=[0.1, 0.2, 0.3])
    before = pickle.dumps(robot)
    with pytest.raises((TypeError, ValueError), match=message):
        robot.decide(**given)
    assert pickle.dumps(robot) == before


def test_what_a_controller_has_not_is_named() -> None:
    with pytest.raises(TypeError, match=r"lidar: this controller has none; give it one, as in Controller\(…, lidar="):
        Controller("random-walk").decide(lidar=[1.0])
    with pytest.raises(TypeError, match="lidar=3: must be a Lidar"):
        Controller("random-walk", lidar=3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="reads 5 rays, and its robots have no lidar"):
        Controller(Roving())
    with pytest.raises(ValueError, match="team: has the identity 2147483647.* number them from 0"):
        Controller(Avoiding("random-walk"), "pairwise", team=(0, 2**31 - 1))
