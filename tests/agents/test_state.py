"""State: saved, restored and reset, a world goes on as if nothing had happened."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Robot, World
from teamsight.agents.resolve import columns_of_state
from teamsight.policies import ACmommt
from teamsight.policies.handmade.target_tracks import USED

PARTS: list[dict[str, Any]] = [
    {}, {"awareness": "shared", "target_policy": "evasive"}, {"policy": "centroid", "policy_options": {"idle": "wander"}},
    {"policy": "stationary", "uniform_target_speed": True},
]  # fmt: skip


def same(one: CMOMMT, other: CMOMMT) -> bool:
    return bool(
        np.array_equal(one.robots.position, other.robots.position)
        and np.array_equal(one.targets.position, other.targets.position)
        and one.recording.history.equals(other.recording.history)
        and (one.tick, one.steps, one.observed_fraction) == (other.tick, other.steps, other.observed_fraction)
    )


@pytest.mark.short
@pytest.mark.parametrize("settings", PARTS, ids=str)
def test_a_saved_state_goes_on_in_the_same_world_and_in_an_equal_one(settings: dict[str, Any]) -> None:
    model, reference = (CMOMMT(rng=6, radius=2.0, **settings) for _ in range(2))
    reference.run(50)
    model.run(20)
    saved = pickle.loads(pickle.dumps(model.state()))
    model.run(7)
    model.restore(saved)
    other = CMOMMT(rng=99, radius=2.0, **settings)
    other.run(3)
    other.restore(saved)
    for world in (model, other):
        assert world.tick == 20
        world.run(29)
        world.step()
        assert same(world, reference)


def test_a_state_is_a_copy() -> None:
    model = CMOMMT(rng=1)
    model.run(5)
    saved = model.state()
    before = pickle.dumps(saved)
    model.run(5)
    model.restore(saved)
    model.run(5)
    assert pickle.dumps(saved) == before


@pytest.mark.parametrize("settings", PARTS, ids=str)
def test_a_reset_world_is_a_new_one(settings: dict[str, Any]) -> None:
    model = CMOMMT(rng=6, **settings)
    model.clock.at(30, lambda: pytest.fail("events do not outlive a reset"))
    model.run(20)
    for seed in (7, None):
        model.reset(seed)
        model.run(20)
        new = CMOMMT(rng=7, **settings)
        new.run(20)
        assert same(model, new)
        assert model.datacollector.get_model_vars_dataframe().equals(new.datacollector.get_model_vars_dataframe())


def test_a_copy_either_lives_by_itself_or_is_refused() -> None:
    model, reference = CMOMMT(rng=1), CMOMMT(rng=1)
    for world in (model, reference):
        world.run(5)
    try:
        other = copy.deepcopy(model)
    except TypeError as error:
        assert "state()" in str(error)
        return
    other.step()
    assert (other.tick, model.tick) == (6, 5)
    model.run(5)
    reference.run(5)
    assert same(model, reference)


def test_a_restored_world_forgets_what_it_collected_since() -> None:
    model = CMOMMT(rng=1)
    model.run(3)
    saved = model.state()
    model.run(5)
    model.restore(saved)
    model.run(5)
    assert len(model.datacollector.get_model_vars_dataframe()) == 9


def test_a_reset_world_keeps_its_users_collector() -> None:
    import mesa

    model = CMOMMT(rng=1)
    model.datacollector = mesa.DataCollector({"tick": "tick"})
    model.reset()
    model.step()
    assert model.datacollector.get_model_vars_dataframe().tick.tolist() == [0, 1]


def test_a_state_is_refused_by_a_world_with_another_policy() -> None:
    saved = CMOMMT(policy="centroid", rng=1).state()
    with pytest.raises(ValueError, match=r"restore\(…\)"):
        CMOMMT(policy="a-cmommt", rng=1).restore(saved)


def test_a_world_that_somebody_left_can_be_reset() -> None:
    world = World(Disc(5.0), rng=1)
    robots = world.add(Robot, 3, policy="stationary", placement=[(0, 0), (1, 1), (2, 2)], speed=[0.1, 0.2, 0.3])
    robots[0].remove()
    world.reset()
    assert robots.position.tolist() == [[1, 1], [2, 2]]
    assert robots.speed.tolist() == [0.2, 0.3]


def test_the_generator_of_a_reset_world_is_that_of_a_new_one() -> None:
    world = CMOMMT(rng=1)
    world.rng.random()
    world.reset(2)
    assert world.rng.random() == CMOMMT(rng=2).rng.random()


def test_a_reset_world_shuffles_like_a_new_one() -> None:
    model = CMOMMT(rng=1)
    first = model.agents.shuffle().get("unique_id")
    model.reset()
    assert model.agents.shuffle().get("unique_id") == first


def test_a_state_of_a_policy_with_other_constants_is_refused() -> None:

    few, many = (CMOMMT(policy=ACmommt(target_tracks=size), rng=1) for size in (4, 64))
    few.run(5)
    many.run(5)
    before = many.robots.position.copy()
    with pytest.raises(ValueError, match=r"restore\(…\): the state is of a world with robots that have target_tracks=4, and robots have target_tracks=64 here"):
        many.restore(few.state())
    with pytest.raises(ValueError, match=r"robots that have RingAwareness, delta=16, and robots have PairwiseAwareness here"):
        CMOMMT(rng=1).restore(CMOMMT(awareness="ring", rng=1).state())
    assert np.array_equal(many.robots.position, before)
    many.run(5)


def test_a_memory_that_a_kernel_would_read_beyond_its_end_is_refused() -> None:
    saved = CMOMMT(rng=1).state()
    bodies = saved.groups[0].bodies
    for name in columns_of_state(0):
        field, values = bodies.fields[name], bodies[name][:, :2].copy()
        bodies.declare(field._replace(shape=values.shape[1:]), values)
    forged = pickle.loads(pickle.dumps(saved))
    with pytest.raises(ValueError, match=r"restore\(…\): the policy of robots has the state .*\[10, 2, 4\].*\[10, 16, 4\]"):
        CMOMMT(rng=1).restore(forged)


def test_a_forged_word_of_slots_is_read_as_far_as_there_are_slots() -> None:
    world = CMOMMT(rng=1, policy=ACmommt(target_tracks=4), awareness="shared")
    world.run(30)
    saved = world.state()
    name = columns_of_state(0)[1]
    saved.groups[0].bodies[name][:, 0, USED] = -1
    world.restore(saved)
    world.run(30)
    assert (world.robots.policy_state.ints[:, 0, USED] < 16).all()


class Drawing(CMOMMT):
    """A model whose planned method draws from both generators of the model."""

    def draw(self) -> None:
        self.log("drawn", rng=float(self.rng.random()), random=self.random.random(), row=self.random.choice(range(9)))
        self.clock.at(self.clock.now + 3.5, self.draw)


@pytest.mark.short
@pytest.mark.parametrize("tick", [1, 6])
def test_a_state_holds_where_the_random_numbers_of_the_model_are(tick: int) -> None:
    worlds = [Drawing(rng=seed) for seed in (5, 5, 8)]
    for world in worlds:
        world.clock.at(2, world.draw)
        world.run(tick)
    first = worlds[0]
    saved = pickle.loads(pickle.dumps(first.state()))
    kept = first.rng
    first.run(20)
    expected = first.events.to_json()
    for world in worlds:
        world.restore(saved)
        world.run(20)
        assert world.events.to_json() == expected
    if tick > 2:
        # Whoever keeps the generator goes on with it.
        assert first.rng is kept


def test_a_state_of_another_form_is_refused_with_the_version_that_saved_it() -> None:
    model = CMOMMT(3, seed=1)
    saved = model.state()
    with pytest.raises(ValueError, match=r"was written by teamsight 0\.0\.7 in format 0, and this one reads format 1 only"):
        model.restore(saved._replace(format=0, version="0.0.7"))
    assert model.tick == 0
