"""Bodies: robots that have a size get in each other's way, and bump; what does that cost a team?"""

from __future__ import annotations

from typing import Literal

from teamsight import CMOMMT, Box, Bumps, Robot, World, run_many


def corridor(contact: Literal["stop", "slide"]) -> World:
    """Return a narrow box in which twelve robots have wandered for 300 steps."""
    world = World(Box(8, 2), contact=contact, rng=1)
    robots = world.add(Robot, 12, policy="random-walk", radius=0.2, speed=0.1)
    world.attach(Bumps(), robots)  # logs each as an event
    world.run(300)
    return world


def main() -> None:
    for contact in ("stop", "slide"):
        world = corridor(contact)
        robots = world.groups[0]
        print(f"contact={contact!r}: {robots.bumps.sum()} bumps, {robots.bumps.max()} of them of one robot")
        print(world.events[["tick", "what", "agent"]].head(3).to_string(index=False), end="\n\n")
    # A team that observes moving targets, with robots and targets of several sizes, 50 runs each.
    radii = [{"robot_radius": one, "target_radius": one, "contact": "slide"} for one in (0.0, 0.1, 0.2)]
    table = run_many(radii, replicates=50, steps=600, rng=1, model=CMOMMT)
    print(table.groupby("robot_radius")["observed_fraction"].agg(["mean", "sem"]).round(3))


if __name__ == "__main__":
    main()
