"""Groups: several in a world, what they see of each other, and what is counted."""

from __future__ import annotations

from typing import Any, ClassVar

import networkx as nx
import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.analysis.neighbour_graph import to_networkx
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Policy, PolicyState, RandomWalk, Stationary


def test_names_are_given_and_kept_apart() -> None:
    world = World(Disc(5.0), rng=1)
    for _ in range(3):
        world.add(Robot, 1, policy=Stationary())
    world.add(Target, 1, policy=Stationary(), name="prey")
    assert [group.name for group in world.groups] == ["robots", "robots-2", "robots-3", "prey"]
    assert "robots-2" in repr(world.groups[1])


def test_a_world_of_nobody() -> None:
    world = World(Disc(5.0), rng=1)
    world.run(3)
    world.step()
    assert world.tick == len(world.recording.history) == 4
    assert np.isnan(world.observed_fraction)
    assert world.max_neighbours == 0


@pytest.mark.short
def test_counts_are_those_of_the_positions() -> None:
    model = CMOMMT(radius=3.0, rng=fresh_seed())
    model.recording.record_positions()
    model.run(30)
    table = model.recording.trajectory
    for step, row in model.recording.history.iterrows():
        now = table[table.time == step]
        robots, targets = (now[now.group == name][["x", "y"]].to_numpy() for name in ("robots", "targets"))
        near = np.hypot(*(robots[:, None] - robots[None]).transpose(2, 0, 1)) <= 1
        degree = near.sum(axis=1) - 1
        seen = (np.hypot(*(robots[:, None] - targets[None]).transpose(2, 0, 1)) <= 1).any(axis=0)
        assert (row.observed, row.mean_neighbours, row.max_neighbours) == (
            seen.mean(),
            pytest.approx(degree.mean()),
            degree.max(),
        )
    assert model.observed_fraction == pytest.approx(model.recording.history.observed.mean(), rel=1e-12)


def test_two_groups_of_a_team_count_together() -> None:
    world = World(Disc(1.0), rng=1)
    targets = world.add(Target, 5, policy=Stationary())
    for _ in range(2):
        world.senses(world.add(Robot, 2, policy=Stationary(), sensing_range=2.0, awareness_range=2.0), targets)
    world.run(2)
    assert world.recording.history.observed.tolist() == [1.0, 1.0]
    assert world.recording.history.mean_neighbours.tolist() == [3.0, 3.0]


def test_what_two_teams_observe_is_counted_once() -> None:
    class Rival(Robot):
        team: ClassVar[str | None] = "rivals"

    world = World(Disc(1.0), rng=1)
    targets = world.add(Target, 5, policy=Stationary())
    for kind in (Robot, Rival):
        world.senses(world.add(kind, 2, policy=Stationary(), sensing_range=2.0, awareness_range=2.0), targets)
    world.run(1)
    assert world.recording.history.mean_neighbours.tolist() == [1.0]
    assert world.recording.history.observed.tolist() == [1.0]


@pytest.mark.parametrize("equal", [True, False])
def test_the_graph_of_neighbours(equal: bool) -> None:
    world = World(Disc(2.0), rng=3)
    robots = world.add(Robot, 12, policy=RandomWalk(), awareness_range=1.0 if equal else np.linspace(0.3, 1.5, 12))
    world.run(4)
    members = world.teammates
    graph = to_networkx(world.neighbours, members.position, members.identity, directed=not equal)
    assert sorted(graph.nodes) == robots.identity.tolist()
    for robot in robots:
        assert sorted(graph.adj[robot.unique_id]) == [teammate.unique_id for teammate in robot.neighbours]
        assert graph.nodes[robot.unique_id]["position"] == tuple(robot.position)
    for one, other, data in graph.edges(data=True):
        places = [np.array(graph.nodes[node]["position"]) for node in (one, other)]
        assert data["distance"] == pytest.approx(np.hypot(*(places[0] - places[1])))
    assert isinstance(graph, nx.Graph)


def test_positions_set_by_hand_are_seen_at_once() -> None:
    model = CMOMMT(robots=2, targets=1, rng=1)
    model.robots[0].position, model.robots[1].position, model.targets[0].position = (0, 0), (0, 0.5), (0, -0.9)
    assert model.observed == 1.0
    assert model.mean_degree == 1.0
    assert model.neighbours.distance.tolist() == [0.5, 0.5]
    assert model.robots[0].observed_targets == [model.targets[0]]
    model.targets[0].position = (3, 0)
    assert model.observed == 0.0
    assert not model.targets[0].is_observed


