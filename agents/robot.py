"""Robots: they sense targets, and teammates as their degree of awareness allows."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body


class Robot(Body):
    """A robot of a team.

    A subclass may override `decide`, to replace the group's policy, or `step`, which is called before each step. Then
    the model makes its steps one by one.
    """

    team: ClassVar[str | None] = "robots"

    @property
    def neighbours(self) -> list[Any]:
        """The teammates within awareness range, whether or not the degree of awareness shows them."""
        relation = self._relation("teammates")
        return relation.agents_in_range(self.row) if relation else []

    @property
    def observed_targets(self) -> list[Any]:
        """The agents that it senses as "targets"."""
        return self.sensed("targets")

    @property
    def situation(self) -> npt.NDArray[np.float32]:
        """The inputs of a learner, shape (width,): 16 target sectors and what the degree of awareness adds (§8)."""
        moment = self.group.host.find_neighbours()
        return np.array(self.group.perception.situate(self.group.awareness, moment)[self.row])
