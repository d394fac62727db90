"""The worlds behind a page: built anew, or left as they are."""

from __future__ import annotations

import pytest

from teamsight import CMOMMT
from teamsight.live.worlds import Worlds


def test_a_model_must_build_a_world_on_each_call() -> None:
    one = CMOMMT(robots=2, seed=1)

    def kept(seed: int = 0) -> CMOMMT:
        return one

    with pytest.raises(ValueError, match="kept: returns a world that it returned before; build one on each call"):
        Worlds(kept, [{}, {}], 0, 1)
    worlds = Worlds(kept, [{}], 0, 1)
    with pytest.raises(ValueError, match="kept: returns a world that it returned before"):
        worlds.rebuild([{}], 5, 1)
    worlds.run(3)
    assert (worlds.seed, worlds.made, one.tick) == (0, 3, 3)
