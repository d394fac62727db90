"""Checks of a user's values: each error names the value, the limit and the cure."""

from __future__ import annotations

import difflib
import math
import re
import secrets
from collections.abc import Iterable, Mapping
from decimal import Decimal
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any

#: Seeds are kept as 64-bit integers.
MOST_SEED = 2**63 - 1

# Of drawn seeds: whole numbers of a page's script are exact up to there.
_BITS_OF_SEED = 53
_MOST_SHOWN = 60
# Python refuses to write a larger integer in decimal: it takes quadratic time.
_MOST_BITS = 256
_ANY_NUMBER: Any = (Real, Decimal)
# What an error has for those who write Python or commands. Texts in quotes stay as they are; an example of code follows
# ", as in"; a value that `shown` has cut says nothing without its end.
_NESTED = r"\((?:[^()]|\([^()]*\))*\)"
_OF_CODE = re.compile(
    rf"""
    (?<!\w)(?P<text>'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")(?!\w)
    |(?P<left_out>,\ as\ in\ (?:{_NESTED}|[^,;()])+|\ \(--[^)]*\))
    |(?<![\w.-])(?P<cut>[a-z_][\w.]*)=(?!['"])[^…]{{0,{_MOST_SHOWN}}}…(?=:\ )
    |(?<![\w.-])(?P<given>[a-z_][\w.]*)=(?=\S)
    |(?<![\w./-])(?P<bare>[a-z]\w*(?:\.\w+)?)(?![\w/(-]|\.\w)
    |\b(?P<made>[A-Z]\w*)\((?=\w+=)
    |\)\.(?P<method>\w+)\(
    |<(?P<agent>[A-Z][^<>]*)>
    """,
    re.VERBOSE,
)


def shown(value: Any, most: int = _MOST_SHOWN) -> str:
    """Return a value as errors show it: its `repr`, but on one line of at most `most` characters.

    Parameters
    ----------
    value : Any
        Anything, even a number that Python refuses to write, or an object whose `repr` fails.
    most : int
        The longest text.
    """
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > _MOST_BITS:
        return f"{'-' if value < 0 else ''}(about 10^{int(value.bit_length() * math.log10(2))})"
    if isinstance(value, str | bytes) and len(value) > most:
        # Not the repr of all of it, which may be gigabytes.
        return f"{value[: most // 2]!r}… ({len(value)} characters)"
    try:
        text = " ".join(repr(value).split())
    except Exception:  # whatever the object of a user raises
        return f"({type(value).__name__})"
    return text if len(text) <= most else f"{text[: most - 1]}…"


