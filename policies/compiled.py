"""Compiled policies: a kernel that decides for a whole group, and the record that hands it the percept."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, array_at, inlined, specialise
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies.interface import Action, Floats, Percept, Policy, PolicyArrays, PolicyState

_SEEN = ("start", "identity", "offset", "distance")

DECISION = np.dtype(
    [(name, np.int64) for name in ("size", "heading", "moved", "speed", "sensing_range", "awareness_range")]
    + [(f"{kind}_{name}", np.int64) for kind in ("targets", "teammates", "relayed") for name in _SEEN]
    + [(name, np.int64) for name in ("situation", "width", "parameters", "parameter_count")]
    + [(name, np.int64) for name in ("table", "table_rows", "table_columns")]
    + [(name, np.int64) for name in ("floats", "floats_slots", "floats_fields", "ints", "ints_slots", "ints_fields")]
    + [(name, np.int64) for name in ("noise", "draws", "noise_size", "action_heading", "action_distance")]
)


@inlined
def neighbour_list_at(size: int, start: int, identity: int, offset: int, distance: int) -> NeighbourList:
    """Return the sightings of `size` robots whose arrays lie at these addresses."""
    first = array_at(start, size + 1, np.int64)
    count = first[size]
    return NeighbourList(
        first,
        array_at(identity, count, np.int64),
        array_at(offset, (count, 2), np.float64),
        array_at(distance, count, np.float64),
    )


def _decide(address: int) -> int:
    d = array_at(address, 1, DECISION)[0]
    n = d.size
    targets = neighbour_list_at(n, d.targets_start, d.targets_identity, d.targets_offset, d.targets_distance)
    teammates = neighbour_list_at(n, d.teammates_start, d.teammates_identity, d.teammates_offset, d.teammates_distance)
    relayed = neighbour_list_at(n, d.relayed_start, d.relayed_identity, d.relayed_offset, d.relayed_distance)
    percept = Percept(
        array_at(d.heading, (n, 2), np.float64),
        array_at(d.moved, (n, 2), np.float64),
        array_at(d.speed, n, np.float64),
        array_at(d.sensing_range, n, np.float64),
        array_at(d.awareness_range, n, np.float64),
        targets,
        teammates,
        relayed,
        array_at(d.situation, (n, d.width), np.float32),
    )
    arrays = PolicyArrays(
        array_at(d.parameters, d.parameter_count, np.float64),
        array_at(d.table, (d.table_rows, d.table_columns), np.float32),
        PolicyState(
            array_at(d.floats, (n, d.floats_slots, d.floats_fields), np.float64),
            array_at(d.ints, (n, d.ints_slots, d.ints_fields), np.int64),
        ),
    )
    action = Action(
        array_at(d.action_heading, (n, 2), np.float64),
        array_at(d.action_distance, n, np.float64),
    )
    decision_kernel(percept, arrays, array_at(d.noise, (d.draws, d.noise_size), np.float64), action)  # type: ignore[name-defined]  # noqa: F821
    return 0


_ENTRIES: dict[Callable[..., Any], Entry] = {}

#: Called with what `CompiledPolicy.decide` is called with, before the kernel runs; `check_policy` tries it there.
before_decision: Callable[[CompiledPolicy, Percept, PolicyState, Floats], Any] | None = None


class CompiledPolicy(Policy):
    """A policy whose rule is a kernel, so that a world can run without Python between its steps.

    A subclass gives `kernel` and, where it has them, `parameters`, `draws`, `knowledge` and `start`.

    Attributes
    ----------
    kernel : kernel
        ``kernel(percept, arrays, noise, action)`` writes ``action.heading`` and ``action.distance`` for every robot and
        changes ``arrays.state`` in place. Rows of `noise` are draws; they may be longer than there are robots.
    draws : int
        How many uniform random numbers each robot needs for a decision.
    """

    kernel: ClassVar[Callable[..., None]]

    @property
    def is_sound(self) -> bool:
        """Whether the kernel's actions are valid for every percept, so that worlds need not check them."""
        return False

    @property
    @abstractmethod
    def parameters(self) -> tuple[float, ...] | Floats:
        """The policy's constants, in the order in which its kernel reads them."""

    @property
    def table(self) -> npt.NDArray[np.float32]:
        """The table that all robots of a group share; by default an empty one."""
        return np.zeros((0, 0), np.float32)

    def start(self, size: int) -> PolicyState:
        """Return what `size` robots remember before their first decision; by default nothing."""
        return PolicyState(np.zeros((size, 0, 0)), np.zeros((size, 0, 0), np.int64))

    def check_percept(self, percept: Percept) -> None:
        """Refuse a percept, given from Python, that the kernel cannot read; worlds give none such."""

    @classmethod
    def entry(cls) -> Entry:
        """Return the compiled decision of this kind of policy."""
        if cls.kernel not in _ENTRIES:
            _ENTRIES[cls.kernel] = specialise(_decide, cls.__name__.lower(), decision_kernel=cls.kernel)
        return _ENTRIES[cls.kernel]

    def decide(self, percept: Percept, memory: PolicyState, noise: Floats) -> tuple[Action, PolicyState]:
        """Return the robots' action and what they remember from now on; the arguments stay as they are.

        Parameters
        ----------
        percept : Percept
            What n robots know.
        memory : PolicyState
            What they remember.
        noise : ndarray, shape (draws, n), float64
            Uniform numbers in (0, 1).
        """
        self.check_percept(percept)
        if before_decision is not None:
            before_decision(self, percept, memory, noise)
        size = len(percept.heading)
        action = Action(np.zeros((size, 2)), np.zeros(size))
        after = PolicyState(memory.floats.copy(), memory.ints.copy())
        record = np.zeros(1, DECISION)
        kept = bind_decision(record[0], self, percept, after, np.ascontiguousarray(noise, float), action)
        self.entry()(record.ctypes.data)
        del kept
        return action, after


