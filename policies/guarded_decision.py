"""Decisions of compiled policies on guarded arrays: what a kernel reads and writes, and whether it may."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from teamsight.core.kernel import Entry, array_at, inlined, specialise
from teamsight.core.kernel.fences import Fences
from teamsight.core.kernel.guard import LIMIT, READ_ONLY, guarded_at
from teamsight.core.kernel.guarded_arrays import Axis, Named, machine_code, run_guarded
from teamsight.core.kernel.guarded_copy import guarded
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies.compiled import DECISION, CompiledPolicy, bind_decision, check_memory
from teamsight.policies.interface import Action, Floats, Percept, PolicyArrays, PolicyState

_ROBOT = Axis("robots", "robots are 0 to n − 1, and n is percept.heading.shape[0]")
_XY = Axis("components", "they are 0, x, and 1, y")
_SIGHTING = Axis("sightings", "robot i sees those from start[i] up to, not including, start[i + 1]")
_START = Axis("elements", "there is one more than robots; robot i's are start[i] and start[i + 1]")
_TABLE = "the table is what `knowledge` returns"
_DECLARED = "declare as many as it needs in start(size)"


def _seen(kind: str) -> list[Named]:
    return [
        Named(f"percept.{kind}.start", (_START,)),
        Named(f"percept.{kind}.identity", (_SIGHTING,)),
        Named(f"percept.{kind}.offset", (_SIGHTING, _XY)),
        Named(f"percept.{kind}.distance", (_SIGHTING,)),
    ]


# In the order of the numbers in `_decide`, from 1 on.
_ARRAYS = [
    Named("", ()),
    *_seen("targets"), *_seen("teammates"), *_seen("relayed"),
    Named("percept.heading", (_ROBOT, _XY)),
    Named("percept.moved", (_ROBOT, _XY)),
    Named("percept.speed", (_ROBOT,)),
    Named("percept.sensing_range", (_ROBOT,)),
    Named("percept.awareness_range", (_ROBOT,)),
    Named("percept.situation", (_ROBOT, Axis("inputs", "declare as many as it needs as `inputs`"))),
    Named("arrays.parameters", (Axis("parameters", "add what it needs to `parameters`"),)),
    Named("arrays.table", (Axis("rows", _TABLE), Axis("columns", _TABLE))),
    Named("arrays.state.floats", (_ROBOT, Axis("slots", _DECLARED), Axis("fields", _DECLARED))),
    Named("arrays.state.ints", (_ROBOT, Axis("slots", _DECLARED), Axis("fields", _DECLARED))),
    Named("noise", (
        Axis("draws", "declare as many as it needs as `draws`"),
        Axis("robots", "rows of noise can be longer than there are robots: stop at percept.heading.shape[0]"),
    )),
    Named("action.heading", (_ROBOT, _XY)),
    Named("action.distance", (_ROBOT,)),
]  # fmt: skip

# An action that no kernel computes, to see what was not written.
_UNWRITTEN = np.uint64(0x7FF8_5EED_5EED_5EED)


@inlined
def _neighbour_list(size: int, start: int, identity: int, offset: int, distance: int, number: int) -> NeighbourList:
    first = guarded_at(start, size + 1, np.int64, number + READ_ONLY)
    count = first[size]
    return NeighbourList(
        first,
        guarded_at(identity, count, np.int64, number + 1 + READ_ONLY),
        guarded_at(offset, (count, 2), np.float64, number + 2 + READ_ONLY),
        guarded_at(distance, count, np.float64, number + 3 + READ_ONLY),
    )


def _decide(address: int) -> int:
    d = array_at(address, 1, DECISION)[0]
    n = d.size
    percept = Percept(
        guarded_at(d.heading, (n, 2), np.float64, 13 + READ_ONLY),
        guarded_at(d.moved, (n, 2), np.float64, 14 + READ_ONLY),
        guarded_at(d.speed, n, np.float64, 15 + READ_ONLY),
        guarded_at(d.sensing_range, n, np.float64, 16 + READ_ONLY),
        guarded_at(d.awareness_range, n, np.float64, 17 + READ_ONLY),
        _neighbour_list(n, d.targets_start, d.targets_identity, d.targets_offset, d.targets_distance, 1),
        _neighbour_list(n, d.teammates_start, d.teammates_identity, d.teammates_offset, d.teammates_distance, 5),
        _neighbour_list(n, d.relayed_start, d.relayed_identity, d.relayed_offset, d.relayed_distance, 9),
        guarded_at(d.situation, (n, d.width), np.float32, 18 + READ_ONLY),
    )
    arrays = PolicyArrays(
        guarded_at(d.parameters, d.parameter_count, np.float64, 19 + READ_ONLY),
        guarded_at(d.table, (d.table_rows, d.table_columns), np.float32, 20 + READ_ONLY),
        PolicyState(
            guarded_at(d.floats, (n, d.floats_slots, d.floats_fields), np.float64, 21),
            guarded_at(d.ints, (n, d.ints_slots, d.ints_fields), np.int64, 22),
        ),
    )
    action = Action(
        guarded_at(d.action_heading, (n, 2), np.float64, 24),
        guarded_at(d.action_distance, n, np.float64, 25),
    )
    noise = guarded_at(d.noise, (d.draws, d.noise_size), np.float64, 23 + READ_ONLY + n * LIMIT)
    decision_kernel(percept, arrays, noise, action)  # type: ignore[name-defined]  # noqa: F821
    return 0


_ENTRIES: dict[Callable[..., Any], Entry | None] = {}


def _entry(policy: CompiledPolicy) -> Entry | None:
    kernel = getattr(type(policy), "kernel", None)
    if kernel is None:
        raise TypeError(f"{type(policy).__name__}: has no 'kernel'; give kernel(percept, arrays, noise, action)")
    if kernel not in _ENTRIES:
        name = type(policy).__name__
        made = specialise(_decide, f"{name.lower()}-guarded", decision_kernel=guarded(kernel))
        _ENTRIES[kernel] = machine_code(name, "its kernel", made, policy.entry())
    return _ENTRIES[kernel]


def check_declared(policy: CompiledPolicy) -> None:
    """Refuse parameters and knowledge that are no arrays of numbers of one and of two dimensions.

    Raises
    ------
    TypeError
        Naming the policy and the member.
    """
    for member, dimensions in (("parameters", 1), ("table", 2)):
        value = getattr(policy, member)
        try:
            # Knowledge can be large; it is not copied.
            array = value if isinstance(value, np.ndarray) else np.asarray(value, float)
        except (TypeError, ValueError):
            array = np.array("")
        if array.ndim != dimensions or array.dtype.kind not in "fiub":
            shown = " ".join(repr(value).split())[:80]
            raise TypeError(
                f"{type(policy).__name__}.{member}={shown}: must be numbers in {dimensions} "
                f"dimension{'s' * (dimensions > 1)}, such as {(1.0, 2.0) if dimensions == 1 else 'np.zeros((3, 2))'}"
            )


def try_decision(policy: CompiledPolicy, percept: Percept, memory: PolicyState, noise: Floats) -> None:
    """Run a policy's kernel on guarded arrays.

    Parameters
    ----------
    policy : CompiledPolicy
        Whose kernel.
    percept, memory, noise
        As `CompiledPolicy.decide` takes them; they stay as they are.

    Raises
    ------
    TypeError
        If the kernel cannot be compiled.
    ValueError
        If it uses memory, parameters or noise that the policy did not declare, writes into what it may only read, or
        leaves a part of the action unwritten.
    """
    entry = _entry(policy)
    if entry is None:
        return
    name, size = type(policy).__name__, len(percept.heading)
    check_declared(policy)
    check_memory(policy, memory, size)
    found = []
    # In a world, rows of noise are longer than there are robots. What stands there must not matter.
    for beyond in (np.nan, 0.5):
        long = np.full((len(noise), (size // 8 + 2) * 8), beyond)
        long[:, :size] = noise
        found.append(_run(entry, policy, percept, memory, long))
    (action, after), (other, otherwise) = found
    _check_written(name, action)
    pairs = zip((*action, *after), (*other, *otherwise), strict=True)
    if any(not np.array_equal(a, b, equal_nan=True) for a, b in pairs):
        raise ValueError(
            f"{name}: its kernel uses noise beyond the {size} robots; rows of noise can be longer: stop at "
            "percept.heading.shape[0]"
        )


def _check_written(name: str, action: Action) -> None:
    for part, array in action._asdict().items():
        is_written = (array.view(np.uint64) != _UNWRITTEN).reshape(len(array), -1).all(axis=1)
        if not is_written.all():
            raise ValueError(
                f"{name}: its kernel leaves action.{part} of robot {np.argmin(is_written)} unwritten, so that a world "
                "would go on with an older one; write it for every robot at each decision"
            )


def _run(
    entry: Entry, policy: CompiledPolicy, percept: Percept, memory: PolicyState, noise: Floats
) -> tuple[Action, PolicyState]:
    """Run the kernel once on arrays between fences; return the action and what is remembered afterwards."""
    name, fences = type(policy).__name__, Fences()
    parts: list[Any] = []
    for part, value in percept._asdict().items():
        if isinstance(value, tuple):
            seen = zip(NeighbourList._fields, value, strict=True)
            parts.append(
                NeighbourList(*(fences.put(f"percept.{part}.{n}", array, read_only=True) for n, array in seen))
            )
        else:
            parts.append(fences.put(f"percept.{part}", value, read_only=True))
    after = PolicyState(
        *(fences.put(f"arrays.state.{n}", array) for n, array in zip(PolicyState._fields, memory, strict=True))
    )
    size = len(percept.heading)
    blank = np.full((size, 3), _UNWRITTEN).view(np.float64)
    action = Action(fences.put("action.heading", blank[:, :2]), fences.put("action.distance", blank[:, 2]))
    record = np.zeros(1, DECISION)
    given = fences.put("noise", noise, read_only=True)
    kept = bind_decision(record[0], policy, Percept(*parts), after, given, action)
    run_guarded(name, "its kernel", entry, record.ctypes.data, _ARRAYS)
    del kept
    if broken := fences.broken():
        raise ValueError(
            f"{name}: its kernel writes next to {broken}, or into it where it may only read; index arrays within their "
            "shape"
        )
    return Action(action.heading.copy(), action.distance.copy()), PolicyState(after.floats.copy(), after.ints.copy())
