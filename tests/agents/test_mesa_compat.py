"""mesa: what its users expect of models, agents, collectors and batch runs holds here too."""

from __future__ import annotations

import gc
import inspect
import weakref
from typing import Any

import mesa
import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.policies import RandomWalk

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


@pytest.mark.short
def test_agents_are_found_as_mesa_users_expect() -> None:
    model = CMOMMT(robots=4, targets=6, rng=1)
    assert len(model.agents) == 10
    assert {kind: len(agents) for kind, agents in model.agents_by_type.items()} == {Robot: 4, Target: 6}
    assert [agent.unique_id for agent in model.agents] == [*model.robots.identity, *model.targets.identity]
    assert len({agent.unique_id for agent in model.agents}) == 10
    assert all(agent.model is model and isinstance(agent, mesa.Agent) for agent in model.agents)


def test_agents_are_views_of_their_rows() -> None:
    model = CMOMMT(rng=1)
    model.run(5)
    for group in (model.robots, model.targets):
        assert [agent.position.tolist() for agent in group] == group.position.tolist()
        assert [agent.heading.tolist() for agent in group] == group.heading.tolist()
    with pytest.raises(ValueError, match="read-only"):
        model.robots[0].position[0] = 3.0
    with pytest.raises(ValueError, match="read-only"):
        model.robots.position[:] = 0.0


def test_sets_of_agents_can_be_worked_on() -> None:
    model = CMOMMT(robots=4, targets=6, rng=1)
    robots = model.agents_by_type[Robot]
    assert len(model.agents.select(lambda agent: agent.position[0] > 0)) == sum(model.robots.position[:, 0] > 0) + sum(
        model.targets.position[:, 0] > 0
    )
    robots.do(lambda robot: setattr(robot, "position", (0.1, 0.2)))
    assert model.robots.position.tolist() == [[0.1, 0.2]] * 4
    assert all(len(robot.neighbours) == 3 for robot in robots)
    robots.set("charge", 1.0)
    assert robots.get("charge") == [1.0] * 4
    assert robots.agg("charge", sum) == 4.0
    assert sorted(robots.shuffle().get("unique_id")) == sorted(robots.get("unique_id"))
    robots.shuffle_do("advance")


def test_shuffling_depends_on_the_seed_alone() -> None:
    # Sets hold their agents weakly: a model that nobody keeps takes them along.
    models = [CMOMMT(rng=seed) for seed in (1, 1, 2)]
    orders = [model.agents.shuffle().get("unique_id") for model in models]
    assert orders[0] == orders[1] != orders[2]
    assert CMOMMT(rng=3).random.random() == CMOMMT(rng=3).random.random()


@pytest.mark.short
def test_counters_go_on_as_with_single_steps() -> None:
    run, stepped = CMOMMT(rng=1), CMOMMT(rng=1)
    run.run(17)
    for _ in range(17):
        stepped.step()
    for model in (run, stepped):
        assert (model.tick, model.steps, model.clock.now) == (17, 17, 17.0)
        assert getattr(model, "time", 17.0) == 17.0


def test_a_users_collector() -> None:
    tables = []
    for stepping in (False, True):
        model = CMOMMT(robots=3, targets=4, rng=1)
        model.datacollector = mesa.DataCollector(
            model_reporters={"seen": lambda m: m.observed, "fraction": "observed_fraction", "tick": "tick"},
            agent_reporters={"x": lambda agent: float(agent.position[0]), "kind": lambda agent: type(agent).__name__},
            agenttype_reporters={Robot: {"near": lambda robot: len(robot.neighbours)}},
        )
        for _ in range(6 if stepping else 0):
            model.step()
        model.run(0 if stepping else 6)
        collector = model.datacollector
        tables.append(
            [
                collector.get_model_vars_dataframe(),
                collector.get_agent_vars_dataframe(),
                collector.get_agenttype_vars_dataframe(Robot),
            ]
        )
        assert tables[-1][0].tick.tolist() == list(range(7))
        assert tables[-1][0].seen.tolist()[1:] == model.recording.history.observed.tolist()
        assert len(tables[-1][1]) == 7 * 7
    for one, other in zip(*tables, strict=True):
        pd.testing.assert_frame_equal(one, other)


def test_the_models_own_collector_holds_the_history() -> None:
    model = CMOMMT(rng=1)
    model.run(20)
    table = model.datacollector.get_model_vars_dataframe()
    assert len(table) == 21
    assert table.observed.tolist()[1:] == model.recording.history.observed.tolist()
    assert table.observed_fraction.iloc[-1] == model.observed_fraction == pytest.approx(model.recording.history.observed.mean())
    assert table.max_neighbours.iloc[-1] == model.max_neighbours == model.recording.history.max_neighbours.max()
    assert table.mean_degree.tolist()[1:] == model.recording.history.mean_neighbours.tolist()
    assert table.mean_neighbours.iloc[-1] == model.mean_neighbours == model.recording.mean_neighbours
    assert table.mean_neighbours.iloc[7] == pytest.approx(model.recording.history.mean_neighbours[:7].mean())


