"""Decisions of compiled policies on guarded arrays, which reveal forbidden reads and writes of a kernel."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from teamsight.core.kernel import Entry, specialise
from teamsight.core.kernel.guard import Axis, Fences, GuardedRecord, guarded, machine_code, run_guarded
from teamsight.policies.compiled import CompiledPolicy, check_state, decide_at, decision_record, pack_decision
from teamsight.policies.interface import Action, Floats, Percept, PolicyState

_ROBOT = Axis("robots", "robots are 0 to n − 1, and n is percept.heading.shape[0]")
_TABLE = "the policy's `table` determines the shape"
_DECLARED = "declare as many as it needs in start(size)"

#: The axes of percepts and scenes, by the name of their length; for errors.
PERCEPT_AXES = {
    "n": _ROBOT,
    "2": Axis("components", "0 is x, and 1 is y"),
    "n + 1": Axis("elements", "there is one more than robots; robot i's are start[i] and start[i + 1]"),
    "k": Axis("neighbours", "those of robot i are start[i] up to, not including, start[i + 1]"),
    "width": Axis("inputs", "declare as many as it needs as `inputs`"),
    "identities": Axis("identities", "hidden ones are −1; read elements by column_of(column, identity)"),
    "p": Axis("parameters", "add what it needs to `parameters`"),
}

_AXES = PERCEPT_AXES | {
    "rows": Axis("rows", _TABLE), "columns": Axis("columns", _TABLE),
    "slots": Axis("slots", _DECLARED), "fields": Axis("fields", _DECLARED),
    "intslots": Axis("slots", _DECLARED), "intfields": Axis("fields", _DECLARED),
    "ticks": Axis("ticks", "the kernel receives one"), "1": Axis("ticks", "there is one"),
    "draws": Axis("draws", "declare as many as it needs as `draws`"),
    "lanes": Axis(
        "robots", "rows of noise can be longer than there are robots: stop at percept.heading.shape[0]"
    ),
}  # fmt: skip


@cache
def _guarded_record(channels: tuple[str, ...], columns: tuple[str, ...]) -> GuardedRecord:
    return GuardedRecord(decision_record(channels, columns), ("arrays.state", "action"), _AXES, {"noise": "n"})


# A value that no kernel computes; it marks what was not written.
_UNWRITTEN = np.uint64(0x7FF8_5EED_5EED_5EED)

_ENTRIES: dict[tuple[Any, ...], Entry | None] = {}


def _entry(policy: CompiledPolicy) -> Entry | None:
    kernel = getattr(type(policy), "kernel", None)
    if kernel is None:
        raise TypeError(f"{type(policy).__name__}: has no 'kernel'; give kernel(percept, arrays, noise, action)")
    kind = kernel, policy.channels, policy.columns
    if kind not in _ENTRIES:
        name = type(policy).__name__
        record = _guarded_record(policy.channels, policy.columns)
        guards = {"decision_kernel": guarded(kernel), "decision_at": record.at}
        made = specialise(decide_at, f"{name.lower()}-guarded", **guards)
        _ENTRIES[kind] = machine_code(name, "its kernel", made, policy.entry())
    return _ENTRIES[kind]


def check_declared(policy: CompiledPolicy) -> None:
    """Refuse parameters that are not numbers in one dimension, and a table that is not in two."""
    for member, dimensions in (("parameters", 1), ("table", 2)):
        value = getattr(policy, member)
        try:
            # A table can be large; it is not copied.
            array = value if isinstance(value, np.ndarray) else np.asarray(value, float)
        except (TypeError, ValueError):
            array = np.array("")
        if array.ndim != dimensions or array.dtype.kind not in "fiub":
            shown = " ".join(repr(value).split())[:80]
            raise TypeError(
                f"{type(policy).__name__}.{member}={shown}: must be numbers in {dimensions} "
                f"dimension{'s' * (dimensions > 1)}, such as {(1.0, 2.0) if dimensions == 1 else 'np.zeros((3, 2))'}"
            )


def try_decision(policy: CompiledPolicy, percept: Percept, state: PolicyState, noise: Floats) -> None:
    """Run a policy's kernel on guarded copies of the arguments of `CompiledPolicy.decide`.

    Raises
    ------
    TypeError
        If the kernel cannot be compiled.
    ValueError
        If it uses state, parameters or noise that the policy did not declare, writes into read-only arrays, or leaves a
        part of the action unwritten.
    """
    entry = _entry(policy)
    if entry is None:
        return
    name, size = type(policy).__name__, len(percept.heading)
    check_declared(policy)
    check_state(policy, state, size)
    found = []
    # In a world, rows of noise are longer than there are robots. The numbers behind must have no effect.
    for beyond in (np.nan, 0.5):
        long = np.full((len(noise), (size // 8 + 2) * 8), beyond)
        long[:, :size] = noise
        found.append(_run(entry, policy, percept, state, long))
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
                f"{name}: its kernel leaves action.{part} of robot {np.argmin(is_written)} unwritten, so that the last "
                "one would be repeated; write it for every robot at each decision"
            )


def _run(
    entry: Entry, policy: CompiledPolicy, percept: Percept, state: PolicyState, noise: Floats
) -> tuple[Action, PolicyState]:
    """Run the kernel once on arrays between fences; return the action and the new state."""
    name, fences = type(policy).__name__, Fences()
    size = len(percept.heading)
    blank = np.full((size, 3), _UNWRITTEN).view(np.float64)
    action = Action(fences.put("action.heading", blank[:, :2]), fences.put("action.distance", blank[:, 2]))
    after: PolicyState = fences.put("arrays.state", state)
    fenced: Percept = fences.put("percept", percept, read_only=True)
    given = fences.put("noise", noise[np.newaxis], read_only=True)
    record = pack_decision(policy, fenced, after, given, np.zeros(1, np.int64), action)
    run_guarded(name, "its kernel", entry, record, _guarded_record(policy.channels, policy.columns).arrays, fences)
    return Action(action.heading.copy(), action.distance.copy()), PolicyState(after.floats.copy(), after.ints.copy())
