"""Seeds: whatever NumPy makes a generator of makes a world, and equal seeds make equal worlds."""

from __future__ import annotations

import pickle
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Box, Disc, World, run_many

KINDS: dict[str, Callable[[], Any]] = {
    "numbers": lambda: [1, 2, 3],
    "array": lambda: np.array([1, 2, 3]),
    "sequence": lambda: np.random.SeedSequence(7).spawn(2)[1],
    "bits": lambda: np.random.Philox(7),
    "generator": lambda: np.random.default_rng(7),
}


def test_the_error_of_a_class_without_an_arena_names_the_call_that_it_needs() -> None:
    class Plain(World):
        def __init__(self, n: int = 3, rng: int | None = None) -> None:
            super().__init__(rng=rng)

    with pytest.raises(TypeError, match=r"Plain: has no arena; .* super\(\).__init__\(Box\(10, 10\), rng=rng\)"):
        Plain()
    with pytest.raises(TypeError, match=r"World: has no arena; .* World\(Box\(10, 10\), rng=rng\)"):
        World()
    assert World(Box(10, 10), rng=1).seed_used == 1


@pytest.mark.short
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["rng", "seed"])
def test_equal_seeds_of_each_kind_make_equal_worlds(kind: str, name: str) -> None:
    made = KINDS[kind]
    one, same = CMOMMT(**{name: made()}), CMOMMT(**{name: made()})
    again, other = CMOMMT(rng=one.seed_used), CMOMMT(rng=8)
    for world in (one, same, again, other):
        world.run(3)
    assert one.robots.position.tolist() == same.robots.position.tolist() == again.robots.position.tolist()
    assert one.robots.position.tolist() != other.robots.position.tolist()
    assert one.rng.random() == again.rng.random()
    assert one.random.random() == again.random.random()
    # What is drawn is what NumPy draws, and any page or table can hold it.
    assert one.seed_used == np.random.default_rng(made()).integers(2**53)


def test_a_generator_goes_on_and_a_sequence_does_not() -> None:
    generator, sequence = np.random.default_rng(7), np.random.SeedSequence(7)
    assert CMOMMT(rng=generator).seed_used != CMOMMT(rng=generator).seed_used
    assert CMOMMT(rng=sequence).seed_used == CMOMMT(rng=sequence).seed_used


def test_whole_numbers_of_any_type_are_the_seed_itself() -> None:
    for five in (5, np.int32(5), np.uint64(5)):
        assert CMOMMT(rng=five).seed_used == 5
    assert CMOMMT(rng=5, seed=np.int64(5)).seed_used == 5


@pytest.mark.parametrize("wrong", ["5", 1.5, [1.5], True, [True, False], [-1], np.array(5), {}, object()])
def test_what_is_no_seed_is_refused(wrong: Any) -> None:
    with pytest.raises(TypeError, match="rng=.*: must be a whole number of at least 0, several, .* or None"):
        World(Disc(2.0), rng=wrong)


def test_two_seeds_are_refused() -> None:
    for one, other in ((5, 6), ([1], [1]), (5, np.random.default_rng(5))):
        with pytest.raises(ValueError, match="two names for one seed"):
            CMOMMT(rng=one, seed=other)
    same = np.random.default_rng(5)
    assert CMOMMT(rng=same, seed=same).seed_used == CMOMMT(rng=np.random.default_rng(5)).seed_used


def test_what_stores_or_shows_the_seed_has_the_whole_number() -> None:
    world = CMOMMT(rng=np.random.SeedSequence(7))
    seed = str(world.seed_used)
    assert f"seed {seed}" in repr(world)
    assert seed in (world._repr_html_() or "")
    replay = world.record()
    world.run(3)
    assert seed in replay.stop()._repr_html_()
    saved = pickle.loads(pickle.dumps(world.state()))
    world.run(3)
    after = world.robots.position.tolist()
    world.reset(rng=np.random.default_rng(1))
    assert world.seed_used == CMOMMT(rng=np.random.default_rng(1)).seed_used
    world.restore(saved)
    world.run(3)
    assert (world.robots.position.tolist(), str(world.seed_used)) == (after, seed)
    assert set(world.datacollector.model_vars["seed_used"]) == {int(seed)}


def test_many_runs_derive_their_seeds_from_a_whole_number() -> None:
    with pytest.raises(TypeError, match="rng=.*: must be a whole number"):
        run_many({}, steps=1, rng=np.random.default_rng(1))


def test_here_a_world_without_a_seed_gets_one_from_the_name_of_its_test(request: pytest.FixtureRequest) -> None:
    """Without this, one commit passes and fails: each run of the tests is another trial."""
    if request.config.getoption("--explore"):
        pytest.skip("--explore draws other seeds on purpose")
    assert World(Disc(3.0)).seed_used == random.Random(request.node.nodeid).getrandbits(53)
