"""Claims about learning hunters that can fail: Tan's orders, and what awareness of the partner is worth over time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.analysis.pursuit.trials import BLOCK
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, above

Floats = npt.NDArray[np.float64]

#: Trials that count as early, and as late.
EARLY, LATE = 200, 500
# Depths whose crossings are compared.
_DEPTHS = (2, 3, 4)
#: Blocks that a crossing is smoothed over.
_SMOOTH = 5


def verdicts(table: pd.DataFrame) -> list[Verdict]:
    """Return the verdicts on all claims whose conditions are in the table; one row for each run of a `Plan`."""
    have = set(table["condition"])
    return [decide(table) for needs, decide in CLAIMS if have.issuperset(needs)]


def _values(table: pd.DataFrame, name: str, column: str) -> Floats:
    return np.asarray(table[table["condition"] == name].sort_values("replicate")[column], float)


def _curves(table: pd.DataFrame, name: str) -> Floats:
    """Return the learning curves of a condition, shape (runs, blocks)."""
    curves = table[table["condition"] == name].sort_values("replicate")["curve"].tolist()
    return np.array([np.asarray(curve, float) for curve in curves])


def gains(table: pd.DataFrame, base: str, other: str) -> Floats:
    """Return how many steps a trial is shorter with `other` than with `base`, by run and block of trials."""
    one, two = _curves(table, base), _curves(table, other)
    blocks = min(one.shape[1], two.shape[1])
    return np.asarray(one[:, :blocks] - two[:, :blocks])


def crossing(gain: Floats) -> float:
    """Return the trial at which a smoothed gain becomes positive for good; infinite if it ends below 0."""
    smooth = np.convolve(gain, np.full(_SMOOTH, 1.0 / _SMOOTH), "valid")
    below = np.flatnonzero(smooth <= 0.0)
    if not len(below):
        return 0.0
    last = int(below[-1]) + 1
    return math.inf if last == len(smooth) else float(BLOCK * (last + _SMOOTH // 2))


def _above(interval: Interval, unit: str = "steps") -> tuple[str, str]:
    """Return what was measured, in words, and whether it is above 0."""
    mean, low, high = interval
    return f"{mean:+.1f} ({low:+.1f} to {high:+.1f}) {unit}".replace("-", "−"), above(interval)


def _fewer_steps(worse: str, better: str, phase: str, source: str, claim: str) -> tuple[Sequence[str], Decide]:
    """A claim that one condition needs fewer steps than another in a phase; runs of one number are paired."""

    def decide(table: pd.DataFrame) -> Verdict:
        measured, verdict = _above(interval_of(_values(table, worse, phase) - _values(table, better, phase)))
        return Verdict(claim, source, f"{worse} − {better}: {measured}", verdict)

    return (worse, better), decide


def _early_and_late(depth: int) -> tuple[Sequence[str], Decide]:
    names = _joint(depth)

    def decide(table: pd.DataFrame) -> Verdict:
        gain = gains(table, *names)
        early, early_verdict = _above(interval_of(-gain[:, : EARLY // BLOCK].mean(axis=1)))
        late, late_verdict = _above(interval_of(gain[:, -LATE // BLOCK :].mean(axis=1)))
        both = {early_verdict, late_verdict}
        verdict = FAILS if FAILS in both else UNDECIDED if UNDECIDED in both else HOLDS
        claim = f"Depth {depth}: the gain from seeing the partner is negative early and positive late"
        measured = f"loss in the first {EARLY} trials {early}; gain in the last {LATE} {late}"
        return Verdict(claim, "ours", measured, verdict)

    return names, decide


def crossings(table: pd.DataFrame, depth: int) -> Floats:
    """Return the trial from which seeing the partner pays in each run at this depth.

    All depths are judged over the trials of the shortest training: the last of many noisy blocks below 0 comes later
    in a longer curve, even if nothing differs.
    """
    found = {one: gains(table, *_joint(one)) for one in _DEPTHS if set(_joint(one)) <= set(table["condition"])}
    blocks = min(gain.shape[1] for gain in found.values())
    return np.array([crossing(one) for one in found[depth][:, :blocks]])


def _joint(depth: int) -> tuple[str, str]:
    """Return the names of the conditions without and with sight of the partner at this depth."""
    suffix = "" if depth == 4 else f", depth {depth}"
    return f"2/2 joint{suffix}", f"2/2 joint passive{suffix}"


def _crossing_moves(table: pd.DataFrame) -> Verdict:
    found = {depth: crossings(table, depth) for depth in _DEPTHS}
    shown = "; ".join(f"d = {depth}: trial {_median(one)}" for depth, one in found.items())
    claim = "The crossing moves right with d: a larger table pays later"
    if not all(np.isfinite(one).all() for one in found.values()):
        return Verdict(claim, "ours", f"{shown}; some runs do not cross", UNDECIDED)
    steps = [found[3] - found[2], found[4] - found[3]]
    verdicts = [_above(interval_of(step), "trials") for step in steps]
    kinds = {verdict for _, verdict in verdicts}
    verdict = FAILS if FAILS in kinds else UNDECIDED if UNDECIDED in kinds else HOLDS
    return Verdict(claim, "ours", f"{shown}; shifts {verdicts[0][0]} and {verdicts[1][0]}", verdict)


def _median(found: Floats) -> str:
    middle = float(np.median(found))
    return f"{middle:,.0f}" if math.isfinite(middle) else "none"


def _shared_early(name: str, claim: str) -> tuple[Sequence[str], Decide]:
    def decide(table: pd.DataFrame) -> Verdict:
        gain = gains(table, "1/2 depth 4", name)[:, : EARLY // BLOCK].mean(axis=1)
        measured, verdict = _above(interval_of(gain))
        return Verdict(claim, "Tan §6.2", f"in the first {EARLY} trials {measured}", verdict)

    return ("1/2 depth 4", name), decide


def _neighbours(table: pd.DataFrame) -> Verdict:
    most = table[table["condition"] == "2/2 joint"]["neighbours"]
    claim = "Both hunters meet while they learn, so that the largest number of neighbours is N − 1 = 1"
    return Verdict(claim, "ours", f"{(most == 1).sum()} of {len(most)} runs", HOLDS if (most == 1).all() else FAILS)


_OF_CROSSINGS = tuple(
    f"2/2 joint{kind}{depth}" for kind in ("", " passive") for depth in ("", ", depth 2", ", depth 3")
)

Decide = Callable[[pd.DataFrame], Verdict]
#: The claims: the conditions that each reads, and the function that decides it.
CLAIMS: tuple[tuple[Sequence[str], Decide], ...] = (
    _fewer_steps("1/1 random", "1/1 depth 4", "training", "Tan, Table 1", "One hunter learns to capture"),
    _fewer_steps("1/1 depth 2", "1/1 scout 2", "test", "Tan, Table 2", "A scout of depth 2 shortens tests"),
    _fewer_steps("1/1 scout 2", "1/1 scout 3", "training", "Tan, Table 2", "One of depth 3 shortens training"),
    _fewer_steps("1/1 scout 3", "1/1 scout 4", "training", "Tan, Table 2", "One of depth 4 shortens it more"),
    _fewer_steps("1/2 mutual 2", "1/2 depth 2", "training", "Tan, Table 3", "At depth 2, reports slow training"),
    _fewer_steps("1/2 depth 4", "1/2 mutual 4", "training", "Tan, Table 3", "At depth 4 they shorten training"),
    _fewer_steps("1/2 depth 4", "1/2 mutual 4", "test", "Tan, Table 3", "At depth 4 they shorten tests"),
    _shared_early("1/2 averaging 10", "Averaging tables every 10 steps speeds learning up"),
    _shared_early("1/2 averaging 50", "So does averaging every 50 steps"),
    _shared_early("1/2 averaging 200", "So does averaging every 200 steps"),
    _shared_early("1/2 one table", "So does one table for both"),
    _fewer_steps("2/2 joint", "2/2 joint passive", "training", "Tan, Fig. 7", "Seeing the partner helps"),
    _fewer_steps("2/2 joint passive", "2/2 joint mutual", "training", "Tan, Fig. 7", "Mutual scouting helps more"),
    _fewer_steps("1/2 joint", "1/2 joint passive", "training", "Tan, Fig. 8", "So it does with one prey"),
    _fewer_steps("1/2 joint passive", "1/2 joint mutual", "training", "Tan, Fig. 8", "Mutual scouting helps more"),
    *map(_early_and_late, _DEPTHS),
    (_OF_CROSSINGS, _crossing_moves),
    (("2/2 joint",), _neighbours),
)
