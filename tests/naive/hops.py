"""Awareness over several hops, as its definition says it: slow, with lists, and networkx where there is no delay."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import networkx as nx


class Moment(NamedTuple):
    """What robots sense at one tick, by their index in the team: teammates and targets, with offset and distance."""

    links: list[dict[int, tuple[float, float, float]]]
    targets: list[list[tuple[int, float, float]]]


def _length(x: float, y: float) -> float:
    return math.sqrt(x * x + y * y)


def known(past: list[Moment], robot: int, hops: int, delay: int) -> dict[int, tuple[int, float, float, float]]:
    """Return for each teammate that a robot knows: hops, offset and distance.

    All walks of h links are listed in the order of the robots on them, the link of hop h from h · delay ticks ago.
    """
    found: dict[int, tuple[int, float, float, float]] = {}
    walks: list[tuple[int, float, float]] = [(robot, 0.0, 0.0)]
    for hop in range(1, hops + 1):
        tick = len(past) - 1 - hop * delay
        if tick < 0:
            break
        further: dict[int, tuple[int, float, float]] = {}
        for via, x, y in walks:
            for other, (dx, dy, distance) in sorted(past[tick].links[via].items()):
                there = (dx, dy) if hop == 1 else (x + dx, y + dy)
                further.setdefault(other, (other, *there))
                if other != robot and other not in found:
                    found[other] = (hop, *there, distance if hop == 1 else _length(*there))
        walks = list(further.values())
    return found


def relayed(past: list[Moment], robot: int, hops: int, delay: int) -> list[tuple[int, float, float]]:
    """Return the targets of each teammate that a robot knows, with offset."""
    found = []
    for other, (hop, x, y, _) in sorted(known(past, robot, hops, delay).items()):
        for target, dx, dy in past[len(past) - 1 - hop * delay].targets[other]:
            found.append((target, x + dx, y + dy))
    return found


def reached(now: Moment, robot: int, hops: int) -> dict[int, int]:
    """Return the hops to each robot within so many, without delay, by a breadth-first search of networkx."""
    graph: Any = nx.DiGraph()
    graph.add_nodes_from(range(len(now.links)))
    graph.add_edges_from((i, j) for i, links in enumerate(now.links) for j in links)
    return {j: d for j, d in nx.single_source_shortest_path_length(graph, robot, cutoff=hops).items() if j != robot}
