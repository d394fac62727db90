"""The worlds behind a page: built anew, or left as they are."""

from __future__ import annotations

import pytest

from teamsight import CMOMMT
from teamsight.live.worlds import Worlds


def test_a_model_must_build_a_world_on_each_call() -> None:
    one = CMOMMT(robots=2, seed=1)

    def kept(seed: int = 0) -> CMOMMT:
        return one

    worlds = Worlds(kept, [{}], 0)
    with pytest.raises(ValueError, match="kept: returns a world that it returned before; build one on each call"):
        worlds.build([{}, {}], 0)
    worlds.replace(worlds.build([{}], 0), 0)
    with pytest.raises(ValueError, match="kept: returns a world that it returned before"):
        worlds.build([{}], 5)
    worlds.run(3)
    assert (worlds.seed, worlds.made, one.tick) == (0, 3, 3)
