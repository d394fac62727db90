"""What is evolved, and how. Nothing slow is imported here, so that the help of a command answers at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from teamsight.core.component import Allowed, Component, Seed

#: More candidates or generations than can be computed.
MOST = 100_000


@dataclass(frozen=True)
class Evolution(Component):
    """Parameters of an evolution of a policy.

    Parameters
    ----------
    population : int
        Number of candidates in each generation.
    spread : float
        Standard deviation of the first generation, in units of those that the policy declares for its constants.
    seed : int
        Seed of the candidates and of the initial hidden neurons.
    start : tuple of float
        Constants with which to begin; by default those that the policy declares.
    policy : str
        The policy whose constants are sought.
    """

    population: Annotated[int, Allowed(least=2, most=MOST)] = 40
    spread: Annotated[float, Allowed(least=1e-6, most=10)] = 0.07
    seed: Seed = 1
    start: tuple[float, ...] = ()
    policy: Literal["adaptive-forces", "evolved", "group-forces"] = "evolved"
