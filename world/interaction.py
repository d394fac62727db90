"""Interactions: what happens between bodies after they have moved, such as capture, carrying or pushing."""

from __future__ import annotations

import keyword
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple, get_args, get_type_hints

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Component
from teamsight.core.contracts import check_names, class_name, numbers, parameters_of
from teamsight.core.kernel import Entry, Record, specialise
from teamsight.core.kernel.record import READ_ONLY

if TYPE_CHECKING:
    from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]


class InteractingBodies(NamedTuple):
    """The bodies of one role, as the kernel of an interaction sees them; its columns follow as further fields.

    Attributes
    ----------
    position, heading : ndarray, shape (n, 2), float64
        Positions [length] and unit vectors; may be written.
    before : ndarray, shape (n, 2), float64
        The positions before this step [length].
    moved : ndarray, shape (n, 2), float64
        The displacement in this step so far [length]; it follows from what is written into `position`.
    speed : ndarray, shape (n,), float64
        The largest distance of a step [length]; may be written.
    active : ndarray, shape (n,), bool
        Whether each takes part. One that does not has not moved; the kernel should leave it alone.
    reward : ndarray, shape (n,), float64
        What the bodies get in this call, 0 at its begin; may be written.
    ended : ndarray, shape (n,), bool
        Whether a trial ends for them, False at the begin of a call; may be written.
    identity : ndarray, shape (n,), int64
        The numbers of the bodies, at least 1. Rows shift when an agent leaves, numbers stay: columns and states refer
        to a body by its number.
    """

    position: Annotated[Floats, "n", 2]
    heading: Annotated[Floats, "n", 2]
    before: Annotated[Floats, "n", 2]
    moved: Annotated[Floats, "n", 2]
    speed: Annotated[Floats, "n"]
    active: Annotated[Flags, "n"]
    reward: Annotated[Floats, "n"]
    ended: Annotated[Flags, "n"]
    identity: Annotated[Integers, "n"]


class InteractionState(NamedTuple):
    """The state of an interaction: two tables of any shape.

    Attributes
    ----------
    floats : ndarray, shape (rows, fields), float64
    ints : ndarray, shape (rows, fields), int64
    """

    floats: Annotated[Floats, "float rows", "float fields"]
    ints: Annotated[Integers, "int rows", "int fields"]


class Interacting(NamedTuple):
    """The record of a call: the arguments of the kernel of an interaction."""

    bodies: Any
    state: InteractionState
    parameters: Annotated[Floats, "parameters"]
    noise: Any
    scores: Annotated[Floats, "scores"]
    turn: int


#: The arrays that a kernel may declare that it writes, besides the state, the scores and its columns.
WRITABLE = ("position", "heading", "speed", "reward", "ended")

#: What a call returns that has come to its end; numba lets one whose kernel raises an exception return 0.
COMPLETED = 1

# The columns of each role: name and type, one after the other.
Kinds = tuple[tuple[str, tuple[tuple[str, str], ...]], ...]


@cache
def bodies_type(role: str, columns: tuple[tuple[str, str], ...], writes: tuple[str, ...] = WRITABLE) -> Any:
    """Return the NamedTuple of the bodies of a role with these columns, given by name and type.

    It has the fields of `InteractingBodies`, with a length of its own; those that are not in `writes` are read-only.
    """
    arrays: dict[str, Any] = {"f": Floats, "i": Integers, "b": Flags}
    fields: Any = []
    for name, hint in get_type_hints(InteractingBodies, include_extras=True).items():
        kind, _, *further = get_args(hint)
        further += [] if name in writes else [READ_ONLY]
        fields.append((name, Annotated[(kind, length_of(role), *further)]))
    fields += [(name, Annotated[arrays[np.dtype(kind).kind], length_of(role)]) for name, kind in columns]
    return NamedTuple(f"{role.capitalize()}Bodies", fields)


def length_of(role: str) -> str:
    """Return the name of the number of bodies of a role, in records."""
    return f"number_of_{role}"


def lanes_of(role: str) -> str:
    """Return the name of the length of the rows of noise of a role, in records."""
    return f"lanes_of_{role}"


