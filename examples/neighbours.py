"""The neighbour graph of one run: at one moment in networkx, and over time in numbers."""

from __future__ import annotations

import networkx as nx

from teamsight import CMOMMT
from teamsight.analysis import neighbour_graph


def main() -> None:
    model = CMOMMT(robots=30, radius=3.0, policy="random-walk", rng=1)
    over_time = neighbour_graph.over_time(model, 200, every=20)
    print(over_time.to_string(index=False, float_format="{:.2f}".format))

    graph = neighbour_graph.to_networkx(model.neighbours, identity=model.teammates.identity)
    sizes = sorted(map(len, nx.connected_components(graph)), reverse=True)
    print(f"now: {graph.number_of_edges()} pairs of neighbours, components of {sizes} robots")
    print(f"robot {max(graph, key=graph.degree)} has most neighbours; largest number so far: {model.max_neighbours}")


if __name__ == "__main__":
    main()
