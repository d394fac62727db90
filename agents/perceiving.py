"""What the robots of a group perceive: neighbours in each channel, the percept, and the noise of their policy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS, TEAMMATES, Channel
from teamsight.agents.decisions.deciding import Deciding
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.policies.channels import OWN_FIELDS, channels_of
from teamsight.policies.columns import columns_of
from teamsight.policies.interface import Percept
from teamsight.world.noise import TICKS_A_BLOCK

if TYPE_CHECKING:
    from teamsight.agents.awareness.binding import Perception
    from teamsight.agents.engine.relation import Relation
    from teamsight.world.bodies import Bodies

Floats = npt.NDArray[np.float64]


class Perceiving(Deciding):
    """What a group says of its perception; `Group` derives from it.

    Attributes
    ----------
    channels : dict of str to Channel
        What the group senses, by name; `World.senses` declares it.
    perceived_columns : dict of str to ndarray, shape (identities,), float64
        The columns that its policies read, by identity; empty for a function of one robot in a world without any.
    numbers : ndarray, shape (4, draws, lanes), float64
        The policy's random numbers of four ticks.
    members : ndarray, shape (lanes,), int64
        The members whose random numbers these are: `Bodies.member`, and 0 after the last agent.
    relations, perception : dict of str to Relation, Perception
        Who is near in each channel, and what of it the degree of awareness shows.
    """

    bodies: Bodies
    channels: dict[str, Channel]
    relations: dict[str, Relation]
    perception: Perception
    perceived_columns: dict[str, Floats]
    numbers: Floats
    members: npt.NDArray[np.int64]

    def neighbours(self, channel: str) -> NeighbourList:
        """Return what the sensor of a channel shows, whatever the degree of awareness shows."""
        return filled(self.room(channel))

    def room(self, channel: str) -> NeighbourList:
        """Return the arrays behind `neighbours`, including the unused room."""
        return self.relations[channel].room if channel in self.relations else self.perception.nothing

    @property
    def percept(self) -> Percept:
        """The present percept, as views that the next step overwrites."""
        teammates = self.neighbours(TEAMMATES) if self.awareness.shows_teammates else filled(self.perception.shown)
        names = tuple(name for name in self.channels if name not in OWN_FIELDS)
        percept = self.percept_of(self.room(TARGETS), teammates, filled(self.perception.relayed), names)
        return percept._replace(
            targets=filled(percept.targets), channels=channels_of(names, map(filled, percept.channels))
        )

    def percept_of(
        self, targets: NeighbourList, teammates: NeighbourList, relayed: NeighbourList, channels: tuple[str, ...]
    ) -> Percept:
        """Return a percept that shows these neighbours, and the arrays of further channels."""
        bodies = self.bodies
        moved = bodies.moved if self.timetable is None else self.timetable.travelled
        body = (bodies.heading, moved, bodies.speed, self.sensing_range, self.awareness_range)
        others = channels_of(channels, map(self.room, channels))
        return Percept(
            *body, targets, teammates, relayed, self.perception.situation, others, self.time,
            bodies.reward, bodies.ended, bodies.identity,
            columns_of(tuple(self.perceived_columns), self.perceived_columns.values()),
        )  # fmt: skip

    def noise(self, tick: int) -> Floats:
        """Return the policy's random numbers for a tick, shape (draws, n)."""
        return self.numbers[tick % TICKS_A_BLOCK, :, : len(self.bodies)]