def first_state(interaction: Interaction, sizes: Any) -> InteractionState:
    """Return the state of an interaction before the first step, checked.

    Raises
    ------
    TypeError, ValueError
        If `start` returns anything but an `InteractionState` of two tables.
    """
    name = f"{type(interaction).__name__}.start"
    state = interaction.start(sizes)
    if not isinstance(state, InteractionState):
        raise TypeError(f"{name}: returned {type(state).__name__}; it must return InteractionState(floats, ints)")
    for part, array, dtype in zip(state._fields, state, (np.float64, np.int64), strict=True):
        if not isinstance(array, np.ndarray) or array.dtype != dtype:
            kind = getattr(array, "dtype", type(array).__name__)
            raise TypeError(f"{name}: its {part} have the type {kind}; they must be an array of {np.dtype(dtype)}")
        if array.ndim != 2:
            raise ValueError(f"{name}: its {part} have the shape {array.shape}; they must be (rows, fields)")
        if not np.isfinite(array).all():
            raise ValueError(f"{name}: its {part} are not finite; begin with finite numbers")
    # Copies: the kernel writes into them, and `start` may return the same arrays each time.
    return InteractionState(np.array(state.floats, order="C"), np.array(state.ints, order="C"))


@cache
def sizes_type(roles: tuple[str, ...]) -> Any:
    """Return the NamedTuple of the numbers of bodies of these roles."""
    return NamedTuple("Sizes", [(role, int) for role in roles])  # type: ignore[misc]


@cache
def interacting_record(kinds: Kinds, writes: tuple[str, ...] = WRITABLE) -> Record[Interacting]:
    """Return the record of calls of interactions with these roles and columns, which write these arrays of bodies."""
    bodies: Any = [(role, bodies_type(role, columns, writes)) for role, columns in kinds]
    noise: Any = [(role, Annotated[Floats, "draws", lanes_of(role)]) for role, _ in kinds]
    parts: Any = {"bodies": NamedTuple("BodiesOfRoles", bodies), "noise": NamedTuple("Noise", noise)}
    return Record(Interacting, parts)


def interact_at(address: int) -> int:
    """Call the kernel of an interaction on the arrays of a record."""
    here = interacting_at(address)  # type: ignore[name-defined]  # noqa: F821
    interaction_kernel(here.bodies, here.state, here.parameters, here.noise, here.scores, here.turn)  # type: ignore[name-defined]  # noqa: F821
    return COMPLETED


class Interaction(Component):
    """What happens between the bodies of some groups after they have moved, as a kernel: the base class.

    A subclass defines `roles` and `kernel`, and each attribute whose default is wrong for it. The fields of a subclass
    that is a dataclass are the constants of its kernel; `Component` says how they are checked. `World.interact` puts it
    into a world.

    Attributes
    ----------
    kernel : kernel
        ``kernel(bodies, state, parameters, noise, scores, turn)``. ``bodies.ROLE`` are `InteractingBodies`,
        ``noise.ROLE`` are uniform numbers, shape (draws, n or more), and `scores` one number for each of `scores`,
        0 at the begin of a step.
    roles : tuple of str
        The names under which the kernel sees groups.
    scores : tuple of str, default ()
        Columns that it adds to `World.history`.
    draws : int, default 0
        Uniform random numbers for each body at each tick.
    in_turn : bool, default False
        Whether the groups move one after the other, in the order in which they were added, and the kernel runs after
        the move of each role's group: `turn` is then the index of that role. Otherwise the kernel runs once, when all
        have moved, and `turn` is −1.
    columns : tuple of (str, str, float or int or bool), default ()
        Properties that the interaction keeps of bodies: role, name and first value, such as
        ``(("robots", "load", 0.0),)``. They are columns of the group (`Group.add_column`), and fields of
        ``bodies.robots`` that the kernel may write.
    writes : tuple of str, default ("position", "heading", "speed", "reward", "ended")
        The arrays of bodies that the kernel writes. What it does not write need not be saved and checked in each step.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Touching(Interaction):
    ...     roles = ("robots", "beacons")
    ...     scores = ("touches",)
    ...     reach: float = 0.1
    ...     kernel = touch
    """

    kernel: ClassVar[Callable[..., None]]
    roles: tuple[str, ...] = ()
    scores: tuple[str, ...] = ()
    draws: int = 0
    in_turn: bool = False
    columns: tuple[tuple[str, str, float | int | bool], ...] = ()
    writes: tuple[str, ...] = WRITABLE

    @property
    def parameters(self) -> tuple[float, ...] | Floats:
        """The constants, in the order in which the kernel reads them; by default the fields of a dataclass."""
        return parameters_of(self, Interaction)

    def start(self, sizes: Any) -> InteractionState:
        """Return the state before the first step; empty by default.

        Parameters
        ----------
        sizes : NamedTuple of int
            The number of bodies of each role, as ``sizes.hunters``.
        """
        return InteractionState(np.zeros((0, 0)), np.zeros((0, 0), np.int64))

    def check_fit(self, arena: Arena, order: tuple[str, ...]) -> None:
        """Refuse a world for which the interaction is not made; by default it is made for any.

        Parameters
        ----------
        arena : Arena
            The arena of the world.
        order : tuple of str
            The roles, in the order in which their groups move.

        Raises
        ------
        ValueError
            If it is not made for them.
        """

    def entry(self, kinds: Kinds) -> Entry:
        """Return the compiled call of this kind of interaction, for these types of columns."""
        bound = {"interaction_kernel": type(self).kernel, "interacting_at": interacting_record(kinds, self.writes).at}
        return specialise(interact_at, type(self).__name__.lower(), **bound)


