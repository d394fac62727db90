"""A measure of runs: what is observed, how evenly over the targets, and by how many robots."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from teamsight.analysis.runs.run_many import summary

if TYPE_CHECKING:
    from teamsight.agents.world import World


class Evenness(NamedTuple):
    """The columns of `evenness`: those of the summary, and three more.

    Attributes
    ----------
    observed_fraction, max_neighbours, mean_neighbours
        As in the summary of `run_many`.
    spread : float
        Standard deviation over the targets of the share of its steps in which each is observed; 0 if it is the same.
    entropy : float
        Entropy of the targets' shares of all observation [nat]: at most the logarithm of their number.
    redundancy : float
        Mean number of robots that sense an observed target, at least 1.
    """

    observed_fraction: float
    spread: float
    entropy: float
    redundancy: float
    max_neighbours: int
    mean_neighbours: float


def evenness(world: World, steps: int) -> Evenness:
    """Run a world and return its `Evenness`: a measure for `run_many`, and "evenness" for studies.

    Parameters
    ----------
    world : World
        The world; it counts observations during these steps only, unless it counts them already.
    steps : int
        The number of steps.
    """
    before = world.sources
    counts = world.count_observations()
    found = summary(world, steps)
    measured = Evenness(
        found.observed_fraction, counts.spread, counts.entropy, counts.redundancy, found.max_neighbours,
        found.mean_neighbours,
    )  # fmt: skip
    if not any(counts is source for source in before):
        # So that the next run can use the world again.
        world.detach(counts)
    return measured