@kernel
def _fails_late(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        arrays.state.ints[i, 0, 0] += 1
        action.heading[i, 0] = 1.0
        action.heading[i, 1] = 0.0
        action.distance[i] = np.nan if arrays.state.ints[i, 0, 0] > 20 else 0.01


class FailsLate(CompiledPolicy):
    """Goes east, and at its 21st decision nowhere that has a number."""

    kernel = _fails_late
    parameters = ()

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 0, 0)), np.zeros((size, 1, 1), np.int64))


@pytest.mark.parametrize("path", ["run", "step"])
def test_a_kernel_that_answers_nonsense_is_named_with_its_tick(path: str) -> None:
    model = CMOMMT(policy=FailsLate(), rng=1)
    with pytest.raises(ValueError, match=r"FailsLate: an action of robots at tick 20 is not finite.*check_policy\(\)"):
        for _ in range(30):
            model.run(30) if path == "run" else model.step()
    assert (model.tick, len(model.recording.history)) == (20, 20)


@pytest.mark.parametrize("advance", [lambda model: model.run(30), lambda model: [model.step() for _ in range(30)]])
def test_a_kernel_that_answers_nonsense_is_refused_until_the_policy_is_another(advance: Any) -> None:
    model, other = CMOMMT(policy=FailsLate(), rng=1), CMOMMT(policy=FailsLate(), rng=1)
    other.run(20)
    for _ in range(3):
        with pytest.raises(ValueError, match="FailsLate.*at tick 20"):
            advance(model)
        assert np.array_equal(model.robots.position, other.robots.position)
        assert np.array_equal(model.targets.position, other.targets.position)
    for world in (model, other):
        world.robots.policy = "a-cmommt"
        world.run(20)
    assert np.array_equal(model.robots.position, other.robots.position)
    assert model.recording.history.equals(other.recording.history)
    assert model.observed_fraction == other.observed_fraction


def test_a_subclass_of_a_compiled_policy_may_decide_in_python() -> None:
    class Halved(RandomWalk):
        def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
            action, memory = super().decide(percept, memory, noise)
            return Action(action.heading, action.distance / 2), memory

    model = CMOMMT(policy=Halved(), robot_speed=0.1, radius=50.0, rng=1)
    model.step()
    assert np.hypot(*model.robots.bodies.moved.T) == pytest.approx(np.full(10, 0.05))


class Remembering(Policy):
    """Counts its decisions, robot by robot."""

    draws = 0

    def start(self, size: int) -> Any:
        return np.zeros(size)

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        return Action(percept.heading, np.zeros(len(memory))), memory + 1


@pytest.mark.filterwarnings("ignore:run.. makes")
def test_those_who_stay_remember_when_somebody_leaves() -> None:
    model = CMOMMT(robots=4, policy=Remembering(), rng=1)
    model.run(3)
    model.robots[1].remove()
    assert model.robots.policy_state.tolist() == [3.0] * 3


@pytest.mark.filterwarnings("ignore:run.. makes")
@pytest.mark.parametrize("policy", ["a-cmommt", "centroid", "stationary"])
def test_a_subclass_that_only_repeats_its_policy_changes_nothing(policy: str) -> None:
    class Echo(Robot):
        def decide(self, percept: Any, rng: Any) -> tuple[float, float]:
            return super().decide(percept, rng)

    ends = []
    for kind in (Robot, Echo):
        world = World(Disc(2.0), rng=2)
        robots = world.add(kind, 6, policy=policy, awareness="pairwise")
        world.senses(robots, world.add(Target, 6, policy="random-walk"))
        world.run(10)
        ends.append(robots.position.copy())
    # Its turn is an angle, which costs a few last bits.
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


