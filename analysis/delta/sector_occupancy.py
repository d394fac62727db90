"""Occupancy of the sectors of a ring: neighbours in the same sector merge into the nearest of them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.core.neighbour_list import NeighbourList

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Bearings(NamedTuple):
    """Bearings of neighbours, sampled over many robots and times.

    ``degree`` (m,) int64 is the number of neighbours of each robot and time; ``turn`` (degree.sum(),) float64 their
    bearings, in the same order, anticlockwise from the heading, as fractions of a full turn in [0, 1).
    """

    degree: Ints
    turn: Floats


def expected_sectors(neighbours: int | Ints, sectors: int) -> Floats:
    """Return the mean number of δ sectors that k neighbours in independent, uniform directions occupy.

    Notes
    -----
    *Source:* the classical occupancy problem: δ(1 − (1 − 1/δ)^k).
    """
    return np.asarray(sectors * (1.0 - (1.0 - 1.0 / sectors) ** np.asarray(neighbours)), dtype=np.float64)


def bearings(graph: NeighbourList, heading: Floats) -> Bearings:
    """Return the bearings of each robot's neighbours, relative to its heading.

    Parameters
    ----------
    graph : NeighbourList
        Robots among themselves.
    heading : ndarray of float64, shape (n, 2)
        Headings, of any length; robots whose heading is zero or NaN are left out.
    """
    known = np.hypot(heading[:, 0], heading[:, 1]) > 0  # False for NaN
    degree = np.diff(graph.start)
    kept = np.repeat(known, degree)
    ahead = np.repeat(heading, degree, axis=0)[kept]
    offset = graph.offset[kept]
    cross = ahead[:, 0] * offset[:, 1] - ahead[:, 1] * offset[:, 0]
    turn = np.arctan2(cross, (ahead * offset).sum(axis=1)) / (2 * np.pi)
    return Bearings(degree[known], turn % 1.0 % 1.0)  # twice: −1e-17 % 1 is 1.0


def gather(parts: Iterable[Bearings]) -> Bearings:
    """Return all samples together."""
    parts = [Bearings(np.empty(0, np.int64), np.empty(0)), *parts]
    return Bearings(np.concatenate([part.degree for part in parts]), np.concatenate([part.turn for part in parts]))


def occupied_sectors(found: Bearings, sectors: int) -> Ints:
    """Return the number of δ sectors with a neighbour for each robot and time, int64 of shape (m,).

    Notes
    -----
    As in `RingAwareness`, the first sector is centred on the heading.
    """
    owner = np.repeat(np.arange(len(found.degree)), found.degree)
    sector = np.floor(found.turn * sectors + 0.5).astype(np.int64) % sectors
    # Sorted, because numpy.unique is 80 times as slow.
    place = np.sort(owner * sectors + sector)
    return np.bincount(place[np.diff(place, prepend=-1) > 0] // sectors, minlength=len(found.degree))


def ring_table(found: Bearings, rings: Iterable[int], largest: int) -> pd.DataFrame:
    """Return the mean number of neighbours that rings of several sizes show, by formula and as measured.

    Parameters
    ----------
    found : Bearings
        The samples.
    rings : iterable of int
        Numbers of sectors.
    largest : int
        Largest number of neighbours in the table.

    Returns
    -------
    DataFrame
        One row for each ring and number of neighbours from 1 to `largest`: sectors, neighbours, samples (int64);
        expected and shown, the mean occupied sectors by formula and as measured; hidden, the mean number of neighbours
        that merging hides; all_shown, the share of samples in which none is hidden (float64, NaN without samples).
    """
    rows = []
    for sectors in sorted(set(rings)):
        occupied = occupied_sectors(found, sectors)
        for neighbours in range(1, largest + 1):
            shown = occupied[found.degree == neighbours]
            mean = shown.mean() if len(shown) else np.nan
            clear = (shown == neighbours).mean() if len(shown) else np.nan
            expected = float(expected_sectors(neighbours, sectors))
            rows.append((sectors, neighbours, len(shown), expected, mean, neighbours - mean, clear))
    columns = ["sectors", "neighbours", "samples", "expected", "shown", "hidden", "all_shown"]
    return pd.DataFrame(rows, columns=columns)
