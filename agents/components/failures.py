"""Failures of agents, and their repair."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.agents.components.disabling import Disabling
from teamsight.agents.components.durations import Duration, Times, lasting, time_to
from teamsight.agents.components.interruptions import Interruptions

if TYPE_CHECKING:
    from teamsight.agents.body import Body


class Failures(Disabling, Interruptions):
    """Agents fail, each independently of the others, and may be repaired.

    An agent that has failed is inactive: it neither moves nor decides, senses nobody and is sensed by nobody. The log
    says "failed" and "repaired".

    Parameters
    ----------
    time_to_failure : float, Duration or Times
        The time from the start, or from the last repair, to a failure [ticks]: the mean of an exponential time, a
        duration such as `Weibull`, or the times of failures since the start of the run.
    time_to_repair : float, Duration or Times, optional
        The time from a failure to its repair [ticks]; by default agents that have failed stay so. `Times` are those of
        the first repair of an agent, of the second, and so on.

    Raises
    ------
    TypeError, ValueError
        If a time is neither a number nor a duration, or is not positive; when attached, if a listed time has passed.

    Notes
    -----
    An agent fails at its times whether or not it is active then. What the user sets wins: an agent that the user makes
    inactive stays so after its repair, and one that the user makes active in a failure has not failed any more. With
    exponential times, the share of the time in which an agent works tends to the availability, MTTF / (MTTF + MTTR).

    Examples
    --------
    ``failures = world.attach(Failures(500, 50), robots)``
    """

    words = "failed", "repaired"
    parameters = "time_to_failure", "time_to_repair"

    def __init__(
        self, time_to_failure: float | Duration | Times, time_to_repair: float | Duration | Times | None = None
    ) -> None:
        self.time_to_failure = time_to("time_to_failure", time_to_failure)
        self.time_to_repair = None if time_to_repair is None else lasting("time_to_repair", time_to_repair)

    def begin(self) -> None:
        """Plan the first failure of each agent."""
        Disabling.begin(self)
        Interruptions.begin(self)

    @property
    def failed(self) -> list[Body]:
        """The agents that have failed and are neither repaired yet nor set active by the user."""
        return [self.agent(member) for member in sorted(member for member, _ in self._held)]

    def begin_one(self, agent: Body, member: int) -> None:
        """Let an agent fail."""
        self.disable(member)

    def end_one(self, agent: Body, member: int) -> None:
        """Repair an agent."""
        self.enable(member)
