"""Awareness over several hops: who is known, how late, and that all paths agree."""

from __future__ import annotations

import pickle
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import hops as naive

from teamsight import CMOMMT, Disc, Robot, Sensor, Target, UnreliableAwareness, World, check_awareness
from teamsight.agents.awareness import Awareness, RelayedAwareness, show
from teamsight.agents.awareness.interface import team_group_at
from teamsight.agents.controller import Controller
from teamsight.core.kernel import kernel
from teamsight.policies import ACmommt, Stationary
from tests.sensed_worlds import assert_one_answer, herd, percept_of

DEGREES = [
    RelayedAwareness(), RelayedAwareness(1), RelayedAwareness(2), RelayedAwareness(3, delay=1),
    RelayedAwareness("all", delay=2), RelayedAwareness(2, loss=0.3), RelayedAwareness(4, delay=3, loss=0.2),
]  # fmt: skip

seeds = st.integers(0, 2**31)


def team(awareness: Any, seed: int = 1, sizes: tuple[int, ...] = (6, 3), side: float = 1.5, **options: Any) -> World:
    """Robots of one team in two groups, with ranges of their own, among targets; all walk at random."""
    world = World(Disc(side), rng=seed)
    targets = world.add(Target, 5, policy="random-walk", speed=0.1)
    for number, size in enumerate(sizes):
        ranges = np.random.default_rng([seed, number]).uniform(0.3, 0.9, (2, size))
        robots = world.add(
            Robot, size, policy="random-walk", awareness=awareness, sensing_range=ranges[0], awareness_range=ranges[1],
            speed=0.1, **options,
        )  # fmt: skip
        world.senses(robots, targets)
    return world


def moment(world: World) -> naive.Moment:
    """Return what the robots of a world sense now, from what the sensors of their groups show."""
    groups = world.groups[1:]
    place = {robot.unique_id: at for at, robot in enumerate(robot for group in groups for robot in group)}
    links: list[dict[int, tuple[float, float, float]]] = []
    targets: list[list[tuple[int, float, float]]] = []
    for group in groups:
        near, seen = group.neighbours("teammates"), group.neighbours("targets")
        for row in range(len(group)):
            entries = range(near.start[row], near.start[row + 1])
            links.append({place[int(near.identity[k])]: (*near.offset[k].tolist(), float(near.distance[k])) for k in entries})
            entries = range(seen.start[row], seen.start[row + 1])
            targets.append([(int(seen.identity[k]), *seen.offset[k].tolist()) for k in entries])
    return naive.Moment(links, targets)


def perceived(world: World) -> list[Any]:
    """Return what each robot perceives: teammates by place, and relayed targets."""
    groups = world.groups[1:]
    place = {robot.unique_id: at for at, robot in enumerate(robot for group in groups for robot in group)}
    found = []
    for group in groups:
        percept = percept_of(group)
        for row in range(len(group)):
            mine = range(percept.teammates.start[row], percept.teammates.start[row + 1])
            others = [
                (place[int(percept.teammates.identity[k])], *percept.teammates.offset[k].tolist(), float(percept.teammates.distance[k]))
                for k in mine
            ]
            theirs = range(percept.relayed.start[row], percept.relayed.start[row + 1])
            found.append((others, [(int(percept.relayed.identity[k]), *percept.relayed.offset[k].tolist()) for k in theirs]))
    return found


@pytest.mark.parametrize(("hops", "delay"), [(1, 0), (2, 0), (3, 0), ("all", 0), (1, 2), (2, 1), (3, 2), ("all", 1)])
@given(seed=seeds)
def test_who_is_known_and_where_is_what_the_twin_says(hops: Any, delay: int, seed: int) -> None:
    world = team(RelayedAwareness(hops, delay), seed)
    most, past = 8 if hops == "all" else hops, []
    for _ in range(10):
        past.append(moment(world))
        for robot, (others, relayed) in enumerate(perceived(world)):
            wanted = naive.known(past, robot, most, delay)
            assert others == [(other, *wanted[other][1:]) for other in sorted(wanted)]
            assert relayed == naive.relayed(past, robot, most, delay)
            if delay == 0:
                assert {other: entry[0] for other, entry in wanted.items()} == naive.reached(past[-1], robot, most)
        world.step()


