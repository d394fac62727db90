"""Arrivals: agents that join a group in mid-run go on as if they had always been in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.policies import Action, Policy, Stationary

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


def bits(world: World) -> tuple[Any, ...]:
    """Return all that must be equal to the last bit."""
    places = [(g.name, g.position.tobytes(), g.heading.tobytes(), g.speed.tolist(), g.turn_limit.tolist()) for g in world.groups]
    history = world.recording.history
    return places, history.to_numpy().tobytes(), repr(world.observed_fraction), world.max_neighbours, world.tick


class Counting(Policy):
    """Counts its decisions, robot by robot, and turns with them."""

    draws = 1

    def start(self, size: int) -> Any:
        return {"count": np.zeros(size), "limit": 9}

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        aim = np.stack([np.cos(memory["count"]), np.sin(memory["count"])], axis=-1)
        return Action(aim, percept.speed * noise[0]), {**memory, "count": memory["count"] + 1}


def with_arrivals(policy: Any, seed: int) -> CMOMMT:
    """Return a model whose robots arrive at an event and by a process, one of which leaves; some targets come too."""
    model = CMOMMT(robots=6, targets=5, radius=2.0, policy=policy, awareness="pairwise", rng=seed)
    model.recording.record_positions(every=3)
    model.robots.add_column("battery", 1.0)

    def comings() -> Iterator[Any]:
        yield model.clock.timeout(4.5)
        for number in range(3):
            model.robots.add(2, battery=[0.5, number], speed=0.1 + 0.05 * number)
            yield model.clock.timeout(5)
            model.robots[number + 1].remove()

    model.clock.process(comings())
    model.clock.at(7, lambda: model.targets.add(3, heading=(1, 2)))
    return model


ADVANCES: list[Callable[[World], Any]] = [
    lambda world: world.run(30),
    lambda world: [world.step() for _ in range(30)],
    lambda world: (world.run(5), world.step(), world.run(14), [world.step() for _ in range(3)], world.run(7)),
]


@pytest.mark.short
@pytest.mark.parametrize("policy", ["a-cmommt", "centroid", Counting()], ids=["a-cmommt", "centroid", "in Python"])
def test_both_paths_give_the_same_bits(policy: Any) -> None:
    seed = fresh_seed()
    ends = []
    for advance in ADVANCES:
        model = with_arrivals(policy, seed)
        advance(model)
        assert (len(model.robots), len(model.targets)) == (9, 8)
        ends.append((bits(model), model.recording.trajectory.to_numpy().tolist(), model.robots.columns["battery"].tolist()))
    assert ends[0] == ends[1] == ends[2]


@pytest.mark.parametrize("placement", ["uniform", "spread"])
def test_a_group_that_has_grown_is_one_that_was_larger(placement: Any) -> None:
    seed = fresh_seed()
    grown, whole = (World(Disc(6.0), rng=seed) for _ in range(2))
    for world, sizes in ((grown, [3, 1, 4]), (whole, [8])):
        prey = world.add(Target, 4, policy="random-walk")
        robots = world.add(Robot, sizes[0], policy="a-cmommt", awareness="pairwise", turn_limit=0.3, placement=placement)
        world.senses(robots, prey)
        for size in sizes[1:]:
            robots.add(size, placement=placement)
        if placement == "spread":
            # Robots that come later are spread among themselves; a reset spreads all.
            world.reset()
        world.run(25)
        world.step()
    assert grown.groups[1].bodies.turn_sine.tobytes() == whole.groups[1].bodies.turn_sine.tobytes()
    assert bits(grown) == bits(whole)
    grown.reset(5)
    whole.reset(5)
    grown.run(9)
    whole.run(9)
    assert bits(grown) == bits(whole)


def test_a_place_does_not_depend_on_when_one_comes() -> None:
    seed, places = fresh_seed(), []
    for ticks in (0, 13):
        world = World(Disc(3.0), rng=seed)
        robots = world.add(Robot, 4, policy="random-walk")
        world.run(ticks)
        (late,) = robots.add()
        places.append((late.position.tolist(), late.heading.tolist()))
    assert places[0] == places[1]


def test_a_reset_places_all_again_where_their_rules_say() -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 2, policy="random-walk", position=[(0, 0), (1, 0)])
    robots.add(1, position=(0, 1), heading=(0, -2))
    robots.add(1)
    drawn = robots[3].position.copy()
    robots.add(2, position=[(0, 2), (0, -2)], heading=[(1, 0), (0, 1)], speed=[0.2, 0.3])
    robots[4].remove()
    world.run(10)
    robots.speed = 0.7
    world.reset()
    assert robots.position.tolist() == [[0, 0], [1, 0], [0, 1], drawn.tolist(), [0, -2]]
    assert robots.heading[[2, 4]].tolist() == [[0, -1], [0, 1]]
    assert robots.speed.tolist() == [0.1, 0.1, 0.1, 0.1, 0.3]


def test_numbers_are_not_used_again() -> None:
    robots = World(Disc(3.0), rng=1).add(Robot, 2, policy="random-walk")
    for _ in range(3):
        robots[1].remove()
        robots.add()
    assert robots.bodies.member.tolist() == [0, 4]
    assert robots.identity.tolist() == [1, 5]
    assert robots.members_so_far == 5


def test_those_who_come_get_first_states_and_the_others_keep_theirs() -> None:
    model = CMOMMT(robots=2, policy=Counting(), rng=1)
    model.run(3)
    model.robots.add(2)
    model.run(1)
    assert model.robots.policy_state["count"].tolist() == [4, 4, 1, 1]


class Lazy(Counting):
    """Makes its memory when it first decides, which leaves no room for robots that come later."""

    def start(self, size: int) -> Any:
        return None

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        return super().decide(percept, memory or {"count": np.zeros(len(noise[0]))}, noise)


def test_a_memory_that_cannot_grow_is_refused() -> None:
    model = CMOMMT(robots=2, policy=Lazy(), rng=1)
    model.run(3)
    with pytest.raises(TypeError, match=r"policy=Lazy: start\(3\) returns NoneType.*return arrays with a row for each"):
        model.robots.add()
    model.run(3)
    assert model.robots.policy_state["count"].tolist() == [6, 6]


def test_abilities_are_those_of_the_group_unless_given() -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 2, policy="random-walk", speed=0.2, turn_limit=0.1, sensing_range=[0.5, 0.6])
    with pytest.raises(ValueError, match=r"sensing_range: the agents of 'robots' have different ones, from 0.5 to 0.6"):
        robots.add()
    robots.speed = 0.3
    robots.add(2, sensing_range=[0.7, 0.8], awareness_range=0.4)
    assert robots.speed.tolist() == [0.3] * 4
    assert robots.sensing_range.tolist() == [0.5, 0.6, 0.7, 0.8]
    assert robots.awareness_range.tolist() == [1.0, 1.0, 0.4, 0.4]
    assert robots.turn_limit.tolist() == [robots.turn_limit[0]] * 4


def test_an_empty_group_can_grow() -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 1, policy="a-cmommt", speed=0.2)
    robots.add_column("battery", 2)
    robots[0].remove()
    robots.add_column("load", 0.5)
    world.run(2)
    (robot,) = robots.add(battery=3)
    assert (robot.battery, robot.load, robot.speed) == (3, 0.5, 0.2)
    world.run(2)


def test_columns_have_values_for_those_who_come() -> None:
    robots = World(Disc(3.0), rng=1).add(Robot, 2, policy="random-walk")
    battery = robots.add_column("battery", 1.0)
    robots.add_column("tag", "none")
    robots.add_column("place", np.zeros((2, 2)))
    with pytest.raises(ValueError, match="place: was added with one value for each agent.*give it"):
        robots.add()
    with pytest.raises(ValueError, match=r"battery=\[1, 2, 3\]: must be one value, or 2"):
        robots.add(2, place=(1, 2), battery=[1, 2, 3])
    with pytest.raises(TypeError, match="battery='full': the column has the type float64"):
        robots.add(2, place=(1, 2), battery="full")
    robots.add(2, place=(1, 2), battery=[3, 4], tag="new")
    assert battery.tolist() == [1, 1, 3, 4]
    assert robots.columns["tag"].tolist() == ["none", "none", "new", "new"]
    assert robots.columns["place"].tolist() == [[0, 0], [0, 0], [1, 2], [1, 2]]
    robots[3].battery -= 1
    assert battery[3] == 3


def test_what_was_recorded_stays_and_goes_on() -> None:
    world = World(Disc(2.0), rng=1)
    robots = world.add(Robot, 3, policy="random-walk", awareness="ring", awareness_range=4.0)
    world.senses(robots, prey := world.add(Target, 2, policy=Stationary(), position=(0, 0)))
    world.recording.record_transitions(robots)
    world.recording.record_positions()
    world.run(4)
    robots.add(2)
    prey.add(1)
    world.run(4)
    assert len(world.recording.transitions(robots).action) == 3 * 4 + 5 * 4
    assert world.recording.trajectory.groupby("time").size().tolist() == [5] * 4 + [8] * 4
    assert world.recording.history.mean_neighbours.tolist() == [2.0] * 4 + [4.0] * 4
    assert len(world.datacollector.get_model_vars_dataframe()) == 9
    assert world.mean_degree == 4.0


def test_a_state_from_before_lets_those_go_who_came_since() -> None:
    ends = []
    model = with_arrivals("a-cmommt", 3)
    model.run(21)
    saved, robots = model.state(), len(model.robots)
    for _ in range(2):
        late = model.robots.add(2, battery=0.1, speed=0.3)
        model.robots.add_column(f"c{len(ends)}", 1)
        model.run(9)
        ends.append(bits(model))
        model.restore(saved)
        assert (len(model.robots), len(model.agents)) == (robots, sum(map(len, model.groups)))
        with pytest.raises(ValueError, match="was removed from the world"):
            late[0].row  # noqa: B018
        assert len(model.robots.columns[f"c{len(ends) - 1}"]) == robots
    assert ends[0] == ends[1]
    model.robots.add(speed=0.7)
    first = model.robots[0]
    first.remove()
    later = model.state()
    model.restore(saved)
    model.robots.add(2, battery=0.1, speed=0.3)
    model.run(9)
    assert (model.robots[0], bits(model)) == (first, ends[0])
    model.restore(later)
    assert first not in model.robots.agents
    model.run(2)
    model.reset()
    assert model.robots[-1].speed == 0.7


def test_uniform_speeds_are_drawn_again_for_the_first_targets_only() -> None:
    model, other = (CMOMMT(uniform_target_speed=True, rng=2) for _ in range(2))
    with pytest.raises(ValueError, match="speed: the agents of 'targets' have different ones"):
        model.targets.add()
    model.targets.add(2, speed=0.5)
    model.reset(3)
    other.reset(3)
    assert model.targets.speed.tolist() == [*other.targets.speed.tolist(), 0.5, 0.5]


def test_percepts_and_neighbours_of_a_group_are_those_of_the_agents_that_are_there() -> None:
    model = CMOMMT(robots=3, targets=5, radius=1.5, awareness="pairwise", rng=fresh_seed())
    model.run(2)
    for change in (model.robots.add, model.robots.add, model.robots[1].remove):
        change()
        near, percept = model.robots.neighbours("teammates"), model.robots.percept
        assert len(near.start) == len(percept.targets.start) == len(model.robots) + 1
        expected = [robot.unique_id for one in model.robots for robot in one.neighbours]
        assert near.identity.tolist() == expected
