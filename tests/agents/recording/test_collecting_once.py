"""A collector has one row a tick, whoever collects: the world, or a model's own step as usual in mesa."""

from __future__ import annotations

from typing import Any

import mesa
import pandas as pd
import pytest

from teamsight import CMOMMT, Box, Robot, World

pytestmark = [pytest.mark.short, pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")]


class Walkers(World):
    """Walkers with a counter, and a collector of their own if asked for; collects as mesa's tutorials do."""

    def __init__(self, when: str = "never", own: bool = True, rng: int | None = None) -> None:
        super().__init__(Box(4, 4), rng=rng)
        self.steps_made, self.when = 0, when
        if own:
            self.datacollector = mesa.DataCollector(
                model_reporters={"made": "steps_made", "agents": lambda world: len(world.agents)},
                agent_reporters={"x": lambda agent: float(agent.position[0])},
            )
        self.add(Robot, 3, policy="random-walk")
        if when != "never":
            self.datacollector.collect(self)

    def step(self) -> None:
        if self.when == "before":
            self.datacollector.collect(self)
        super().step()
        self.steps_made += 1
        if self.when == "after":
            self.datacollector.collect(self)


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("when", ["before", "after"])
def test_collecting_in_step_adds_no_second_row(when: str, own: bool) -> None:
    worlds = Walkers(when, own, rng=1), Walkers("never", own, rng=1)
    for world in worlds:
        world.run(2)
        world.step()
        world.run(2)
        world.datacollector.collect(world)
        world.datacollector.collect(world)
    model, plain = (world.datacollector.get_model_vars_dataframe() for world in worlds)
    assert len(model) == len(plain) == 6
    if not own:
        pd.testing.assert_frame_equal(model, plain)
        return
    # The row is that of the last who collected: after what `step` does, and after the agents were added.
    assert model.made.tolist() == [0, 1, 2, 3, 4, 5]
    assert (model.agents.tolist(), plain.agents.tolist()) == ([3] * 6, [0, 3, 3, 3, 3, 3])
    agents = [world.datacollector.get_agent_vars_dataframe() for world in worlds]
    pd.testing.assert_frame_equal(*[table[table.index.get_level_values(0) > 0] for table in agents])


def test_a_tick_that_comes_again_has_a_row_of_its_own() -> None:
    world = CMOMMT(robots=2, rng=1)
    world.datacollector = collector = mesa.DataCollector(model_reporters={"tick": "tick"})
    world.run(1)
    saved = world.state()
    world.run(1)
    world.restore(saved)
    world.run(1)
    assert collector.model_vars["tick"] == [0, 1, 2, 2]
    world.reset()
    world.datacollector.collect(world)
    world.run(1)
    world.datacollector.collect(world)
    assert world.datacollector.model_vars["tick"] == [0, 1]
    # The same collector, set again, or in another world, begins anew there.
    other = CMOMMT(robots=2, rng=1)
    other.datacollector = collector
    collector.collect(other)
    assert collector.model_vars["tick"] == [0, 1, 2, 2, 0]


def test_a_reporter_that_fails_leaves_no_part_of_a_row() -> None:
    world = CMOMMT(robots=2, rng=1)
    world.datacollector = collector = mesa.DataCollector(
        model_reporters={"tick": "tick", "rest": lambda world: 1 / (2 - world.tick)}
    )
    with pytest.raises(ZeroDivisionError):
        world.run(5)
    world.run(2)
    assert collector.model_vars == {"tick": [0, 1, 3, 4], "rest": [0.5, 1.0, -1.0, -0.5]}


def test_batches_of_models_that_collect_themselves_have_one_row_a_step() -> None:
    options: dict[str, Any] = {"max_steps": 4, "data_collection_period": 1, "display_progress": False}
    for when in ("before", "after"):
        rows = mesa.batch_run(Walkers, {"when": when, "own": True}, **options)
        assert sorted((row["Step"], row["AgentID"]) for row in rows) == [(k, one) for k in range(5) for one in (1, 2, 3)]
        # The last tick is step 4 from mesa 3.4 on, and 5 before; no later step collects it again.
        assert [row["made"] for row in rows[::3]][:4] == [0, 1, 2, 3]
