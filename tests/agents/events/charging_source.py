"""A source with a SimPy resource, whose queue a state must hold; used by tests in two processes."""

from __future__ import annotations

from typing import Any

import simpy

from teamsight import CMOMMT, EventSource


class Charging(EventSource):
    """Robots come to one of two places at random times, in a queue, and charge for a time."""

    def begin(self) -> None:
        self.resource = simpy.Resource(self.clock, 2)
        self.requests: dict[int, Any] = {}
        self.index: dict[int, int] = {}
        for member in self.members:
            self.plan(8 * self.random(member, 0), "come", member, 1)

    def come(self, member: int, index: int) -> None:
        self.log("came", self.agent(member))
        self.ask(member, index)

    def ask(self, member: int, index: int) -> None:
        self.requests[member] = request = self.resource.request()
        self.index[member] = index
        self.when(request, "charge", member, index)

    def charge(self, member: int, index: int) -> None:
        self.log("charges", self.agent(member), waiting=len(self.resource.queue))
        self.plan(self.now + 1 + 6 * self.random(member, index), "leave", member, index + 1)

    def leave(self, member: int, index: int) -> None:
        self.resource.release(self.requests.pop(member))
        self.log("leaves", self.agent(member))
        # Whole times: many events of one tick.
        self.plan(int(self.now + 3 + 8 * self.random(member, index)) + 1, "come", member, index + 1)

    def save(self) -> Any:
        whose = {request: (member, self.index[member]) for member, request in self.requests.items()}
        return [whose[request] for request in self.resource.users], [whose[request] for request in self.resource.queue]

    def load(self, data: Any) -> None:
        self.resource, self.requests, self.index = simpy.Resource(self.clock, 2), {}, {}
        users, queue = data
        for member, index in users:
            # That a place was given to it has happened, or is planned.
            self.requests[member], self.index[member] = self.resource.request(), index
        for member, index in queue:
            self.ask(member, index)


class Rainy(CMOMMT):
    """A world with a method that is planned by name, and charging robots."""

    def __init__(self, **parameters: Any) -> None:
        super().__init__(robots=6, targets=3, **parameters)
        self.attach(Charging(), self.robots)
        self.attach(Charging(), self.targets)
        self.clock.at(2.5, self.rain)
        self.clock.at(41.5, self.robots[3].remove)
        self.schedule_recurring(self.shine, 7.5)

    def rain(self) -> None:
        self.log("rain", observed=self.observed)
        self.clock.at(self.clock.now + 3.25, self.rain)

    def shine(self) -> None:
        self.log("sun")


def rainy(seed: int) -> Rainy:
    """Return a world before its first step."""
    return Rainy(rng=seed)
