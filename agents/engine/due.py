"""The robots of a group that are due: the record and the kernels with which only these decide.

Robots whose rows follow each other and that share a policy are a *run*. The kernel of the policy is called once for
each run; the window of its record shows it only these rows. Nothing is copied. If any robot is due, all perceive.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.decisions import ROUNDING
from teamsight.core.kernel import Entry, Packed, Record, call, inlined, kernel
from teamsight.core.kernel.record import Window, show_rows, window
from teamsight.policies.compiled import Decision
from teamsight.policies.interface import Action, Policy
from teamsight.policies.registry import label
from teamsight.world.noise import TICKS_A_BLOCK, Stream, philox, stream_number

if TYPE_CHECKING:
    from teamsight.agents.engine.binding import Sizes
    from teamsight.agents.group import Group

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class ChoiceArrays(NamedTuple):
    """The record of a policy of a group: its kernel and its record, and the window of that; None for Python."""

    decide: Entry | None
    decision: Packed[Decision] | None
    window: Window


class DueArrays(NamedTuple):
    """The record of a group in which not all robots decide at every step, or not by the same policy.

    Attributes
    ----------
    key, stream
        Of the noise of cycles.
    member, active, moved
        As in `BODIES`.
    start, period, jitter, delay, sensings, next_at, decided_at, trip, travelled, policy, arrives_at, waiting
        As in `Timetable`.
    heading, distance : ndarray
        The actions that are carried out.
    chosen_heading, chosen_distance : ndarray
        What policies write: the same arrays without delays.
    runs : ndarray, shape (n, 3), int64
        The runs that are due: first row, row after the last, policy.
    number : ndarray, shape (1,), int64
        Their number.
    choices : list of Packed of ChoiceArrays
        The policies.
    """

    key: Annotated[npt.NDArray[np.uint64], 2]
    stream: int
    member: Annotated[Integers, "n"]
    active: Annotated[npt.NDArray[np.bool_], "n"]
    moved: Annotated[Floats, "n", 2]
    start: Annotated[Floats, "n"]
    period: Annotated[Floats, "n"]
    jitter: Annotated[Floats, "n"]
    delay: Annotated[Integers, "n"]
    sensings: Annotated[Integers, "n"]
    next_at: Annotated[Integers, "n"]
    decided_at: Annotated[Integers, "n"]
    trip: Annotated[Floats, "n", 2]
    travelled: Annotated[Floats, "n", 2]
    policy: Annotated[Integers, "n"]
    arrives_at: Annotated[Integers, "n", "slots"]
    waiting: Annotated[Floats, "n", "slots", 3]
    heading: Annotated[Floats, "n", 2]
    distance: Annotated[Floats, "n"]
    chosen_heading: Annotated[Floats, "n", 2]
    chosen_distance: Annotated[Floats, "n"]
    runs: Annotated[Integers, "n", 3]
    number: Annotated[Integers, 1]
    choices: list[Packed[ChoiceArrays]]


CHOICE = Record(ChoiceArrays)
DUE = Record(DueArrays)
choice_at, due_at = CHOICE.at, DUE.at


@kernel
def list_due(address: int, tick: int) -> int:
    """List the runs of robots that are due, and update the odometry of all; return the number of runs."""
    due = due_at(address)
    count = 0
    for i in range(due.member.shape[0]):
        x = due.moved[i, 0]
        y = due.moved[i, 1]
        # Not added to 0, which would turn −0 into 0: a robot that decides at each step reads the bits of `moved`.
        if due.decided_at[i] != tick - 1:
            x += due.trip[i, 0]
            y += due.trip[i, 1]
        due.travelled[i, 0] = x
        due.travelled[i, 1] = y
        if due.next_at[i] > tick or not due.active[i]:
            continue
        policy = due.policy[i]
        if count > 0 and due.runs[count - 1, 1] == i and due.runs[count - 1, 2] == policy:
            due.runs[count - 1, 1] = i + 1
            continue
        due.runs[count, 0] = i
        due.runs[count, 1] = i + 1
        due.runs[count, 2] = policy
        count += 1
    due.number[0] = count
    return count


@inlined
def _sensed_late(due: Any, i: int) -> float:
    """Return the number in (0, 1) by which a sensing is late, in units of the jitter."""
    if due.jitter[i] == 0.0:
        return 0.0
    four = due.sensings[i] // TICKS_A_BLOCK
    words = philox(
        np.uint64(four), np.uint64(due.member[i]), np.uint64(0), np.uint64(due.stream), due.key[0], due.key[1]
    )
    at = due.sensings[i] % TICKS_A_BLOCK
    word = words[0] if at == 0 else words[1] if at == 1 else words[2] if at == 2 else words[3]
    return (np.float64(np.int64(word)) + 0.5) * 2.0**-32


@inlined
def _advance(due: Any, i: int, tick: int) -> None:
    """Set when a robot decides next, after this tick."""
    while due.next_at[i] <= tick:
        due.sensings[i] += 1
        time = due.start[i] + due.sensings[i] * due.period[i] + due.jitter[i] * _sensed_late(due, i)
        due.next_at[i] = np.int64(math.ceil(time - ROUNDING))


@kernel
def decide_due(address: int, tick: int) -> None:
    """Call the policies of the runs, and send their actions on their way; nothing in it can fail."""
    due = due_at(address)
    for r in range(due.number[0]):
        choice = choice_at(due.choices[due.runs[r, 2]])
        if choice.decide != 0:
            show_rows(choice.window, due.runs[r, 0], due.runs[r, 1])
            call(choice.decide, choice.decision)
    slots = due.arrives_at.shape[1]
    for r in range(due.number[0]):
        for i in range(due.runs[r, 0], due.runs[r, 1]):
            due.decided_at[i] = tick
            if slots > 0:
                slot = (tick + due.delay[i]) % slots
                due.arrives_at[i, slot] = tick + due.delay[i]
                due.waiting[i, slot, 0] = due.chosen_heading[i, 0]
                due.waiting[i, slot, 1] = due.chosen_heading[i, 1]
                due.waiting[i, slot, 2] = due.chosen_distance[i]
    for i in range(due.member.shape[0]):
        due.trip[i, 0] = due.travelled[i, 0] if due.decided_at[i] != tick else 0.0
        due.trip[i, 1] = due.travelled[i, 1] if due.decided_at[i] != tick else 0.0
        _advance(due, i, tick)
        # The action that reaches an inactive robot is lost.
        if slots > 0 and due.arrives_at[i, tick % slots] == tick and due.active[i]:
            due.heading[i, 0] = due.waiting[i, tick % slots, 0]
            due.heading[i, 1] = due.waiting[i, tick % slots, 1]
            due.distance[i] = due.waiting[i, tick % slots, 2]


_NO_WINDOW = Window(np.zeros(0, np.int64), 0, np.zeros((0, 3), np.int64))


def bind_due(
    group: Group,
    key: npt.NDArray[np.uint64],
    decision_of: Callable[[Any, Any, Action], Packed[Decision]],
) -> Packed[DueArrays]:
    """Return the record of the robots of a group that are due.

    ``decision_of(policy, state, action)`` returns the record of the decision of all robots by a policy.
    """
    table, bodies = group.timetable, group.bodies
    assert table is not None
    for policy in group.policies:
        check_decides_alone(group.name, policy)
    size, rows = len(group), bodies.room
    chosen = group.action
    if table.arrives_at.shape[1]:
        chosen = Action(np.zeros((rows, 2))[:size], np.zeros(rows)[:size])
    aim, distance = group.action
    known = {name: bodies[name] for name in DueArrays._fields if name in bodies and name not in ("heading", "distance")}
    group.due = arrays = DueArrays(
        key=key, stream=stream_number(Stream.CYCLE, group.number), heading=aim, distance=distance,
        chosen_heading=chosen.heading, chosen_distance=chosen.distance, runs=np.zeros((rows, 3), np.int64)[:size],
        number=np.zeros(1, np.int64), choices=[CHOICE.pack(one) for one in _choices(group, chosen, decision_of)],
        **known,
    )  # fmt: skip
    return DUE.pack(arrays)


def follow_due(group: Group, packed: Packed[DueArrays], sizes: Sizes) -> None:
    """Let the records of the robots that are due follow the size of their group."""
    sizes.add_rows(packed, group)
    for choice in packed.value.choices:
        if (decision := choice.value.decision) is not None:
            sizes.add_rows(decision, group, is_decision=True)


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
