"""The facts of a step, from which rewards are computed."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks

Floats = npt.NDArray[np.float64]

#: What is known of each robot, in the order of the columns that the kernel writes.
OF_ROBOTS = (
    "sensed", "gained", "lost", "alone", "alone_gained", "alone_lost", "team_sensed", "team_gained", "team_lost",
    "share", "neighbours", "travelled", "active", "reward", "ended",
)  # fmt: skip
#: What is known of each world.
OF_WORLDS = ("observed", "targets", "neighbours_in_all", "max_neighbours", "robots")


class Facts:
    """What has happened in a step, robot by robot, in one or more worlds.

    All are float64 arrays that cannot be written to; those of robots have the shape (worlds, robots), those of worlds
    (worlds, 1), so that both can be combined. They hold until the next step.

    Attributes
    ----------
    sensed : ndarray, shape (worlds, robots)
        The number of targets that each robot senses.
    gained, lost : ndarray, shape (worlds, robots)
        Of these, those that it did not sense before the step; and those that it senses no longer. Both are 0 after a
        step in which bodies came or left.
    alone, alone_gained, alone_lost : ndarray, shape (worlds, robots)
        The same for targets that the robot senses and no teammate does.
    team_sensed, team_gained, team_lost : ndarray, shape (worlds, robots)
        The same for targets that at least one robot of the team senses; equal for all robots.
    share : ndarray, shape (worlds, robots)
        Each robot's share of the targets that the team senses: a target sensed by k robots counts 1/k for each.
    neighbours : ndarray, shape (worlds, robots)
        The number of teammates within its awareness range.
    travelled : ndarray, shape (worlds, robots)
        The length of its way in this step, as a share of its speed, in [0, 1].
    active : ndarray, shape (worlds, robots)
        1, or 0 for a robot that is inactive: one that has failed or has no energy.
    reward : ndarray, shape (worlds, robots)
        What interactions gave each robot in the step; 0 in worlds without an interaction.
    ended : ndarray, shape (worlds, robots)
        1 if an interaction ended a trial for the robot, else 0.
    observed : ndarray, shape (worlds, 1)
        The number of targets that are observed.
    targets : ndarray, shape (worlds, 1)
        The number of active targets.
    neighbours_in_all, max_neighbours : ndarray, shape (worlds, 1)
        The sum of the numbers of neighbours of all teams, and the largest of them.
    robots : ndarray, shape (worlds, 1)
        The number of active robots of all teams.
    teammates : ndarray, shape (worlds, 1)
        The number of teammates of a robot, in range or not, at the start of the episode.
    mean_neighbours : ndarray, shape (worlds, 1)
        The mean number of neighbours of active robots; 0 without robots.
    observed_fraction : ndarray, shape (worlds, 1)
        The share of targets that are observed; 0 without targets.
    """

    sensed: Floats
    gained: Floats
    lost: Floats
    alone: Floats
    alone_gained: Floats
    alone_lost: Floats
    team_sensed: Floats
    team_gained: Floats
    team_lost: Floats
    share: Floats
    neighbours: Floats
    travelled: Floats
    active: Floats
    reward: Floats
    ended: Floats
    observed: Floats
    targets: Floats
    neighbours_in_all: Floats
    max_neighbours: Floats
    robots: Floats
    teammates: Floats

    def __init__(self, robots: Floats, worlds: Floats, teammates: Floats) -> None:
        """Show arrays of shape (worlds, robots, `OF_ROBOTS`), (worlds, `OF_WORLDS`) and (worlds, 1)."""
        others = teammates[..., np.newaxis]
        for names, array in ((OF_ROBOTS, robots), (OF_WORLDS, worlds[:, np.newaxis]), (("teammates",), others)):
            shown = array.view()
            shown.flags.writeable = False
            for column, name in enumerate(names):
                setattr(self, name, shown[..., column])

    @property
    def observed_fraction(self) -> Floats:
        return np.asarray(self.observed / np.maximum(self.targets, 1.0))

    @property
    def mean_neighbours(self) -> Floats:
        return np.asarray(self.neighbours_in_all / np.maximum(self.robots, 1.0))

    def fact(self, name: str) -> Floats:
        """Return a fact by its name, as `LazyMemory.fact` does, so that the rewards of learners read facts too.

        Raises
        ------
        ValueError
            If there is no such fact.
        """
        value: Any = getattr(self, checks.choice("name", name, (*OF_ROBOTS, *OF_WORLDS)))
        return np.asarray(value)
