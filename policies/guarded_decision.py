"""Decisions of compiled policies under guard, which reveal forbidden reads and writes of a kernel."""

from __future__ import annotations

from functools import cache

import numpy as np

from teamsight.core.kernel.guard import Axis, Guard
from teamsight.policies.compiled import CompiledPolicy, Decision, check_state, decision_record, dense, pack_decision
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
def _guard(channels: tuple[str, ...], columns: tuple[str, ...]) -> Guard[Decision]:
    return Guard(decision_record(channels, columns), ("arrays.state", "action"), _AXES)


# A value that no kernel computes; it marks what was not written.
_UNWRITTEN = np.uint64(0x7FF8_5EED_5EED_5EED)

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
    """Run a policy's kernel under guard, on copies of the arguments of `CompiledPolicy.decide`.

    Raises
    ------
    TypeError
        If the kernel cannot be compiled.
    ValueError
        If it uses state, parameters or noise that the policy did not declare, writes into read-only arrays, or leaves a
        part of the action unwritten.
    """
    name, size = type(policy).__name__, len(percept.heading)
    if getattr(type(policy), "kernel", None) is None:
        raise TypeError(f"{name}: has no 'kernel'; give kernel(percept, arrays, noise, action)")
    check_declared(policy)
    check_state(policy, state, size)
    action = Action(*(np.full(shape, _UNWRITTEN).view(np.float64) for shape in ((size, 2), size)))
    # In a world, rows of noise are longer than there are robots. The numbers behind must have no effect.
    long = np.zeros((1, len(noise), (size // 8 + 2) * 8))
    long[0, :, :size] = noise
    given = pack_decision(policy, dense(percept), state, long, np.zeros(1, np.int64), action).value
    guard = _guard(policy.channels, policy.columns)
    guard.interpret(name, "its kernel", policy.entry(), given, {"noise": size})
    found = []
    for beyond in (np.nan, 0.5):
        long[0, :, size:] = beyond
        done = guard.execute(name, "its kernel", policy.entry(), given)[1]
        found.append((*done.action, *done.arrays.state))
    _check_written(name, Action(*found[0][:2]))
    if any(not np.array_equal(a, b, equal_nan=True) for a, b in zip(*found, strict=True)):
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
