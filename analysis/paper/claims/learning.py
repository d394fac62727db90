"""Claims about the gain from awareness of policies learned from transitions (section 8, Fig. 11)."""

from __future__ import annotations

from teamsight.analysis.paper.claims.awareness import growth, where
from teamsight.analysis.paper.claims.interface import (
    Tables,
    Verdict,
    above,
    average,
    claim,
    gain,
    part,
    peak,
    verdict,
    within,
)
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE

_BOTH = (COOPERATIVE, COLLECTIVE)
# The gain of A-CMOMMT counts as faded below 10 of its 60 pp.
_FADED_SHARE = 1 / 6


@claim(
    where="§8.2",
    statement="the lazy memory: 120 steps × 5 robots among 10 targets, random rotation and distance",
    figure="600 transitions",
    rule="exact",
)
def memory_size(tables: Tables) -> Verdict:
    from teamsight.policies.lazy.lazy_q import shipped

    memory = shipped()
    team, steps, targets = (memory.settings[name] for name in ("robots", "steps", "targets"))
    exact = (len(memory), team, steps, targets) == (600, 5, 120, 10)
    measured = f"{len(memory)} transitions: {steps} steps × {team} robots among {targets} targets"
    return verdict(measured, 0.0 if exact else 2.0)


@claim(
    where="§8.2, Fig. 11",
    statement="lazy learning: cooperative (32 inputs) minus collective (16)",
    figure="up to 25 pp",
    rule="largest gain 25 ± 8 pp",
    needs=_BOTH,
)
def learned_gain(tables: Tables) -> Verdict:
    most = peak(gain(*(tables[name] for name in _BOTH)))
    return verdict(f"{most.value:.1f} pp at N = {most.robots}, R = {most.radius:g}", within(most.value, 25, 8))


@claim(
    where="§8.2, Fig. 11",
    statement="the gain is largest for R = 2..6 and grows with N",
    figure="shape",
    rule="as awareness-where and awareness-robots, with a sixth of the largest gain in place of 10 pp",
    needs=_BOTH,
)
def learned_shape(tables: Tables) -> Verdict:
    grid = gain(*(tables[name] for name in _BOTH))
    place, *near = where(grid)
    team, *many = growth(grid, _FADED_SHARE * peak(grid).value)
    return verdict(f"{place}; {team}", *near, *many)


@claim(
    where="§8.2, Fig. 11",
    statement="in very large arenas with few robots awareness slightly hurts",
    figure="slightly negative",
    rule="mean over N ≤ 8, R ≥ 7 below 0",
    needs=_BOTH,
)
def learned_hurts(tables: Tables) -> Verdict:
    loss = average(part(gain(*(tables[name] for name in _BOTH)), (1, 8), (7, 9)))
    return verdict(f"{loss:+.2f} pp", above(0, loss))


@claim(
    where="§8.2; §10 says “compared well”",
    statement="learning does not reach A-CMOMMT",
    figure="below",
    rule="cooperative minus A-CMOMMT: mean over the grid below 0",
    needs=(COOPERATIVE, "a-cmommt"),
)
def learned_below_designed(tables: Tables) -> Verdict:
    difference = average(gain(tables[COOPERATIVE], tables["a-cmommt"]))
    return verdict(f"{difference:+.1f} pp", above(0, difference))
