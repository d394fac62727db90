"""Sensors: the kernel equals its slow twin, and the options are checked."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from naive import sensing as naive

from teamsight.agents.sensing import Sensor, View
from teamsight.agents.sensing.check import sample_view
from teamsight.agents.sensing.sensor import detect, salt_of
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Torus
from teamsight.world.walls import Sight


def a_share() -> Any:
    return st.one_of(st.sampled_from([0.0, 1.0, 0.5]), st.floats(0, 1))


sensors = st.builds(
    Sensor,
    field_of_view=st.one_of(st.sampled_from([2 * math.pi, math.pi, 0.5]), st.floats(0.01, 2 * math.pi)),
    range_noise=st.sampled_from([0.0, 0.05, 10.0]), bearing_noise=st.sampled_from([0.0, 0.1, 3.0]),
    missed=a_share(), false_positives=a_share(), occluded=st.booleans(),
)  # fmt: skip


def rows(sensed: NeighbourList) -> list[dict[int, tuple[float, float]]]:
    """Return what each observer senses, by index."""
    found = []
    for begin, end in zip(sensed.start[:-1], sensed.start[1:], strict=True):
        entries = [(int(sensed.identity[k]), tuple(sensed.offset[k].tolist())) for k in range(begin, end)]
        found.append(dict(entries))
        assert len(found[-1]) == len(entries)
    return found


def cut_by(sight: Sight, sensor: Sensor) -> Any:
    """Return whether a disc of the sight blocks a way: slowly, at many places of it."""

    def is_blocked(here: Any, way: tuple[float, float]) -> bool:
        if not sensor.occluded:
            return False
        places = np.asarray(here) + np.linspace(0, 1, 2001)[:, np.newaxis] * np.array(way)
        gaps = [np.hypot(*(places - disc[:2]).T).min() - disc[2] for disc in sight.discs]
        # A grazing way is a matter of rounding.
        assume(all(abs(gap) > 1e-4 for gap in gaps))
        return any(gap < 0 for gap in gaps)

    return is_blocked


@given(
    sensor=sensors, seed=st.integers(0, 2**32), sizes=st.tuples(st.integers(0, 6), st.integers(0, 12)), among=st.booleans(),
    discs=st.integers(0, 2), side=st.just(2.0), square=st.booleans(),
)  # fmt: skip


@example(sensor=Sensor(false_positives=1.0), seed=0, sizes=(1, 0), among=True, discs=0, side=2.0, square=True)
@example(sensor=Sensor(false_positives=1.0, missed=1.0), seed=3, sizes=(6, 2), among=True, discs=1, side=2.0, square=False)
# More agents in range than a chunk has: of all observers together, and of one.
@example(sensor=Sensor(4.0, 0.1, 0.2, 0.1, 0.5), seed=1, sizes=(12, 40), among=True, discs=0, side=0.8, square=True)
@example(sensor=Sensor(4.0, 0.1, 0.2, 0.1, 0.5), seed=2, sizes=(3, 300), among=False, discs=1, side=1.0, square=False)
@example(sensor=Sensor(), seed=2, sizes=(3, 300), among=False, discs=0, side=0.1, square=False)
def test_the_kernel_equals_its_slow_twin(
    sensor: Sensor, seed: int, sizes: tuple[int, int], among: bool, discs: int, side: float, square: bool
) -> None:
    rng = np.random.default_rng(seed)
    view = sample_view(*sizes, side, rng, among=among, square=square)
    blockers = np.column_stack([rng.uniform(0, 2, (discs, 2)), rng.uniform(0.05, 0.3, discs)])
    view = view._replace(sight=view.sight._replace(discs=blockers))
    ahead = view.heading @ np.array([1, 1j])
    for k, i in enumerate(np.repeat(np.arange(sizes[0]), view.in_range.degree)):
        angle = abs(np.angle((view.in_range.offset[k] @ np.array([1, 1j])) * np.conj(ahead[i])))
        assume(abs(angle - sensor.field_of_view / 2) > 1e-9 or angle > 3)
    sensed = detect(sensor, view)
    wanted = naive.sense(sensor, view, cut_by(view.sight, sensor))
    assert np.allclose(sensed.distance, np.hypot(*sensed.offset.T), rtol=1e-12, atol=0)
    assert (sensed.distance <= np.repeat(view.reach * view.farthest, sensed.degree)).all()
    for found, expected in zip(rows(sensed), wanted, strict=True):
        assert sorted(found) == sorted(expected)
        order = [index if index >= 0 else ~index for index in found]
        assert order == sorted(order)
        for index, offset in found.items():
            assert offset == pytest.approx(expected[index], abs=1e-9)


def test_a_perfect_sensor_shows_what_is_in_range() -> None:
    view = sample_view(6, 12, 1.0, np.random.default_rng(4))
    assert Sensor().is_perfect
    sensed = detect(Sensor(), view)
    for one, other in zip(sensed, view.in_range, strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("width", [1.0, 3.0, math.pi, 5.0, 2 * math.pi])
def test_the_field_of_view_is_centred_on_the_heading(width: float) -> None:
    angle = 2 * math.pi * (np.arange(100) + 0.5) / 100
    around = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    heading = np.array([[0.6, 0.8]])
    seen = Sensor(field_of_view=width).detect([[0, 0]], around, heading, 1.5)
    assert np.array_equal(seen.identity, np.flatnonzero(np.arccos(np.clip(around @ heading[0], -1, 1)) <= width / 2))
    assert 100 * width / (2 * math.pi) == pytest.approx(len(seen.identity), abs=1)


def test_what_is_at_the_same_place_or_straight_behind_is_in_view() -> None:
    narrow = Sensor(field_of_view=0.1).detect([[1, 1]], [[1, 1], [1, 0.9]], [[0, 1]], 1.0)
    assert narrow.identity.tolist() == [0]
    for turn in np.linspace(0, 7, 200):
        heading = np.array([[math.cos(turn), math.sin(turn)]])
        assert len(Sensor().detect([[0, 0]], -0.3 * heading, heading, 1.0).identity) == 1


def test_noisy_readings_stay_between_a_millionth_of_the_range_and_the_range() -> None:
    places = np.stack([np.linspace(0, 2, 500), np.zeros(500)], axis=-1)
    heading = np.tile([0.0, 1.0], (500, 1))
    sensed = Sensor(range_noise=5.0).detect(places, places, heading, 0.7)
    assert sensed.distance.min() == 0.7e-6
    assert sensed.distance.max() == 0.7
    # Those at the same place appear straight ahead.
    same = sensed.identity == np.repeat(np.arange(500), sensed.degree)
    assert same.sum() == 500
    assert (sensed.offset[same, 0] == 0).all()
    assert (sensed.offset[same, 1] > 0).all()


@pytest.mark.parametrize("width", [0.4, 2.0, 5.0, 2 * math.pi])
def test_false_detections_are_uniform_over_the_part_of_a_square_in_view(width: float) -> None:
    size, reach, ahead = 4000, 2.0, np.array([0.6, 0.8])
    places = np.column_stack([100.0 * np.arange(size), np.zeros(size)])
    sensed = Sensor(field_of_view=width, false_positives=1.0).detect(
        places, places + [50.0, 0.0], np.tile(ahead, (size, 1)), reach, range_shape="square"
    )
    assert (sensed.degree == 1).all()
    assert np.abs(sensed.offset).max() <= reach
    assert sensed.distance == pytest.approx(np.hypot(*sensed.offset.T), rel=1e-12)
    angles = np.arccos(np.clip(sensed.offset @ ahead / sensed.distance, -1, 1))
    assert angles.max() <= width / 2 + 1e-9
    # Compared with points of the square that are in view: the share in each cell of a grid.
    x, y = np.meshgrid(*2 * [reach * (np.arange(400) + 0.5) / 200 - reach])
    in_view = np.arccos(np.clip((0.6 * x + 0.8 * y) / np.hypot(x, y), -1, 1)) <= width / 2
    edges = np.linspace(-reach, reach, 5)
    wanted = np.histogram2d(x[in_view], y[in_view], (edges, edges))[0] / in_view.sum()
    found = np.histogram2d(*sensed.offset.T, (edges, edges))[0] / size
    # Six standard deviations of a share of 1/2 at most, and the grid's own error.
    assert np.abs(found - wanted).max() < 6 * math.sqrt(0.25 / size) + 0.005


def test_noisy_readings_in_a_square_end_at_its_half_diagonal() -> None:
    places = np.zeros((500, 2))
    sensed = Sensor(range_noise=50.0).detect([[0, 0]], places, [[0, 1]], 0.7, range_shape="square")
    assert sensed.distance.max() == 0.7 * math.sqrt(2.0)


def test_a_torus_is_seen_through_its_border() -> None:
    seen = Sensor(field_of_view=1.0).detect([[0.9, 0]], [[-0.9, 0], [0.7, 0]], [[1, 0]], 0.5, arena=Torus(2, 2))
    assert seen.identity.tolist() == [0]
    assert seen.offset[0] == pytest.approx([0.2, 0])


def test_channels_have_noise_of_their_own() -> None:
    salts = {tuple(salt_of(name).tolist()) for name in ("targets", "teammates", "predators", "")}
    assert len(salts) == 4
    assert all(0 < word < 2**32 for salt in salts for word in salt)


WRONG = [
    ({"field_of_view": 120}, r"field_of_view=120: must be at most 2π \[rad\]; for degrees use math.radians\(120\)"),
    ({"field_of_view": 0}, r"field_of_view=0.0: must be above 0 \[rad\] and at most 2π; to sense nothing, use missed=1"),
    ({"field_of_view": -1}, r"field_of_view=-1.0: must be above 0 \[rad\] and at most 2π"),
    ({"field_of_view": math.nan}, r"field_of_view=nan: must be a finite number"),
    ({"field_of_view": "wide"}, r"field_of_view='wide': must be a number"),
    ({"bearing_noise": 5}, r"bearing_noise=5: must be at most π \[rad\]; for degrees use math.radians\(5\)"),
    ({"delay": 1.5}, r"delay=1.5: must be a whole number of at least 0"),
    ({"delay": -1}, r"delay=-1: must be at least 0; it is a number of ticks"),
    ({"delay": 1_001}, r"delay=1001: must be at most 1000; it is a number of ticks"),
]


@pytest.mark.parametrize(("options", "message"), WRONG, ids=[f"{case[0]}" for case in WRONG])
def test_wrong_options_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message) as raised:
        Sensor(**options)
    assert "\n" not in str(raised.value)


def test_options_are_values() -> None:
    assert Sensor(missed=np.float32(0.5), delay=np.int64(2)) == Sensor(missed=0.5, delay=2)  # type: ignore[arg-type]
    assert hash(Sensor()) == hash(Sensor(missed=0))
    assert not any(
        Sensor(**{name: value}).is_perfect
        for name, value in {"field_of_view": 6, "range_noise": 1e-9, "bearing_noise": 1, "missed": 1, "false_positives": 1, "delay": 1}.items()
    )
    assert Sensor(occluded=False, range=2).is_perfect


def test_a_sensor_shows_the_options_that_differ() -> None:
    assert repr(Sensor()) == "Sensor()"
    sensor = Sensor(math.radians(90), missed=0.5, range=2)
    assert repr(sensor) == f"Sensor(field_of_view={math.pi / 2!r}, missed=0.5, range=2.0)"
    assert eval(repr(sensor)) == sensor


def test_a_sensor_with_another_kernel_is_not_perfect() -> None:
    class Own(Sensor):
        sense = lambda view, parameters, sensed: 0  # noqa: E731

    assert not Own().is_perfect


def test_wrong_headings_are_refused() -> None:
    with pytest.raises(ValueError, match=r"heading: must be 2 unit vectors, of shape \(2, 2\)"):
        Sensor().detect([[0, 0], [1, 1]], None, [[1, 0], [1, 1]], 1.0)
    with pytest.raises(ValueError, match=r"heading: must be 2 unit vectors"):
        Sensor().detect([[0, 0], [1, 1]], None, [[1, 0]], 1.0)


def without(view: View, index: int) -> View:
    """Return the view after an observed agent that is not an observer has left."""
    seen = view.in_range
    keeps = seen.identity != index
    start = np.concatenate([[0], np.cumsum(keeps)])[seen.start]
    identity = seen.identity[keeps]
    left = NeighbourList(start, identity - (identity > index), seen.offset[keeps], seen.distance[keeps])
    return view._replace(everyone=np.delete(view.everyone, index), in_range=left)


@pytest.mark.parametrize("tick", [0, 1, 2**33 + 5])
def test_an_agent_that_leaves_changes_the_noise_of_no_other(tick: int) -> None:
    sensor = Sensor(field_of_view=5.0, range_noise=0.1, bearing_noise=0.2, missed=0.3)
    view = sample_view(8, 10, 1.0, np.random.default_rng(5))._replace(tick=np.array([tick]))
    for index in range(10):
        before, after = rows(detect(sensor, view)), rows(detect(sensor, without(view, index)))
        for one, other in zip(before, after, strict=True):
            shifted = {j - (j > index): offset for j, offset in one.items() if j != index}
            assert shifted == other


def test_noise_depends_on_tick_observer_identity_channel_and_seed() -> None:
    sensor = Sensor(range_noise=0.01)
    view = sample_view(8, 10, 0.3, np.random.default_rng(6))
    base = detect(sensor, view).distance
    for changed in (
        view._replace(tick=view.tick + 1), view._replace(member=view.member + 1), view._replace(everyone=view.everyone + 1),
        view._replace(salt=salt_of("predators")), view._replace(key=view.key + np.uint64(1)), view._replace(stream=view.stream + 256),
    ):  # fmt: skip
        other = detect(sensor, changed).distance
        assert len(base) == len(other)
        assert (base != other).all()


def test_a_range_of_zero_gives_finite_readings() -> None:
    sensed = Sensor(range_noise=0.1, bearing_noise=0.1, false_positives=1.0).detect(
        [[1, 1], [2, 2]], [[1, 1], [3, 3]], [[1, 0], [0, 1]], 0.0
    )
    assert (~sensed.identity[sensed.identity < 0]).size == 2
    assert not sensed.offset.any()
    assert not sensed.distance.any()