def check_memory(policy: CompiledPolicy, memory: Any, size: int) -> None:
    """Refuse a memory that a kernel would read beyond its end.

    Raises
    ------
    TypeError, ValueError
        If it is no `PolicyState` of arrays with a row for each robot and the right types.
    """
    name = f"{type(policy).__name__}.start({size})"
    if not isinstance(memory, PolicyState):
        raise TypeError(f"{name} returned {type(memory).__name__}; a compiled policy needs PolicyState(floats, ints)")
    for part, array, dtype in (("floats", memory.floats, np.float64), ("ints", memory.ints, np.int64)):
        if not isinstance(array, np.ndarray) or array.dtype != dtype:
            kind = getattr(array, "dtype", type(array).__name__)
            raise TypeError(f"{name}.{part}: has the type {kind}; it must be {dtype.__name__}")
        if array.ndim != 3 or len(array) != size or not array.flags.c_contiguous:
            raise ValueError(f"{name}.{part}: has the shape {array.shape}; it must be dense, ({size}, slots, fields)")


def bind_decision(
    record: Any, policy: CompiledPolicy, percept: Percept, memory: PolicyState, noise: Floats, action: Action
) -> list[npt.NDArray[Any]]:
    """Write the addresses of all that a decision reads and writes into a record.

    Returns
    -------
    list of ndarray
        The arrays; whoever uses the record must keep them.
    """
    check_memory(policy, memory, len(percept.heading))
    given = PolicyArrays(np.array(policy.parameters, float), np.ascontiguousarray(policy.table, np.float32), memory)
    arrays: dict[str, npt.NDArray[Any]] = {
        "heading": percept.heading, "moved": percept.moved, "speed": percept.speed,
        "sensing_range": percept.sensing_range, "awareness_range": percept.awareness_range,
        "situation": percept.situation, "parameters": given.parameters, "table": given.table,
        "floats": memory.floats, "ints": memory.ints, "noise": noise,
    }  # fmt: skip
    for kind in ("targets", "teammates", "relayed"):
        arrays |= {f"{kind}_{name}": getattr(getattr(percept, kind), name) for name in _SEEN}
    # A caller's arrays may be views with gaps; kernels read dense ones.
    arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    arrays |= {"action_heading": action.heading, "action_distance": action.distance}
    for name, array in arrays.items():
        record[name] = array.ctypes.data
    record["size"], record["width"] = percept.situation.shape
    record["parameter_count"] = len(given.parameters)
    record["table_rows"], record["table_columns"] = given.table.shape
    record["floats_slots"], record["floats_fields"] = memory.floats.shape[1:]
    record["ints_slots"], record["ints_fields"] = memory.ints.shape[1:]
    record["draws"], record["noise_size"] = noise.shape
    return list(arrays.values())
