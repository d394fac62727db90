"""Models and measures of a user, some of which misbehave; studies of the tests name them as ``odd_models:...``."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any, NamedTuple

from teamsight import CMOMMT, Disc, Robot, Target, World

SMALL: dict[str, Any] = {"targets": 2, "policy": "a-cmommt"}


class Own(World):
    """A world of a user."""

    def __init__(self, robots: int = 2, radius: float = 2.0, *, rng: int | None = None) -> None:
        super().__init__(Disc(radius), rng=rng)
        self.robots = self.add(Robot, robots, policy="a-cmommt")
        self.senses(self.robots, self.add(Target, 2, policy="random-walk"))


def without_seed(robots: int = 2) -> World:
    return CMOMMT(robots=robots, **SMALL)


def no_world(robots: int = 2, *, rng: int) -> Any:
    return robots


def raising(robots: int = 2, bad: int = 1, *, rng: int) -> World:
    """Fail for `bad` robots, with an address in the message."""
    if robots == bad:
        raise RuntimeError(f"no team of {robots}\nin {object()!r}")
    return CMOMMT(robots=robots, **SMALL, rng=rng)


def crashing(robots: int = 2, radius: float = 5.0, *, rng: int) -> World:
    """End the process for 9 robots."""
    if robots == 9:
        os._exit(7)
    return CMOMMT(robots=robots, radius=radius, **SMALL, rng=rng)


def interrupting(robots: int = 2, *, rng: int) -> World:
    if robots == 3:
        raise KeyboardInterrupt
    return CMOMMT(robots=robots, **SMALL, rng=rng)


def leaving(robots: int = 2, *, rng: int) -> World:
    if robots == 3:
        sys.exit("enough")
    return CMOMMT(robots=robots, **SMALL, rng=rng)


def printing(robots: int = 2, *, rng: int) -> World:
    print("a world", robots)
    print("and a remark", file=sys.stderr)
    return CMOMMT(robots=robots, **SMALL, rng=rng)


def dying_once(folder: str, robots: int = 2, *, rng: int) -> World:
    """Kill the process that makes a run of 3 robots, the first time only."""
    mark = Path(folder) / f"died-{rng}"
    if robots == 3 and not mark.exists():
        mark.touch()
        os._exit(9)
    return CMOMMT(robots=robots, **SMALL, rng=rng)


class Numbers(NamedTuple):
    observed: float
    steps_made: int
    is_even: bool
    word: str
    perhaps: float | None


def numbers(world: World, steps: int) -> Numbers:
    world.run(steps)
    even = world.seed_used % 2 == 0
    return Numbers(world.observed_fraction, world.tick, even, "even" if even else "odd", 0.5 if even else None)


def plain(world: World, steps: int) -> dict[str, Any]:
    """Return whole numbers and flags without annotations."""
    world.run(steps)
    return {"ticks": world.tick, "is_even": world.seed_used % 2 == 0, "word": "ü", "nothing": None}


def other_columns(world: World, steps: int) -> dict[str, Any]:
    world.run(steps)
    return {"a": 1.0, "b": 2.0} if world.seed_used % 2 else {"a": 1.0, "c": 3.0}


def nested(world: World, steps: int) -> dict[str, Any]:
    world.run(steps)
    return {"observed": world.observed_fraction, "parts": {"first": 1}}


def other_types(world: World, steps: int) -> dict[str, Any]:
    return {"a": "text" if world.seed_used % 2 else 1.0}


def taken(world: World, steps: int) -> dict[str, Any]:
    return {"replicate": 1}


def logging(world: World, steps: int) -> dict[str, Any]:
    """Log events whose details differ in type."""
    world.log("began", steps=steps)
    world.run(steps)
    world.log("ended", share=world.observed_fraction, word="done")
    return {"ticks": world.tick}


def logging_types(world: World, steps: int) -> dict[str, Any]:
    """Log an event with a detail whose type depends on the run."""
    world.run(steps)
    world.log("ended", what_it_was="done" if world.seed_used % 2 else 1.0)
    return {"ticks": world.tick}


def logging_at_times(world: World, steps: int) -> dict[str, Any]:
    """Log an event with a detail that some runs do not have."""
    world.run(steps)
    world.log("ended", word="odd" if world.seed_used % 2 else None)
    return {"ticks": world.tick}


def compiling(robots: int = 2, *, rng: int) -> World:
    """Announce a compilation, as the first use of a kernel on a machine does."""
    from teamsight.core.kernel import entry

    entry.announce("a kernel")
    return CMOMMT(robots=robots, **SMALL, rng=rng)


def wandering(world: World, steps: int) -> dict[str, Any]:
    os.chdir("/")
    return {"a": 1.0}


class SpeechlessError(Exception):
    def __str__(self) -> str:
        raise RuntimeError("no words")


def speechless(world: World, steps: int) -> dict[str, Any]:
    raise SpeechlessError


def exiting(world: World, steps: int) -> dict[str, Any]:
    raise GeneratorExit


def ringing(world: World, steps: int) -> dict[str, Any]:
    """Fail with a message that a terminal acts on."""
    raise ValueError("red: \x1b[31m,\r\n bell: \a")


def half_a_character(world: World, steps: int) -> dict[str, Any]:
    return {"a\ud800": 1.0}


def unnamed(world: World, steps: int) -> dict[str, Any]:
    return {"a": 1.0, "": 2.0}


def passing_on(robots: int = 2, *, rng: int, **more: Any) -> World:
    return CMOMMT(robots=robots, **SMALL, **more, rng=rng)
