"""`check_interaction`: tests whether an interaction keeps its contract."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.world.arena import Torus
from teamsight.world.contract import Arena
from teamsight.world.guarded_interaction import Called
from teamsight.world.interaction import (
    InteractingBodies,
    Interaction,
    InteractionState,
    Kinds,
    bodies_type,
    first_state,
    sizes_type,
)
from teamsight.world.interaction_declarations import check_interaction_declarations
from teamsight.world.noise import LANES

# The number of bodies of each role in turn, and the share of the arena over which they are spread.
_SCENES = (((1,), 1.0), ((7, 4), 1.0), ((4, 9, 2), 0.2), ((3, 0), 0.5), ((0, 5), 0.5), ((12, 12), 0.02), ((5, 3), 0.0))
# A step, as a share of that spread.
_STEP = 0.2


def check_interaction(
    interaction: Interaction, arena: Arena | None = None, *, steps: int = 40, seed: int = 1
) -> None:
    """Check whether an interaction keeps the contract of `Interaction`, on random bodies.

    Its kernel runs with bounds checks: on bodies that are alone, crowded and at one place, on roles without bodies, and
    with inactive bodies.

    Parameters
    ----------
    interaction : Interaction
        The interaction to check.
    arena : Arena, optional
        The arena of the world for which it is made; by default ``Torus(10, 10)``.
    steps : int
        The number of steps for each set of bodies.
    seed : int
        The seed of the bodies.

    Raises
    ------
    TypeError
        If it is not an `Interaction`, declares something of a wrong type, or its kernel cannot be compiled.
    ValueError
        If the kernel reads or writes outside its arrays, writes read-only ones, depends on numbers behind those of the
        bodies, or leaves a body outside the arena, a heading that is no unit vector, a negative speed, or a number that
        is not finite.
    """
    check_interaction_declarations(interaction)
    if arena is not None:
        interaction.check_fit(arena, interaction.roles)
    rng = np.random.default_rng(seed)
    for sizes, spread in _SCENES:
        numbers = {role: sizes[at % len(sizes)] for at, role in enumerate(interaction.roles)}
        scene = _Scene(interaction, arena or Torus(10.0, 10.0), numbers, spread, rng)
        try:
            for _ in range(steps):
                scene.step()
        except ValueError as error:
            if empty := [role for role, size in numbers.items() if not size]:
                raise ValueError(f"{error} (with 0 bodies in the role {empty[0]!r}, as when all have left)") from None
            raise


class _Scene:
    """Some bodies of each role, which move at random."""

    def __init__(
        self, interaction: Interaction, arena: Arena, sizes: dict[str, int], spread: float, rng: np.random.Generator
    ) -> None:
        self._interaction, self._arena, self._sizes, self._rng = interaction, arena, sizes, rng
        self._name = type(interaction).__name__
        self._step = _STEP * spread * float(np.ptp(arena.bounds, axis=0).max())
        self._kinds: Kinds = tuple(
            (role, tuple((name, np.asarray(fill).dtype.str) for of, name, fill in interaction.columns if of == role))
            for role in interaction.roles
        )
        self._state = first_state(interaction, sizes_type(interaction.roles)(**sizes))
        middle = np.array(arena.place(*rng.random((2, 1))))
        self._bodies = {role: self._new(role, columns, middle, spread) for role, columns in self._kinds}

    def _new(self, role: str, columns: Any, middle: npt.NDArray[np.float64], spread: float) -> Any:
        size, rng = self._sizes[role], self._rng
        place = np.array(self._arena.place(*rng.random((2, size)))).reshape(size, 2)
        place = self._inside(middle + spread * self._arena.displacement(middle, place))
        angle = rng.uniform(0, 2 * np.pi, size)
        first = {name: fill for of, name, fill in self._interaction.columns if of == role}
        own = InteractingBodies(
            place, np.stack([np.cos(angle), np.sin(angle)], axis=-1), place.copy(), np.zeros((size, 2)),
            np.full(size, self._step), rng.random(size) < 0.8, np.zeros(size), np.zeros(size, np.bool_),
            self._first_identity(role) + np.arange(size),
        )  # fmt: skip
        return bodies_type(role, columns)(*own, *(np.full(size, first[name], kind) for name, kind in columns))

    def _first_identity(self, role: str) -> int:
        """Return the number of the first body of a role; those of all roles follow each other."""
        earlier = self._interaction.roles[: self._interaction.roles.index(role)]
        return 1 + sum(self._sizes[one] for one in earlier)

    def _inside(self, place: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        if not len(place):
            return place
        # Not on the wall, where rounding decides.
        margin = 1e-9 * float(np.ptp(self._arena.bounds, axis=0).max())
        return np.ascontiguousarray(self._arena.inside(np.ascontiguousarray(place), margin))

    def step(self) -> None:
        """Move the active bodies, and call the kernel as often as in a step."""
        for role, bodies in self._bodies.items():
            way = self._step * self._rng.normal(size=bodies.position.shape) * bodies.active[:, np.newaxis]
            place = np.where(bodies.active[:, np.newaxis], self._inside(bodies.position + way), bodies.position)
            moved = self._arena.displacement(bodies.position, place)
            self._bodies[role] = bodies._replace(
                position=place, before=bodies.position, moved=np.ascontiguousarray(moved)
            )
        noise = {
            role: self._rng.random((self._interaction.draws, (size // LANES + 2) * LANES))
            for role, size in self._sizes.items()
        }
        for turn in range(len(self._interaction.roles)) if self._interaction.in_turn else (-1,):
            self._call(noise, turn)

    def _call(self, noise: dict[str, npt.NDArray[np.float64]], turn: int) -> None:
        bodies = {
            role: one._replace(reward=np.zeros_like(one.reward), ended=np.zeros_like(one.ended))
            for role, one in self._bodies.items()
        }
        found = []
        # The numbers behind those of the bodies must have no effect.
        for beyond in (np.nan, 0.5):
            given = {role: array.copy() for role, array in noise.items()}
            for role, array in given.items():
                array[:, self._sizes[role] :] = beyond
            found.append(Called(self._interaction, self._kinds, (bodies, self._state, given), turn))
        one, other = found
        pairs = zip(one.arrays, other.arrays, strict=True)
        if any(not np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in pairs):
            raise ValueError(
                f"{self._name}: its kernel uses noise beyond the bodies, or another source of chance; rows of noise "
                "can be longer: stop at the number of bodies"
            )
        _check_written(self._name, self._interaction, self._arena, one)
        self._state = InteractionState(one.state.floats.copy(), one.state.ints.copy())
        self._bodies = {role: type(own)(*(array.copy() for array in own)) for role, own in one.bodies.items()}


def _check_written(name: str, interaction: Interaction, arena: Arena, called: Called) -> None:
    """Refuse what a world would refuse after a call."""
    for role, bodies in called.bodies.items():
        if not len(bodies.position):
            continue
        length = np.hypot(*bodies.heading.T)
        for good, array, wrong in (
            (np.asarray(arena.contains(bodies.position)), bodies.position, f"a position outside {arena}"),
            (np.abs(length - 1.0) < 1e-6, bodies.heading, "a heading that is no unit vector"),
            ((bodies.speed >= 0.0) & np.isfinite(bodies.speed), bodies.speed, "a speed that is not finite or negative"),
            (np.isfinite(bodies.reward), bodies.reward, "a reward that is not finite"),
        ):
            if not good.all():
                row = int(np.argmin(good))
                raise ValueError(
                    f"{name}: its kernel leaves {role} {row} with {wrong}, {np.round(array[row], 6).tolist()}; a world "
                    "undoes the step and stops. Give check_interaction the arena for which it is made"
                )
    for score, value in zip(interaction.scores, called.scores.tolist(), strict=True):
        if not np.isfinite(value):
            raise ValueError(f"{name}: its kernel leaves the score {score!r} at {value}; scores must be finite")
