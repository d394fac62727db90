"""Seeds: every root seed that ships, but the default 0, in one table, and the seed of each world derived from a root.

A root at or above 0 may also be given by a user. Roots below 0 are refused by every command, so that the ledger and a
user's experiments never meet the worlds on which a constant was chosen.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any, Literal, get_args

#: Roots by purpose; no root serves two purposes.
ROOTS: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "reproduce": (2000,),
        "learning curves": (9000,),
        "unreliable": (2100,),
        "hops": (2200,),
        "ceilings": (2300,),
        "pursuit": (1993,),
        "pursuit: readings": (1998,),
        "surround": (1996,),
        "foraging": (1994,),
        "foraging: loads": (1995,),
        "pushing": (1992,),
        "collecting": (1997,),
        "calibration: screen": (-101,),
        "calibration: final": (-102, -103, -104),
        "calibration: report": (-105, -106),
        "figure 11: explore": (-41,),
        "learning: report": (-42,),
        "closed form: report": (-61,),
        "lost targets: report": (-62,),
        "evolution: train": (-21,),
        "evolution: validate": (-22,),
        "evolution: screen": (-23,),
        "evolution: first test": (-24,),
        "evolution: test": (-25,),
        "evolution: generalise": (-26,),
        "evolution: train further": (-27,),
        "evolution: adaptive forces": (-28,),
        "designed feature": (-51,),
        "pursuit: constants": (-71,),
        "toward the evolved policy": (-43,),
        "imagination": (-44,),
        "imagination: report": (-45,),
        "imagination: parts": (-46,),
        "benchmark: report": (-31,),
        "benchmark: explore": (-32,),
        "benchmark: screen": (-33,),
    }
)


def root(purpose: str) -> int:
    """Return the root of a purpose that has only one; raise ValueError if it has none."""
    if purpose not in ROOTS:
        raise ValueError(f"root={purpose!r}: has no seed; add it to ROOTS in teamsight/analysis/runs/seeds.py")
    (only,) = ROOTS[purpose]
    return only


def canonical(value: Any) -> str:
    """Return one text for equal values of any type: 2, 2.0 and NumPy's 2 give the same.

    Whole numbers are written as integers, other numbers exactly in hexadecimal, mappings in the order of their keys,
    lists item by item, everything else by ``repr``.
    """
    # The usual types first: a reproduction converts a million values, and checks against abstract classes are slow.
    kind = type(value)
    if kind is int:
        return str(value)
    if kind is str or kind is bool:
        return repr(value)
    if kind is not float:
        if isinstance(value, Mapping):
            return "{" + ", ".join(f"{name}={canonical(value[name])}" for name in sorted(value)) + "}"
        if kind is list:
            return "[" + ", ".join(map(canonical, value)) + "]"
        if not isinstance(value, Real):
            return repr(value)
        value = int(value) if isinstance(value, Integral) else float(value)
    return value.hex() if isinstance(value, float) and not value.is_integer() else str(int(value))


def model_seed(root: int, replicate: int, robots: int, targets: int, radius: float) -> int:
    """Return the seed of one world, 0 to 2**53 - 1, derived from its scenario.

    The policy, the degree of awareness, ranges and speeds do not enter. Two treatments of one scenario therefore get
    the same placement and the same target noise, and their difference is paired.

    Parameters
    ----------
    root : int
        Root seed of the experiment.
    replicate : int
        Number of the repetition, from 0 upwards. Explorations count from −1 downwards, so that no world is both
        explored and evaluated.
    robots, targets : int
        Numbers of robots and of targets.
    radius : float
        Radius of the arena [length].
    """
    return seeds_of(root, {"robots": robots, "targets": targets, "radius": radius}, is_cmommt=True)(replicate)


def run_seed(root: int, run: int) -> int:
    """Return the seed of one run of a model whose scenario is unknown, 0 to 2**63 - 1.

    Parameters
    ----------
    root : int
        Root seed of the exploration.
    run : int
        Number of the run.
    """
    return seeds_of(root, {}, is_cmommt=False)(run)


#: Which values of a setting enter its seeds: those of its scenario, so that treatments are paired, or all.
Pairing = Literal["scenario", "none"]
PAIRINGS: tuple[Pairing, ...] = get_args(Pairing)
# The parameters of `CMOMMT` that make its scenario.
_SCENARIO = ("robots", "targets", "radius")
# Of a seed: so many survive the conversion to float that mixed tables and JSON make.
_BITS = 53


def seeds_of(
    root: int, setting: Mapping[str, object], is_cmommt: bool, pairing: Pairing = "scenario"
) -> Callable[[int], int]:
    """Return the function that returns the seed of a replicate of a setting; `run_many` and studies use the same.

    Parameters
    ----------
    root : int
        Root seed.
    setting : mapping
        Parameters of the model.
    is_cmommt : bool
        Whether the model is `CMOMMT`, whose scenario is known: robots, targets and radius. All settings of another
        model get the same seeds.
    pairing : "scenario" or "none"
        With "none" all values of the setting enter, so that the runs of two settings are independent.
    """
    rest, person, bits = "", b"teamsight-delta", 63
    if pairing == "none":
        rest, person, bits = f";setting={canonical(setting)}", b"teamsight-study", _BITS
    elif is_cmommt:
        if any(name not in setting for name in _SCENARIO):
            from teamsight.agents.cmommt import DEFAULTS

            setting = {**DEFAULTS, **setting}
        rest = "".join(f";{name}={canonical(setting[name])}" for name in _SCENARIO)
        person, bits = b"teamsight-stage", _BITS
    # Once for all replicates, since a study makes a seed for each run. The text and the personalisation decide every
    # published number: they must not change.
    begun = hashlib.blake2b(f"root={canonical(root)};replicate=".encode(), digest_size=8, person=person)

    def seed(replicate: int) -> int:
        digest = begun.copy()
        digest.update(f"{canonical(replicate)}{rest}".encode())
        return int.from_bytes(digest.digest(), "big") >> 64 - bits

    return seed
