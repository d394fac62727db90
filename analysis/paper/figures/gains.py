"""Figs. 8, 10 and 11: what awareness, and a longer awareness range, add to the percentage of observed targets."""

from __future__ import annotations

import pandas as pd

from teamsight.analysis.paper.figures.differences import Contrast, difference_figure, gain_in_words


def _learned_in_words(cells: pd.DataFrame) -> str:
    """Return Fig. 11 in one line, and a pointer: another exploration gives another surface."""
    return f"gain from awareness of the learned policies: {gain_in_words(cells, 'learned')}; see docs/lazy-search.md"


FIGURE_8 = difference_figure(
    "8",
    "Gain by awareness: A-CMOMMT less centroid",
    (Contrast("a-cmommt", "centroid", "a-cmommt - centroid", "Fig. 7 less Fig. 6"),),
)
FIGURE_10 = difference_figure(
    "10",
    "Gain by an awareness range of 1 instead of 0.5: A-CMOMMT",
    (
        Contrast(
            "a-cmommt",
            "half-range",
            "repulsion scaled with sensing range",
            "repulsion scaled with the sensing range (d1, d2 = 0.481, 0.769)",
        ),
        Contrast(
            "a-cmommt",
            "half-range-scaled",
            "repulsion scaled with awareness range",
            "repulsion scaled with the awareness range (half of that at 0.5)",
        ),
    ),
)
FIGURE_11 = difference_figure(
    "11",
    "Gain by awareness in lazy Q-learning: 32 inputs less 16 inputs, with Fig. 8 for comparison",
    (
        Contrast(
            "lazy-cooperative",
            "lazy-collective",
            "learned",
            "lazy Q-learning from one memory of 600 transitions: with teammates less without; this row has its own "
            "colour scale; another memory gives another surface (docs/lazy-search.md)",
        ),
        Contrast("a-cmommt", "centroid", "designed", "designed (Fig. 8): A-CMOMMT less centroid"),
    ),
    own_colours=True,
    summarise=_learned_in_words,
)
