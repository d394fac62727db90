"""Measures of a memory and of what is learned from it, for situations that show a single target, by its distance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.neighbour_list import no_neighbours
from teamsight.policies.interface import Floats, Percept
from teamsight.policies.lazy.lazy_q import LazyQ
from teamsight.policies.lazy.readings import unit_vectors
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import Reward, rewards_of

#: Number of intervals of equal width into which distances are divided.
BINS = 20
#: The middle of each interval [sensing ranges].
DISTANCES: Floats = (np.arange(BINS) + 0.5) / BINS
# Toward a target: within 45° of its bearing, by more than half a step. Away from it: the same, in the other direction.
_NEAR_BEARING, _HALF_STEP = math.cos(math.pi / 4), 0.5


def action_effect(memory: LazyMemory, reward: Reward) -> tuple[Floats, Floats]:
    """Return the mean reward of moves toward a target, and of those away from it, by the distance of the target.

    Situations count that show a single target. A move goes toward it if it is more than half a step and within 45° of
    the target's bearing, and away from it in the same way.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    reward : callable
        See `teamsight.policies.rewards`.

    Returns
    -------
    toward, away : ndarray, shape (BINS,), float64
        NaN without such a move.
    """
    own = np.asarray(memory.situation[:, : memory.own])
    single = np.flatnonzero((own < 1.0).sum(axis=1) == 1)
    sector = (own[single] < 1.0).argmax(axis=1)
    place = np.minimum((own[single, sector] * BINS).astype(np.int64), BINS - 1)
    rotation, share = np.asarray(memory.action, float)[single].T
    along = np.cos(rotation - 2.0 * math.pi * sector / memory.own)
    rewards = rewards_of(memory, reward)[single]
    far = share > _HALF_STEP
    toward, away = (_mean_by(place, rewards, far & (side * along > _NEAR_BEARING)) for side in (1.0, -1.0))
    return toward, away


def _mean_by(place: npt.NDArray[np.int64], values: Floats, chosen: npt.NDArray[np.bool_]) -> Floats:
    count = np.bincount(place[chosen], minlength=BINS)
    total = np.bincount(place[chosen], values[chosen], minlength=BINS)
    return np.asarray(np.divide(total, count, out=np.full(BINS, np.nan), where=count > 0))


def single_targets(own: int, inputs: int) -> npt.NDArray[np.float32]:
    """Return the situations that show one target at one of `DISTANCES` and nothing else.

    Returns
    -------
    ndarray, shape (BINS, own, inputs), float32
        By distance and sector.
    """
    found = np.ones((BINS, own, inputs), np.float32)
    sectors = np.arange(own)
    found[:, sectors, sectors] = DISTANCES[:, np.newaxis]
    return found


def matched_share(memory: LazyMemory, inputs: int, k: int) -> Floats:
    """Return how many of the transitions that match a single target show one where it is, by its distance.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    inputs : int
        Number of components that are compared.
    k : int
        Number of nearest transitions.

    Returns
    -------
    ndarray, shape (BINS,), float64
        The share of the k nearest situations with a target in the same sector or the next one on either side, averaged
        over the sectors.
    """
    own = memory.own
    queries = single_targets(own, inputs).reshape(-1, inputs)
    index, _ = memory.nearest(queries, k, inputs)
    shown = np.asarray(memory.situation[:, :own])[index].reshape(BINS, own, k, own) < 1.0
    near = _within_one_sector(own)
    return np.asarray((shown & near[:, np.newaxis]).any(axis=-1).mean(axis=(1, 2)))


def shown_share(memory: LazyMemory) -> float:
    """Return the same share for transitions drawn at random: how many show a target near a given sector."""
    shown = np.asarray(memory.situation[:, : memory.own]) < 1.0
    return float((shown[:, np.newaxis] & _within_one_sector(memory.own)).any(axis=-1).mean())


def _within_one_sector(own: int) -> npt.NDArray[np.bool_]:
    sectors = np.arange(own)
    apart = (sectors - sectors[:, np.newaxis]) % own
    return np.asarray(np.minimum(apart, own - apart) <= 1)


def rewarded_share(policy: LazyQ) -> Floats:
    """Return how often the transition whose action `LazyQ` repeats was rewarded, by the distance of a single target.

    Returns
    -------
    ndarray, shape (BINS,), float64
        The share of situations, one for each sector, whose chosen transition has a reward above 0.
    """
    memory, inputs = policy.memory, policy.inputs
    queries = single_targets(memory.own, inputs).reshape(-1, inputs)
    index, _ = memory.nearest(queries, policy.k, inputs)
    best = np.take_along_axis(index, policy.values[index].argmax(axis=1)[:, np.newaxis], axis=1)
    rewarded = rewards_of(memory, policy.reward)[best] > 0.0
    return np.asarray(rewarded.reshape(BINS, memory.own).mean(axis=1))


def approach(policy: Any) -> Floats:
    """Return by how much of a step a policy's moves approach a single target, by the target's distance.

    Parameters
    ----------
    policy : Learner
        A learner whose actions depend on the situation alone.

    Returns
    -------
    ndarray, shape (BINS,), float64
        Share of the full step · cos(rotation − bearing of the target), averaged over the sectors: 1 is a full step
        toward the target, −1 a full step away from it.
    """
    own, inputs = policy.memory.own, policy.inputs
    situation = single_targets(own, inputs).reshape(-1, inputs)
    size = len(situation)
    heading, speed, nobody = np.tile([1.0, 0.0], (size, 1)), np.ones(size), no_neighbours(size)
    percept = Percept(heading, np.zeros((size, 2)), speed, speed, speed, nobody, nobody, nobody, situation)
    action, _ = policy.decide(percept, policy.start(size), np.zeros((policy.draws, size)))
    bearing = np.tile(unit_vectors(own, 0, ""), (BINS, 1))
    gained = action.distance * (action.heading * bearing).sum(axis=1)
    return np.asarray(gained.reshape(BINS, own).mean(axis=1))
