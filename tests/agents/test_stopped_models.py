"""A model that is stopped says so when it is asked to run."""

from __future__ import annotations

import warnings

import pytest

from teamsight import CMOMMT, Disc, Robot, World
from teamsight.analysis.delta import choose_delta
from teamsight.policies import RandomWalk


def test_a_run_of_a_stopped_model_warns_once() -> None:
    model = CMOMMT(robots=2, targets=2, rng=1)
    model.running = False
    stopped = r"run\(\) makes no step: the model is stopped .*running = True, or use reset"
    with pytest.warns(UserWarning, match=stopped) as met:
        model.run(3)
    assert met[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.run(3)
    assert model.tick == 0
    model.running = True
    model.run(3)
    assert model.tick == 3


def test_a_run_of_a_closed_model_says_that_it_was_closed() -> None:
    model = CMOMMT(robots=2, targets=2, rng=1)
    model.close()
    with pytest.warns(UserWarning, match="the model was closed"):
        model.run(3)


class _Ending(World):
    """A team whose model stops itself."""

    def __init__(self, rng: int) -> None:
        super().__init__(Disc(2.0), rng=rng)
        self.add(Robot, 3, policy=RandomWalk())
        self.clock.at(25, self._end)

    def _end(self) -> None:
        self.running = False


def test_a_model_that_stops_itself_does_not_warn() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        world = _Ending(1)
        world.run(100)
        assert world.tick == 25
        # Each run is made in several stretches.
        choose_delta(_Ending, runs=20, steps=100, rng=1)
