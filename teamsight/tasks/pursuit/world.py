"""The world of pursuit: hunters and prey on a grid."""

from __future__ import annotations

import warnings
from typing import Any

from teamsight.agents.attributes import AwarenessLike, PolicyLike
from teamsight.agents.body import Body, Robot
from teamsight.agents.group import Group
from teamsight.agents.settings import MOST_AGENTS
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.tasks.pursuit.capture import RULES, Capture
from teamsight.tasks.pursuit.surround import Surround
from teamsight.world.arena import Box, Torus

#: The largest side of the grid [cells].
MOST_SIDE = 1000

_SURROUND = "surround"
# Of a cell; hunters must be on all.
_SIDES = 4


class Hunter(Robot):
    """A hunter of the team "hunters"."""

    team = "hunters"


class Prey(Body):
    """A prey, on no team."""


class Scout(Robot):
    """A robot of the hunters' team that senses prey and does not capture any."""

    team = "hunters"


class Pursuit(World):
    """Hunters and prey that move from cell to cell of a grid, at most one cell in a step.

    Bodies are at the centres of cells of side 1; several can be in one cell. A move against the wall is lost.

    Parameters
    ----------
    hunters, prey : int
        Their numbers; by default 2 and 1.
    side : int
        The side of the grid [cells]; by default 10.
    depth : int
        Hunters sense prey in a square of this many cells to each side; by default 4.
    teammate_depth : int, optional
        They perceive teammates, as their degree of awareness allows, in a square of this many; by default `depth`.
    rule : {"alone", "pair", "surround"}
        Who captures: see `Capture`, and `Surround` for four hunters at once. By default "alone". Fewer than four never
        surround a prey; a warning says so.
    torus : bool
        Whether the grid has no walls; by default it has.
    policy : str or Policy
        The policy of the hunters; by default "lattice-walk", random moves.
    awareness : str or Awareness
        What they perceive of teammates; by default "none".
    prey_policy : str or Policy
        The policy of the prey; by default "lattice-walk".
    scouts : int
        The number of scouts, which move at random; by default 0.
    scout_depth : int, optional
        Scouts sense prey in a square of this many cells to each side; by default `depth`.
    rng, seed : int, optional
        Two names for the seed.

    Attributes
    ----------
    hunters, prey : Group
        The two groups.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a name is unknown.

    Notes
    -----
    *Source:* Tan (1993); Ono and Fukumoto (1996) for "surround". *Departs:* see `Capture` and `Surround`.
    """

    def __init__(
        self,
        hunters: int = 2,
        prey: int = 1,
        side: int = 10,
        *,
        depth: int = 4,
        teammate_depth: int | None = None,
        rule: str = "alone",
        torus: bool = False,
        policy: PolicyLike = "lattice-walk",
        awareness: AwarenessLike = "none",
        prey_policy: PolicyLike = "lattice-walk",
        scouts: int = 0,
        scout_depth: int | None = None,
        rng: int | None = None,
        seed: int | None = None,
    ) -> None:
        _check(hunters, prey, side, torus, rule, scouts)
        super().__init__(Torus(side, side) if torus else Box(side, side), rng=rng, seed=seed)
        near = _range("teammate_depth", depth if teammate_depth is None else teammate_depth, side)
        common: dict[str, Any] = {
            "awareness": awareness, "awareness_range": near, "range_shape": "square", "speed": 1.0,
            "placement": "cells",
        }  # fmt: skip
        self._hunters = self.add(
            Hunter, hunters, policy=policy, sensing_range=_range("depth", depth, side), name="hunters", **common
        )
        self._prey = self.add(Prey, prey, policy=prey_policy, speed=1.0, placement="cells", name="prey")
        self.senses(self._hunters, self._prey)
        if scouts:
            seen = _range("scout_depth", depth if scout_depth is None else scout_depth, side)
            others = self.add(Scout, scouts, policy="lattice-walk", sensing_range=seen, name="scouts", **common)
            self.senses(others, self._prey)
        meets = Surround(side, side, torus) if rule == _SURROUND else Capture(side, side, torus, rule)
        self.interact(meets, hunters=self._hunters, prey=self._prey)

    @property
    def hunters(self) -> Group[Hunter]:
        """The hunters."""
        return self._hunters

    @property
    def prey(self) -> Group[Prey]:
        """The prey."""
        return self._prey


def _check(hunters: int, prey: int, side: int, torus: bool, rule: str, scouts: int) -> None:
    """Refuse what is wrong, and warn of hunters that cannot capture."""
    checks.count("hunters", hunters, most=MOST_AGENTS)
    checks.count("prey", prey, most=MOST_AGENTS)
    checks.count("side", side, least=2, most=MOST_SIDE)
    checks.flag("torus", torus)
    checks.choice("rule", rule, (*RULES, _SURROUND))
    checks.count("scouts", scouts, least=0, most=MOST_AGENTS)
    if rule == _SURROUND and hunters < _SIDES:
        warnings.warn(
            f"hunters={hunters}: fewer than {_SIDES} never capture where rule={rule!r}, on all sides of a prey; take "
            f"{_SIDES} or more, add some with hunters.add(…), or take rule='pair'",
            stacklevel=3,
        )


def _range(name: str, depth: int, side: int) -> float:
    """Return the range that reaches so many cells to each side."""
    return float(checks.count(name, depth, most=side))
