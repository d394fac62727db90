"""Experience: what the robots of a group met while they acted, pair by pair, for learners.

A pair is what a robot knew, what it did, what it knew afterwards, and facts on targets, of which rewards are made. The
compiled loop writes it, see `teamsight.agents.recording.transition_kernels`; so both roads record the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.binding import SCENE, situate_entry
from teamsight.agents.engine.records import EXPERIENCE
from teamsight.agents.recording.transition_kernels import FACTS

if TYPE_CHECKING:
    from teamsight.agents.engine.neighbours import Relation
    from teamsight.agents.group import Group

Reals = npt.NDArray[np.float32]


class Experience(NamedTuple):
    """What a group met, k pairs in the order of time, robots in the order of their rows.

    Attributes
    ----------
    situation, next_situation : ndarray, shape (k, width), float32
        What the robot knew before and after, as its degree of awareness tells learners.
    action : ndarray, shape (k, 2), float32
        What its body did: the rotation from the heading before, anticlockwise, in (−π, π] [rad], within its turning
        limit; and the distance over its speed, 0..1. At a wall both are what was set out on, not where it led.
    facts : mapping of str to ndarray, shape (k,), float32
        Numbers of targets: ``sensed`` by the robot afterwards, ``gained`` and ``lost`` by it in the step; the same of
        those that it senses and no teammate does (``alone``…), and of those that anybody of its team senses
        (``team_sensed``…).
    """

    situation: Reals
    action: Reals
    next_situation: Reals
    facts: Mapping[str, Reals]


class ExperienceLog:
    """The experience of a group while the groups of its world stay as they are.

    Parameters
    ----------
    group : Group
        Whose.
    team_size : int
        How many robots its team has.
    """

    def __init__(self, group: Group, team_size: int) -> None:
        self.group, self.size = group, len(group)
        width = group.awareness.width(max(team_size, 1))
        self.own, self.added = width
        self.rows = 0
        self._scene = np.zeros(1, SCENE)
        self._arrays = {
            name: np.zeros((16, self.size, columns), np.float32)
            for name, columns in (
                ("situation", sum(width)), ("action", 2), ("next_situation", sum(width)), ("facts", len(FACTS)),
            )
        }  # fmt: skip
        self._kept = np.zeros(self.size + 1, np.int64), np.zeros(0, np.int64)
        self._counts = np.zeros((2, 0), np.int64)

    def make_room(self, steps: int) -> bool:
        """Make room for this many more steps; return whether the arrays are others now."""
        room = len(self._arrays["action"])
        if self.rows + steps <= room:
            return False
        for name, array in self._arrays.items():
            longer = np.zeros((max(self.rows + steps, 2 * room), *array.shape[1:]), np.float32)
            longer[: self.rows] = array[: self.rows]
            self._arrays[name] = longer
        return True

    def bind(self, record: Any, groups: list[Group], relations: list[Relation], bodies: int) -> None:
        """Write where everything is into a record of kind `EXPERIENCE`; what was noted before a move stays."""
        group, team = self.group, self.group.team
        sensing = [r for r, relation in enumerate(relations) if relation.kind == "targets"]
        own = [r for r in sensing if relations[r].observers is group]
        room = max((len(relations[r].identity) for r in own), default=0)
        if room > len(self._kept[1]):
            longer = np.zeros(room, np.int64)
            longer[: len(self._kept[1])] = self._kept[1]
            self._kept = self._kept[0], longer
        if len(self._counts[0]) != bodies:
            self._counts = np.zeros((2, bodies), np.int64)
        teammates = own if team is None else [r for r in sensing if relations[r].observers.team == team]
        self._team = np.array(teammates, np.int64)
        arrays = self._arrays | {
            "scene": self._scene, "team": self._team, "kept_start": self._kept[0], "kept_index": self._kept[1],
            "counts_before": self._counts[0], "counts_after": self._counts[1],
        }  # fmt: skip
        for name, array in arrays.items():
            record[name] = array.ctypes.data
        record["group"], record["relation"] = groups.index(group), own[0] if own else -1
        record["situate"], record["width"] = situate_entry(group.awareness).address, self.own + self.added
        record["team_size"], record["kept_room"], record["row"] = len(self._team), len(self._kept[1]), self.rows
        assert set(record.dtype.names) == set(EXPERIENCE.names or ())

    def experience(self) -> Experience:
        """Return the pairs of the steps so far."""
        flat = {name: array[: self.rows].reshape(-1, array.shape[-1]) for name, array in self._arrays.items()}
        facts = {name: flat["facts"][:, column] for column, name in enumerate(FACTS)}
        return Experience(flat["situation"], flat["action"], flat["next_situation"], facts)


def joined(group: Group, logs: list[ExperienceLog]) -> Experience:
    """Return the experience of a group from all its logs.

    Raises
    ------
    ValueError
        If there is none, or its situations differ in width.
    """
    if not logs:
        raise ValueError(f"experience({group!r}): none was recorded; call record_experience(group) before the steps")
    widths = sorted({log.own + log.added for log in logs if log.rows})
    if len(widths) > 1:
        raise ValueError(
            f"experience({group!r}): its situations have {' and '.join(map(str, widths))} components, for the team "
            "has grown or shrunk; use RingAwareness(), whose width is that of no team"
        )
    parts = [log.experience() for log in logs if log.rows] or [logs[-1].experience()]
    return Experience(
        np.concatenate([part.situation for part in parts]),
        np.concatenate([part.action for part in parts]),
        np.concatenate([part.next_situation for part in parts]),
        {name: np.concatenate([part.facts[name] for part in parts]) for name in FACTS},
    )