@pytest.mark.parametrize("processes", [1, 2])
def test_a_batch_run_gives_the_numbers_of_a_run_by_hand(processes: int) -> None:
    swept: dict[str, Any] = {"robots": [3, 6], "awareness": ["none", "ring"], "radius": 2.0}
    # Newer versions of mesa hand out seeds themselves; to older ones a seed is a parameter like any other.
    named = {"rng": [7, 8]} if "rng" in inspect.signature(mesa.batch_run).parameters else {}
    rows = mesa.batch_run(
        CMOMMT, swept if named else {**swept, "seed": [7, 8]}, max_steps=20, number_processes=processes,
        display_progress=False, **named,
    )  # fmt: skip
    table = pd.DataFrame(rows)
    assert sorted(table.seed.tolist()) == [7] * 4 + [8] * 4
    for row in table.itertuples():
        model = CMOMMT(robots=row.robots, awareness=row.awareness, radius=2.0, rng=row.seed)
        model.run(20)
        assert row.Step == 20
        assert row.observed_fraction == model.observed_fraction
        assert row.max_neighbours == model.max_neighbours


def test_removing_an_agent() -> None:
    model = CMOMMT(robots=5, targets=4, radius=1.0, rng=1)
    model.run(3)
    gone, others = model.robots[2], [model.robots[k] for k in (0, 1, 3, 4)]
    before = {robot.unique_id: robot.position.tolist() for robot in others}
    identities = model.robots.identity.tolist()
    gone.remove()
    assert len(model.robots) == 4
    assert gone not in model.agents
    assert {robot.unique_id: robot.position.tolist() for robot in model.robots} == before
    assert gone not in [teammate for robot in model.robots for teammate in robot.neighbours]
    assert gone not in [robot for target in model.targets for robot in target.observers]
    model.run(3)
    late = model.add(Robot, 2, policy=RandomWalk(), name="late")
    assert not set(late.identity.tolist()) & {*identities, *model.targets.identity.tolist()}
    assert len(model.recording.history) == 6


def test_removing_everybody() -> None:
    model = CMOMMT(rng=1)
    model.run(2)
    model.remove_all_agents()
    model.run(2)
    model.step()
    assert len(model.agents) == len(model.robots) == len(model.targets) == 0
    assert model.recording.history.observed.isna().tolist() == [False, False, True, True, True]
    assert len(model.neighbours.start) == 1


def test_removing_twice_is_refused_and_takes_nobody_else() -> None:
    model = CMOMMT(robots=5, rng=1)
    gone = model.robots[2]
    gone.remove()
    with pytest.raises(ValueError, match="was removed already; test whether agent.pos is None"):
        gone.remove()
    assert len(model.robots) == len(model.agents_by_type[Robot]) == 4


def test_who_has_left_is_nowhere() -> None:
    model = CMOMMT(robots=5, rng=1)
    gone = model.robots[2]
    gone.remove()
    after = model.robots.position.copy()
    with pytest.raises((ValueError, RuntimeError, AttributeError), match="left|removed|no longer"):
        gone.position = (0.0, 0.0)
    assert np.array_equal(model.robots.position, after)


@pytest.mark.short
def test_models_that_nobody_refers_to_are_let_go() -> None:
    models = []
    for seed in range(300):
        model = CMOMMT(robots=2, targets=2, rng=seed)
        models.append(weakref.ref(model))
        mesa.Agent(model)
        if seed % 60:
            continue
        # What keeps references to a world, or to its methods.
        model.add(Robot, 1, policy="random-walk", name="others")
        model.robots.add(1)
        model.schedule_recurring(model.robots[0].break_sensor, 50)
        model.clock.at(2, lambda world=model: world.log("fog", world.robots[0]))
        model.clock.process(_patrol(model))
        model.clock.at(90, model.reset)
        model.recording.record_positions()
        replay = model.record()
        model.run(5)
        model.step()
        model.restore(model.state(pending="drop"))
        replay.stop()
        assert (len(model.space.agents), len(model.events)) == (len(model.agents) - 1, 1)
    del model, replay
    gc.collect()
    assert sum(reference() is not None for reference in models) == 0


def _patrol(model: CMOMMT) -> Any:
    while True:
        yield model.until.lost(model.targets[0])
        yield model.clock.timeout(1)


def test_identities_count_from_1_in_each_model_whoever_makes_the_agents() -> None:
    for _ in range(2):
        model = CMOMMT(robots=2, targets=1, rng=1)
        plain = mesa.Agent(model)
        late = model.robots.add(1)[0]
        assert [agent.unique_id for agent in model.agents] == [1, 2, 3, 4, 5]
        assert (plain.unique_id, late.unique_id, late.identity) == (4, 5, 5)


def test_a_model_is_a_mesa_model_of_ones_own() -> None:
    class Fenced(World):
        def __init__(self, rng: int) -> None:
            super().__init__(Disc(2.0), rng=rng)
            self.walkers = self.add(Target, 5, policy=RandomWalk())
            self.beats = 0

        def step(self) -> None:
            self.beats += 1
            super().step()

    model, plain = Fenced(1), World(Disc(2.0), rng=1)
    walkers = plain.add(Target, 5, policy=RandomWalk())
    model.run(10)
    model.step()
    plain.run(11)
    assert (model.beats, model.steps, model.tick) == (11, 11, 11)
    assert np.array_equal(model.walkers.position, walkers.position)


@pytest.mark.skipif(not hasattr(mesa.Model, "run_for"), reason="this mesa has no run_for")
def test_mesas_run_for_makes_steps() -> None:
    model = CMOMMT(rng=1)
    model.run_for(5)
    assert (model.tick, len(model.recording.history)) == (5, 5)


def test_both_names_of_the_seed() -> None:
    assert np.array_equal(CMOMMT(rng=5).robots.position, CMOMMT(seed=5).robots.position)
    assert CMOMMT(rng=5, seed=5).seed_used == 5
    first, second = CMOMMT(), CMOMMT()
    assert first.seed_used != second.seed_used
    again = CMOMMT(rng=first.seed_used)
    assert np.array_equal(first.robots.position, again.robots.position)
