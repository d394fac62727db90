"""How evenly the targets of a world are observed, and by how many robots: numbers of a world that counts it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from teamsight.agents.events.observation_counts import ObservationCounts
    from teamsight.agents.model import World


def spread(world: World) -> float:
    """Return the standard deviation over the targets of the observed share of each; see `ObservationCounts.spread`.

    Raises
    ------
    ValueError
        If the world does not count observations.
    """
    return _counts(world, "spread").spread


def entropy(world: World) -> float:
    """Return the entropy of the targets' shares of all observation [nat]; see `ObservationCounts.entropy`.

    Raises
    ------
    ValueError
        If the world does not count observations.
    """
    return _counts(world, "entropy").entropy


def redundancy(world: World) -> float:
    """Return the mean number of robots that sense an observed target; see `ObservationCounts.redundancy`.

    Raises
    ------
    ValueError
        If the world does not count observations.
    """
    return _counts(world, "redundancy").redundancy


def _counts(world: World, name: str) -> ObservationCounts:
    from teamsight.agents.events.observation_counts import ObservationCounts

    for source in world.sources:
        if isinstance(source, ObservationCounts):
            return source
    raise ValueError(
        f"{name}({type(world).__name__}): the world does not count how often each target is observed; call "
        "world.count_observations() before the run"
    )
