"""Adaptive logic networks: their values, and what they learn."""

from __future__ import annotations

import itertools
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight.core.kernel import plain
from teamsight.policies.braitenberg import AdaptiveNetwork, FixedPriority
from teamsight.policies.braitenberg.adaptive_network import most_votes, train_trees
from teamsight.policies.braitenberg.vehicle import BEHAVIOUR, BEHAVIOURS, CUES, by_priority
from teamsight.policies.braitenberg.vehicle import LAST_CUES as AT_CUES
from teamsight.policies.check import check_policy
from teamsight.tasks.pushing import BoxPushing
from tests.interactions import fingerprint
from tests.naive.braitenberg import elected

KINDS = len(BEHAVIOURS)


def random_trees(seed: int, depth: int = 4, trees: int = 3) -> np.ndarray:
    """Return trees with random literals and functions."""
    rng, leaves = np.random.default_rng(seed), 2**depth
    literals = rng.integers(1, len(CUES) + 1, (KINDS * trees, leaves)) * rng.choice([-1, 1], (KINDS * trees, leaves))
    return np.hstack([literals, rng.integers(0, 4, (KINDS * trees, leaves - 1))]).astype(np.float32)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), depth=st.integers(1, 6), trees=st.integers(1, 4), data=st.data())
def test_values_are_those_of_the_slow_twin(seed: int, depth: int, trees: int, data: Any) -> None:
    table = random_trees(seed, depth, trees)
    cues = data.draw(st.lists(st.integers(0, 2 ** len(CUES) - 1), min_size=1, max_size=6))
    expected = [elected(table.tolist(), KINDS, one) for one in cues]
    room = np.zeros(table.shape[1], np.int64)
    assert [plain(most_votes)(table, KINDS, one, room) for one in cues] == expected
    assert AdaptiveNetwork(trees=table).select(cues).tolist() == expected


def test_the_compiled_policy_does_what_its_network_selects() -> None:
    seen = set()
    for seed in range(3):
        network = AdaptiveNetwork(trees=random_trees(seed), recovery=False)
        world: Any = BoxPushing(12, 20.0, policy=network, rng=2)
        for _ in range(30):
            world.step()
            kept = world.robots.policy_state.ints[:, 0]
            assert kept[:, BEHAVIOUR].tolist() == network.select(kept[:, AT_CUES]).tolist()
            seen |= set(kept[:, BEHAVIOUR].tolist())
    assert len(seen) > 3


