"""Every claim by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from teamsight.analysis.paper.claims import awareness, formulas, learned, neighbours, performance
from teamsight.analysis.paper.claims.interface import Claim, Tables, Verdict

#: Every claim, in the order of the paper.
CLAIMS: Mapping[str, Claim] = MappingProxyType(
    {
        "degrees": formulas.degrees,
        "neighbours-random": neighbours.neighbours_random,
        "neighbours-small-arena": neighbours.neighbours_small_arena,
        "neighbours-acmommt": neighbours.neighbours_acmommt,
        "neighbours-same-peak": neighbours.neighbours_same_peak,
        "neighbours-targets": neighbours.neighbours_targets,
        "neighbours-evasive": neighbours.neighbours_evasive,
        "collective-drop": performance.collective_drop,
        "collective-large": performance.collective_large,
        "collective-flat": performance.collective_flat,
        "small-arena-policy": performance.small_arena_policy,
        "acmommt-monotonic": performance.acmommt_monotonic,
        "acmommt-full": performance.acmommt_full,
        "acmommt-saturates": performance.acmommt_saturates,
        "acmommt-r10": performance.acmommt_r10,
        "stationary-r10": performance.stationary_r10,
        "awareness-gain": awareness.awareness_gain,
        "awareness-where": awareness.awareness_where,
        "awareness-robots": awareness.awareness_robots,
        "repulsion": formulas.repulsion,
        "range-gain": awareness.range_gain,
        "range-neighbours": awareness.range_neighbours,
        "delta-sufficient": awareness.delta_sufficient,
        "memory-size": learned.memory_size,
        "learned-gain": learned.learned_gain,
        "learned-shape": learned.learned_shape,
        "learned-hurts": learned.learned_hurts,
        "learned-below-designed": learned.learned_below_designed,
    }
)


def needed(claims: Mapping[str, Claim] = CLAIMS, *, beside: bool = True) -> set[str]:
    """Return the names of the experiments that the claims read.

    Parameters
    ----------
    claims : mapping of str to Claim
        Which claims.
    beside : bool
        Include the experiments that decide nothing and are reported beside.
    """
    return set().union(*(claim.reads(beside=beside) for claim in claims.values()))


def judge(tables: Tables, claims: Mapping[str, Claim] = CLAIMS, *, beside: bool = False) -> dict[str, Verdict]:
    """Return the verdict on each claim by its name.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        The tables of all experiments that the claims read, one row a run, by name of the experiment.
    claims : mapping of str to Claim
        Which claims.
    beside : bool
        Also report what decides nothing; see `Claim.judge`.
    """
    return {name: claim.judge(tables, beside=beside) for name, claim in claims.items()}
