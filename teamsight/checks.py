"""Checks of what a user gives: each error names the value, the limit and the cure."""

from __future__ import annotations

import difflib
import math
import secrets
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any


def count(name: str, value: Any, *, least: int = 1, most: int | None = None, cure: str = "") -> int:
    """Return `value` as an int of at least `least` and at most `most`.

    Raises
    ------
    TypeError
        If `value` is not a whole number.
    ValueError
        If it is outside the limits.
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        if isinstance(value, Real) and not isinstance(value, bool) and float(value).is_integer():
            value = int(float(value))
        else:
            raise TypeError(f"{name}={value!r}: must be a whole number of at least {least}")
    if value < least:
        raise ValueError(f"{name}={value}: must be at least {least}" + (f"; {cure}" if cure else ""))
    if most is not None and value > most:
        raise ValueError(f"{name}={value}: must be at most {most}")
    return int(value)


def flag(name: str, value: Any) -> bool:
    """Return `value` if it is True or False.

    Raises
    ------
    TypeError
        If it is neither.
    """
    if value is True or value is False:
        return bool(value)
    raise TypeError(f"{name}={value!r}: must be True or False")


def number(
    name: str, value: Any, *, above: float | None = None, least: float | None = None, most: float | None = None
) -> float:
    """Return `value` as a finite float within the limits.

    Raises
    ------
    TypeError
        If `value` is not a real number.
    ValueError
        If it is NaN, infinite, or outside the limits.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{name}={value!r}: must be a number")
    result = float(value)
    limits = []
    if above is not None:
        limits.append(f"above {above:g}")
    if least is not None:
        limits.append(f"at least {least:g}")
    if most is not None:
        limits.append(f"at most {most:g}")
    wrong = (
        not math.isfinite(result)
        or (above is not None and result <= above)
        or (least is not None and result < least)
        or (most is not None and result > most)
    )
    if wrong:
        raise ValueError(f"{name}={result}: must be a finite number" + (", " + " and ".join(limits) if limits else ""))
    return result


def choice(name: str, value: Any, allowed: Iterable[str]) -> str:
    """Return `value` if it is one of `allowed`; otherwise suggest the nearest.

    Raises
    ------
    ValueError
        If `value` is not among `allowed`.
    """
    names = sorted(allowed)
    if value in names:
        return str(value)
    near = difflib.get_close_matches(str(value).lower(), names, n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise ValueError(f"{name}={value!r}: unknown; {hint}known are {', '.join(names)}")


def seed(rng: Any, seed: Any) -> int:
    """Return the seed that is given under one of its two names, or a new one.

    Raises
    ------
    TypeError
        If a seed is no whole number.
    ValueError
        If one is negative, or both are given and differ.
    """
    for name, value in (("rng", rng), ("seed", seed)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, Integral)):
            raise TypeError(f"{name}={value!r}: must be a whole number of at least 0, or None for a new seed")
        if value is not None and value < 0:
            raise ValueError(f"{name}={value}: must be at least 0")
    if rng is not None and seed is not None and rng != seed:
        raise ValueError(f"rng={rng}, seed={seed}: two names for one seed; give one of them")
    given = rng if rng is not None else seed
    return secrets.randbits(53) if given is None else int(given)
