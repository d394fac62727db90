"""Totals do not depend on how steps are divided: restoring and adjusting change no last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight import CMOMMT, Box, Disc, Robot, Torus, World

deeds = st.lists(
    st.tuples(st.sampled_from(["run", "step", "adjust", "restore", "senses", "place"]), st.integers(1, 9)), max_size=12
)


@given(deeds, st.integers(1, 17))
def test_what_changes_nothing_changes_no_last_bit(done: list[tuple[str, int]], targets: int) -> None:
    model = CMOMMT(robots=4, targets=targets, radius=2.0, rng=targets)
    for deed, steps in done:
        if deed == "adjust":
            model.adjust(model.robots)
        elif deed == "restore":
            model.restore(model.state())
        elif deed == "senses":
            model.senses(model.robots, model.targets)
        elif deed == "place":
            model.robots[0].position = model.robots[0].position
        elif deed == "run":
            model.run(steps)
        else:
            for _ in range(steps):
                model.step()
    other = CMOMMT(robots=4, targets=targets, radius=2.0, rng=targets)
    other.run(model.tick)
    assert repr(model.observed_fraction) == repr(other.observed_fraction)
    assert model.recording.history.equals(other.recording.history)
    mine, theirs = (world.datacollector.get_model_vars_dataframe() for world in (model, other))
    assert mine.equals(theirs)


@pytest.mark.short
@pytest.mark.parametrize("arena", [Disc(9.0), Box(6.0, 6.0), Torus(6.0, 6.0), Disc(3.0000001)], ids=str)
def test_a_state_of_another_arena_is_refused(arena: Any) -> None:
    worlds = []
    for place in (Disc(3.0), arena):
        world = World(place, rng=1)
        world.add(Robot, 10, policy="random-walk")
        world.run(5)
        worlds.append(world)
    before = worlds[0].groups[0].position.copy()
    with pytest.raises(ValueError, match=r"restore\(…\): the state is of a world in .*this world is in Disc\(radius=3\.0\)"):
        worlds[0].restore(worlds[1].state())
    assert np.array_equal(worlds[0].groups[0].position, before)
    worlds[0].restore(worlds[0].state())


def test_targets_that_left_keep_their_speeds_apart_in_a_reset() -> None:
    model, new = (CMOMMT(targets=6, uniform_target_speed=True, rng=1) for _ in range(2))
    model.targets[0].remove()
    model.reset(5)
    new.reset(5)
    assert model.targets.speed.tolist() == new.targets.speed.tolist()[1:]
