"""The check of an interaction: its kernel under guard and compared."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.contracts import random_headings
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.world.arena import Torus
from teamsight.world.contract import Arena
from teamsight.world.interaction import (
    WRITABLE,
    Interacting,
    InteractingBodies,
    Interaction,
    InteractionState,
    Kinds,
    bodies_type,
    check_interaction_declarations,
    first_state,
    interacting_record,
    lanes_of,
    length_of,
    sizes_type,
)
from teamsight.world.noise import LANES

_STATE = "start(sizes) determines the shape"


@cache
def _guard(kinds: Kinds) -> Guard[Interacting]:
    axes = {
        "2": Axis("components", "0 is x, and 1 is y"),
        "parameters": Axis("parameters", "add what it needs to `parameters`"),
        "scores": Axis("scores", "declare as many as it needs as `scores`"),
        "draws": Axis("draws", "declare as many as it needs as `draws`"),
        "floatrows": Axis("rows", _STATE), "floatfields": Axis("fields", _STATE),
        "introws": Axis("rows", _STATE), "intfields": Axis("fields", _STATE),
    }  # fmt: skip
    writable = ["state", "scores"]
    for role, columns in kinds:
        count = f"bodies.{role}.position.shape[0]"
        axes[length_of(role)] = Axis("bodies", f"{role} are 0 to n − 1, and n is {count}")
        axes[lanes_of(role)] = Axis("bodies", f"rows of noise can be longer than there are {role}: stop at {count}")
        writable += [f"bodies.{role}.{name}" for name in (*WRITABLE, *(name for name, _ in columns))]
    return Guard(interacting_record(kinds), tuple(writable), axes)


def call_of(
    interaction: Interaction, kinds: Kinds, bodies: Mapping[str, Any], state: InteractionState,
    noise: Mapping[str, npt.NDArray[np.float64]], turn: int,
) -> Interacting:  # fmt: skip
    """Return the arguments of the kernel of an interaction, from the bodies and the noise of each role."""
    bodies_node, _, _, noise_node, *_ = interacting_record(kinds).node.parts
    parameters, scores = np.array(interaction.parameters, float), np.zeros(len(interaction.scores))
    return Interacting(bodies_node.kind(**bodies), state, parameters, noise_node.kind(**noise), scores, turn)


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
    begin_check()
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
        self._step = _STEP * spread * float(np.ptp(arena.bounds, axis=0).max())
        self._kinds: Kinds = tuple(
            (role, tuple((name, np.asarray(fill).dtype.str) for of, name, fill in interaction.columns if of == role))
            for role in interaction.roles
        )
        self._state = first_state(interaction, sizes_type(interaction.roles)(**sizes))
        middle = np.array(arena.place(*rng.random((2, 1))))
        self._bodies: dict[str, Any] = {}
        identity = 1
        for role, columns in self._kinds:
            size = sizes[role]
            place = np.array(arena.place(*rng.random((2, size)))).reshape(size, 2)
            place = self._inside(middle + spread * arena.displacement(middle, place))
            first = {name: fill for of, name, fill in interaction.columns if of == role}
            own = InteractingBodies(
                place, random_headings(size, rng), place.copy(), np.zeros((size, 2)), np.full(size, self._step),
                rng.random(size) < 0.8, np.zeros(size), np.zeros(size, np.bool_), identity + np.arange(size),
            )  # fmt: skip
            more = [np.full(size, first[name], kind) for name, kind in columns]
            self._bodies[role] = bodies_type(role, columns)(*own, *more)
            identity += size

    def _inside(self, place: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        if not len(place):
            return place
        # Not on the wall, where rounding decides.
        margin = 1e-9 * float(np.ptp(self._arena.bounds, axis=0).max())
        return np.ascontiguousarray(self._arena.inside(np.ascontiguousarray(place), margin))

    def step(self) -> None:
        """Move the active bodies, and call the kernel as often as in a step."""
        interaction, kinds = self._interaction, self._kinds
        for role, bodies in self._bodies.items():
            way = self._step * self._rng.normal(size=bodies.position.shape) * bodies.active[:, np.newaxis]
            place = np.where(bodies.active[:, np.newaxis], self._inside(bodies.position + way), bodies.position)
            moved = np.ascontiguousarray(self._arena.displacement(bodies.position, place))
            self._bodies[role] = bodies._replace(position=place, before=bodies.position, moved=moved)
        noise = {
            role: self._rng.random((interaction.draws, (size // LANES + 2) * LANES))
            for role, size in self._sizes.items()
        }
        name, sizes = type(interaction).__name__, {f"noise.{role}": size for role, size in self._sizes.items()}
        for turn in range(len(interaction.roles)) if interaction.in_turn else (-1,):
            bodies = {
                role: one._replace(reward=np.zeros_like(one.reward), ended=np.zeros_like(one.ended))
                for role, one in self._bodies.items()
            }
            given = call_of(interaction, kinds, bodies, self._state, noise, turn)
            done = _guard(kinds).run(name, "its kernel", interaction.entry(kinds), given, sizes)[1]
            _check_written(name, interaction, self._arena, done)
            self._bodies, self._state = done.bodies._asdict(), done.state


def _check_written(name: str, interaction: Interaction, arena: Arena, done: Interacting) -> None:
    """Refuse what a world would refuse after a call."""
    for role, bodies in done.bodies._asdict().items():
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
    for score, value in zip(interaction.scores, done.scores.tolist(), strict=True):
        if not np.isfinite(value):
            raise ValueError(f"{name}: its kernel leaves the score {score!r} at {value}; scores must be finite")
