"""Captures: against a game on cells move by move, against the exact Markov chain, and against Tan's random hunters."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from naive import pursuit as naive

from teamsight import check_interaction
from teamsight.core.kernel import inlined
from teamsight.policies import BoundedPreyQ, BoundedWalk, CompiledPolicy, PreyQ
from teamsight.policies.online.lattice_walk import lattice_move
from teamsight.tasks.pursuit import Capture, Pursuit


@inlined
def steer(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        lattice_move(int(arrays.parameters[0]), i, percept, action)


GAMES: list[dict[str, Any]] = [
    {"hunters": 1, "prey": 1, "side": 4, "torus": False, "rule": "alone"},
    {"hunters": 3, "prey": 2, "side": 5, "torus": True, "rule": "alone"},
    {"hunters": 2, "prey": 2, "side": 5, "torus": False, "rule": "pair"},
    {"hunters": 4, "prey": 1, "side": 6, "torus": True, "rule": "pair"},
    {"hunters": 2, "prey": 2, "side": 5, "torus": False, "rule": "pair", "order": "in turn"},
    {"hunters": 3, "prey": 1, "side": 4, "torus": True, "rule": "pair", "order": "in turn", "diagonals": False},
    {"hunters": 2, "prey": 1, "side": 4, "torus": False, "rule": "alone", "order": "at once"},
]


def _open_of(given: dict[str, Any]) -> dict[str, Any]:
    """The order and the diagonals of the twin."""
    order = given.get("order", "by rule")
    in_turn = given["rule"] == "alone" if order == "by rule" else order == "in turn"
    return {"in_turn": in_turn, "diagonals": given.get("diagonals", True)}


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
        open_points = _open_of(given)
        game = naive.Game(
            side, given["hunters"], given["prey"], random.Random(0), joint=joint, torus=torus, **open_points
        )
        game.hunters, game.prey = before
        hunted = [naive.moved(c, m, side, torus=torus) for c, m in zip(before[0], moves[0], strict=True)]
        captors = game.step(*moves)
        first = naive.captors(hunted, before[1], side, joint=joint, torus=torus, diagonals=open_points["diagonals"])
        if open_points["in_turn"] and first:
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
        {"side": 3, "hunters": 2, "prey": 1, "torus": False, "rule": "pair", "order": "in turn", "diagonals": False},
        {"side": 4, "hunters": 1, "prey": 1, "torus": False, "rule": "alone", "prey_policy": BoundedWalk(side=4)},
        {"side": 4, "hunters": 1, "prey": 1, "torus": False, "rule": "alone", "policy": BoundedWalk(side=4)},
    ],
    ids=str,
)
def test_random_hunters_need_as_long_as_the_exact_chain_says(given: dict[str, Any]) -> None:
    exact = naive.mean_steps(
        given["side"], given["hunters"], given["prey"], joint=given["rule"] == "pair", torus=given["torus"],
        legal_prey="prey_policy" in given, legal_hunters="policy" in given, **_open_of(given),
    )  # fmt: skip
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


def _stands(world: Pursuit, hunters: Any, prey: Any) -> None:
    """Put all into cells, numbered from the south-west."""
    for group, cells in ((world.hunters, hunters), (world.prey, prey)):
        for body, place in zip(group, np.array(cells, float) + 0.5 - world.arena.bounds[1][0], strict=True):
            body.position = place


#: North, east, south and west, as actions of `Steered`.
NORTH, EAST, SOUTH, WEST = range(4)


@dataclass(frozen=True)
class Steered(CompiledPolicy):
    """Agents that all make the same lattice move."""

    move: int = 0

    kernel = steer


@pytest.mark.parametrize(
    ("rule", "order", "hunters", "prey", "moves", "captured", "prey_moves"),
    [
        # The hunter enters the cell of the prey before it leaves.
        ("alone", "in turn", [(1, 1)], [(2, 1)], (EAST, EAST), True, False),
        ("alone", "at once", [(1, 1)], [(2, 1)], (EAST, EAST), False, True),
        # They change places: in turn the hunter is first, at once they pass each other.
        ("alone", "in turn", [(1, 1)], [(2, 1)], (EAST, WEST), True, False),
        ("alone", "at once", [(1, 1)], [(2, 1)], (EAST, WEST), False, True),
        # The prey enters the hunter's cell after that has moved away from it: nobody meets in either order.
        ("alone", "in turn", [(1, 1)], [(1, 0)], (EAST, NORTH), False, True),
        # The hunter waits at the wall, and the prey comes.
        ("alone", "in turn", [(0, 0)], [(1, 0)], (SOUTH, WEST), True, True),
        ("alone", "at once", [(0, 0)], [(1, 0)], (SOUTH, WEST), True, True),
        # Two come next to the prey, which goes away.
        ("pair", "in turn", [(0, 0), (0, 1)], [(2, 1)], (EAST, EAST), True, False),
        ("pair", "at once", [(0, 0), (0, 1)], [(2, 1)], (EAST, EAST), False, True),
        # Two stand at the wall, and the prey comes next to them.
        ("pair", "in turn", [(0, 0), (0, 1)], [(2, 1)], (WEST, WEST), True, True),
        ("pair", "at once", [(0, 0), (0, 1)], [(2, 1)], (WEST, WEST), True, True),
    ],
)
def test_the_order_of_moves_decides(
    rule: str, order: str, hunters: Any, prey: Any, moves: tuple[int, int], captured: bool, prey_moves: bool
) -> None:
    hunt, flee = map(Steered, moves)
    for steps_alone in (True, False):
        world = Pursuit(len(hunters), 1, 5, rule=rule, order=order, policy=hunt, prey_policy=flee, rng=1)
        _stands(world, hunters, prey)
        world.step() if steps_alone else world.run(1)
        assert bool(world.recording.history["captures"].iloc[-1]) == captured
        assert (_cells(world, world.prey.position) != prey) == prey_moves
        assert world.hunters.captures.tolist() == [int(captured)] * len(hunters)


def test_the_order_of_the_rule_is_the_default() -> None:
    for rule, order in (("alone", "in turn"), ("pair", "at once")):
        worlds = [Pursuit(2, 2, 5, rule=rule, rng=3, **more) for more in ({}, {"order": order})]
        for world in worlds:
            world.run(500)
        assert worlds[0].recording.history.equals(worlds[1].recording.history)


def test_only_cells_with_a_side_in_common_are_next_to_each_other_if_wished() -> None:
    for diagonals in (True, False):
        world = Pursuit(2, 1, 5, rule="pair", diagonals=diagonals, policy=Steered(WEST), prey_policy=Steered(WEST), rng=1)
        # All stay at the wall: one hunter in the prey's cell, the other at a corner of it after they have moved.
        _stands(world, [(0, 2), (2, 3)], [(0, 2)])
        world.run(1)
        assert bool(world.recording.history["captures"].iloc[-1]) == diagonals


@pytest.mark.parametrize("moves", [4, 5])
def test_a_bounded_walk_makes_all_legal_moves_and_no_others(moves: int) -> None:
    side = 3
    world = Pursuit(3, 2, side, depth=1, prey_policy=BoundedWalk(moves, side), policy=BoundedWalk(moves, side), rng=6)
    seen: dict[tuple[tuple[int, int], tuple[int, int]], int] = {}
    for _ in range(4000):
        before = _cells(world, world.hunters.position)
        world.step()
        if world.recording.history["trial_steps"].iloc[-1] > 0:
            for one, other in zip(before, _cells(world, world.hunters.position), strict=True):
                seen[one, other] = seen.get((one, other), 0) + 1
    for x in range(side):
        for y in range(side):
            place = (x, y)
            expected = {naive.moved(place, move, side, torus=False) for move in naive.legal(place, side)}
            expected |= {place} if moves == 5 else set()
            found = {other: count for (one, other), count in seen.items() if one == place}
            assert set(found) == expected
            total = sum(found.values())
            # Six standard errors of a binomial share.
            wide = 6 * math.sqrt(total * (1 - 1 / len(expected)) / len(expected))
            assert all(abs(count - total / len(expected)) < wide for count in found.values())


def test_bounded_prey_never_lose_a_move_and_others_do() -> None:
    for policy, loses in ((BoundedWalk(side=4), False), ("lattice-walk", True)):
        world = Pursuit(1, 3, 4, prey_policy=policy, rng=2)
        lost = 0
        for _ in range(300):
            before = world.prey.position.copy()
            world.step()
            row = world.recording.history.iloc[-1]
            if row["trial_steps"] > 0 and row["captures"] == 0:
                lost += int((before == world.prey.position).all(axis=1).sum())
        assert (lost > 0) == loses


def test_learners_that_know_the_walls_move_inside_them() -> None:
    for policy, loses in ((BoundedPreyQ(2, side=5), False), (PreyQ(2), True)):
        world = Pursuit(2, 1, 5, depth=2, policy=policy, rng=2)
        lost = 0
        for _ in range(600):
            before = world.hunters.position.copy()
            world.step()
            if world.recording.history["trial_steps"].iloc[-1] > 0:
                lost += int((before == world.hunters.position).all(axis=1).sum())
        assert (lost > 0) == loses


def test_surround_has_one_order() -> None:
    for given, named in (({"order": "in turn"}, "order='in turn'"), ({"diagonals": False}, "diagonals=False")):
        with pytest.raises(ValueError, match=f"{named}.*leave them out where rule='surround'"):
            Pursuit(4, 1, 5, rule="surround", torus=True, **given)
    with pytest.raises(ValueError, match="order='hunters first'"):
        Capture(10, 10, order="hunters first")


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
    "capture",
    [
        Capture(10, 10), Capture(10, 10, torus=True), Capture(10, 10, rule="pair"),
        Capture(10, 10, rule="pair", order="in turn"), Capture(10, 10, order="at once"),
        Capture(10, 10, rule="pair", diagonals=False),
    ],
    ids=str,
)
def test_contract(capture: Capture) -> None:
    check_interaction(capture)


def test_wrong_rules_are_named() -> None:
    with pytest.raises(ValueError, match="rule='three'"):
        Capture(10, 10, rule="three")