FUNCTIONS = {
    "and": lambda a, b, c: a and b,
    "or": lambda a, b, c: a or c,
    "one alone": lambda a, b, c: a and not b,
    "majority": lambda a, b, c: a + b + c >= 2,
    "a choice": lambda a, b, c: b if a else c,
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_it_learns_a_known_function(name: str) -> None:
    inputs = list(itertools.product((0, 1), repeat=3))
    cues = np.array([a + 2 * b + 4 * c for a, b, c in inputs])
    truth = np.array([int(FUNCTIONS[name](*one)) for one in inputs])
    perfect = 0
    for seed in range(4):
        table = train_trees(cues, truth, inputs=3, kinds=2, trees=3, depth=5, rng=seed)
        perfect += all(elected(table.tolist(), 2, int(one)) == wanted for one, wanted in zip(cues, truth, strict=True))
    # With seeds 100 to 199 at most 2 of 100 fail; 3 of 4 would then have a probability below 1e-4.
    assert perfect >= 2


def test_it_learns_the_fixed_priority_from_examples() -> None:
    rng = np.random.default_rng(3)
    cues = rng.integers(0, 2 ** len(CUES), 100)
    wanted = np.array([plain(by_priority)(int(one)) for one in cues])
    network = AdaptiveNetwork.trained(cues, wanted, rng=1, trees=3, depth=5)
    assert (network.select(cues) == wanted).mean() > 0.9
    other = rng.integers(0, 2 ** len(CUES), 1000)
    truth = np.array([plain(by_priority)(int(one)) for one in other])
    # To say the most frequent behaviour always is right in 3 of 4 cases, since most random cues have an obstacle.
    assert (network.select(other) == truth).mean() > 0.85
    check_policy(network)


def test_one_seed_gives_one_network() -> None:
    cues, wanted = np.arange(10), np.arange(10) % KINDS
    made = [AdaptiveNetwork.trained(cues, wanted, rng=seed, trees=1, depth=3) for seed in (1, 1, 2)]
    assert made[0].table.tobytes() == made[1].table.tobytes() != made[2].table.tobytes()
    assert repr(made[0]) == repr(made[1]) != repr(made[2])
    assert pickle.loads(pickle.dumps(made[0])).table.tobytes() == made[0].table.tobytes()
    # The order and the number of equal examples make no difference.
    again = AdaptiveNetwork.trained(np.tile(cues[::-1], 2), np.tile(wanted[::-1], 2), rng=1, trees=1, depth=3)
    assert again.table.tobytes() == made[0].table.tobytes()


def test_a_network_that_agrees_everywhere_moves_the_same_way() -> None:
    # All cue sets are known to it: each behaviour is a tree whose leaves are its condition.
    leaves = {
        "avoid": ([1, 2, 1, 2], [3, 3, 3]), "goal": ([-1, -2, 5, 5], [0, 0, 0]),
        "slow": ([-1, -2, -5, 11], [0, 0, 0]),
    }  # fmt: skip
    rows = [[*leaves[name][0], *leaves[name][1]] for name in ("avoid", "goal", "slow")]
    # Follow, where no earlier condition holds, has the fewer votes; find always has a vote of its own, and comes last.
    rows += [[10, 10, 10, 10, 0, 0, 0], [1, -1, 1, -1, 3, 3, 3]]
    cues = np.arange(2 ** len(CUES))
    # Cues that cannot be together: slow range without a teammate ahead.
    cues = cues[((cues >> 10 & 1) <= (cues >> 9 & 1))]
    network = AdaptiveNetwork(trees=np.array(rows, np.float32))
    assert network.select(cues).tolist() == [plain(by_priority)(int(one)) for one in cues]
    worlds = [BoxPushing(9, 24.0, policy=policy, rng=5) for policy in (network, FixedPriority())]
    for world in worlds:
        world.run(200, progress=False)
    places = [world.robots.bodies.position.tobytes() for world in worlds]
    assert places[0] == places[1]
    assert fingerprint(worlds[0])[0] == fingerprint(worlds[1])[0]


def test_networks_that_differ_are_shown_as_different() -> None:
    trees = random_trees(1)
    shown = [repr(AdaptiveNetwork(contact=contact, trees=trees)) for contact in (2.6, 2.6000001, 2.6)]
    assert shown[0] == shown[2] != shown[1]
    assert "2.6000001, trees=<" in shown[1]
    assert repr(AdaptiveNetwork(trees=random_trees(2))) != repr(AdaptiveNetwork(trees=trees))


@pytest.mark.parametrize(
    ("trees", "error", "message"),
    [
        (None, TypeError, r"trees=None: .*AdaptiveNetwork\.trained"),
        ("abc", TypeError, r"trees='abc': must be an array of numbers"),
        (np.zeros((5, 6)), ValueError, r"shape \(5, 6\).*power of 2"),
        (np.zeros((4, 7)), ValueError, r"shape \(4, 7\).*5 behaviours"),
        (np.zeros((0, 7)), ValueError, r"shape \(0, 7\)"),
        (np.zeros((5, 7)), ValueError, r"from 1 to 12.*AdaptiveNetwork\.trained"),
        (np.full((5, 7), 13.0), ValueError, r"from 1 to 12"),
        (np.full((5, 7), 4.0), ValueError, r"nodes from 0 to 3"),
    ],
)
def test_bad_trees_are_named(trees: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        AdaptiveNetwork(trees=trees)


@pytest.mark.parametrize(
    ("cues", "wanted", "options", "message"),
    [
        ([], [], {}, r"shapes \(0,\) and \(0,\).*at least one"),
        ([1, 2], [0], {}, r"shapes \(2,\) and \(1,\)"),
        ([8], [0], {}, r"cues: are from 8 to 8; they must be from 0 to 7"),
        ([1], [2], {}, r"options: are from 2 to 2; they must be from 0 to 1"),
        ([1], [1], {"depth": 11}, r"depth=11.*at most 10"),
        ([1], [1], {"trees": 0}, r"trees=0.*at least 1"),
    ],
)
def test_bad_examples_are_named(cues: Any, wanted: Any, options: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        train_trees(cues, wanted, inputs=3, kinds=2, **options)
