"""The neighbour search among many bodies: sort them into cells, and compare those in neighbouring cells only."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined, kernel
from teamsight.world.arena import ENDLESS
from teamsight.world.proximity.edges import Observed, append, is_hidden, is_near, limit_of, shortest, take_roots

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class Cells(NamedTuple):
    """Work space for sorting bodies into cells; `start` has one entry per cell and two more."""

    start: Annotated[Integers, "cells + 2"]
    place: Annotated[Integers, "sorted"]
    order: Annotated[Integers, "sorted"]
    x: Annotated[Floats, "sorted"]
    y: Annotated[Floats, "sorted"]


class Grid(NamedTuple):
    """The division of the plane into cells."""

    low_x: float
    low_y: float
    per_x: float
    per_y: float
    columns: int
    rows: int


@inlined
def _column(x: float, low: float, per: float, count: int) -> int:
    return min(max(int((x - low) * per), 0), count - 1)


@kernel
def sort_into_cells(observed: Observed, grid: Grid, cells: Cells) -> None:
    """Order the bodies by cell, within a cell by index; leave out those at NaN."""
    size = observed.size
    cells.start[:] = 0
    for j in range(size):
        if is_hidden(observed, j):
            continue
        row = _column(observed.y[j], grid.low_y, grid.per_y, grid.rows)
        place = row * grid.columns + _column(observed.x[j], grid.low_x, grid.per_x, grid.columns)
        cells.place[j] = place
        cells.start[place + 2] += 1
    for place in range(2, cells.start.shape[0]):
        cells.start[place] += cells.start[place - 1]
    for j in range(size):
        if is_hidden(observed, j):
            continue
        place = cells.place[j] + 1
        at = cells.start[place]
        cells.start[place] = at + 1
        cells.order[at] = j
        cells.x[at] = observed.x[j]
        cells.y[at] = observed.y[j]


@kernel
def _settle(graph: Any, first: int, edge: int) -> None:
    """Insert the newest edge of an observer into the order of indices."""
    j = graph.identity[edge]
    if edge == first or graph.identity[edge - 1] < j:
        return
    way_x = graph.offset[edge, 0]
    way_y = graph.offset[edge, 1]
    distance = graph.distance[edge]
    while edge > first and graph.identity[edge - 1] > j:
        graph.identity[edge] = graph.identity[edge - 1]
        graph.offset[edge, 0] = graph.offset[edge - 1, 0]
        graph.offset[edge, 1] = graph.offset[edge - 1, 1]
        graph.distance[edge] = graph.distance[edge - 1]
        edge -= 1
    graph.identity[edge] = j
    graph.offset[edge, 0] = way_x
    graph.offset[edge, 1] = way_y
    graph.distance[edge] = distance


@kernel
def _search_span(
    here: tuple[float, float, float, int],
    span: tuple[int, int],
    observed: Observed,
    cells: Cells,
    graph: Any,
    edges: tuple[int, int],
) -> int:
    """Find the edges from one observer to the bodies of a row of cells; return the index of the next edge."""
    x, y, limit, myself = here
    first, edge = edges
    wraps = observed.period_x > 0.0
    for at in range(span[0], span[1]):
        way_x = cells.x[at] - x
        way_y = cells.y[at] - y
        if wraps:
            way_x = shortest(way_x, observed.period_x)
            way_y = shortest(way_y, observed.period_y)
        if is_near(way_x, way_y, limit, observed.shape):
            j = cells.order[at]
            if j != myself:
                if edge < graph.identity.shape[0]:
                    append(graph, edge, j, way_x, way_y, way_x * way_x + way_y * way_y)
                    _settle(graph, first, edge)
                edge += 1
    return edge


@kernel
def search_cells(position: Any, reach: Any, observed: Observed, grid: Grid, cells: Cells, graph: Any) -> int:
    """Find all edges by comparing bodies of neighbouring cells; parameters and result as for `search_pairs`."""
    sort_into_cells(observed, grid, cells)
    wraps_x = 0.0 < observed.period_x < ENDLESS
    wraps_y = 0.0 < observed.period_y < ENDLESS
    edge = 0
    for i in range(position.shape[0]):
        first = edge
        graph.start[i] = edge
        x = position[i, 0]
        y = position[i, 1]
        here = (x, y, limit_of(reach[i], observed.shape), i + observed.own if observed.own >= 0 else -1)
        column = _column(x, grid.low_x, grid.per_x, grid.columns)
        row = _column(y, grid.low_y, grid.per_y, grid.rows)
        for r in range(row - 1, row + 2):
            line = r
            if wraps_y:
                line = r % grid.rows
            elif r < 0 or r >= grid.rows:
                continue
            base = line * grid.columns
            left = max(column - 1, 0)
            right = min(column + 1, grid.columns - 1)
            span = (cells.start[base + left], cells.start[base + right + 1])
            edge = _search_span(here, span, observed, cells, graph, (first, edge))
            if wraps_x and (column == 0 or column == grid.columns - 1):
                far = grid.columns - 1 if column == 0 else 0
                span = (cells.start[base + far], cells.start[base + far + 1])
                edge = _search_span(here, span, observed, cells, graph, (first, edge))
    graph.start[position.shape[0]] = edge
    take_roots(graph, edge)
    return edge
