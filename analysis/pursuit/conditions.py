"""The conditions: which hunters learn from what, in which of Tan's tasks, for how many trials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from teamsight.policies.online.prey_q import PreyQ

#: Trials of training where one hunter captures, and where two must.
ALONE, JOINT = 2000, 10_000
#: Trials of conditions of which only the beginning matters.
EARLY = 3000
#: The square that reported prey and teammates are in, wherever they are on Tan's grid [cells to each side].
_EVERYWHERE = 10


@dataclass(frozen=True)
class Condition:
    """A team and its task.

    Parameters
    ----------
    world : mapping of str to object
        Parameters of `Pursuit`, without the policy.
    policy : PreyQ, optional
        How hunters learn; without it they move at random.
    trials : int
        Trials of training.
    """

    world: Mapping[str, Any]
    policy: PreyQ | None = None
    trials: int = ALONE

    @property
    def parameters(self) -> dict[str, Any]:
        """All parameters of the world."""
        return {**self.world, **({} if self.policy is None else {"policy": self.policy})}


def _learner(depth: int, **how: Any) -> PreyQ:
    # Tan's V(y) is the value of what is perceived next, at the end of a trial too.
    return PreyQ(depth, values_ends=True, **how)


def _alone(hunters: int, depth: int, **world: Any) -> dict[str, Any]:
    return {"hunters": hunters, "prey": 1, "depth": depth, "rule": "alone", **world}


def _joint(prey: int, depth: int = 4, **world: Any) -> dict[str, Any]:
    return {"hunters": 2, "prey": prey, "depth": depth, "rule": "pair", **world}


_REPORTED: dict[str, Any] = {"awareness": "shared", "teammate_depth": _EVERYWHERE}
_SEEN: dict[str, Any] = {"awareness": "pairwise"}


def _conditions() -> dict[str, Condition]:
    found = {
        "1/1 random": Condition(_alone(1, 4)),
        "1/2 random": Condition(_alone(2, 4)),
        "1/2 joint random": Condition(_joint(1)),
        "2/2 joint random": Condition(_joint(2)),
        "1/1 depth 4": Condition(_alone(1, 4), _learner(4)),
        "1/1 depth 2": Condition(_alone(1, 2), _learner(2)),
    }
    for depth in (2, 3, 4):
        scout = {"scouts": 1, "scout_depth": depth, **_REPORTED}
        found[f"1/1 scout {depth}"] = Condition(_alone(1, 2, **scout), _learner(2, reach=_EVERYWHERE))
        found[f"1/2 depth {depth}"] = Condition(_alone(2, depth), _learner(depth))
        mutual = _alone(2, depth, **_REPORTED)
        found[f"1/2 mutual {depth}"] = Condition(mutual, _learner(depth, reach=_EVERYWHERE))
    for every in (10, 50, 200):
        found[f"1/2 averaging {every}"] = Condition(_alone(2, 4), _learner(4, average_every=every))
    found["1/2 one table"] = Condition(_alone(2, 4), _learner(4, one_table=True))
    for prey in (1, 2):
        found[f"{prey}/2 joint"] = Condition(_joint(prey), _learner(4), JOINT)
        found[f"{prey}/2 joint passive"] = Condition(_joint(prey, **_SEEN), _learner(4, partner=4), JOINT)
        known = _learner(4, reach=_EVERYWHERE, partner=_EVERYWHERE)
        found[f"{prey}/2 joint mutual"] = Condition(_joint(prey, **_REPORTED), known, JOINT)
    for depth in (2, 3):
        found[f"2/2 joint, depth {depth}"] = Condition(_joint(2, depth), _learner(depth), EARLY)
        seen = _learner(depth, partner=depth)
        found[f"2/2 joint passive, depth {depth}"] = Condition(_joint(2, depth, **_SEEN), seen, EARLY)
    return found


#: The conditions by name: prey/hunters, and how they learn.
CONDITIONS: Mapping[str, Condition] = _conditions()