# What the kernels can read.
_TYPES = (np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.bool_))


def check_interaction_declarations(interaction: Interaction) -> None:
    """Refuse what is no interaction, or declares something of a wrong type; see `Interaction`.

    Raises
    ------
    TypeError, ValueError
        Naming the attribute.
    """
    name = class_name(interaction, Interaction, "Capture()")
    if not hasattr(type(interaction), "kernel"):
        raise TypeError(f"{name}: has no 'kernel'; give kernel(bodies, state, parameters, noise, scores, turn)")
    _check_fields(f"{name}.roles", interaction.roles, "('hunters', 'prey')")
    if not interaction.roles:
        raise ValueError(f"{name}.roles=(): must name at least one role, such as ('robots',)")
    _check_fields(f"{name}.scores", interaction.scores, "('captures',)")
    checks.count(f"{name}.draws", interaction.draws, least=0)
    checks.flag(f"{name}.in_turn", interaction.in_turn)
    check_names(f"{name}.writes", interaction.writes, "('reward',)")
    for written in interaction.writes:
        checks.choice(f"{name}.writes", written, WRITABLE)
    _check_columns(name, interaction)
    numbers(f"{name}.parameters", interaction.parameters)


def _check_fields(what: str, names: Any, example: str) -> None:
    check_names(what, names, example)
    for name in names:
        if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_") or hasattr(tuple, name):
            raise ValueError(f"{what}: {name!r} cannot be the name of a field; take a name such as {example}")
        if names.count(name) > 1:
            raise ValueError(f"{what}: {name!r} is there twice; take two names")


def _check_columns(name: str, interaction: Interaction) -> None:
    what, example = f"{name}.columns", "(('robots', 'load', 0.0),)"
    columns = interaction.columns
    if not isinstance(columns, tuple) or not all(isinstance(one, tuple) and len(one) == 3 for one in columns):
        raise TypeError(f"{what}={checks.shown(columns)}: must be tuples of role, name and value, such as {example}")
    for role, column, value in columns:
        checks.choice(f"{what}: the role", role, interaction.roles)
        _check_fields(what, (column,), example)
        if column in InteractingBodies._fields:
            raise ValueError(f"{what}: {column!r} is a field of all bodies, bodies.{role}.{column}; take another name")
        kind, first = np.asarray(value).dtype, f"{what}: {column}={checks.shown(value)}"
        is_number = isinstance(value, (bool, int, float, np.bool_, np.integer, np.floating))
        if is_number and kind not in _TYPES:
            cure = value.item() if isinstance(value, np.generic) else 0.0
            raise TypeError(f"{first}: has the type {kind}; columns are float64, int64 or bool: begin with {cure!r}")
        if not is_number or not np.isfinite(value):
            raise TypeError(f"{first}: must begin as a finite number, as in {example}")
        if sum(other[:2] == (role, column) for other in columns) > 1:
            raise ValueError(f"{what}: {column!r} of {role} is there twice; take two names")
