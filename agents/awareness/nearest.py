"""Θ(1): a list of the δ nearest teammates, nearest first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

from teamsight.agents.awareness.interface import OWN_SECTORS, Awareness, Width, situate_targets
from teamsight.agents.awareness.pairwise import SIGMA, bearing_of
from teamsight.agents.awareness.team import next_nearest, show
from teamsight.core import checks
from teamsight.core.kernel import kernel

#: Largest number of teammates in the list; more would fill memory with empty places.
MOST_LISTED = 10_000


@kernel
def _perceive(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    seen = scene.teammates
    room = teammates.distance.shape[0]
    shown = 0
    for i in range(scene.heading.shape[0]):
        teammates.start[i] = shown
        first = seen.start[i]
        end = seen.start[i + 1]
        k = -1
        for _ in range(min(end - first, int(parameters[0]))):
            k = next_nearest(seen, first, end, k)
            if shown < room:
                show(seen, k, teammates, shown)
                teammates.identity[shown] = -1
            shown += 1
    teammates.start[scene.heading.shape[0]] = shown
    return shown


@kernel
def _situate(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    seen = scene.teammates
    for i in range(situation.shape[0]):
        row = situation[i]
        row[OWN_SECTORS:] = 1.0
        first = seen.start[i]
        end = seen.start[i + 1]
        k = -1
        for slot in range(min(end - first, int(parameters[0]))):
            k = next_nearest(seen, first, end, k)
            at = OWN_SECTORS + SIGMA * slot
            row[at] = seen.distance[k] / (scene.awareness_range[i] * scene.farthest)
            row[at + 1] = bearing_of(seen, k, scene.heading[i, 0], scene.heading[i, 1])


@dataclass(frozen=True)
class NearestAwareness(Awareness):
    """Θ(1): the δ nearest teammates in awareness range, nearest first, without identity.

    The percept holds their exact offsets. Of two at the same distance, the one of smaller identity comes first. The
    situation holds, for each place of the list, the distance over the awareness range and the bearing, anticlockwise
    from the heading, as a fraction of a full turn. Both are 1 for an empty place. Unlike in a ring, teammates in one
    direction do not merge; those beyond the δ nearest are hidden.

    Parameters
    ----------
    delta : int, default 16
        Length of the list, from 1 to `MOST_LISTED`; the paper's δ.

    Raises
    ------
    ValueError, TypeError
        If `delta` is not a whole number within these limits.

    Notes
    -----
    *Source:* none; the paper's Θ(1) is a ring (§3.4). σ = 2 as in §3.3, so it adds σδ inputs where a ring adds δ.
    """

    delta: int = 16

    name = "nearest"
    order = "Θ(1)"
    formula = "n + σδ"
    shows = "the δ nearest teammates' offsets"
    teammate_layout = "offsets"
    perceive = _perceive
    situate = _situate
    delivers = ("targets", "teammates")

    def __post_init__(self) -> None:
        cure = "a list needs at least 1 place; for no awareness use NoAwareness()"
        delta = checks.count("delta", self.delta, cure=cure)
        if delta > MOST_LISTED:
            raise ValueError(
                f"delta={checks.shown(delta)}: must be at most {MOST_LISTED}, since a situation has {SIGMA} inputs for "
                "each place of the list; for all teammates use PairwiseAwareness()"
            )
        object.__setattr__(self, "delta", delta)

    def width(self, team_size: int) -> Width:
        checks.count("team_size", team_size)
        return Width(OWN_SECTORS, SIGMA * self.delta)

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        return own + sigma * delta

    @classmethod
    def adding(cls, added: int) -> Self:
        return cls(max(added // SIGMA, 1))
