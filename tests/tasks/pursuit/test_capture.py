"""Captures: against a game on cells move by move, against the exact Markov chain, and against Tan's random hunters."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest
from naive import pursuit as naive

from teamsight import check_interaction
from teamsight.tasks.pursuit import Capture, Pursuit

GAMES: list[dict[str, Any]] = [
    {"hunters": 1, "prey": 1, "side": 4, "torus": False, "rule": "alone"},
    {"hunters": 3, "prey": 2, "side": 5, "torus": True, "rule": "alone"},
    {"hunters": 2, "prey": 2, "side": 5, "torus": False, "rule": "pair"},
    {"hunters": 4, "prey": 1, "side": 6, "torus": True, "rule": "pair"},
]


def _cells(world: Pursuit, places: Any) -> list[tuple[int, int]]:
    side = world.arena.bounds[1][0] * 2
    found = np.asarray(places) + side / 2 - 0.5
    assert np.array_equal(found, np.rint(found)), "every body stands at the centre of a cell"
    return [tuple(row) for row in found.astype(int).tolist()]


def _moves_between(before: list[Any], after: list[Any], side: int, *, torus: bool) -> list[int]:
    """A move that leads from each cell to the next; at a wall one that is lost."""
    return [
        next(m for m in (0, 1, 2, 3, 4) if naive.moved(one, m, side, torus=torus) == other)
        for one, other in zip(before, after, strict=True)
    ]


@pytest.mark.parametrize("given", GAMES, ids=str)
def test_every_step_is_one_of_the_game(given: dict[str, Any]) -> None:
    world = Pursuit(**given, depth=1, rng=4)
    side, torus, joint = given["side"], given["torus"], given["rule"] == "pair"
    captured = steps = 0
    captors: set[int] = set()
    for _ in range(800):
        before = [_cells(world, group.position) for group in (world.hunters, world.prey)]
        world.step()
        after = [_cells(world, group.position) for group in (world.hunters, world.prey)]
        row = world.recording.history.iloc[-1]
        is_restart = row["trial_steps"] == 0
        if is_restart:
            # Those that captured are anywhere, and all others where they were.
            assert after[1] == before[1]
            assert [c for i, c in enumerate(after[0]) if i not in captors] == [
                c for i, c in enumerate(before[0]) if i not in captors
            ]
            steps = 0
            continue
        steps += 1
        moves = [_moves_between(*both, side, torus=torus) for both in zip(before, after, strict=True)]
        game = naive.Game(side, given["hunters"], given["prey"], random.Random(0), joint=joint, torus=torus)
        game.hunters, game.prey = before
        hunted = [naive.moved(c, m, side, torus=torus) for c, m in zip(before[0], moves[0], strict=True)]
        captors = game.step(*moves)
        if not joint and (first := naive.captors(hunted, before[1], side, joint=False, torus=torus)):
            assert after[1] == before[1], "prey that was captured before its move does not move"
            assert captors == first
        assert set(np.flatnonzero(world.hunters.captures)) == captors
        assert row["trial_steps"] == steps
        assert (row["captures"] > 0) == bool(captors)
        percept = world.hunters.percept
        assert percept.ended.tolist() == [bool(captors)] * given["hunters"]
        assert percept.reward.tolist() == [1.0 if i in captors else -0.1 for i in range(given["hunters"])]
        captured += bool(captors)
    assert captured > 3


def _mean_and_error(world: Pursuit, steps: int) -> tuple[float, float]:
    """The mean length of a trial, and its standard error from blocks of trials, which depend on one another."""
    world.run(steps)
    history = world.recording.history
    lengths = history["trial_steps"][history["captures"] > 0].to_numpy()
    blocks = np.array([block.mean() for block in np.array_split(lengths, 40)])
    return float(lengths.mean()), float(blocks.std(ddof=1) / math.sqrt(len(blocks)))


@pytest.mark.parametrize(
    "given",
    [
        {"side": 3, "hunters": 1, "prey": 1, "torus": True, "rule": "alone"},
        {"side": 4, "hunters": 1, "prey": 1, "torus": False, "rule": "alone"},
        {"side": 3, "hunters": 2, "prey": 1, "torus": True, "rule": "alone"},
        {"side": 3, "hunters": 2, "prey": 1, "torus": False, "rule": "pair"},
    ],
    ids=str,
)
def test_random_hunters_need_as_long_as_the_exact_chain_says(given: dict[str, Any]) -> None:
    exact = naive.mean_steps(
        given["side"], given["hunters"], given["prey"], joint=given["rule"] == "pair", torus=given["torus"]
    )
    mean, error = _mean_and_error(Pursuit(**given, depth=1, rng=11), 200_000)
    # Student's t with 39 degrees of freedom exceeds 5 once in 80,000 runs.
    assert abs(mean - exact) < 5 * error, f"{mean} ± {error}, exactly {exact}"


@pytest.mark.parametrize(
    ("hunters", "prey", "joint", "tan"),
    [(1, 1, False, 123.08), (2, 1, False, 56.47), (2, 1, True, 354.45), (2, 2, True, 224.92)],
)
def test_random_hunters_of_table_1(hunters: int, prey: int, joint: bool, tan: float) -> None:
    world = Pursuit(hunters, prey, rule="pair" if joint else "alone", rng=7)
    mean, error = _mean_and_error(world, 400_000)
    # Tan's number is the mean of 200 trials, whose lengths are spread about as much as their mean.
    assert abs(mean - tan) < 3 * math.hypot(error, tan / math.sqrt(200)), f"{mean} ± {error}"
    game = naive.Game(10, hunters, prey, random.Random(3), joint=joint, torus=False)
    lengths = np.array(naive.trials(game, 300))
    assert abs(mean - lengths.mean()) < 5 * math.hypot(error, lengths.std(ddof=1) / math.sqrt(len(lengths)))


def test_a_reset_and_a_restored_world_begin_the_trial_where_it_was() -> None:
    world = Pursuit(3, 2, rule="pair", rng=2)
    world.run(300)
    saved = world.state()
    world.run(500)
    first = world.recording.history.tail(500).to_numpy()
    world.restore(saved)
    world.run(500)
    assert np.array_equal(world.recording.history.tail(500).to_numpy(), first)
    world.reset(2)
    world.run(800)
    assert np.array_equal(world.recording.history.tail(500).to_numpy(), first)


@pytest.mark.parametrize(
    "capture", [Capture(10, 10), Capture(10, 10, torus=True), Capture(10, 10, rule="pair")], ids=str
)
def test_contract(capture: Capture) -> None:
    check_interaction(capture)


def test_wrong_rules_are_named() -> None:
    with pytest.raises(ValueError, match="rule='three'"):
        Capture(10, 10, rule="three")
