"""Calls of interactions on guarded arrays, which reveal forbidden reads and writes of a kernel."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, specialise
from teamsight.core.kernel.fences import Fences
from teamsight.core.kernel.guarded_arrays import Axis, machine_code, run_guarded
from teamsight.core.kernel.guarded_copy import guarded
from teamsight.core.kernel.guarded_record import GuardedRecord
from teamsight.world.interaction import (
    WRITABLE,
    Interacting,
    Interaction,
    InteractionState,
    Kinds,
    bodies_type,
    interact_at,
    interacting_record,
    lanes_of,
    length_of,
)

_STATE = "start(sizes) determines the shape"


@cache
def _guarded_record(kinds: Kinds) -> GuardedRecord:
    axes = {
        "2": Axis("components", "0 is x, and 1 is y"),
        "parameters": Axis("parameters", "add what it needs to `parameters`"),
        "scores": Axis("scores", "declare as many as it needs as `scores`"),
        "draws": Axis("draws", "declare as many as it needs as `draws`"),
        "floatrows": Axis("rows", _STATE), "floatfields": Axis("fields", _STATE),
        "introws": Axis("rows", _STATE), "intfields": Axis("fields", _STATE),
    }  # fmt: skip
    writable, limits = ["state", "scores"], {}
    for role, columns in kinds:
        count = f"bodies.{role}.position.shape[0]"
        axes[length_of(role)] = Axis("bodies", f"{role} are 0 to n − 1, and n is {count}")
        axes[lanes_of(role)] = Axis("bodies", f"rows of noise can be longer than there are {role}: stop at {count}")
        writable += [f"bodies.{role}.{name}" for name in (*WRITABLE, *(name for name, _ in columns))]
        limits[f"noise.{role}"] = length_of(role)
    return GuardedRecord(interacting_record(kinds), tuple(writable), axes, limits)


_ENTRIES: dict[tuple[Callable[..., Any], Kinds], Entry | None] = {}


def _entry(interaction: Interaction, kinds: Kinds) -> Entry | None:
    kind = type(interaction).kernel, kinds
    if kind not in _ENTRIES:
        name = type(interaction).__name__
        guards = {"interaction_kernel": guarded(type(interaction).kernel), "interacting_at": _guarded_record(kinds).at}
        made = specialise(interact_at, f"{name.lower()}-guarded", **guards)
        _ENTRIES[kind] = machine_code(name, "its kernel", made, interaction.entry(kinds))
    return _ENTRIES[kind]


class Called:
    """What a kernel has written in one call on guarded copies.

    Attributes
    ----------
    bodies : dict of str to NamedTuple
        The bodies of each role.
    state : InteractionState
        The state.
    scores : ndarray, shape (s,), float64
        The scores.
    """

    def __init__(
        self,
        interaction: Interaction,
        kinds: Kinds,
        given: tuple[dict[str, Any], InteractionState, dict[str, npt.NDArray[np.float64]]],
        turn: int,
    ) -> None:
        (bodies, state, noise), fences = given, Fences()
        self.bodies = {
            role: bodies_type(role, columns)(*(
                fences.put(f"bodies.{role}.{name}", array, read_only=name in ("before", "moved", "active", "identity"))
                for name, array in bodies[role]._asdict().items()
            ))
            for role, columns in kinds
        }  # fmt: skip
        self.state: InteractionState = fences.put("state", state)
        self.scores = fences.put("scores", np.zeros(len(interaction.scores)))
        parameters = fences.put("parameters", np.array(interaction.parameters, float), read_only=True)
        rows = {role: fences.put(f"noise.{role}", array, read_only=True) for role, array in noise.items()}
        record = interacting_record(kinds)
        bodies_kind, noise_kind = record.node.parts[0].kind, record.node.parts[3].kind
        call = Interacting(
            bodies_kind(**self.bodies), self.state, parameters, noise_kind(**rows), self.scores, turn
        )  # fmt: skip
        entry, name = _entry(interaction, kinds) or interaction.entry(kinds), type(interaction).__name__
        run_guarded(name, "its kernel", entry, record.pack(call), _guarded_record(kinds).arrays, fences)

    @property
    def arrays(self) -> list[npt.NDArray[Any]]:
        """All that was written."""
        return [*(array for one in self.bodies.values() for array in one), *self.state, self.scores]
