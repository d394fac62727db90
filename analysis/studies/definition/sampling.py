"""Samples of several parameters at once: Sobol sequences and Latin hypercubes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition import keys
from teamsight.analysis.studies.definition.axes import MOST_SETTINGS, check_ends, check_log
from teamsight.analysis.studies.definition.columns import columns_of
from teamsight.analysis.studies.definition.values import Table
from teamsight.core import checks

# Parameters of a sample: scipy has direction numbers for more, but nobody such a model.
_MOST_AXES = 1000


class _Axis(NamedTuple):
    low: float
    high: float
    is_log: bool
    is_integer: bool


def sample_of(given: object) -> Table | None:
    """Return the columns of a sample: those given, or those that its method draws.

    Parameters
    ----------
    given : mapping, optional
        ``method``, ``count``, ``seed`` (0 by default) and ``axes``, of which each has ``from`` and ``to``, and may have
        ``scale`` and ``integer``; or the columns themselves.

    Raises
    ------
    TypeError, ValueError
        If a key or a value is wrong.
    """
    if given is None:
        return None
    if not isinstance(given, Mapping):
        raise TypeError(f"sample={checks.shown(given)}: must be a table with method, count and axes")
    if given and all(isinstance(one, (list, tuple, np.ndarray)) for one in given.values()):
        return columns_of("sample", given)
    for key in given:
        checks.choice("sample: key", key, keys.SAMPLE)
    for key in ("method", "count", "axes"):
        if key not in given:
            raise ValueError(f"sample: has no {key!r}; give method, count and axes")
    method = checks.choice("sample.method", given["method"], keys.METHODS)
    cure = "give fewer" if isinstance(given["count"], int) and given["count"] > 0 else "remove the sample"
    count = checks.count("sample.count", given["count"], most=MOST_SETTINGS, cure=cure)
    seed = checks.count("sample.seed", given.get("seed", 0), least=0, most=checks.MOST_SEED)
    axes = _axes(given["axes"])
    unit = _sobol(len(axes), count, seed) if method == "sobol" else _latin_hypercube(len(axes), count, seed)
    columns = {name: _scaled(unit[:, i], axis) for i, (name, axis) in enumerate(axes.items())}
    distinct = max(len(set(column)) for column in columns.values())
    if distinct < count:
        distinct = len(set(zip(*columns.values(), strict=True)))
    if distinct < count:
        raise ValueError(
            f"sample.count={count}: gives only {distinct} different settings, because axes are integer; give fewer, or "
            "wider axes"
        )
    return columns_of("sample", columns)


def _axes(given: object) -> dict[str, _Axis]:
    if not isinstance(given, Mapping) or not given:
        raise TypeError(f"sample.axes={checks.shown(given)}: must be a table of axes, as radius = {{from = 2, to = 9}}")
    if len(given) > _MOST_AXES:
        raise ValueError(f"sample.axes: has {len(given)} axes, at most {_MOST_AXES}; give fewer")
    axes = {}
    for name, table in given.items():
        where = f"sample.axes.{name}"
        if not isinstance(table, Mapping):
            raise TypeError(f"{where}={checks.shown(table)}: must be a table such as {{from = 2, to = 9}}")
        for key in table:
            checks.choice(f"{where}: key", key, keys.SAMPLE_AXIS)
        low, high = check_ends(where, table)
        is_log = checks.choice(f"{where}.scale", table.get("scale", "linear"), keys.SCALES) == "log"
        is_integer = checks.flag(f"{where}.integer", table.get("integer", False))
        if is_integer and not (isinstance(low, int) and isinstance(high, int)):
            raise ValueError(f"{where}: from={low} and to={high} must be whole numbers if integer = true; round them")
        if is_log:
            check_log(where, low)
        axes[str(name)] = _Axis(low, high, is_log, is_integer)
    return axes


def _sobol(axes: int, count: int, seed: int) -> NDArray[np.float64]:
    if count & (count - 1):
        below = 1 << (count.bit_length() - 1)
        raise ValueError(f"sample.count={count}: must be a power of 2 for method 'sobol'; give {below} or {2 * below}")
    from scipy.stats import qmc

    return _drawn(qmc.Sobol, axes, count, seed)


def _latin_hypercube(axes: int, count: int, seed: int) -> NDArray[np.float64]:
    from scipy.stats import qmc

    return _drawn(qmc.LatinHypercube, axes, count, seed)


def _drawn(kind: Any, axes: int, count: int, seed: int) -> NDArray[np.float64]:
    """Return points of the unit cube, (count, axes)."""
    generator = np.random.default_rng(seed)
    try:
        engine = kind(axes, rng=generator)
    except TypeError:  # before scipy 1.15
        engine = kind(axes, seed=generator)
    return np.asarray(engine.random(count), np.float64)


def _scaled(unit: NDArray[np.float64], axis: _Axis) -> list[float] | list[int]:
    low, high = axis.low, axis.high + (1 if axis.is_integer else 0)
    if axis.is_log:
        logarithms = math.log(low) + (math.log(high) - math.log(low)) * unit
        # Logarithms differ in the last digits between machines; the settings, and so their ids, must not.
        values = np.array([float(f"{value:.12g}") for value in np.exp(logarithms).tolist()])
    else:
        values = low + (high - low) * unit
    if axis.is_integer:
        whole: list[int] = np.clip(np.floor(values), axis.low, axis.high).astype(np.int64).tolist()
        return whole
    found: list[float] = np.clip(values, axis.low, axis.high).tolist()
    return found