@pytest.mark.short
def test_abilities_may_change_on_both_paths() -> None:
    ends: list[Any] = []
    for stepping in (False, True):
        model = CMOMMT(radius=2.0, rng=4)
        model.clock.at(5, lambda model=model: model.adjust(model.robots, speed=0.3, sensing_range=np.linspace(0.5, 1.5, 10)))
        model.clock.at(9, lambda model=model: model.adjust(model.robots, policy="centroid", awareness="shared"))
        model.clock.at(12, lambda model=model: model.adjust(model.robots, turn_limit=0.1, awareness_range=0.2))
        for _ in range(20 if stepping else 0):
            model.step()
        model.run(0 if stepping else 20)
        ends.append((model.robots.position.tobytes(), model.recording.history))
        assert model.robots.awareness.name == "shared"
        assert model.robots.speed.tolist() == [0.3] * 10
        before, heading = model.robots.position.copy(), model.robots.heading.copy()
        model.step()
        assert np.all(
            np.sum(heading * model.robots.heading, axis=1)[np.hypot(*model.robots.position.T) < 1.6]
            > np.cos(0.1) - 1e-9
        )
        assert not np.array_equal(before, model.robots.position)
    assert ends[0][0] == ends[1][0]
    assert ends[0][1].equals(ends[1][1])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": -1}, "speed=-1"), ({"policy": "a-cmomt"}, "did you mean 'a-cmommt'"), ({"awareness": 3}, "awareness=3"),
        ({"sensing_range": [1, 2]}, r"sensing_range: has the shape \(2,\)"), ({"turn_limit": np.nan}, "turn_limit=nan"),
    ],
)  # fmt: skip
def test_an_adjustment_that_cannot_be_changes_nothing(change: dict[str, Any], message: str) -> None:
    model, other = CMOMMT(rng=1), CMOMMT(rng=1)
    with pytest.raises((ValueError, TypeError), match=message):
        model.adjust(model.robots, **{"speed": 0.5, "awareness": "none", **change})
    model.run(10)
    other.run(10)
    assert np.array_equal(model.robots.position, other.robots.position)


def test_own_columns_leave_and_are_saved_with_their_agents() -> None:
    model = CMOMMT(robots=4, rng=1)
    charge = model.robots.add_column("charge", [1.0, 2.0, 3.0, 4.0])
    assert model.robots.add_column("where", np.zeros((4, 2))).shape == (4, 2)
    saved = model.state()
    charge[0] = 9.0
    model.restore(saved)
    assert model.robots.columns["charge"].tolist() == [1.0, 2.0, 3.0, 4.0]
    model.robots[1].remove()
    assert model.robots.columns["charge"].tolist() == [1.0, 3.0, 4.0]
    with pytest.raises(ValueError, match="name='charge': the group 'robots' has this column"):
        model.robots.add_column("charge")


def test_a_column_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\(3,\).*10"):
        CMOMMT(rng=1).robots.add_column("charge", [1.0, 2.0, 3.0])


@kernel
def _strides(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.speed.shape[0]):
        action.heading[i, 0] = 1.5
        action.heading[i, 1] = 0.0
        action.distance[i] = percept.speed[i]


class Strides(CompiledPolicy):
    """Breaks the contract: its headings are half as long again as unit vectors."""

    kernel = _strides
    parameters = ()


def test_a_compiled_heading_that_is_no_unit_vector_is_refused() -> None:
    model = CMOMMT(policy=Strides(), radius=50.0, rng=1)
    with pytest.raises(ValueError, match=r"Strides: .*unit vector"):
        model.step()
    assert np.all(np.hypot(*model.robots.bodies.moved.T) <= 0.1 + 1e-12)


@pytest.mark.parametrize(
    "memory",
    [
        lambda size: PolicyState(np.zeros((size, 0, 0), np.float32), np.zeros((size, 1, 1), np.int32)),
        lambda size: PolicyState(np.zeros((size - 1, 0, 0)), np.zeros((size - 1, 1, 1), np.int64)),
    ],
)
def test_a_compiled_memory_of_the_wrong_kind_or_size_is_refused(memory: Any) -> None:
    policy = type("Forgetful", (Strides,), {"start": lambda self, size: memory(size)})()
    with pytest.raises((TypeError, ValueError), match="Forgetful"):
        CMOMMT(policy=policy, rng=1)


@pytest.mark.parametrize(
    "path", ["run", "step"]
)
def test_mesas_counter_keeps_up_when_a_kernel_fails(path: str) -> None:
    model = CMOMMT(policy=FailsLate(), rng=1)
    with pytest.raises(ValueError, match="FailsLate"):
        for _ in range(30):
            model.run(30) if path == "run" else model.step()
    assert (model.tick, model.steps) == (20, 20)
