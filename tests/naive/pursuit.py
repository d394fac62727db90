"""Tan's pursuit as plain loops over cells, and its exact Markov chain: both know nothing of worlds.

In turn: hunters move, check, prey move, check. At once: all move, then check. Alone, a hunter in a prey's cell captures it,
by default in turn; jointly, two hunters in or next to its cell do, diagonals included unless said otherwise, by default at
once. Prey that hunters have captured first do not move. A move against the wall is lost. The hunters that captured are placed at random for the next trial; all others stay.
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Sequence

import numpy as np

Cell = tuple[int, int]
MOVES: tuple[Cell, ...] = ((0, 1), (1, 0), (0, -1), (-1, 0), (0, 0))


def moved(place: Cell, move: int, side: int, *, torus: bool) -> Cell:
    """The cell after a move."""
    x, y = place[0] + MOVES[move][0], place[1] + MOVES[move][1]
    if torus:
        return x % side, y % side
    return (x, y) if 0 <= x < side and 0 <= y < side else place


def legal(place: Cell, side: int) -> list[int]:
    """The moves that leave a cell and end in another."""
    return [move for move in range(4) if moved(place, move, side, torus=False) != place]


def gap(one: Cell, other: Cell, side: int, *, torus: bool, diagonals: bool = True) -> int:
    """How many king's moves two cells are apart; or moves without diagonals."""
    gaps = [abs(a - b) for a, b in zip(one, other, strict=True)]
    gaps = [min(g, side - g) if torus else g for g in gaps]
    return max(gaps) if diagonals else sum(gaps)


def captors(
    hunters: Sequence[Cell], prey: Sequence[Cell], side: int, *, joint: bool, torus: bool, diagonals: bool = True
) -> set[int]:
    """The hunters that capture a prey where all stand now."""
    found: set[int] = set()
    for one in prey:
        gaps = [gap(hunter, one, side, torus=torus, diagonals=diagonals) for hunter in hunters]
        close = [i for i, apart in enumerate(gaps) if apart <= joint]
        if len(close) >= 1 + joint:
            found.update(close)
    return found


class Game:
    """A game with random places from `rng`; moves are given."""

    def __init__(
        self, side: int, hunters: int, prey: int, rng: random.Random, *, joint: bool, torus: bool,
        in_turn: bool | None = None, diagonals: bool = True,
    ) -> None:  # fmt: skip
        self.side, self.rng, self.joint, self.torus = side, rng, joint, torus
        self.in_turn, self.diagonals = not joint if in_turn is None else in_turn, diagonals
        self.hunters = [self.anywhere() for _ in range(hunters)]
        self.prey = [self.anywhere() for _ in range(prey)]

    def anywhere(self) -> Cell:
        return self.rng.randrange(self.side), self.rng.randrange(self.side)

    def step(self, hunters: Sequence[int], prey: Sequence[int]) -> set[int]:
        """Make a step; the hunters that captured, which stand elsewhere now."""
        kind = {"joint": self.joint, "torus": self.torus, "diagonals": self.diagonals}
        self.hunters = [
            moved(place, m, self.side, torus=self.torus) for place, m in zip(self.hunters, hunters, strict=True)
        ]
        found = captors(self.hunters, self.prey, self.side, **kind) if self.in_turn else set()
        if not found:
            self.prey = [moved(place, m, self.side, torus=self.torus) for place, m in zip(self.prey, prey, strict=True)]
        found = found or captors(self.hunters, self.prey, self.side, **kind)
        for i in found:
            self.hunters[i] = self.anywhere()
        return found


def trials(game: Game, count: int, moves: int = 4) -> list[int]:
    """The steps of some trials of random walkers."""
    lengths, steps = [], 0
    while len(lengths) < count:
        steps += 1
        walks = [[game.rng.randrange(moves) for _ in group] for group in (game.hunters, game.prey)]
        if game.step(*walks):
            lengths.append(steps)
            steps = 0
    return lengths


def mean_steps(
    side: int, hunters: int, prey: int, *, joint: bool, torus: bool, moves: int = 4, in_turn: bool | None = None,
    diagonals: bool = True, legal_prey: bool = False, legal_hunters: bool = False,
) -> float:  # fmt: skip
    """The exact mean length of a trial of random walkers, over infinitely many trials.

    It is 1 / the probability of a capture in a step, in the stationary distribution of the chain over all places.
    """
    cells = list(itertools.product(range(side), repeat=2))
    places = list(itertools.product(cells, repeat=hunters + prey))
    number = {place: k for k, place in enumerate(places)}
    kind = {"joint": joint, "torus": torus, "diagonals": diagonals}
    chain, caught = np.zeros((len(places), len(places))), np.zeros(len(places))
    goes_first = not joint if in_turn is None else in_turn
    are_legal = [legal_hunters] * hunters + [legal_prey] * prey
    for place, steps in itertools.product(places, itertools.product(range(moves), repeat=hunters + prey)):
        choices = [legal(one, side) if yes else list(range(moves)) for one, yes in zip(place, are_legal, strict=True)]
        if any(m not in some for m, some in zip(steps, choices, strict=True)):
            continue
        share = 1.0 / math.prod(map(len, choices))
        after = tuple(moved(one, m, side, torus=torus) for one, m in zip(place, steps, strict=True))
        first = captors(after[:hunters], place[hunters:], side, **kind) if goes_first else set()
        if first:
            after = after[:hunters] + place[hunters:]
        found = sorted(first or captors(after[:hunters], after[hunters:], side, **kind))
        caught[number[place]] += share * bool(found)
        anew = list(itertools.product(cells, repeat=len(found)))
        for new in anew:
            end = list(after)
            for i, cell in zip(found, new, strict=True):
                end[i] = cell
            chain[number[place], number[tuple(end)]] += share / len(anew)
    # The stationary distribution: π (P − 1) = 0 and Σ π = 1.
    system = np.vstack([chain.T - np.eye(len(places)), np.ones(len(places))])
    right = np.append(np.zeros(len(places)), 1.0)
    stationary = np.linalg.lstsq(system, right, rcond=None)[0]
    return float(1.0 / (stationary @ caught))
