"""Interactions through all that happens to worlds: resets, states, agents that come and go, cycles, inactive bodies."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from interactions import Capture, CaptureInTurn, fingerprint, hunt

from teamsight import Cycle, Robot, Sensor, Target, Torus, World
from teamsight.core.kernel import kernel
from teamsight.world import Interaction


def test_a_reset_begins_anew() -> None:
    world, other = hunt(seed=1), hunt(seed=2)
    world.run(80)
    world.reset(2)
    assert not world.groups[0].bodies.reward.any()
    assert not world.groups[1].caught.values.any()
    for one in (world, other):
        one.run(80)
    assert fingerprint(world) == fingerprint(other)


@pytest.mark.parametrize("interaction", [Capture(), CaptureInTurn()], ids=repr)
def test_a_state_is_restored_in_another_world(interaction: Capture) -> None:
    world = hunt(interaction)
    world.run(70)
    saved = pickle.loads(pickle.dumps(world.state()))
    world.run(50)
    after = fingerprint(world)
    other = hunt(interaction, seed=5)
    other.run(3)
    for one in (world, other):
        one.restore(saved)
        one.run(50)
        assert fingerprint(one) == after


def test_a_state_with_other_interactions_is_refused() -> None:
    saved = hunt(Capture(reach=0.3)).state()
    for world in (hunt(Capture(reach=0.4)), hunt(CaptureInTurn(reach=0.3))):
        with pytest.raises(ValueError, match=r"interactions Capture of hunters and prey \(0\.3, 6\.0\).*built in the"):
            world.restore(saved)


def test_columns_begin_with_what_they_had_when_the_interaction_came() -> None:
    world = World(Torus(6.0, 6.0), rng=1)
    hunters = world.add(Robot, 3, policy="random-walk")
    prey = world.add(Target, 3, policy="random-walk")
    world.senses(hunters, prey)
    prey.add_column("caught", [5, 6, 7])
    world.interact(Capture(reach=2.0), hunters=hunters, prey=prey)
    world.run(20)
    assert (prey.caught > [5, 6, 7]).all()
    prey.add(2, caught=[9, 3])
    world.run(20)
    assert (prey.caught[3:] > [9, 3]).all()
    world.reset()
    assert prey.caught.tolist() == [5, 6, 7, 9, 3]


@pytest.mark.parametrize("interaction", [Capture(), CaptureInTurn()], ids=repr)
def test_agents_come_and_go(interaction: Capture) -> None:
    worlds = [hunt(interaction), hunt(interaction)]
    for world, steps in zip(worlds, ([40, 40, 40], [1] * 120), strict=True):
        for _ in range(len(steps) // 3):
            world.run(steps[0])
        world.groups[0][1].remove()
        world.groups[1].add(4)
        for _ in range(len(steps) // 3):
            world.run(steps[0])
        world.groups[1][0].remove()
        world.groups[0].add(1)
        for _ in range(len(steps) // 3):
            world.run(steps[0])
    assert fingerprint(worlds[0]) == fingerprint(worlds[1])
    assert worlds[0].recording.history["captures"].sum() > 0


def test_an_agent_that_leaves_changes_no_other_noise() -> None:
    found = []
    for is_there in (True, False):
        world = hunt(Capture(reach=10.0), prey=4)
        if not is_there:
            world.groups[1][1].remove()
        world.step()
        bodies = world.groups[1].bodies
        found.append(dict(zip(bodies.member.tolist(), map(tuple, bodies.position.tolist()), strict=True)))
    assert all(found[0][member] == place for member, place in found[1].items())
    assert len(found[1]) == 3


def test_inactive_bodies_do_not_move_and_decide_nothing() -> None:
    world = hunt(Capture(reach=3.0))
    hunters, prey = world.groups
    world.run(2)
    hunters[0].active = prey[1].active = False
    place, reward = prey[1].position.copy(), hunters.bodies.reward[0]
    world.run(5)
    assert (prey[1].position == place).all()
    assert not prey.bodies.moved[1].any()
    # It decides no more, so the cost of all five moves adds up.
    assert hunters.bodies.reward[0] == pytest.approx(reward - 0.5)


def test_rewards_add_up_until_a_robot_decides() -> None:
    seen: list[tuple[int, float]] = []

    def rule(percept: Any, rng: Any) -> tuple[float, float]:
        seen.append((int(percept.time), percept.reward))
        return 0.0, 0.0

    world = hunt(Capture(reach=1e-9), policy=rule, hunters=1, cycle=Cycle(5))
    for _ in range(16):
        world.step()
    assert [tick for tick, _ in seen] == [0, 5, 10, 15]
    assert [reward for _, reward in seen] == pytest.approx([0.0, -0.5, -0.5, -0.5])


@kernel
def _mark(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots = bodies.robots
    for i in range(robots.position.shape[0]):
        robots.reward[i] = 1.0
        robots.ended[i] = i == 0
    scores[0] = noise.robots[0, 0]


class Mark(Interaction):
    roles = ("robots",)
    scores = ("first",)
    draws = 1
    kernel = _mark


class MarkOthers(Mark):
    scores = ("second",)


def test_two_interactions_add_their_rewards_and_draw_their_own_numbers() -> None:
    world = hunt(Capture(reach=1e-9))
    world.interact(Mark(), robots=world.groups[0])
    world.interact(MarkOthers(), robots=world.groups[0])
    world.run(20)
    assert world.groups[0].bodies.reward == pytest.approx(np.full(6, 1.9))
    assert world.groups[0].bodies.ended.tolist() == [True] + 5 * [False]
    history = world.recording.history
    assert history["first"].nunique() == history["second"].nunique() == 20
    assert not (history["first"] == history["second"]).any()
    assert list(history)[3:] == ["captures", "first", "second"]


def test_an_interaction_can_come_in_the_middle_of_a_run() -> None:
    world = hunt(Capture(reach=1e-9))
    world.run(4)
    world.interact(Mark(), robots=world.groups[0])
    world.run(2)
    assert world.recording.history["first"].isna().tolist() == 4 * [True] + 2 * [False]


def test_another_world_without_the_interaction_moves_alike() -> None:
    world = hunt(Capture(reach=1e-9))
    plain = World(world.arena, rng=1)
    hunters = plain.add(Robot, 6, policy="centroid", sensing_range=2.0, speed=0.2, name="hunters")
    plain.senses(hunters, plain.add(Target, 5, policy="random-walk", speed=0.1, name="prey"))
    world.run(100)
    plain.run(100)
    for one, other in zip(world.groups, plain.groups, strict=True):
        for name in ("position", "heading", "moved"):
            assert getattr(one.bodies, name).tobytes() == getattr(other.bodies, name).tobytes()


@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(
    st.integers(0, 2**32), st.lists(st.sampled_from(["run", "step", "remove", "add", "off", "on", "widen", "narrow", "back", "reset"]), max_size=12),
    st.booleans(), st.booleans(),
)  # fmt: skip
def test_any_order_of_calls_gives_one_result(seed: int, calls: list[str], in_turn: bool, has_cycle: bool) -> None:
    kind = CaptureInTurn if in_turn else Capture
    cycle = {"cycle": Cycle(3, phase=[0, 1, 2, 0, 1, 2], jitter=0.5)} if has_cycle else {}
    worlds = [hunt(kind(reach=0.8), seed=seed, **cycle) for _ in range(2)]
    for call in calls:
        for world, is_one_by_one in zip(worlds, (False, True), strict=True):
            hunters, prey = world.groups
            if call == "run":
                for _ in range(7 if is_one_by_one else 1):
                    world.run(1 if is_one_by_one else 7)
            elif call == "step":
                world.step()
            elif call == "remove" and len(prey) > 1:
                prey[-1].remove()
            elif call == "add":
                prey.add(1)
            elif call in ("off", "on"):
                hunters[2].active = prey[0].active = call == "on"
            elif call in ("widen", "narrow"):
                world.adjust(world.interactions[0], reach=1.2 if call == "widen" else 0.3)
            elif call == "back":
                world.restore(world.state())
            elif call == "reset":
                world.reset()
        assert fingerprint(worlds[0]) == fingerprint(worlds[1])


@kernel
def _break(view: Any, parameters: Any, sensed: Any) -> int:
    entries = view.in_range.start[view.member.shape[0]]
    for i in range(view.in_range.start.shape[0]):
        sensed.start[i] = view.in_range.start[i] if view.tick[0] < parameters[0] else -i
    for k in range(min(entries, sensed.identity.shape[0])):
        sensed.identity[k] = view.in_range.identity[k]
        sensed.distance[k] = view.in_range.distance[k]
        for axis in range(2):
            sensed.offset[k, axis] = view.in_range.offset[k, axis]
    return int(entries)


class Broken(Sensor):
    """Writes a wrong list from tick 30 on."""

    sense = _break
    parameters = np.array([30.0])


@pytest.mark.parametrize("policy", ["centroid", lambda percept, rng: (0.1, 0.05)], ids=["compiled", "in Python"])
@pytest.mark.parametrize("cycle", [1, Cycle(3, phase=[0, 1, 2, 0, 1, 2])], ids=["every step", "a cycle"])
@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_a_step_that_fails_after_the_interaction_is_undone(policy: Any, cycle: Any) -> None:
    fine, world = (hunt(Capture(reach=1.0), policy=policy, cycle=cycle) for _ in range(2))
    world.groups[0].sensors["targets"] = Broken()
    fine.run(29)
    with pytest.raises(ValueError, match="wrong list for tick 30"):
        world.run(50)
    assert fingerprint(world) == fingerprint(fine)
    del world.groups[0].sensors["targets"]
    for one in (world, fine):
        one.run(30)
    assert fingerprint(world) == fingerprint(fine)
