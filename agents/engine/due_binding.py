"""Binding of a group whose robots do not all decide at every step, or not by the same policy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.binding import SENSING, Sensing
from teamsight.agents.engine.due import CHOICE, DUE, ChoiceArrays, DueArrays
from teamsight.agents.group import Group
from teamsight.core.kernel import Packed
from teamsight.core.kernel.window import Window, entry_moves, window
from teamsight.policies.compiled import Decision
from teamsight.policies.interface import Action, Policy
from teamsight.policies.registry import label
from teamsight.world.noise import Stream, stream_number

_NO_WINDOW = Window(np.zeros(0, np.int64), 0, np.zeros((0, 3), np.int64))


def bind_due(
    group: Group,
    key: npt.NDArray[np.uint64],
    sensing: Sensing,
    decision_of: Callable[[Any, Any, Action], Packed[Decision]],
) -> Packed[DueArrays]:
    """Return the record of the robots of a group that are due.

    ``decision_of(policy, state, action)`` returns the record of the decision of all robots by a policy.
    """
    table, bodies = group.timetable, group.bodies
    assert table is not None
    for policy in group.policies:
        check_decides_alone(group.name, policy)
    size = len(group)
    chosen = table.action
    if len(table.arrives_at):
        chosen = Action(np.zeros((size, 2)), np.zeros(size))
    seen = SENSING.pack(sensing)
    numbers = table.numbers
    arrays = DueArrays(
        key, stream_number(Stream.CYCLE, group.number), bodies.member, bodies.active, bodies.moved,
        table.start, numbers.period, numbers.jitter, numbers.delay, table.sensings, table.next_at, table.decided_at,
        table.trip, table.travelled, table.policy, table.arrives_at, table.waiting, *table.action, *chosen,
        np.zeros((size, 3), np.int64), np.zeros(1, np.int64),
        seen, window(seen, numbers=("scene.first",)),
        sensing.teammates.start, sensing.relayed.start,
        entry_moves(seen, "teammates"), entry_moves(seen, "relayed"),
        [CHOICE.pack(one) for one in _choices(group, chosen, decision_of)],
    )  # fmt: skip
    group.due = arrays
    return DUE.pack(arrays)


def check_decides_alone(name: str, policy: Any) -> None:
    """Refuse a policy that needs the state of all robots in a group whose robots do not all decide together.

    Raises
    ------
    ValueError
        If it does.
    """
    if isinstance(policy, Policy) and policy.decides_together:
        raise ValueError(
            f"policy={label(policy)}: needs the state of all robots at each decision, and those of {name!r} do not all "
            "decide at every step by this policy; leave out cycles, failures and policies of single robots, or use "
            "options with which each robot decides by itself"
        )


def _choices(
    group: Group, chosen: Action, decision_of: Callable[[Any, Any, Action], Packed[Decision]]
) -> Sequence[ChoiceArrays]:
    if not group.is_compiled:
        return [ChoiceArrays(None, None, _NO_WINDOW) for _ in group.policies]
    pairs = zip(group.policies, group.states, strict=True)
    decisions = [decision_of(policy, state, chosen) for policy, state in pairs]
    return [
        ChoiceArrays(policy.entry(), decision, window(decision, last_axis=("noise",)))
        for policy, decision in zip(group.policies, decisions, strict=True)
    ]
