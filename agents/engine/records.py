"""How a world lies in memory for the compiled loop: three kinds of records that hold numbers and addresses."""

from __future__ import annotations

import numpy as np

GROUP = np.dtype(
    [(name, np.int64) for name in ("size", "lanes", "identity", "stream", "draws", "noise", "noise_block", "position")]
    + [(name, np.int64) for name in ("perceive", "scene", "room", "situate", "decide", "decision")]
    + [(name, np.int64) for name in ("sound", "advance", "move")]
)
"""A group: its noise, and the entries for what it does in a step with the records that they work on; 0 for none.

``noise`` is the address of a block of four ticks, ``noise_block`` which four it holds; ``room`` is how many entries the
sightings have room for that ``perceive`` writes. ``sound`` is 1 where no action needs to be checked.
"""

RELATION = np.dtype(
    [(name, np.int64) for name in ("search", "observers", "observed", "parts", "part_count")]
    + [(name, np.int64) for name in ("x", "y", "everyone", "room", "start", "index", "identity", "rows", "met")]
)
"""Who observes whom: the search record, the observed groups, and the graph found.

``parts`` is the address of rows (position, size), ``everyone`` of the identities of all observed, ``met`` of the step
at which each body of the world was last counted by the observers' side, ``rows`` of where in it the observed are.
"""

WORLD = np.dtype(
    [(name, np.int64) for name in ("key", "tick", "steps", "phase", "groups", "group_count")]
    + [(name, np.int64) for name in ("relations", "relation_count", "history", "row", "where", "need")]
    + [(name, np.int64) for name in ("every", "trail", "trail_row", "bodies", "logs", "log_count", "kept")]
)
"""A world: its time, its groups and relations, and the buffers that are recorded into.

``phase`` is 1 when bodies have moved and their sightings are still to be found; ``where`` and ``need`` say which group
or relation ran out of room, and for how many entries. ``every``, when above 0, records positions each so many steps;
``logs`` is where the experience of ``log_count`` groups is written. ``kept``, when not 0, is where the places, headings
and last displacements of all bodies are kept during a move, so that one which leads out of the arena can be undone.
"""

EXPERIENCE = np.dtype(
    [(name, np.int64) for name in ("group", "relation", "team", "team_size", "situate", "scene", "width", "row")]
    + [(name, np.int64) for name in ("situation", "action", "next_situation", "facts")]
    + [(name, np.int64) for name in ("kept_start", "kept_index", "kept_room", "counts_before", "counts_after")]
)
"""The experience of a group: whose, the relations in which it and its team sense targets, and what is written.

``relation`` is −1 for a group that senses nothing; ``team`` is the address of the numbers of the team's relations.
``kept`` holds the group's sightings before the move, ``counts`` how many of the team sense each body of the world.
"""

HISTORY_COLUMNS = 3

DONE, GROW_RELATION, GROW_PERCEPT, BAD_ACTION, OUTSIDE = range(5)