@given(seed=seeds, shape=st.sampled_from(["disc", "square"]))
def test_one_hop_without_delay_and_loss_is_shared_awareness_to_the_last_bit(seed: int, shape: Any) -> None:
    worlds = [team(degree, seed, range_shape=shape) for degree in (RelayedAwareness(1), "shared")]
    for _ in range(3):
        for groups in zip(*(world.groups[1:] for world in worlds), strict=True):
            one, other = map(percept_of, groups)
            for kind in ("teammates", "relayed"):
                for found, wanted in zip(getattr(one, kind), getattr(other, kind), strict=True):
                    assert found.tobytes() == wanted.tobytes()
            for found, wanted in zip(*groups, strict=True):
                assert found.situation.tobytes() == wanted.situation.tobytes()
        for world in worlds:
            world.run(5)


@pytest.mark.parametrize("sensor", [Sensor(range_noise=0.1, missed=0.2), Sensor(false_positives=0.4), Sensor(delay=3)])
def test_one_hop_is_shared_awareness_for_every_sensor(sensor: Sensor) -> None:
    found = []
    for degree in (RelayedAwareness(1), "shared"):
        world = team(degree)
        for group in world.groups[1:]:
            group.sensors["teammates"] = sensor
        world.run(12)
        found.append([*perceived(world), [robot.situation.tobytes() for group in world.groups[1:] for robot in group]])
    assert found[0] == found[1]
    assert any(others for others, _ in found[0][:-1])


def test_all_hops_of_a_connected_team_show_what_a_long_range_shows() -> None:
    # A line of robots, each of which hears the next one only.
    def line(awareness: Any, awareness_range: float) -> Any:
        world = World(Disc(5), rng=1)
        robots = world.add(
            Robot, 7, policy=Stationary(), awareness=awareness, awareness_range=awareness_range,
            position=[(0.875 * k - 3, 0.25 * (k % 2)) for k in range(7)], heading=[(1.0, 0.0)] * 7,
        )  # fmt: skip
        world.senses(robots, world.add(Target, 6, policy=Stationary()))
        return percept_of(robots)

    near, far = line(RelayedAwareness(), 1.0), line("shared", 10.0)
    assert np.diff(line("shared", 1.0).teammates.start).max() == 2
    for kind in ("teammates", "relayed"):
        found, wanted = getattr(near, kind), getattr(far, kind)
        # The places are multiples of 1/8, so sums of offsets are exact.
        for name in ("start", "identity") if kind == "relayed" else ("start", "identity", "offset", "distance"):
            np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
        np.testing.assert_allclose(found.offset, wanted.offset, atol=1e-14)
    for hops in range(1, 7):
        percept = line(RelayedAwareness(hops), 1.0)
        assert np.diff(percept.teammates.start).tolist() == [min(k, hops) + min(6 - k, hops) for k in range(7)]


def test_news_takes_one_delay_for_each_hop() -> None:
    world = World(Disc(5), rng=1)
    robots = world.add(
        Robot, 4, policy=Stationary(), awareness=RelayedAwareness(delay=3), position=[(0.75 * k - 1, 0) for k in range(4)]
    )
    counts = []
    for _ in range(11):
        counts.append(len(percept_of(robots).teammates.identity[: percept_of(robots).teammates.start[1]]))
        world.step()
    assert counts == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3]


def test_the_share_of_lost_reports_is_the_loss() -> None:
    count, wanted = 0, 0
    world = team(RelayedAwareness(1, loss=0.3), side=1.0)
    for _ in range(400):
        percepts = [percept_of(group) for group in world.groups[1:]]
        count += sum(len(percept.teammates.identity) for percept in percepts)
        wanted += sum(len(group.neighbours("teammates").identity) for group in world.groups[1:])
        world.step()
    assert wanted > 5000
    # Four standard deviations.
    assert abs(count / wanted - 0.7) < 4 * np.sqrt(0.21 / wanted)
    lost = team(RelayedAwareness(loss=1.0))
    lost.run(5)
    assert not any(others or relayed for others, relayed in perceived(lost))


def test_loss_is_of_a_link_and_so_of_all_that_comes_over_it() -> None:
    world = World(Disc(5), rng=2)
    robots = world.add(
        Robot, 3, policy=Stationary(), awareness=RelayedAwareness(loss=0.5), position=[(0.75 * k, 0) for k in range(3)]
    )
    seen = set()
    for _ in range(60):
        percept = percept_of(robots)
        seen.add(tuple(percept.teammates.identity[: percept.teammates.start[1]].tolist()))
        world.step()
    near, far = robots[1].unique_id, robots[2].unique_id
    assert seen == {(), (near,), (near, far)}


