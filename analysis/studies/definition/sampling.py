"""Samples of several parameters at once: Sobol sequences and Latin hypercubes."""

from __future__ import annotations

from collections.abc import Mapping

from teamsight.analysis.studies.definition.columns import columns_of
from teamsight.analysis.studies.definition.values import Table


def sample_of(given: object) -> Table | None:
    """Return the columns of a sample: those given, or those that its method draws."""
    if given is None:
        return None
    if isinstance(given, Mapping) and "method" in given:
        raise NotImplementedError("samples come later")
    return columns_of("sample", given)
