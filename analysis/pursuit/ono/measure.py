"""What is measured of a run: captures over time, and which hunter stood on which side of the prey."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from teamsight.analysis.pursuit.ono.conditions import HUNTERS

if TYPE_CHECKING:
    from teamsight.agents.world import World

Integers = npt.NDArray[np.int64]

#: Parts of a run in which captures are counted, and those at its end that count as late.
PARTS, LATE = 40, 10
# Steps at the end of a run whose positions are recorded, at most.
_WATCHED = 100_000
# Shuffles of the hunters in every capture, for the mutual information that chance alone gives.
_SHUFFLES = 200
# East, west, north, south.
_SIDES = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])


@dataclass(frozen=True)
class Surrounding:
    """Measures a world of `Pursuit` with the rule "surround".

    Parameters
    ----------
    side : int
        The side of its torus [cells].
    """

    side: int

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world and return captures by part of the run, and the mutual information of hunters and sides.

        Parameters
        ----------
        world : World
            A `Pursuit`.
        steps : int
            Steps of the run.
        """
        watched = min(_WATCHED, steps // 2)
        world.run(steps - watched, progress=False)
        world.recording.record_positions()
        world.run(watched, progress=False)
        ends = np.flatnonzero(world.recording.history["captures"].to_numpy() > 0)
        parts = np.histogram(ends, np.linspace(0, steps, PARTS + 1))[0]
        found = information(self._sides(world, ends[ends >= steps - watched] + 1), np.random.default_rng(steps))
        return {
            "captures": int(parts.sum()),
            "parts": parts.tolist(),
            "late": int(parts[-LATE:].sum()),
            "neighbours": int(world.max_neighbours),
            **found,
        }

    def _sides(self, world: World, times: Integers) -> Integers:
        """Return which hunter, by number, stood on which side at some times; shape (captures, sides)."""
        frame = world.recording.trajectory
        frame = frame[np.isin(frame["time"].to_numpy(), times)]
        is_prey = frame["group"].to_numpy() == "prey"
        place = frame[["x", "y"]].to_numpy()
        prey, hunters = place[is_prey][:, np.newaxis], place[~is_prey].reshape(len(times), HUNTERS, 2)
        gap = hunters - prey
        gap -= self.side * np.rint(gap / self.side)
        there = (np.rint(gap)[:, :, np.newaxis] == _SIDES).all(axis=-1)
        return cast("Integers", there.argmax(axis=1))


def information(sides: Integers, rng: np.random.Generator) -> dict[str, float]:
    """Return the mutual information of hunters and sides [bit], and its mean if hunters are shuffled in each capture.

    Parameters
    ----------
    sides : ndarray, shape (captures, sides), int64
        The number of the hunter on each side of the prey.
    rng : Generator
        For the shuffles.

    Returns
    -------
    dict
        information, chance (NaN without captures), and watched, the number of captures.
    """
    count = len(sides)
    if not count:
        return {"information": np.nan, "chance": np.nan, "watched": 0}
    shuffled = [_bits(rng.permuted(sides, axis=1)) for _ in range(_SHUFFLES)]
    return {"information": _bits(sides), "chance": float(np.mean(shuffled)), "watched": count}


def _bits(sides: Integers) -> float:
    number = sides.shape[1]
    counts = np.zeros((number, number))
    np.add.at(counts, (np.broadcast_to(np.arange(number), sides.shape), sides), 1)
    share = counts / counts.sum()
    by_chance = share.sum(axis=1, keepdims=True) * share.sum(axis=0, keepdims=True)
    some = share > 0
    return float(np.sum(share[some] * np.log2(share[some] / by_chance[some])))
