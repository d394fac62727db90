"""The records of interactions in the compiled loop: who takes part, and what their kernels get and write."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Packed, Record
from teamsight.world.region import Region

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]


class PartakerArrays(NamedTuple):
    """The record of a group that takes part in an interaction.

    Attributes
    ----------
    group : Packed of GroupArrays
        Its record.
    number : int
        Its number in the world.
    before : ndarray, shape (n, 2), float64
        The positions before the present step [length].
    reward, ended : ndarray
        As in `Bodies`.
    last_rewards : ndarray, shape (2, n), float64
        As in `Group`.
    decided_at : ndarray, shape (n,) or (0,), int64
        The tick at which each robot last decided; empty if all decide at every step.
    """

    group: Packed[Any]
    number: int
    before: Annotated[Floats, "n", 2]
    reward: Annotated[Floats, "n"]
    ended: Annotated[Flags, "n"]
    last_rewards: Annotated[Floats, 2, "n"]
    decided_at: Annotated[Integers, "timed"]


class RoleArrays(NamedTuple):
    """The record of a role of an interaction.

    Attributes
    ----------
    partaker : Packed of PartakerArrays
        Its group.
    noise : ndarray, shape (4, draws, lanes), float64
        The random numbers of four ticks.
    members : ndarray, shape (lanes,), int64
        The members to whom they belong.
    stream : int
        Their stream.
    reward, ended : ndarray, shape (n,)
        What the kernel writes in one call.
    """

    partaker: Packed[PartakerArrays]
    noise: Annotated[Floats, "ticks", "draws", "lanes"]
    members: Annotated[Integers, "lanes"]
    stream: int
    reward: Annotated[Floats, "n"]
    ended: Annotated[Flags, "n"]


class InteractionArrays(NamedTuple):
    """The record of an interaction.

    Attributes
    ----------
    kernel, call
        Its kernel, and the record of a call.
    words, turn, moves
        The words of that record; which one holds `turn`; and how those of the noise depend on the tick, see
        `teamsight.core.kernel.window`.
    in_turn : bool
        Whether it is called after the move of each of its groups.
    key : ndarray, shape (2,), uint64
        The key of its noise.
    block : ndarray, shape (1,), int64
        The block of four ticks of the noise; −1 for none.
    roles : list of Packed of RoleArrays
        Its roles.
    scores : ndarray, shape (s,), float64
        The scores of this step.
    first_score : int
        The column of the first of them among those of the world.
    region : Region
        Where bodies must be.
    found : ndarray, shape (2,), float64
        What is wrong, after a call that left something wrong.
    """

    kernel: Entry
    call: Packed[Any]
    words: Annotated[Integers, ".words"]
    turn: int
    moves: Annotated[Integers, ".moves", 3]
    in_turn: bool
    key: Annotated[npt.NDArray[np.uint64], 2]
    block: Annotated[Integers, 1]
    roles: list[Packed[RoleArrays]]
    scores: Annotated[Floats, "scores"]
    first_score: int
    region: Region
    found: Annotated[Floats, 2]


PARTAKER = Record(PartakerArrays)
ROLE = Record(RoleArrays)
INTERACTION = Record(InteractionArrays)

partaker_at, role_at, interaction_at = PARTAKER.at, ROLE.at, INTERACTION.at
