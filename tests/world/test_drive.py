"""Drives: the closed forms of arcs and of stopping, slow twins, and what is refused."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from naive import drive as naive

from teamsight import Box, Car, DifferentialDrive, Drive, check_drive
from teamsight.core.kernel import kernel
from teamsight.core.table import Field, Table
from teamsight.world.drive import Free, drive_of
from teamsight.world.motion import WRONG_DRIVE, advance_entry, bodies_at, intend_entry, pack_move, turn_limit

pytestmark = pytest.mark.short

ARENA = Box(1000.0, 1000.0)


@kernel
def glide(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    state[0] += parameters[0] * (distance - state[0])
    return state[0], 0.0, turn


class Ride:
    """One body with a drive, in the middle of a large box."""

    def __init__(self, drive: Drive, *, speed: float = 0.2, heading: float = 0.0, limit: float = math.pi) -> None:
        self.drive, self.heading = drive, heading
        self.bodies: Table = bodies_at(np.zeros((1, 2)), np.array([[math.cos(heading), math.sin(heading)]]))
        self.bodies.speed[:] = speed
        self.bodies.turn_cosine[:], self.bodies.turn_sine[:] = turn_limit(limit)
        self.bodies.declare(Field("drive", shape=(len(drive.state),)))
        self.aim, self.distance = np.zeros((1, 2)), np.zeros(1)
        self._move = pack_move(ARENA, self.bodies, self.aim, self.distance, drive=drive)

    def go(self, turn: float, distance: float) -> np.ndarray:
        """Ask for a turn and a distance; return the displacement."""
        x, y = self.bodies.heading[0]
        cosine, sine = math.cos(turn), math.sin(turn)
        self.aim[0] = cosine * x - sine * y, sine * x + cosine * y
        self.distance[0] = distance
        assert advance_entry(ARENA, self.drive)(self._move) == 0
        self.heading = math.atan2(*self.bodies.heading[0, ::-1])
        return np.array(self.bodies.moved[0])

    @property
    def state(self) -> tuple[float, ...]:
        return tuple(self.bodies.drive[0].tolist())


@given(turn=st.floats(-1.5, 1.5).filter(lambda angle: abs(angle) > 0.05), distance=st.floats(0.02, 0.1), heading=st.floats(-3, 3))
@settings(max_examples=30)
def test_a_differential_drive_goes_round_a_circle(turn: float, distance: float, heading: float) -> None:
    ride = Ride(DifferentialDrive(0.08), heading=heading, speed=1.0)
    radius = distance / turn
    centre = radius * np.array([-math.sin(heading), math.cos(heading)])
    for step in range(1, 40):
        ride.go(turn, distance)
        assert np.hypot(*(ride.bodies.position[0] - centre)) == pytest.approx(abs(radius), abs=1e-12)
        assert math.remainder(ride.heading - heading - step * turn, math.tau) == pytest.approx(0, abs=1e-12)
    assert ride.state == pytest.approx((distance - 0.04 * turn, distance + 0.04 * turn))


@given(steering=st.floats(0.05, 1.2), side=st.sampled_from([-1, 1]), base=st.floats(0.05, 2))
@settings(max_examples=30)
def test_a_car_goes_round_a_circle_of_its_steering_angle(steering: float, side: int, base: float) -> None:
    # Else a wider arc is enough for the turn that is asked for.
    assume(3.0 * base / 0.2 > math.tan(steering))
    ride = Ride(Car(base, steering))
    radius = base / math.tan(steering)
    for _ in range(50):
        # It wants to turn round at once.
        ride.go(side * 3.0, 0.2)
        assert np.hypot(*(ride.bodies.position[0] - (0.0, side * radius))) == pytest.approx(radius, abs=1e-12)
    assert ride.state == pytest.approx((0.2, side * steering))


@pytest.mark.parametrize("drive", [DifferentialDrive(0.1, 0.01), Car(0.1, 0.6, None, 0.01)], ids=lambda one: type(one).__name__)
def test_it_takes_v_squared_over_2a_to_stop(drive: Drive) -> None:
    ride = Ride(drive)
    gone = [ride.go(0.0, 0.2)[0] for _ in range(30)]
    assert gone[:20] == pytest.approx(np.arange(1, 21) * 0.01)
    assert gone[20:] == pytest.approx([0.2] * 10)
    # In steps of one tick: v²/2a less the half step that is lost at each change.
    stopping = sum(ride.go(0.0, 0.0)[0] for _ in range(30))
    assert stopping == pytest.approx(0.2**2 / (2 * 0.01) - 0.2 / 2)
    assert max(map(abs, ride.state)) < 1e-15


def test_a_differential_drive_turns_on_the_spot_and_a_car_does_not() -> None:
    ride = Ride(DifferentialDrive(0.2))
    assert not ride.go(1.0, 0.0).any()
    assert ride.heading == pytest.approx(1.0)
    assert ride.state == pytest.approx((-0.1, 0.1))
    # Its wheels are not fast enough for more: 2·speed / wheel base.
    ride = Ride(DifferentialDrive(0.2), speed=0.1)
    ride.go(3.0, 0.0)
    assert ride.heading == pytest.approx(1.0)
    parked = Ride(Car())
    assert not parked.go(1.0, 0.0).any()
    assert parked.heading == 0.0
    assert parked.state == (0.0, 0.6)


def test_the_turning_limit_bounds_what_is_asked_for() -> None:
    ride = Ride(DifferentialDrive(0.01), limit=0.25)
    ride.go(2.0, 0.1)
    assert ride.heading == pytest.approx(0.25)


def test_a_lower_speed_holds_at_once() -> None:
    ride = Ride(DifferentialDrive(0.1, 0.001), speed=0.2)
    ride.bodies.drive[:] = 0.2
    ride.bodies.speed[:] = 0.05
    assert ride.go(0.0, 0.2)[0] == pytest.approx(0.05)


@pytest.mark.parametrize("drive", [DifferentialDrive(0.1), Car(0.1)], ids=lambda one: type(one).__name__)
def test_a_body_that_was_blocked_begins_from_rest(drive: Drive) -> None:
    ride = Ride(type(drive)(acceleration=0.01))
    for _ in range(5):
        ride.go(0.0, 0.2)
    ride.bodies.blocked[:] = True
    assert ride.go(0.0, 0.2)[0] == pytest.approx(0.01)


ACTIONS = st.lists(st.tuples(st.floats(-3.1, 3.1), st.floats(0, 0.2)), min_size=1, max_size=30)
CHANGE = st.none() | st.floats(1e-3, 0.5)


@given(actions=ACTIONS, base=st.floats(0.02, 1), acceleration=CHANGE)
def test_a_differential_drive_is_its_slow_twin(actions: Any, base: float, acceleration: float | None) -> None:
    ride, wheels = Ride(DifferentialDrive(base, acceleration)), (0.0, 0.0)
    for turn, distance in actions:
        before = ride.heading
        moved = ride.go(turn, distance)
        wheels, length, turned = naive.differential(turn, distance, 0.2, wheels, base, acceleration)
        assert ride.state == pytest.approx(wheels, abs=1e-9)
        assert moved == pytest.approx(naive.integrated(before, length, turned), abs=1e-6)
        assert math.remainder(ride.heading - before - turned, math.tau) == pytest.approx(0, abs=1e-7)


@given(actions=ACTIONS, base=st.floats(0.1, 1), largest=st.floats(0.1, 1.2), rate=CHANGE, acceleration=CHANGE)
def test_a_car_is_its_slow_twin(
    actions: Any, base: float, largest: float, rate: float | None, acceleration: float | None
) -> None:
    ride, state = Ride(Car(base, largest, rate, acceleration)), (0.0, 0.0)
    for turn, distance in actions:
        before = ride.heading
        moved = ride.go(turn, distance)
        if abs(turn) < 1e-6:
            # By rounding, either side.
            state = ride.state[0], ride.state[1]
            continue
        state, length, turned = naive.car(turn, distance, state, base, largest, rate, acceleration)
        assert ride.state == pytest.approx(state, abs=1e-9)
        assert moved == pytest.approx(naive.integrated(before, length, turned), abs=1e-6)
        assert math.remainder(ride.heading - before - turned, math.tau) == pytest.approx(0, abs=1e-7)


def test_headings_stay_unit_vectors() -> None:
    ride = Ride(DifferentialDrive(0.1))
    for _ in range(20_000):
        ride.go(0.7, 0.1)
    assert np.hypot(*ride.bodies.heading[0]) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: DifferentialDrive(0.0), r"wheel_base=0\.0: .*above 0; give the distance between the wheels"),
        (lambda: DifferentialDrive(math.nan), "wheel_base=nan"),
        (lambda: DifferentialDrive(0.1, 0.0), r"acceleration=0\.0: .*give None for wheels that reach any speed"),
        (lambda: Car(-1.0), r"wheel_base=-1\.0"),
        (lambda: Car(largest_steering=2.0), r"largest_steering=2\.0: .*at most 1\.5; give less than a quarter of a turn"),
        (lambda: drive_of("bicycle"), "drive='bicycle': unknown"),
        (lambda: drive_of(Car), "drive=Car: is a class; give an object"),
        (lambda: drive_of(3), "drive=3: must be a Drive, or one of free, differential, car"),
        (lambda: drive_of(Drive()), "drive=Drive: has no kernel 'carry'; give carry"),
        (lambda: drive_of(type("Mine", (Free,), {"carry": glide})()), "drive=Mine: has no kernel 'carry'; derive from Drive"),
        (lambda: check_drive(Car(), steps=0), "steps=0: must be at least 1"),
    ],
)
def test_wrong_drives_are_refused(made: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        made()


@dataclass(frozen=True)
class Glider(Drive):
    """A drive of the user's own: its velocity follows what is asked for."""

    state = ("velocity",)
    carry = glide

    response: float = 0.2


