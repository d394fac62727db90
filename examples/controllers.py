"""A simulated team, steered from another process: one controller for each robot answers its readings over a socket."""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections import deque
from multiprocessing.connection import Client, Connection, Listener
from typing import Any

import numpy as np

from teamsight import CMOMMT, Controller, Detections
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies import Action, Percept, Policy

RULES: dict[str, Any] = {"policy": "a-cmommt", "awareness": "pairwise"}
TICK, RUNS, STEPS = 50, 8, 100  # a tick is 50 ms


def steer(link: Connection) -> None:
    """Be the robots: answer their readings with commands, until the world ends."""
    controllers: dict[int, Controller] = {}
    while (message := link.recv()) is not None:
        if "team" in message:
            controllers = {one: Controller(**RULES, **message, identity=one) for one in message["team"]}
            continue
        commands = [controllers[one].decide(**readings) for one, readings in message.items()]
        link.send([(command.heading, command.distance) for command in commands])


class Remote(Policy):
    """Sends each robot's readings, which are `delay` ticks old, and does what its controller answers."""

    def __init__(self, link: Connection, delay: int, seed: int) -> None:
        self.link, self.seed, self.sent = link, seed, deque[list[Any]](maxlen=delay + 1)

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        tick, team = int(percept.time[0]), percept.identity.tolist()
        if not self.sent:
            limits = {name: getattr(percept, name)[0] for name in ("sensing_range", "awareness_range", "speed")}
            self.link.send({"team": team, "seed": self.seed, **limits})
        lists = {"targets": percept.targets, "teammates": percept.teammates}
        seen = [{name: Detections.of(each, row, tick) for name, each in lists.items()} for row in range(len(team))]
        self.sent.append(seen)
        late = self.sent[0] if len(self.sent) == self.sent.maxlen else [{}] * len(team)
        own = [{"heading": percept.heading[row], "moved": percept.moved[row], "tick": tick} for row in range(len(team))]
        self.link.send({one: {**mine, **old} for one, mine, old in zip(team, own, late, strict=True)})
        heading, distance = zip(*self.link.recv(), strict=True)
        return Action(np.array(heading), np.array(distance)), state


def main() -> None:
    warnings.filterwarnings("ignore", "run.. makes its steps one by one", UserWarning)
    with Listener(("127.0.0.1", 0)) as server:
        robots = subprocess.Popen([sys.executable, __file__, "--steer", str(server.address[1])])
        link = server.accept()
    shares: dict[int | None, list[float]] = {delay: [] for delay in (None, 0, 1, 2, 4)}
    for delay, seed in ((delay, seed) for delay in shares for seed in range(RUNS)):
        policy: Any = RULES["policy"] if delay is None else Remote(link, delay, seed)
        world = CMOMMT(robots=10, targets=15, radius=4.0, policy=policy, awareness=RULES["awareness"], rng=seed)
        world.run(STEPS)
        shares[delay].append(100 * world.observed_fraction)
    simulated = shares.pop(None)
    for late, steered in shares.items():
        lost = interval_of(np.subtract(steered, simulated))
        print(f"{(late or 0) * TICK:3} ms late: {lost.mean:+5.2f} points ({lost.low:+.2f} to {lost.high:+.2f})")
    link.send(None)
    robots.wait()


if __name__ == "__main__":
    if "--steer" in sys.argv:
        steer(Client(("127.0.0.1", int(sys.argv[-1]))))
    else:
        main()
