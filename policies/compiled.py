"""Compiled policies: a kernel that decides for a whole group, and the record of its arguments."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.contracts import check_names, parameters_of
from teamsight.core.kernel import Entry, Packed, Record, specialise
from teamsight.policies.channels import (
    OWN_FIELDS,
    channels_type,
    checked_channel,
    columns_type,
    selected,
    selected_columns,
)
from teamsight.policies.interface import (
    IDENTITIES,
    Action,
    Floats,
    Integers,
    Percept,
    Policy,
    PolicyArrays,
    PolicyState,
)


class Decision(NamedTuple):
    """The record of a decision.

    Attributes
    ----------
    percept, arrays, action
        The arguments of the policy's kernel.
    noise : ndarray, shape (ticks, draws, lanes), float64
        The uniform numbers of some ticks. Rows can be longer than there are robots.
    tick : ndarray, shape (1,), int64
        The present tick; its numbers are ``noise[tick % ticks]``.
    """

    percept: Percept
    arrays: PolicyArrays
    noise: Annotated[Floats, "ticks", "draws", "lanes"]
    tick: Annotated[Integers, 1]
    action: Action


@cache
def decision_record(channels: tuple[str, ...], columns: tuple[str, ...] = ()) -> Record[Decision]:
    """Return the record of decisions of policies that read these channels and columns."""
    return Record(Decision, {"percept.channels": channels_type(channels), "percept.columns": columns_type(columns)})


def decide_at(address: int) -> int:
    """Call a policy's kernel on the arrays of a decision record."""
    decision = decision_at(address)  # type: ignore[name-defined]  # noqa: F821
    noise = decision.noise[decision.tick[0] % decision.noise.shape[0]]
    decision_kernel(decision.percept, decision.arrays, noise, decision.action)  # type: ignore[name-defined]  # noqa: F821
    return 0


_ENTRIES: dict[tuple[Any, ...], Entry] = {}

#: If set, called with the arguments of `CompiledPolicy.decide` before the kernel runs; `check_policy` sets it.
before_decision: Callable[[CompiledPolicy, Percept, PolicyState, Floats], Any] | None = None


class CompiledPolicy(Policy):
    """A policy whose rule is a kernel, so that a world can run without Python between its steps.

    A subclass defines `kernel` and, if the defaults do not fit, `parameters`, `table`, `start` and the attributes of
    `Policy`.

    Attributes
    ----------
    kernel : kernel
        ``kernel(percept, arrays, noise, action)`` writes ``action.heading`` and ``action.distance`` of each robot and
        changes ``arrays.state`` in place. Rows of `noise` are draws; they may be longer than there are robots.
    """

    kernel: ClassVar[Callable[..., None]]

    @property
    def is_compiled(self) -> bool:
        """Whether it decides by its kernel alone, so that a world needs no Python; not with a `decide` of its own."""
        return type(self).decide is CompiledPolicy.decide

    @property
    def is_sound(self) -> bool:
        """Whether the kernel's actions are valid for every percept, so that worlds need not check them."""
        return False

    @property
    def reads_teammates(self) -> bool:
        """Whether the kernel reads ``percept.teammates`` or ``percept.relayed``; if not, both are empty for it."""
        return True

    @property
    def parameters(self) -> tuple[float, ...] | Floats:
        """The policy's constants, in the order in which its kernel reads them; by default the fields of a dataclass."""
        return parameters_of(self, CompiledPolicy)

    @property
    def table(self) -> npt.NDArray[np.float32]:
        """The table that all robots of a group share; empty by default."""
        return np.zeros((0, 0), np.float32)

    def start(self, size: int) -> PolicyState:
        """Return the state of `size` robots before their first decision; empty by default."""
        return PolicyState(np.zeros((size, 0, 0)), np.zeros((size, 0, 0), np.int64))

    def check_percept(self, percept: Percept) -> None:
        """Raise an error for a percept, not made by a world, that the kernel cannot read."""

    def entry(self) -> Entry:
        """Return the compiled decision of this kind of policy."""
        kernel = type(self).kernel
        kind = kernel, self.channels, self.columns
        if kind not in _ENTRIES:
            name, read = type(self).__name__.lower(), decision_record(self.channels, self.columns).at
            # The errors of compilation name the declared channels.
            bound = {"decision_kernel": kernel, "decision_at": read, "declared_channels": self.channels}
            _ENTRIES[kind] = specialise(decide_at, name, **bound)
        return _ENTRIES[kind]

    def decide(self, percept: Percept, state: PolicyState, noise: Floats) -> tuple[Action, PolicyState]:
        """Return the robots' actions and their new state; the arguments are not changed.

        Parameters
        ----------
        percept : Percept
            The percept of n robots.
        state : PolicyState
            Their state after the last decision.
        noise : ndarray, shape (draws, n), float64
            Uniform numbers in (0, 1).
        """
        self.check_percept(percept)
        if before_decision is not None:
            before_decision(self, percept, state, noise)
        size = len(percept.heading)
        action = Action(np.zeros((size, 2)), np.zeros(size))
        after = PolicyState(state.floats.copy(), state.ints.copy())
        numbers = np.ascontiguousarray(noise, float)[np.newaxis]
        self.entry()(pack_decision(self, dense(percept), after, numbers, np.zeros(1, np.int64), action))
        return action, after