@pytest.mark.parametrize("degree", DEGREES, ids=str)
def test_all_paths_give_one_result(degree: Awareness) -> None:
    assert_one_answer(lambda: herd({"teammates": Sensor(missed=0.2)}, awareness=degree))


@pytest.mark.parametrize("degree", [DEGREES[0], DEGREES[-1]], ids=str)
def test_all_paths_give_one_result_with_late_sensors(degree: Awareness) -> None:
    assert_one_answer(lambda: herd({"teammates": Sensor(delay=2), "targets": Sensor(delay=1)}, awareness=degree))


@pytest.mark.parametrize("degree", DEGREES, ids=str)
def test_the_degrees_keep_the_contract(degree: Awareness) -> None:
    check_awareness(degree)


def test_what_is_on_its_way_is_part_of_the_state() -> None:
    def tail(world: World) -> list[Any]:
        found = []
        for _ in range(8):
            found.append(perceived(world))
            world.step()
        return found

    world = team(RelayedAwareness(3, delay=2, loss=0.1))
    world.run(20)
    saved = pickle.loads(pickle.dumps(world.state()))
    wanted = tail(world)
    assert any(others for others, _ in wanted[0])
    world.restore(saved)
    assert tail(world) == wanted
    other = team(RelayedAwareness(3, delay=2, loss=0.1))
    other.restore(saved)
    assert tail(other) == wanted
    world.reset()
    assert not any(others for others, _ in perceived(world))
    world.run(20)
    assert tail(world) == wanted


def test_who_leaves_who_is_inactive_and_who_joins() -> None:
    world = team(RelayedAwareness("all", delay=2), side=0.8)
    world.run(20)
    robots = world.groups[1]
    gone, still = robots[0].unique_id, robots[1].unique_id
    assert any(gone in percept_of(group).teammates.identity for group in world.groups[1:])
    robots[0].remove()
    robots[0].active = False
    assert robots[0].unique_id == still
    for group in world.groups[1:]:
        assert not {gone, still} & {*percept_of(group).teammates.identity.tolist()}
    assert percept_of(robots).teammates.start[1] == 0
    # The others go on with the reports that are on their way, now over fewer hops, and then over more.
    assert len(percept_of(robots).teammates.identity) > 0
    world.run(3)
    robots.add(4, awareness_range=0.9, sensing_range=0.9)
    assert len(percept_of(robots).teammates.identity) > 0
    assert set(np.diff(percept_of(robots).teammates.start)[-4:]) == {0}
    world.run(8)
    assert np.diff(percept_of(robots).teammates.start)[-4:].max() > 0


def test_an_inactive_target_is_not_relayed() -> None:
    world = team(RelayedAwareness(2, delay=1), side=0.8)
    world.run(10)
    target = next(iter(percept_of(world.groups[1]).relayed.identity.tolist()))
    next(each for each in world.groups[0] if each.unique_id == target).active = False
    assert target not in percept_of(world.groups[1]).relayed.identity


def test_unreliable_awareness_adds_to_it() -> None:
    world, plain = team(RelayedAwareness()), team(RelayedAwareness())
    for group in world.groups[1:]:
        world.attach(UnreliableAwareness(delay=3), group)
    wanted = []
    for tick in range(8):
        wanted.append(perceived(plain))
        if tick >= 3:
            assert perceived(world) == wanted[tick - 3]
        for each in (world, plain):
            each.step()


def test_groups_of_one_team_with_different_degrees_each_have_their_own() -> None:
    world = team("none")
    alone = [team(degree) for degree in (RelayedAwareness(2, delay=2), RelayedAwareness(3, loss=0.4))]
    for group, one in zip(world.groups[1:], alone, strict=True):
        group.awareness = one.groups[1].awareness
    for each in (world, *alone):
        each.run(15)
    for number, one in enumerate(alone, 1):
        for found, wanted in zip(percept_of(world.groups[number]).teammates, percept_of(one.groups[number]).teammates, strict=True):
            np.testing.assert_array_equal(found, wanted)


