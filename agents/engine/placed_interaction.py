"""An interaction in a world: its groups, its state, and how it is laid out for the compiled loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.interaction_records import (
    INTERACTION,
    ROLE,
    InteractionArrays,
    PartakerArrays,
    RoleArrays,
)
from teamsight.agents.engine.state_rows import layout
from teamsight.agents.group import Group
from teamsight.core.kernel import Packed
from teamsight.core.kernel.window import Integers
from teamsight.core.references import stable_name
from teamsight.world.interaction import (
    Interacting,
    InteractingBodies,
    Interaction,
    InteractionState,
    Kinds,
    bodies_type,
    first_state,
    interacting_record,
    sizes_type,
)
from teamsight.world.noise import LANES, TICKS_A_BLOCK, Stream, key_within, stream_number
from teamsight.world.region import Region

Key = npt.NDArray[np.uint64]


class InteractionSaved(NamedTuple):
    """What changes of an interaction in a run; see `PlacedInteraction`."""

    described: tuple[Any, ...]
    state: InteractionState
    first: dict[tuple[str, str], npt.NDArray[Any]]
    changes: dict[str, Any]


class PlacedInteraction:
    """An interaction in a world.

    Parameters
    ----------
    interaction : Interaction
        The interaction, as it is declared: with its parameters at the begin of a run.
    groups : tuple of Group
        The group of each role.
    nth : int
        Which of its class it is in its world, from 0; its random numbers depend on it.
    key : ndarray, shape (2,), uint64
        The key of the world's noise.

    Attributes
    ----------
    declared, interaction : Interaction
        The interaction as it is declared, and as it is now.
    changes : dict of str to object
        The fields that were changed since, by name.
    state : InteractionState
        Its state.
    first : dict of (str, str) to ndarray
        For each role and column, the values with which members begin a run.
    """

    def __init__(self, interaction: Interaction, groups: tuple[Group, ...], nth: int, key: Key) -> None:
        # Any, because `replace` needs a dataclass, and one without fields need not be one.
        self.declared: Any = interaction
        self.interaction = interaction
        self.groups, self.nth = groups, nth
        self.changes: dict[str, Any] = {}
        self.parameters = np.array(interaction.parameters, float)
        self._first_parameters = tuple(self.parameters.tolist())
        self.scores = np.zeros(len(interaction.scores))
        self.key = np.zeros(2, np.uint64)
        self.block = np.full(1, -1)
        self.state = first_state(interaction, self.sizes)
        self.first: dict[tuple[str, str], npt.NDArray[Any]] = {}
        self.begin(key)

    @property
    def described(self) -> tuple[Any, ...]:
        """What it is and between whom; equal for the same interaction in a world that was built in the same way."""
        one, groups = self.declared, tuple(group.name for group in self.groups)
        return self.name, one.roles, groups, self._first_parameters, one.scores

    @property
    def name(self) -> str:
        """The name of its class, for errors."""
        return type(self.interaction).__name__

    @property
    def roles(self) -> dict[str, Group]:
        """The group of each role."""
        return dict(zip(self.interaction.roles, self.groups, strict=True))

    @property
    def sizes(self) -> Any:
        """The number of bodies of each role, as a NamedTuple."""
        return sizes_type(self.interaction.roles)(*map(len, self.groups))

    def begin(self, key: Key) -> None:
        """Begin to draw from the noise of a world with this key."""
        self.key[:] = key_within(key, f"interaction {stable_name(type(self.interaction))} {self.nth}")
        self.block[:] = -1

    def with_changes(self, changes: Mapping[str, Any]) -> Interaction:
        """Return the interaction with other values of these fields; see `take`.

        Raises
        ------
        ValueError
            If more than what the kernel reads in each step would differ.
        """
        changed: Interaction = replace(self.declared, **changes)
        for what in ("roles", "scores", "draws", "in_turn", "columns"):
            if getattr(changed, what) != getattr(self.declared, what):
                raise ValueError(f"{self.name}.{what}: cannot change in a run; build another world")
        if len(changed.parameters) != len(self.parameters):
            raise ValueError(f"{self.name}.parameters: their number cannot change in a run; build another world")
        begun = zip(first_state(changed, self.sizes), first_state(self.declared, self.sizes), strict=True)
        if not all(np.array_equal(new, old) for new, old in begun):
            raise ValueError(f"{self.name}.start: the state in which runs begin cannot change; build another world")
        return changed

    def take(self, changes: Mapping[str, Any]) -> None:
        """Let these fields have other values, and all others those that were declared; see `with_changes`."""
        self.interaction = replace(self.declared, **changes) if changes else self.declared
        self.changes = dict(changes)
        # In place, because the kernel reads it.
        self.parameters[:] = self.interaction.parameters

    def restart(self, state: InteractionState, *, is_kept: bool) -> None:
        """Go back to the start of a run; if arrays are kept, they are written instead of replaced."""
        if self.changes:
            self.take({})
        if is_kept and all(old.shape == new.shape for old, new in zip(self.state, state, strict=True)):
            for old, new in zip(self.state, state, strict=True):
                old[:] = new
        else:
            self.state = state
        fills = {(role, name): fill for role, name, fill in self.interaction.columns}
        for (role, name), first in self.first.items():
            group = self.roles[role]
            column, member = group.columns.array(name), group.bodies.member
            # Those that came later begin as new ones do.
            column[:] = fills[role, name]
            known = member < len(first)
            column[known] = first[member[known]]

    def saved(self) -> InteractionSaved:
        """Return what changes in a run, as it is."""
        return InteractionSaved(self.described, self.state, self.first, self.changes)

    def put_back(self, saved: InteractionSaved) -> None:
        """Go back to what was saved."""
        self.state, self.first = saved.state, saved.first
        self.take(saved.changes)

    def _note_first(self) -> None:
        """Note with which values members begin that have come since."""
        fills = {(role, name): fill for role, name, fill in self.interaction.columns}
        for (role, name), first in self.first.items():
            group = self.roles[role]
            column, member, known = group.columns.array(name), group.bodies.member, len(first)
            if group.members_so_far == known:
                continue
            longer = np.full(group.members_so_far, fills[role, name], column.dtype)
            kept = min(known, len(longer))
            longer[:kept] = first[:kept]
            longer[member[member >= known]] = column[member >= known]
            self.first[role, name] = longer

    @property
    def kinds(self) -> Kinds:
        """The columns of each role: name and type."""
        declared = self.interaction.columns
        return tuple(
            (role, tuple((name, group.columns.array(name).dtype.str) for of, name, _ in declared if of == role))
            for role, group in self.roles.items()
        )

    @property
    def arrays(self) -> list[npt.NDArray[Any]]:
        """The arrays that only its kernel writes: its state and its columns."""
        roles = self.roles
        return [*self.state, *(roles[role].columns.array(name) for role, name, _ in self.interaction.columns)]

    def bind(
        self, partakers: dict[int, Packed[PartakerArrays]], region: Region, first_score: int
    ) -> Packed[InteractionArrays]:
        """Return the record of the interaction; `partakers` are those of the groups, by number."""
        self._note_first()
        kinds, roles = self.kinds, []
        for role, group in enumerate(self.groups):
            size = len(group)
            lanes = -(-max(size, 1) // LANES) * LANES
            members = np.zeros(lanes, np.int64)
            members[:size] = group.bodies.member
            noise = np.zeros((TICKS_A_BLOCK, self.interaction.draws, lanes))
            stream = stream_number(Stream.INTERACTION, role)
            roles.append(RoleArrays(
                partakers[group.number], noise, members, stream, np.zeros(size), np.zeros(size, np.bool_)
            ))  # fmt: skip
        self.block[:] = -1
        call = interacting_record(kinds).pack(self._call(kinds, partakers, roles))
        turn, moves = _words(call, roles)
        return INTERACTION.pack(InteractionArrays(
            self.interaction.entry(kinds), call, call.words, turn, moves, self.interaction.in_turn, self.key,
            self.block, [ROLE.pack(role) for role in roles], self.scores, first_score, region, np.zeros(2),
        ))  # fmt: skip

    def _call(
        self, kinds: Kinds, partakers: dict[int, Packed[PartakerArrays]], roles: list[RoleArrays]
    ) -> Interacting:
        """Return the arguments of the kernel."""
        record = interacting_record(kinds)
        (bodies_kind, noise_kind) = (part.kind for part in (record.node.parts[0], record.node.parts[3]))
        bodies = []
        for (role, columns), group, written in zip(kinds, self.groups, roles, strict=True):
            own, before = group.bodies, partakers[group.number].value.before
            shown = InteractingBodies(
                own.position, own.heading, before, own.moved, own.speed, own.active, written.reward, written.ended,
                own.identity,
            )
            bodies.append(bodies_type(role, columns)(*shown, *(group.columns.array(name) for name, _ in columns)))
        noise = noise_kind(*(role.noise[0] for role in roles))
        return Interacting(bodies_kind(*bodies), self.state, self.parameters, noise, self.scores, -1)


def check_interactions(saved: Sequence[InteractionSaved], present: Sequence[PlacedInteraction]) -> None:
    """Refuse saved interactions that are not those of a world."""
    theirs, mine = [one.described for one in saved], [one.described for one in present]
    if theirs != mine:
        shown = [", ".join(f"{one[0]} of {' and '.join(one[2])} {one[3]}" for one in all_) for all_ in (theirs, mine)]
        raise ValueError(
            f"restore(…): the state is of a world with the interactions {shown[0] or 'none'}, and this one has "
            f"{shown[1] or 'none'}; restore it in a world built in the same way"
        )
    for one, other in zip(saved, present, strict=True):
        if one.changes:
            other.with_changes(one.changes)
        # The number of rows may depend on how many bodies there were.
        if [table.shape[1] for table in one.state] != [table.shape[1] for table in other.state]:
            raise ValueError(
                f"restore(…): the interaction {other.name} has the state {layout(one.state)}, and here "
                f"{layout(other.state)}; restore it in a world whose interactions have the same options"
            )


def _words(call: Packed[Any], roles: list[RoleArrays]) -> tuple[int, Integers]:
    """Return the word of `turn` in the record of a call, and how the words of the noise depend on the tick."""
    leaves = call.leaves
    turn = next(leaf.slot for leaf in leaves if leaf.path == "turn")
    noise = [leaf.slot for leaf in leaves if leaf.path.startswith("noise.")]
    moves = [(slot, call.words[slot], role.noise[0].nbytes) for slot, role in zip(noise, roles, strict=True)]
    return turn, np.array(moves, np.int64).reshape(-1, 3)
