"""What is run: worlds described by the keyword parameters of CMOMMT, and the seed that each of them gets."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from numbers import Integral, Real
from typing import Any, NamedTuple

# What it costs a learner to compare two numbers of its memory, in steps of a middling world.
_COMPARISON = 9e-5
# Longest text of a setting where a run is described, in characters.
_LONGEST_SETTING = 48


class Grid(NamedTuple):
    """The team sizes and arena radii over which a surface is drawn."""

    robots: tuple[int, ...]
    radius: tuple[float, ...]

    @property
    def cells(self) -> tuple[tuple[int, float], ...]:
        """Every pair (robots, radius), radius by radius."""
        return tuple((robots, radius) for radius in self.radius for robots in self.robots)


#: The grid of the paper's Figs. 4 to 10.
PAPER = Grid(tuple(range(1, 31)), tuple(float(radius) for radius in range(1, 10)))
#: A coarse grid on which every claim can still be computed.
QUICK = Grid((1, 2, 5, 8, 10, 20, 30), (1.0, 2.0, 3.0, 5.0, 7.0, 8.0, 9.0))


def canonical(value: Any) -> str:
    """Return one text for equal values, whatever their type: 2, 2.0 and NumPy's 2 alike.

    Numbers that are whole become integers, other numbers are written exactly in hexadecimal, mappings in the order of
    their keys; everything else is written by ``repr``.
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}={canonical(value[name])}" for name in sorted(value)) + "}"
    if isinstance(value, bool):
        return repr(value)
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Real):
        number = float(value)
        return str(int(number)) if number.is_integer() else number.hex()
    return repr(value)


def model_seed(root: int, replicate: int, robots: int, targets: int, radius: float) -> int:
    """Return the seed of one world, 0 to 2**53 - 1, from what sets its stage.

    The policy, the degree of awareness, ranges and speeds have no part in it: two treatments of one stage meet the
    same placement and the same target noise, so that their difference is paired.

    Parameters
    ----------
    root : int
        Seed of the whole study.
    replicate : int
        Which of the repetitions.
    robots, targets : int
        Numbers of robots and of targets.
    radius : float
        Radius of the arena [length].
    """
    stage = {"root": root, "replicate": replicate, "robots": robots, "targets": targets, "radius": radius}
    text = ";".join(f"{name}={canonical(value)}" for name, value in stage.items())
    digest = hashlib.blake2b(text.encode(), digest_size=8, person=b"teamsight-stage").digest()
    # 53 bits survive as a float, which a row of a mixed table and JSON turn integers into.
    return int.from_bytes(digest, "big") >> 11


@dataclass(frozen=True)
class Run:
    """One world to simulate: keyword parameters of CMOMMT, its replicate, its length and its seed."""

    parameters: Mapping[str, Any]
    replicate: int
    steps: int
    seed: int

    @property
    def key(self) -> tuple[str, ...]:
        """What makes two runs the same run."""
        named = (f"{name}={canonical(value)}" for name, value in sorted(self.parameters.items()))
        return (*named, f"steps={self.steps}", f"seed={self.seed}")

    @property
    def cost(self) -> float:
        """World-steps, weighted by what a step of this size costs; in steps of a world with 15 robots and 15 targets.

        Fitted by eye to the compiled model: a fixed part, and a part that grows with the pairs that are looked at.
        """
        robots, targets = int(self.parameters["robots"]), int(self.parameters["targets"])
        world = (self.steps + 400.0) * (0.25 + 0.75 * robots * (robots + targets) / 450.0)
        return world + self.steps * robots * getattr(self.parameters.get("policy"), "effort", 0.0) * _COMPARISON

    def describe(self) -> str:
        """Return the settings on one line; a long one, such as that of a policy, is cut."""
        texts = {name: " ".join(str(value).split()) for name, value in self.parameters.items()}
        named = ", ".join(
            f"{name}={text if len(text) <= _LONGEST_SETTING else text[: _LONGEST_SETTING - 1] + '…'}"
            for name, text in texts.items()
        )
        return f"{named}, replicate={self.replicate}, steps={self.steps}, rng={self.seed}"


@dataclass(frozen=True)
class Experiment:
    """A treatment over cells of (robots, radius); each replicate of each cell is one run.

    Parameters
    ----------
    name : str
        Name of the table that results.
    treatment : mapping
        Keyword parameters of CMOMMT that set the treatment.
    cells : tuple of (int, float)
        Pairs (robots, radius).
    targets : int
        Number of targets.
    sweep : mapping of str to tuple
        Further keyword parameters, of which every combination is run; each becomes a column of the table.
    replicates : int
        How many times as many replicates as the study asks for.
    """

    name: str
    treatment: Mapping[str, Any]
    cells: tuple[tuple[int, float], ...]
    targets: int = 15
    sweep: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    replicates: int = 1

    def parameters(self, setting: Mapping[str, Any]) -> dict[str, Any]:
        """Return the treatment under `setting`, without the policy options that its policy does not have.

        Runs that differ in such options only are then equal, and are made once.
        """
        from teamsight.agents.resolve import shared_options

        found = {**setting, **self.treatment}
        options = shared_options(self.treatment["policy"], found.pop("policy_options", {}))
        return found | ({"policy_options": options} if options else {})

    def rows(
        self, setting: Mapping[str, Any], root: int, runs: int, steps: int
    ) -> Iterator[tuple[dict[str, Any], Run]]:
        """Yield, for each run, the columns that tell it from its siblings, and the run."""
        common = self.parameters(setting)
        sweeps = [dict(zip(self.sweep, values, strict=True)) for values in product(*self.sweep.values())]
        for robots, radius in self.cells:
            stage = {"robots": robots, "targets": self.targets, "radius": radius}
            for swept in sweeps:
                for replicate in range(runs * self.replicates):
                    seed = model_seed(root, replicate, robots, self.targets, radius)
                    run = Run(common | stage | swept, replicate, steps, seed)
                    yield {**stage, **swept, "replicate": replicate, "seed": seed}, run
