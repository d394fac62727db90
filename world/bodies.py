"""Bodies: the state and the abilities of agents, declared as the columns of a table."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.core.table import Field, Table

Column = npt.NDArray[np.float64]

#: What each agent can do. Those who come to a group have them from the start of a run.
ABILITIES = (
    Field("speed", unit="length/tick", reset="first"),
    # The turning limit; see `motion.turn_limit`.
    Field("turn_cosine", fill=-2.0, reset="first"),
    Field("turn_sine", reset="first"),
    Field("sensing_range", unit="length", reset="first"),
    Field("awareness_range", unit="length", reset="first"),
)

#: The columns of all agents.
BODIES = (
    # Unique in the world, never reused.
    Field("identity", np.int64),
    # The agent's number within its group, never reused. It selects the agent's noise.
    Field("member", np.int64),
    Field("position", shape=(2,), unit="length"),
    # Unit vectors.
    Field("heading", shape=(2,)),
    # The displacement of the last step.
    Field("moved", shape=(2,), reset="fill", unit="length"),
    *ABILITIES,
    # Whether it takes part: else it neither moves nor decides, senses nobody and is sensed by nobody.
    Field("active", np.bool_, fill=True, reset="fill"),
    # The sum of what interactions have given it since its last decision, and whether one has ended a trial since then.
    Field("reward", reset="fill"),
    Field("ended", np.bool_, fill=False, reset="fill"),
    # The same of the last step alone: the sum, and 1 if one has ended a trial.
    Field("last_rewards", shape=(2,), reset="fill"),
    # The last action; see `Action`.
    Field("aim", shape=(2,), reset="fill"),
    Field("distance", reset="fill", unit="length"),
)


def bodies_at(position: Column, heading: Column) -> Table:
    """Return bodies that stay at these places, shape (n, 2) each; their columns can be written."""
    table = Table(BODIES, len(position))
    table.position[:], table.heading[:] = position, heading
    table.member[:] = np.arange(len(position))
    return table