def in_words(error: str, labels: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return an error as people read it who have not written the arguments that it names.

    Errors of teamsight write what was given as Python does: ``sensing_range=-1``, ``Disc(radius=5.0)``.

    Parameters
    ----------
    error : str
        The error.
    labels : mapping of str to str
        What they read in place of the name of an argument; by default the name, with spaces.
    """

    def word(found: re.Match[str]) -> str:
        kind, text = str(found.lastgroup), found[str(found.lastgroup)]
        spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text.replace("_", " "))
        return {
            "text": found[0], "left_out": "", "cut": labels.get(text, spaced), "agent": text,
            "given": f"{labels.get(text, spaced)} ", "made": f"{spaced.lower()} (", "method": f") {spaced} (",
            # A word of the sentence may be called like an argument.
            "bare": labels.get(text, text) if "_" in text or "." in text else text,
        }[kind]  # fmt: skip

    return _OF_CODE.sub(word, error)


def count(name: str, value: Any, *, least: int = 1, most: int | None = None, cure: str = "") -> int:
    """Return `value` as an int of at least `least` and at most `most`.

    Parameters
    ----------
    name : str
        The name used in errors.
    value : Any
        A whole number of any type.
    least, most : int
        The limits.
    cure : str
        The cure named by the error, if the value is outside the limits.

    Raises
    ------
    TypeError
        If `value` is not a whole number.
    ValueError
        If it is outside the limits.
    """
    found = value if type(value) is int else _whole(value)
    if found is None:
        raise TypeError(f"{name}={shown(value)}: must be a whole number of at least {least}")
    if found < least:
        raise ValueError(f"{name}={shown(found)}: must be at least {least}" + (f"; {cure}" if cure else ""))
    if most is not None and found > most:
        raise ValueError(f"{name}={shown(found)}: must be at most {most}" + (f"; {cure}" if cure else ""))
    return found


def _whole(value: Any) -> int | None:
    """Return a whole number as an int, None for anything else."""
    if isinstance(value, bool) or not isinstance(value, _ANY_NUMBER):
        return None
    if isinstance(value, Integral):
        return int(value)
    try:
        # The integer of a Decimal may have a million digits.
        if not math.isfinite(float(value)):
            return None
        found = int(value)
        return found if found == value else None
    except (ArithmeticError, ValueError):  # NaN and infinity
        return None


def flag(name: str, value: Any) -> bool:
    """Return `value` if it is True or False.

    Raises
    ------
    TypeError
        If it is neither.
    """
    if value is True or value is False:
        return bool(value)
    raise TypeError(f"{name}={shown(value)}: must be True or False")


def number(
    name: str,
    value: Any,
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    cure: str = "",
) -> float:
    """Return `value` as a finite float within the limits.

    Parameters
    ----------
    name : str
        The name used in errors.
    value : Any
        A real number of any type.
    above, least, most : float, optional
        The limits; the value must exceed `above`.
    cure : str
        The cure named by the error, if the value is outside the limits.

    Raises
    ------
    TypeError
        If `value` is not a real number.
    ValueError
        If it is NaN, infinite, too large for a float, or outside the limits.
    """
    if isinstance(value, bool) or not isinstance(value, _ANY_NUMBER):
        raise TypeError(f"{name}={shown(value)}: must be a number")
    try:
        result = float(value)
    except (ArithmeticError, ValueError):  # larger than any float, or a NaN that signals
        result = math.nan
    wrong = (
        not math.isfinite(result)
        or (above is not None and result <= above)
        or (least is not None and result < least)
        or (most is not None and result > most)
    )
    if wrong:
        named = {"above": above, "at least": least, "at most": most}
        limits = [f"{words} {limit:g}" for words, limit in named.items() if limit is not None]
        given = f"{result}" if math.isfinite(result) or isinstance(value, float) else shown(value)
        bounds = ", " + " and ".join(limits) if limits else ""
        raise ValueError(f"{name}={given}: must be a finite number{bounds}" + (f"; {cure}" if cure else ""))
    return result


def angle(name: str, value: Any, most: float) -> float:
    """Return an angle [rad] from 0 to `most`; suggest radians for one that must be in degrees.

    Parameters
    ----------
    name : str
        The name used in errors.
    value : Any
        A real number of any type.
    most : float
        The limit: π or 2π.

    Raises
    ------
    TypeError
        If `value` is not a real number.
    ValueError
        If it is not finite, or outside the limits.
    """
    given = number(name, value, least=0)
    if given > most:
        limit = "2π" if most > 4 else "π"
        raise ValueError(
            f"{name}={given:g}: must be at most {limit} [rad]; for degrees use math.radians({min(given, 360):g})"
        )
    return given


def choice(name: str, value: Any, allowed: Iterable[str]) -> str:
    """Return `value` if it is one of `allowed`; otherwise suggest the nearest.

    Parameters
    ----------
    name : str
        The name used in errors.
    value : Any
        The value.
    allowed : iterable of str
        The allowed values; of a registry also the names of plug-ins.

    Raises
    ------
    ValueError
        If `value` is not among `allowed`.
    """
    names = tuple(allowed)
    if isinstance(value, str) and (value in names or (isinstance(allowed, Mapping) and value in allowed)):
        return str(value)
    plug_ins = getattr(allowed, "plug_ins", tuple)
    # Numbers in names by their value: 2 before 10.
    parts = lambda name: [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)]  # noqa: E731
    names = tuple(sorted({*names, *plug_ins()}, key=parts))
    raise ValueError(f"{name}={shown(value)}: unknown; {suggestion(value, names)}known are {', '.join(names)}")


def suggestion(value: Any, names: Iterable[str]) -> str:
    """Return ``"did you mean …? "`` with the name nearest to `value`; empty if none is near.

    Parameters
    ----------
    value : Any
        The value.
    names : iterable of str
        The allowed names.
    """
    # `shown` cuts long values, which would take long to compare.
    near = difflib.get_close_matches(shown(value).strip("'\"").lower(), list(names), n=1, cutoff=0.4)
    return f"did you mean {near[0]!r}? " if near else ""


def other_format(what: Any, found: Any, known: Any, version: Any) -> str:
    """Return the error for a file of another format than the one that is read.

    Parameters
    ----------
    what : object
        The file, or what it holds.
    found, known : object
        The number of its format, and of the one that is read.
    version : object
        The version of teamsight that wrote it; None if that is unknown.
    """
    wrote = f"teamsight {version}" if version else "another version of teamsight"
    return (
        f"{what}: was written by {wrote} in format {shown(found)}, and this one reads format {known} only; use that "
        "version, or make it again"
    )


def seed(rng: Any, seed: Any) -> int:
    """Return the seed given under one of its two names, or a new one.

    Parameters
    ----------
    rng, seed : int, array_like of int, SeedSequence, BitGenerator, Generator or None
        The two names. From anything but a whole number the seed is drawn, by ``numpy.random.default_rng``.

    Raises
    ------
    TypeError
        If NumPy can draw none from a value.
    ValueError
        If one is negative, or both are given and differ.
    """
    given = [(name, value) for name, value in (("rng", rng), ("seed", seed)) if value is not None]
    if len(given) == 2 and rng is not seed and not (_is_whole(rng) and _is_whole(seed) and rng == seed):
        raise ValueError(f"rng={shown(rng)}, seed={shown(seed)}: two names for one seed; give one of them")
    for name, value in given:
        if not _is_whole(value):
            return _drawn(name, value)
        if value < 0:
            raise ValueError(f"{name}={shown(value)}: must be at least 0")
        return int(value)
    return secrets.randbits(_BITS_OF_SEED)


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _drawn(name: str, value: Any) -> int:
    """Return a seed drawn from one of the kinds of SPEC 7."""
    import numpy as np

    try:
        # Without this, NumPy takes flags for numbers.
        if np.asarray(value).dtype == np.bool_:
            raise TypeError
        return int(np.random.default_rng(value).integers(2**_BITS_OF_SEED))
    except Exception:
        raise TypeError(
            f"{name}={shown(value)}: must be a whole number of at least 0, several, a SeedSequence, "
            "BitGenerator or Generator of numpy.random, or None"
        ) from None
