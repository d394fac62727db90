"""Changes of conditions in neighbour lists: only what one body's change concerns is written, not all searched again.

The lists have the same bits as after a search. They must be those of the present positions, and of perfect sensors.
"""

from __future__ import annotations

import math
from typing import Any

from teamsight.agents.engine.records import DONE, GROW_RELATION, group_at, relation_at, world_at
from teamsight.agents.engine.step_records import record_present
from teamsight.core.kernel import Entry, inlined, kernel
from teamsight.world.motion import move_at
from teamsight.world.proximity.edges import append, is_near, limit_of, shortest
from teamsight.world.proximity.search import searching_at


@inlined
def _way(searching: Any, i: int, j: int) -> tuple[float, float]:
    """Return the way from observer `i` to body `j`, as the search computes it."""
    observed = searching.observed
    x = observed.x[j] - searching.position[i, 0]
    y = observed.y[j] - searching.position[i, 1]
    if observed.period_x > 0.0:
        x = shortest(x, observed.period_x)
        y = shortest(y, observed.period_y)
    return x, y


@inlined
def _finds(searching: Any, i: int, j: int) -> Any:
    """Whether observer `i` finds body `j`."""
    x, y = _way(searching, i, j)
    myself = searching.observed.own >= 0 and searching.observed.own + i == j
    shape = searching.observed.shape
    return is_near(x, y, limit_of(searching.reach[i], shape), shape) and not myself


@inlined
def _put(searching: Any, at: int, i: int, j: int) -> None:
    x, y = _way(searching, i, j)
    append(searching.neighbours, at, j, x, y, math.sqrt(x * x + y * y))


@inlined
def _copy(graph: Any, source: int, at: int) -> None:
    append(graph, at, graph.identity[source], graph.offset[source, 0], graph.offset[source, 1], graph.distance[source])


@kernel
def _drop(graph: Any, observer: int, body: int) -> None:
    """Leave out the entries of an observer, and those that show a body; −1 for none."""
    at = 0
    k = 0
    for i in range(graph.start.shape[0] - 1):
        end = graph.start[i + 1]
        while k < end:
            if i != observer and graph.identity[k] != body:
                _copy(graph, k, at)
                at += 1
            k += 1
        graph.start[i + 1] = at


@kernel
def _show(address: int, body: int) -> bool:
    """Insert a body into the lists of all that find it; return whether there was room."""
    searching = searching_at(address)
    graph = searching.neighbours
    observers = graph.start.shape[0] - 1
    at = graph.start[observers]
    k = at - 1
    for i in range(observers):
        at += _finds(searching, i, body)
    if at > graph.identity.shape[0]:
        return False
    # From the last entry on, so that nothing is overwritten before it is moved.
    for i in range(observers - 1, -1, -1):
        first = graph.start[i]
        graph.start[i + 1] = at
        is_due = _finds(searching, i, body)
        while k >= first or is_due:
            at -= 1
            if is_due and (k < first or graph.identity[k] < body):
                _put(searching, at, i, body)
                is_due = False
            else:
                _copy(graph, k, at)
                k -= 1
    return True


@kernel
def _look(address: int, observer: int) -> bool:
    """Fill the empty list of an observer; return whether there was room."""
    searching = searching_at(address)
    graph = searching.neighbours
    observers = graph.start.shape[0] - 1
    found = 0
    for j in range(searching.observed.size):
        found += _finds(searching, observer, j)
    if graph.start[observers] + found > graph.identity.shape[0]:
        return False
    for k in range(graph.start[observers] - 1, graph.start[observer] - 1, -1):
        _copy(graph, k, k + found)
    at = graph.start[observer]
    for j in range(searching.observed.size):
        if _finds(searching, observer, j):
            _put(searching, at, observer, j)
            at += 1
    for i in range(observer + 1, observers + 1):
        graph.start[i] += found
    return True


@kernel
def _change_body(address: int, group: int, row: int) -> bool:
    """Write a body of an observed group into the lists, or take it out; return whether there was room."""
    relation = relation_at(address)
    first = 0
    for g in range(relation.groups.shape[0]):
        move = move_at(group_at(relation.groups[g]).move)
        if relation.groups[g] == group:
            is_active = move.active.shape[0] == 0 or move.active[row]
            body = first + row
            is_hidden = math.isnan(relation.x[body])
            if is_active and is_hidden:
                relation.x[body] = move.position[row, 0]
                relation.y[body] = move.position[row, 1]
                return _show(relation.search, body)  # type: ignore[no-any-return]
            if not is_active and not is_hidden:
                relation.x[body] = math.nan
                relation.y[body] = math.nan
                _drop(relation.neighbours, -1, body)
            return True
        first += move.position.shape[0]
    return True


@kernel
def _change_observer(address: int, row: int) -> bool:
    """Fill the list of an observer, or empty it; return whether there was room."""
    relation = relation_at(address)
    conditions = relation.conditions
    senses = conditions.active[row] and conditions.works[row]
    if senses and conditions.reach[row] < 0.0:
        conditions.reach[row] = conditions.full[row]
        return _look(relation.search, row)  # type: ignore[no-any-return]
    if not senses and conditions.reach[row] >= 0.0:
        conditions.reach[row] = -1.0
        _drop(relation.neighbours, row, -1)
    return True


def _change(address: int) -> int:
    """Bring the lists up to date after a change of one body: its group and row are in ``where`` and ``need``."""
    world = world_at(address)
    group = world.groups[world.progress[0].where]
    row = world.progress[0].need
    for r in range(world.relations.shape[0]):
        relation = relation_at(world.relations[r])
        if relation.conditions.reach.shape[0] == 0:
            continue
        has_room = _change_body(world.relations[r], group, row)
        if has_room and relation.observers == group:
            has_room = _change_observer(world.relations[r], row)
        if not has_room:
            return GROW_RELATION
        for k in range(relation.neighbours.start[relation.neighbours.start.shape[0] - 1]):
            relation.identity[k] = relation.everyone[relation.neighbours.identity[k]]
    record_present(address)
    return DONE


CHANGE = Entry(_change)