@pytest.mark.parametrize("drive", [Free(), DifferentialDrive(0.3, 0.05), Car(0.1, 0.5, 0.1, 0.02), Car(), Glider()], ids=repr)
def test_good_drives_pass_the_check(drive: Drive) -> None:
    check_drive(drive)


def own(carry: Any, state: tuple[str, ...] = ("one",)) -> Drive:
    """A drive with this kernel."""
    made: Drive = type("Own", (Drive,), {"carry": carry, "state": state})()
    return made


@kernel
def too_far(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    return 2.0 * distance, 0.0, turn


@kernel
def nowhere(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    return distance, distance * (speed / speed if speed > 0.0 else np.nan), turn


@kernel
def keeps_nan(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    state[0] = np.nan
    return distance, 0.0, turn


@kernel
def spins(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    return 0.0, 0.0, 1e9


@kernel
def beyond(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    state[1] = 0.0
    return 0.0, 0.0, 0.0


@kernel
def writes_constants(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    parameters[0] = 0.0
    return 0.0, 0.0, 0.0


@kernel
def two_of_six(turn: float, distance: float) -> Any:
    return distance, 0.0, turn


@dataclass(frozen=True)
class Writes(Drive):
    carry = writes_constants

    gain: float = 1.0


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        (own(too_far), "a longer way than the speed"),
        (own(nowhere), "not finite|longer way"),
        (own(keeps_nan), "keeps what is not finite"),
        (own(spins), "turn of too many rounds"),
        (own(beyond), "state"),
        (Writes(), "parameters"),
        (own(glide, "one"), "must be a tuple of names"),
        (own(two_of_six), r"its carry takes \(turn, distance\), and must take those of carry"),
        (own(glide, ("one", "one")), "a name of its own"),
        (own(lambda turn: turn), "carry"),
        ("car", "must be a Drive|Drive"),
    ],
    ids=[*"abcdefghijk"],
)
def test_the_check_finds_what_is_wrong(drive: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        check_drive(drive)


def test_a_way_that_cannot_be_is_reported_and_not_made() -> None:
    for entry in (advance_entry(ARENA, own(too_far)), intend_entry(own(too_far))):
        drive = own(too_far)
        bodies = bodies_at(np.zeros((2, 2)), np.array([[1.0, 0.0]] * 2))
        bodies.speed[:] = 0.2
        bodies.declare(Field("drive", shape=(1,)))
        move = pack_move(ARENA, bodies, np.zeros((2, 2)), np.array([0.2, 0.05]), drive=drive)
        assert entry(move) == -WRONG_DRIVE
        assert bodies.moved.tolist() == [[0.0, 0.0], [0.1, 0.0]]
