"""The conditions: hunters on a torus that learn with modules or with one table over all, and random ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from teamsight.agents.awareness import NearestAwareness
from teamsight.policies.online.lattice_walk import LatticeWalk
from teamsight.policies.online.modular_q import ModularQ

#: The side of the torus of Ono and Fukumoto [cells], and hunters that surround one prey.
SIDE, HUNTERS = 20, 4
#: Smaller tori, on which random hunters capture often enough to be counted.
SMALLER = (4, 5, 6, 7, 8)
#: The torus on which one table over all is learned too, and how far hunters see there [cells].
SMALL, SMALL_DEPTH = 4, 1
#: Steps at depth 2 and of random hunters, at depth 3, on the small torus, and of random hunters on small ones.
STEPS, DEEP_STEPS, SMALL_STEPS, SMALLER_STEPS = 2_000_000, 8_000_000, 3_000_000, 1_000_000


@dataclass(frozen=True)
class Condition:
    """A team and its torus.

    Parameters
    ----------
    side : int
        The side of the torus [cells].
    depth : int
        Hunters perceive prey and each other in a square of so many cells to each side.
    policy : ModularQ, optional
        How hunters learn; without it they move at random.
    awareness : object
        What they perceive of each other.
    steps : int
        Steps of a run.
    """

    side: int
    depth: int
    policy: ModularQ | None = None
    awareness: Any = "pairwise"
    steps: int = STEPS

    @property
    def parameters(self) -> dict[str, Any]:
        """All parameters of the world."""
        walk = LatticeWalk(5)
        return {
            "hunters": HUNTERS, "prey": 1, "side": self.side, "depth": self.depth, "rule": "surround", "torus": True,
            "awareness": "none" if self.policy is None else self.awareness, "prey_policy": walk,
            "policy": walk if self.policy is None else self.policy,
        }  # fmt: skip


def _nearest(delta: int) -> Condition:
    return Condition(SIDE, 2, ModularQ(2, delta, by="distance"), NearestAwareness(delta))


#: The conditions by name.
CONDITIONS: Mapping[str, Condition] = {
    **{f"random, side {side}": Condition(side, 1, steps=SMALLER_STEPS) for side in SMALLER},
    f"random, side {SIDE}": Condition(SIDE, 1),
    "modular, depth 2": Condition(SIDE, 2, ModularQ(2)),
    "monolithic, depth 2": Condition(SIDE, 2, ModularQ(2, monolithic=True)),
    "modular, depth 3": Condition(SIDE, 3, ModularQ(3), steps=DEEP_STEPS),
    **{f"nearest {delta}, depth 2": _nearest(delta) for delta in (1, 2, 3)},
    f"modular, side {SMALL}": Condition(SMALL, SMALL_DEPTH, ModularQ(SMALL_DEPTH), steps=SMALL_STEPS),
    f"monolithic, side {SMALL}": Condition(
        SMALL, SMALL_DEPTH, ModularQ(SMALL_DEPTH, monolithic=True), steps=SMALL_STEPS
    ),
}