def test_worlds_without_it_keep_nothing() -> None:
    world = team("shared")
    world.run(5)
    assert not any(group.readings for group in world.groups)
    world.groups[1].awareness = RelayedAwareness(2, delay=1)
    world.run(5)
    assert all(group.readings for group in world.groups[1:])
    world.groups[1].awareness = "shared"
    world.run(1)
    assert not any(group.readings for group in world.groups)


@kernel
def _popular(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    """Show the teammates that sense more teammates than one does."""
    shown = 0
    for i in range(len(scene.heading)):
        teammates.start[i] = shown
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            at = 0
            group = team_group_at(scene.team[at])
            while scene.place[k] >= group.first + len(group.identity):
                at += 1
                group = team_group_at(scene.team[at])
            row = scene.place[k] - group.first
            theirs = group.teammates.start[row + 1] - group.teammates.start[row]
            if theirs > scene.teammates.start[i + 1] - scene.teammates.start[i]:
                shown = show(scene.teammates, k, teammates, shown)
    teammates.start[len(scene.heading)] = shown
    return shown


class Popular(Awareness):
    """A degree of one's own that reads whom teammates sense."""

    perceive = _popular


def test_a_degree_of_ones_own_reads_whom_teammates_sense() -> None:
    check_awareness(Popular())
    world = team(Popular(), side=1.0)
    world.run(5)
    now, found = moment(world), perceived(world)
    for robot, (others, _) in enumerate(found):
        assert [other for other, *_ in others] == [j for j in sorted(now.links[robot]) if len(now.links[j]) > len(now.links[robot])]
    assert any(others for others, _ in found)


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (lambda: RelayedAwareness(0), ValueError, r"hops=0: .*at least 1.*none"),
        (lambda: RelayedAwareness(True), TypeError, r"hops=True: .*whole number"),
        (lambda: RelayedAwareness(cast(Any, 1.5)), TypeError, r"hops=1.5: .*whole number"),
        (lambda: RelayedAwareness(cast(Any, "every")), ValueError, r"hops='every': .*all"),
        (lambda: RelayedAwareness(delay=-1), ValueError, r"delay=-1: .*at least 0"),
        (lambda: RelayedAwareness(loss=1.2), ValueError, r"loss=1.2: .*at most 1"),
        (lambda: CMOMMT(robots=5, awareness=RelayedAwareness(5)), ValueError, r'hops=5: .*at most 4 .*5.*"all"'),
        (lambda: CMOMMT(robots=50, awareness=RelayedAwareness(delay=50)), ValueError, r"delay=50: 2450 ticks.*1000"),
        (lambda: team(RelayedAwareness(9)).step(), ValueError, r"hops=9: .*at most 8 .*9"),
        (lambda: Controller(ACmommt(), awareness="relayed", team=[1, 2], identity=1), ValueError, r"'relayed'.*'shared'"),
    ],
)  # fmt: skip
def test_bad_input(make: Any, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        make()


def test_a_degree_that_is_refused_changes_nothing() -> None:
    world = team("shared")
    world.run(3)
    before = world.groups[1].awareness
    with pytest.raises(ValueError, match="hops=9"):
        world.groups[1].awareness = RelayedAwareness(9)
    assert world.groups[1].awareness is before
    world.run(3)


@pytest.mark.short
def test_arrivals_count_while_they_are_there() -> None:
    world = World(Disc(4.0), rng=1)
    robots = world.add(Robot, 4, policy="random-walk", awareness=RelayedAwareness("all", delay=100), awareness_range=3.0)
    for _ in range(30):
        world.run(2)
        robots.add(2)
        world.run(1)
        robots[0].remove()
        robots[0].remove()
    assert robots.members_so_far > 60
    before = robots.position.copy()
    with pytest.raises(ValueError, match=r"delay=100: 1100 ticks for hops='all' in a team of 12"):
        robots.add(8)
    assert np.array_equal(robots.position, before)
    world.run(5)


@pytest.mark.short
@pytest.mark.parametrize(("name", "value", "message"), [("memory", -1, "at least 0"), ("memory", 2.5, "whole"), ("loss", 2.0, "at most 1")])
def test_what_a_degree_says_of_its_memory_is_checked(name: str, value: Any, message: str) -> None:
    degree = RelayedAwareness()
    object.__setattr__(degree, name, (lambda size: value) if name == "memory" else value)
    world = World(Disc(4.0), rng=1)
    world.add(Robot, 4, policy="random-walk", awareness=degree)
    with pytest.raises((TypeError, ValueError), match=message):
        world.run(3)
