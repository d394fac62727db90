"""Claims on what awareness is worth to robots that learned their behaviour (section 8, Fig. 11)."""

from __future__ import annotations

from teamsight.analysis.paper.claims.awareness import growth, where
from teamsight.analysis.paper.claims.interface import (
    Claim,
    Tables,
    Verdict,
    above,
    average,
    gain,
    part,
    peak,
    verdict,
    within,
)
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE

_PAIR = (COOPERATIVE, COLLECTIVE)
# The gain of A-CMOMMT counts as faded below 10 of its 60 pp.
_FADED_SHARE = 1 / 6


def judge_memory(tables: Tables) -> Verdict:
    """The lazy memory holds one short exploration."""
    from teamsight.policies.lazy.lazy_q import shipped

    memory = shipped()
    team, steps, targets = (memory.settings[name] for name in ("robots", "steps", "targets"))
    exact = (len(memory), team, steps, targets) == (600, 5, 120, 10)
    return verdict(f"{len(memory)} pairs: {steps} steps × {team} robots among {targets} targets", 0.0 if exact else 2.0)


def judge_gain(tables: Tables) -> Verdict:
    """The largest gain of cooperative over collective lazy learning."""
    most = peak(gain(*(tables[name] for name in _PAIR)))
    return verdict(f"{most.value:.1f} pp at N = {most.robots}, R = {most.radius:g}", within(most.value, 25, 8))


def judge_shape(tables: Tables) -> Verdict:
    """The gain has the shape of that of the designed behaviour."""
    grid = gain(*(tables[name] for name in _PAIR))
    place, *near = where(grid)
    team, *many = growth(grid, _FADED_SHARE * peak(grid).value)
    return verdict(f"{place}; {team}", *near, *many)


def judge_hurts(tables: Tables) -> Verdict:
    """In very large arenas awareness hurts few robots slightly."""
    loss = average(part(gain(*(tables[name] for name in _PAIR)), (1, 8), (7, 9)))
    return verdict(f"{loss:+.2f} pp", above(0, loss))


def judge_below(tables: Tables) -> Verdict:
    """Learned behaviour does not reach the designed one."""
    difference = average(gain(tables[COOPERATIVE], tables["a-cmommt"]))
    return verdict(f"{difference:+.1f} pp", above(0, difference))


CLAIMS = (
    Claim(
        "memory-size",
        "§8.2",
        "the lazy memory: 120 steps × 5 robots among 10 targets, random rotation and distance",
        "600 pairs",
        "exact",
        judge_memory,
    ),
    Claim(
        "learned-gain",
        "§8.2, Fig. 11",
        "lazily learned: cooperative (32 inputs) less collective (16)",
        "up to 25 pp",
        "largest gain 25 ± 8 pp",
        judge_gain,
        _PAIR,
    ),
    Claim(
        "learned-shape",
        "§8.2, Fig. 11",
        "the gain prefers R = 2..6 and grows with N",
        "shape",
        "as awareness-where and -robots, faded when under a sixth of the largest gain (10 of 60 pp)",
        judge_shape,
        _PAIR,
    ),
    Claim(
        "learned-hurts",
        "§8.2, Fig. 11",
        "in very large arenas with few robots awareness slightly hurts",
        "slightly negative",
        "mean over N ≤ 8, R ≥ 7 below 0",
        judge_hurts,
        _PAIR,
    ),
    Claim(
        "learned-below-designed",
        "§8.2; §10 says “compared well”",
        "learning does not reach A-CMOMMT",
        "below",
        "cooperative below A-CMOMMT on the mean over the grid",
        judge_below,
        (COOPERATIVE, "a-cmommt"),
    ),
)
