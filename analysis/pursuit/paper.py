"""What Tan (1993) reports: the 28 values of his Tables 1 to 3, and where the nine runs of Figures 7 and 8 settle."""

from __future__ import annotations

from typing import NamedTuple

#: Trials over which Table 1 averages random hunters.
RANDOM_TRIALS = 200
#: The least number of runs that Tan's intervals stand for, and their level.
RUNS, LEVEL = 5, 0.90


class PaperValue(NamedTuple):
    """A mean number of steps of a trial.

    Attributes
    ----------
    where : str
        The table or the figure.
    condition : str
        A key of `teamsight.analysis.pursuit.conditions.CONDITIONS`.
    phase : {"training", "test"}
        While hunters learn, or afterwards.
    steps : float
        The value.
    half : float or None
        Half the width of its 90 % interval; None if none is given.
    """

    where: str
    condition: str
    phase: str
    steps: float
    half: float | None = None


def _both(where: str, condition: str, *numbers: float) -> list[PaperValue]:
    training, test = numbers[:2], numbers[2:]
    return [PaperValue(where, condition, "training", *training), PaperValue(where, condition, "test", *test)]


VALUES: tuple[PaperValue, ...] = (
    PaperValue("Table 1", "1/1 random", "training", 123.08),
    PaperValue("Table 1", "1/2 random", "training", 56.47),
    PaperValue("Table 1", "1/2 joint random", "training", 354.45),
    PaperValue("Table 1", "2/2 joint random", "training", 224.92),
    PaperValue("Table 1", "1/1 depth 4", "training", 25.32),
    PaperValue("Table 1", "1/2 depth 4", "training", 12.21),
    PaperValue("Table 1", "1/2 joint", "training", 119.17),
    PaperValue("Table 1", "2/2 joint", "training", 100.61),
    *_both("Table 2", "1/1 depth 2", 47.14, 1.28, 49.49, 1.60),
    *_both("Table 2", "1/1 scout 2", 46.33, 1.39, 42.91, 1.48),
    *_both("Table 2", "1/1 scout 3", 39.78, 1.06, 32.08, 1.22),
    *_both("Table 2", "1/1 scout 4", 32.67, 1.03, 25.07, 0.89),
    *_both("Table 3", "1/2 depth 2", 20.38, 0.57, 24.04, 1.00),
    *_both("Table 3", "1/2 depth 3", 14.65, 0.53, 16.04, 0.56),
    *_both("Table 3", "1/2 depth 4", 12.21, 0.65, 11.53, 0.61),
    *_both("Table 3", "1/2 mutual 2", 25.20, 0.79, 24.52, 1.24),
    *_both("Table 3", "1/2 mutual 3", 14.02, 0.75, 12.98, 0.65),
    *_both("Table 3", "1/2 mutual 4", 11.05, 0.56, 8.83, 0.78),
    PaperValue("Fig. 7", "2/2 joint", "training", 101.0),
    PaperValue("Fig. 7", "2/2 joint passive", "training", 49.0),
    PaperValue("Fig. 7", "2/2 joint mutual", "training", 39.0),
    PaperValue("Fig. 7", "2/2 joint", "test", 49.0),
    PaperValue("Fig. 7", "2/2 joint passive", "test", 42.0),
    PaperValue("Fig. 7", "2/2 joint mutual", "test", 34.0),
    PaperValue("Fig. 8", "1/2 joint", "training", 116.0),
    PaperValue("Fig. 8", "1/2 joint passive", "training", 84.0),
    PaperValue("Fig. 8", "1/2 joint mutual", "training", 76.0),
)
