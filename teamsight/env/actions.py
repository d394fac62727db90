"""Actions of environments: their spaces, their checks, and how they are given to the robots."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.policies.actions import ActionGrid
from teamsight.policies.steered import Steered

if TYPE_CHECKING:
    import gymnasium

Floats = npt.NDArray[np.float64]

#: What users give as `action`.
ActionLike: TypeAlias = str | ActionGrid

# The shape of the action of one robot, what its parts mean, and what must be true of an action.
_FORMS: dict[str, tuple[tuple[int, ...], str, str]] = {
    "continuous": (
        (2,), "rotation and distance of each robot",
        "must be finite and between -1 and 1; clip it, as in np.clip(action, -1, 1)",
    ),
    "grid": (
        (), "the number of an action of the grid for each robot", "must be one of the {} actions of the grid, 0 to {}",
    ),
    "heading": (
        (3,), "heading x, heading y and distance of each robot",
        "must be finite: a direction x, y (0, 0 keeps the heading) and a distance",
    ),
    "vector": (
        (2,), "the way ahead and to the left of each robot, in speeds",
        "must be finite and between -1 and 1; clip it, as in np.clip(action, -1, 1)",
    ),
}  # fmt: skip
#: The numbers of the forms, for kernels.
CONTINUOUS, GRID, HEADING, VECTOR = range(4)
#: ``names(world, robot)`` returns the name of an action in errors.
Names: TypeAlias = Callable[[int, int], str]


class ActionForm:
    """A form of actions.

    Parameters
    ----------
    action : {"vector", "continuous", "grid", "heading"} or ActionGrid
        See `parallel_env`.

    Attributes
    ----------
    policy : Steered
        The policy of the robots.
    shape : tuple of int
        The shape of the action of one robot: (2,), () or (3,).
    number : int
        The number of the form, for kernels: `CONTINUOUS`, `GRID`, `HEADING` or `VECTOR`.
    table : ndarray, shape (actions, 2), float64
        The actions of the grid; see `ActionGrid.actions`.
    """

    def __init__(self, action: ActionLike) -> None:
        self.name = "grid" if isinstance(action, ActionGrid) else checks.choice("action", action, _FORMS)
        grid = action if isinstance(action, ActionGrid) else ActionGrid()
        self.table = grid.actions if self.name == "grid" else np.zeros((0, 2))
        self.policy = Steered(self.name if self.name in ("heading", "vector") else "rotation")
        self.shape, self._meaning, self._cure = _FORMS[self.name]
        self.number = list(_FORMS).index(self.name)

    @property
    def none(self) -> npt.NDArray[Any]:
        """An action of one robot, as an example: no rotation, or the first of the grid."""
        return np.zeros(self.shape, np.int64 if self.name == "grid" else np.float32)

    def space(self) -> gymnasium.spaces.Box | gymnasium.spaces.Discrete:
        """Return a new space of the actions of one robot."""
        from gymnasium import spaces

        if self.name == "grid":
            return spaces.Discrete(len(self.table))
        if self.name == "heading":
            return spaces.Box(np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, np.inf]), dtype=np.float64)
        return spaces.Box(-1.0, 1.0, (2,), np.float32)

    def take(self, given: Any, actions: Floats, names: Names) -> None:
        """Write the actions of all robots as numbers, for the compiled loop.

        Parameters
        ----------
        given : array_like, shape (worlds, robots, *shape)
            The actions.
        actions : ndarray, shape (worlds, robots, 1 to 3), float64
            Where they are written.
        names : callable
            ``names(world, robot)`` returns the name of an action in errors; for robot −1, that of all.

        Raises
        ------
        TypeError, ValueError
            If the actions are not numbers, or have another shape.
        """
        shape = (*actions.shape[:2], *self.shape)
        array = as_array(given)
        if array.dtype.kind not in ("iu" if self.name == "grid" else "iuf"):
            what = "whole numbers" if self.name == "grid" else "numbers"
            found = f"of {array.dtype}" if isinstance(given, np.ndarray) else checks.shown(given)
            raise TypeError(f"{names(-1, -1)}: must be {what}, in an array of shape {shape}, and is {found}")
        if array.shape != shape:
            raise ValueError(f"{names(-1, -1)}: has the shape {array.shape}; it must be {shape}, {self._meaning}")
        actions[:] = array[..., np.newaxis] if self.name == "grid" else array

    def refusal(self, actions: Floats, where: int, names: Names) -> ValueError:
        """Return the error for an action that the loop has refused, given by its index among all robots."""
        world, robot = divmod(where, actions.shape[1])
        action: Any = actions[world, robot].tolist()
        if self.name == "grid":
            action = int(action[0])
        cure = self._cure.format(len(self.table), len(self.table) - 1)
        return ValueError(f"{names(world, robot)}={checks.shown(action)}: {cure}")


def as_array(given: Any) -> npt.NDArray[Any]:
    """Return what a user gives as an array; one of objects if it has rows of different lengths."""
    try:
        return np.asarray(given)
    except ValueError:
        return np.asarray(None)
