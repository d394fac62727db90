"""The correct policy, made by hand: which behaviour suits which conditions, and which rows have a clear answer."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.policies.basis.behaviours import DISPERSION, HOMING, RESTING, WANDERING
from teamsight.policies.interface import Floats

# A row of the conditions is 8 · puck + 4 · home + 2 · night + intruder.
_PUCK, _HOME, _NIGHT, _INTRUDER = 8, 4, 2, 1


def _answer(row: int) -> int:
    """Return the behaviour for a row: the first of these rules that fits."""
    if row & _NIGHT:
        return RESTING if row & _HOME else HOMING
    if row & _PUCK and not row & _HOME:
        return HOMING
    return DISPERSION if row & _INTRUDER else WANDERING


#: The behaviour of each of the 16 rows: night → homing, at home resting; puck → homing; intruder → dispersion; else
#: wandering. Rows with a puck at home do not occur, because it is dropped at once.
CORRECT: tuple[int, ...] = tuple(map(_answer, range(16)))

#: The rows whose answer is clear, which are scored: (puck, home, night, intruder). Not clear are rows in which an
#: intruder is near a robot that should do something else too (carry, go home, rest), and the one at home by day with
#: nobody near, where wandering and dispersion both may leave.
CLEAR_ROWS: tuple[int, ...] = (
    0,                              # nothing: wandering
    _INTRUDER,                      # dispersion
    _NIGHT,                         # homing
    _PUCK,                          # homing
    _PUCK | _NIGHT,                 # homing
    _HOME | _INTRUDER,              # dispersion
    _HOME | _NIGHT,                 # resting
)  # fmt: skip


def correct_table(codes: int) -> Floats:
    """Return the values of the correct policy, 1 for the correct behaviour, shape (8 · codes, 4).

    Parameters
    ----------
    codes : int
        Into how many numbers the intruders that are near are coded; 0 is for none.
    """
    table = np.zeros((8 * codes, 4))
    for row in range(8 * codes):
        table[row, CORRECT[2 * (row // codes) + (1 if row % codes else 0)]] = 1.0
    return table


def share_correct(tables: Floats, rows: tuple[int, ...] = CLEAR_ROWS) -> float:
    """Return the share of rows that are learned right, over all robots.

    A row is learned right if the value of its correct behaviour is above those of the three others.

    Parameters
    ----------
    tables : ndarray, shape (robots, 8 · codes, 4), float64
        The tables of robots. Where intruders are counted or in sectors, a row of the 16 with an intruder stands for
        several, each of which counts by its share.
    rows : tuple of int
        Rows of the 16; by default those whose answer is clear.
    """
    tables = np.asarray(tables)
    codes = tables.shape[1] // 8
    found = []
    for row in rows:
        which = [0] if not row & _INTRUDER else list(range(1, codes))
        found.append(np.mean([_is_right(tables[:, (row // 2) * codes + code], CORRECT[row]) for code in which]))
    return float(np.mean(found))


def _is_right(values: Floats, answer: int) -> npt.NDArray[np.bool_]:
    others = np.delete(values, answer, axis=1)
    return np.asarray(values[:, answer] > others.max(axis=1))
