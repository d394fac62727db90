"""Pucks and nights: against a field by sentences, step by step; conservation; both paths; what happens in each case."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive import collecting as naive

from teamsight import TASKS, Box, check_interaction
from teamsight.policies.basis import BasisBehaviours, share_correct
from teamsight.tasks.collecting import LEARNING, Collecting, PuckCollecting, learned
from tests.interactions import fingerprint

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

SMALL: dict[str, Any] = {
    "robots": 5, "pucks": 8, "side": 12.0, "home_radius": 2.0, "reach": 0.7, "period": 40, "night": 12,
}  # fmt: skip


@pytest.mark.parametrize("renewed", [True, False])
def test_the_interaction_keeps_its_contract(renewed: bool) -> None:
    check_interaction(Collecting(4.0, 1.0, 0.7, 3, 1, renewed), Box(4, 4))


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10_000), renewed=st.booleans(), night=st.integers(0, 20), pucks=st.integers(1, 12))
def test_every_step_is_that_of_the_field(seed: int, renewed: bool, night: int, pucks: int) -> None:
    changed = {**SMALL, "renewed": renewed, "night": night, "pucks": pucks}
    # Random behaviours: all events occur.
    world = PuckCollecting(**changed, policy=BasisBehaviours(scheme="none", timeout=7), rng=seed)
    field = naive.Field(world.interactions[0], world.robots, world.pucks)
    for _ in range(130):
        noise = naive.noise_of_pucks(world)
        world.step()
        happened = field.step(world.robots.bodies.position, noise)
        where = f"seed {seed}, tick {world.tick}"
        for name in naive.EVENTS:
            assert getattr(world.robots, name).tolist() == [one[name] for one in field.events], where
        row = world.recording.history.iloc[-1]
        assert row["delivered"] == happened["dropped_home"], where
        for name in ("grabbed", "dropped_away", "woken_home", "woken_away"):
            assert row[name] == happened[name], where
        held = {robot: world.pucks.identity.tolist()[puck] for robot, puck in field.held.items()}
        assert {i: puck for i, puck in enumerate(world.robots.puck.tolist()) if puck} == held, where
        assert world.pucks.bodies.position == pytest.approx(np.array(field.pucks)), where
        assert set(np.flatnonzero(world.pucks.delivered)) == field.delivered, where
        assert set(world.robots.night.tolist()) == {field.night}, where


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000), renewed=st.booleans())
def test_pucks_are_conserved_and_nothing_is_delivered_twice(seed: int, renewed: bool) -> None:
    world = PuckCollecting(**{**SMALL, "renewed": renewed}, policy=BasisBehaviours.correct(), rng=seed)
    gone = np.zeros(8, bool)
    for _ in range(200):
        world.step()
        held = world.robots.puck.values[world.robots.puck.values > 0]
        delivered, holder = world.pucks.delivered.values, world.pucks.holder.values
        # Each is on the ground, held by one robot, or delivered.
        assert len(set(held.tolist())) == len(held) == np.count_nonzero(holder)
        assert not (delivered.astype(bool) & (holder > 0)).any()
        assert (delivered.astype(bool) >= gone).all()
        gone = delivered.astype(bool).copy()
        history = world.recording.history
        assert history["grabbed"].sum() == history["delivered"].sum() + history["dropped_away"].sum() + len(held)
        if not renewed:
            assert history["delivered"].sum() == gone.sum()
    assert world.recording.history["delivered"].sum() > 0


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 999), scheme=st.sampled_from(["delayed", "events", "progress"]),
    parts=st.lists(st.integers(1, 60), max_size=4),
)  # fmt: skip
def test_both_paths_give_one_result(seed: int, scheme: str, parts: list[int]) -> None:
    policy = BasisBehaviours(scheme=scheme, intruders="ring", delta=3)
    worlds = [PuckCollecting(**SMALL, policy=policy, rng=seed) for _ in range(2)]
    for number, steps in enumerate(parts):
        worlds[0].run(steps)
        if number % 2:
            worlds[1].run(steps)
        else:
            for _ in range(steps):
                worlds[1].step()
    assert fingerprint(worlds[0]) == fingerprint(worlds[1])
    assert np.array_equal(*(world.robots.policy_state.floats for world in worlds))


def alone(policy: Any = "stationary", **changed: Any) -> PuckCollecting:
    """Return a world of one robot, far from home, and one puck where it is."""
    world = PuckCollecting(**{**SMALL, "robots": 1, "pucks": 1, **changed}, policy=policy, rng=1)
    world.robots[0].position = world.pucks[0].position = (5.0, 5.0)
    return world


def ahead(percept: Any, rng: Any) -> tuple[float, float]:
    return 0.0, float(percept.speed)


def test_a_robot_that_stands_still_grasps_nothing_and_drops_what_it_has() -> None:
    world = alone()
    world.run(3)
    assert not world.robots.grabbed[0]
    world.robots.policy = ahead
    world.step()
    assert (world.robots.grabbed[0], world.robots.puck[0]) == (1, world.pucks[0].identity)
    world.robots.policy = "stationary"
    world.step()
    assert (world.robots.dropped_away[0], world.robots.puck[0]) == (1, 0)
    assert world.pucks[0].position.tolist() == world.robots[0].position.tolist()


def test_nothing_is_grasped_by_night() -> None:
    world = alone(ahead, night=12, reach=2.9)
    world.robots.policy = "stationary"
    world.run(28)
    assert world.robots.night.tolist() == [True]
    world.robots.policy = ahead
    world.run(3)
    assert not world.robots.grabbed[0]


@pytest.mark.parametrize(
    ("place", "policy", "expected"),
    [((0.0, 0.0), "stationary", (1, 0)), ((5.0, 5.0), "stationary", (0, 1)), ((5.0, 5.0), ahead, (0, 1)),
     ((0.0, 0.0), BasisBehaviours(scheme="none", tables=np.eye(4)[3] * np.ones((16, 1))), (0, 0))],
)  # fmt: skip
def test_who_wakes_where(place: Any, policy: Any, expected: tuple[int, int]) -> None:
    world = alone(policy)
    world.robots[0].position = place
    world.run(39)
    assert (world.robots.woken_home[0], world.robots.woken_away[0]) == (0, 0)
    world.step()
    assert (world.robots.woken_home[0], world.robots.woken_away[0]) == expected


def test_pucks_and_robots_that_leave_take_nobody_elses_puck() -> None:
    world = PuckCollecting(**SMALL, policy=BasisBehaviours(scheme="none", tables=np.eye(4)[0] * np.ones((16, 1))), rng=3)
    while np.count_nonzero(world.robots.puck) < 2:
        world.step()
    first, second = np.flatnonzero(world.robots.puck)[:2]
    robot, kept = world.robots[int(second)], int(world.robots.puck[int(second)])
    lost = int(world.robots.puck[int(first)])
    next(puck for puck in world.pucks if puck.identity == lost).remove()
    world.step()
    assert robot.puck in (kept, 0)
    assert world.robots.puck[int(first)] != lost
    assert world.pucks.holder.tolist().count(robot.identity) <= 1


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"night": 40}, r"night=40: must be less than period=40"),
        ({"home_radius": 4.0}, r"home_radius=4: must be at most a quarter of the side, 3"),
        ({"pucks": 0}, r"pucks=0: must be at least 1"),
        ({"pucks": 10**8}, r"pucks=100000000: must be at most 10000000"),
        ({"robots": 0}, r"robots=0: must be at least 1"),
        ({"robots": 10**8}, r"robots=100000000: must be at most 10000000"),
        ({"reach": 0.0}, r"reach=0.*above 0"),
    ],
)
def test_bad_input_is_named(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PuckCollecting(**{**SMALL, **changed})
    with pytest.raises(TypeError, match="robots='many': must be a whole number"):
        PuckCollecting(robots="many")  # type: ignore[arg-type]


@pytest.mark.parametrize("awareness", ["none", "nearest", "ring", "pairwise"])
@pytest.mark.parametrize("robots", [4, 30])
def test_teams_of_all_sizes_learn_with_all_degrees(awareness: str, robots: int) -> None:
    task = TASKS["collect"]
    parameters = task.parameters("skilled", {"robots": robots}, awareness=awareness, rng=1)
    world = task.world(**parameters, rng=2)
    world.run(50)
    assert len(world.robots) == robots  # type: ignore[attr-defined]
    assert 0.0 < task.measure(world)["rows_correct"] <= 1.0


def test_a_team_that_learns_longer_has_other_tables_and_the_same_seed_the_same() -> None:
    scenario = TASKS["collect"].full_scenario()
    short, again, other = (learned(scenario, None, 1, steps=steps)["policy"] for steps in (500, 500, 1000))
    assert np.array_equal(short.tables, again.tables)
    assert not np.array_equal(short.tables, other.tables)
    assert LEARNING > 1000


def test_the_policy_by_hand_is_right_and_delivers_more_than_exploration() -> None:
    task = TASKS["collect"]
    found = {}
    for name, team in (("by hand", {"policy": BasisBehaviours.correct()}), ("explore", "explore")):
        measured = []
        for seed in range(10):
            world = task.build(team, rng=seed)
            world.run(1200)
            measured.append(task.measure(world))
        found[name] = measured
    assert {one["rows_correct"] for one in found["by hand"]} == {1.0}
    assert {one["rows_correct"] for one in found["explore"]} == {0.0}
    # More in each of ten worlds: by chance once in a thousand times.
    for one, other in zip(found["by hand"], found["explore"], strict=True):
        assert one["delivered"] > other["delivered"]
        assert one["slept_at_home"] > 0.5
    assert share_correct(BasisBehaviours.correct(intruders="count", delta=4).tables[None]) == 1.0  # type: ignore[index]