def check_state(policy: CompiledPolicy, state: Any, size: int) -> None:
    """Refuse a state that is not a `PolicyState` of arrays of the right types with a row for each robot."""
    name = f"{type(policy).__name__}.start({size})"
    if not isinstance(state, PolicyState):
        raise TypeError(f"{name}: returned {type(state).__name__}; it must return PolicyState(floats, ints)")
    for part, array, dtype in (("floats", state.floats, np.float64), ("ints", state.ints, np.int64)):
        if not isinstance(array, np.ndarray) or array.dtype != dtype:
            kind = getattr(array, "dtype", type(array).__name__)
            raise TypeError(f"{name}.{part}: has the type {kind}; it must be {dtype.__name__}")
        if array.ndim != 3 or len(array) != size or not array.flags.c_contiguous:
            raise ValueError(
                f"{name}.{part}: has the shape {array.shape}; it must be C-contiguous, ({size}, slots, fields)"
            )


def pack_decision(
    policy: CompiledPolicy, percept: Percept, state: PolicyState, noise: Floats, tick: Integers, action: Action
) -> Packed[Decision]:
    """Return the record of a decision; parameters as for `Decision`, with C-contiguous arrays."""
    check_state(policy, state, len(percept.heading))
    parameters, table = np.array(policy.parameters, float), np.ascontiguousarray(policy.table, np.float32)
    channels = selected(percept.channels, policy.channels, type(policy).__name__)
    if channels is not percept.channels:
        percept = percept._replace(channels=channels)
    columns = selected_columns(percept.columns, policy.columns, type(policy).__name__)
    if columns is not percept.columns:
        percept = percept._replace(columns=columns)
    percept = percept.completed()
    arrays = PolicyArrays(parameters, table, state)
    return decision_record(policy.channels, policy.columns).pack(Decision(percept, arrays, noise, tick, action))


def dense(value: Any) -> Any:
    """Return an array, or the arrays of a NamedTuple, C-contiguous."""
    return type(value)(*map(dense, value)) if isinstance(value, tuple) else np.ascontiguousarray(value)


def decides_in_kernel(policy: Any) -> bool:
    """Return whether a policy decides by a kernel alone."""
    return isinstance(policy, CompiledPolicy) and policy.is_compiled


def check_declarations(name: str, policy: Policy) -> None:
    """Refuse a policy whose declarations have a wrong type; see `Policy`.

    Parameters
    ----------
    name : str
        The policy, for error messages.
    policy : Policy
        The policy.

    Raises
    ------
    TypeError, ValueError
        Naming the attribute.
    """
    if decides_in_kernel(policy) and not hasattr(type(policy), "kernel"):
        raise TypeError(f"{name}: has no 'kernel'; give kernel(percept, arrays, noise, action)")
    for attribute in ("draws", "inputs", "rays", "effort"):
        checks.count(f"{name}.{attribute}", getattr(policy, attribute), least=0)
    for attribute in ("channels", "columns", "shows", "needs"):
        check_names(f"{name}.{attribute}", getattr(policy, attribute), "('predators',)")
    for need in policy.needs:
        checks.choice(f"{name}.needs", need, (*OWN_FIELDS, IDENTITIES))
    checks.flag(f"{name}.decides_together", policy.decides_together)
    for channel in policy.channels:
        if channel in OWN_FIELDS:
            raise ValueError(f"{name}.channels: {channel!r} is a field of percepts, percept.{channel}; leave it out")
        checked_channel(channel)
    for column in (*policy.columns, *policy.shows):
        if not column.isidentifier() or hasattr(tuple, column):
            raise ValueError(f"{name}.columns: {column!r} cannot be an attribute of percept.columns; rename the column")
    state = policy.start(1) if policy.shows else None
    fields = state.floats.shape[2] if isinstance(state, PolicyState) and state.floats.shape[1] else 0
    if fields < len(policy.shows):
        raise ValueError(
            f"{name}.shows={policy.shows}: are the first {len(policy.shows)} fields of its state.floats[:, 0], which "
            f"has {fields}; return PolicyState(np.zeros((size, 1, {len(policy.shows)})), …) from start(size)"
        )
