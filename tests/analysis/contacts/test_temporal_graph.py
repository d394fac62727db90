"""Contacts, gaps and components of recorded positions, compared with networkx frame by frame and with closed forms."""

from __future__ import annotations

from itertools import combinations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Disc, Robot, Target, Torus, World
from teamsight.agents.components import Failures
from teamsight.analysis import contacts
from teamsight.analysis.contacts import (
    TemporalGraph,
    of_log,
    of_positions,
    of_trajectory,
    of_world,
    snapshot,
    to_networkx,
)

seeds = st.integers(0, 2**32 - 1)


def _walk(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions, some of which are missing, and the range of each robot."""
    rng = np.random.default_rng(seed)
    frames, size = int(rng.integers(1, 9)), int(rng.integers(1, 7))
    position = np.cumsum(rng.normal(0, 0.4, (frames, size, 2)), axis=0) + rng.uniform(0, 2.0, (1, size, 2))
    position[rng.random((frames, size)) < rng.choice([0.0, 0.3])] = np.nan
    reach = rng.uniform(0.3, 1.5, size) if rng.random() < 0.5 else np.full(size, 1.0)
    return position, reach


def _networks(position: np.ndarray, reach: np.ndarray, side: float = 0.0) -> list[nx.DiGraph]:
    """Return the graph of each frame by the words of the definition."""
    networks = []
    for frame in position:
        network = nx.DiGraph()
        network.add_nodes_from(row for row in range(len(frame)) if not np.isnan(frame[row, 0]))
        for one in network:
            for other in network:
                way = frame[other] - frame[one]
                way = way - side * np.round(way / side) if side else way
                if one != other and float(way @ way) <= reach[one] * reach[one]:
                    network.add_edge(one, other)
        networks.append(network)
    return networks


@settings(deadline=None)
@given(seed=seeds, directed=st.booleans(), torus=st.booleans())
def test_every_frame_is_what_networkx_finds(seed: int, directed: bool, torus: bool) -> None:
    position, reach = _walk(seed)
    graph = of_positions(range(len(position)), position, reach, Torus(4.0, 4.0) if torus else None, directed=directed)
    for frame, network in enumerate(_networks(position, reach, 4.0 if torus else 0.0)):
        wanted = network if directed else network.to_undirected(reciprocal=True)
        found = snapshot(graph, frame)
        assert set(found) == set(wanted)
        assert set(found.edges) == {edge if directed else tuple(sorted(edge)) for edge in wanted.edges}
        parts = list((nx.weakly_connected_components if directed else nx.connected_components)(wanted))
        row = graph.components.iloc[frame]
        assert (row["robots"], row["components"]) == (len(wanted), len(parts))
        assert row["largest"] == max(map(len, parts), default=0)
        assert row["isolated"] == sum(len(part) == 1 for part in parts)
        degree = wanted.out_degree if directed else wanted.degree
        there = [degree(node) if node in wanted else None for node in range(len(reach))]
        assert [None if np.isnan(one) else one for one in graph.degree[frame]] == there


@settings(deadline=None)
@given(seed=seeds, directed=st.booleans())
def test_contacts_and_gaps_are_the_runs_of_frames(seed: int, directed: bool) -> None:
    position, reach = _walk(seed)
    last = len(position) - 1
    time = np.cumsum(np.random.default_rng(seed).integers(1, 5, len(position))).astype(float)
    graph = of_positions(time, position, reach, directed=directed)
    networks = _networks(position, reach)
    wanted, gaps = [], []
    for one in range(len(reach)):
        for other in range(len(reach)):
            if one == other or (other < one and not directed):
                continue
            meets = [n.has_edge(one, other) and (directed or n.has_edge(other, one)) for n in networks]
            there = [one in n and other in n for n in networks]
            begins = [k for k in range(last + 1) if meets[k] and not (k and meets[k - 1])]
            ends = [k for k in range(last + 1) if meets[k] and not (k < last and meets[k + 1])]
            for begin, end in zip(begins, ends, strict=True):
                began = "record" if not begin else "range" if there[begin - 1] else "presence"
                ended = "record" if end == last else "range" if there[end + 1] else "presence"
                wanted.append((one, other, time[begin], time[min(end + 1, last)], began, ended))
            if begins:
                bounds = zip([0, *(end + 1 for end in ends)], [*begins, last], strict=True)
                for number, (begin, end) in enumerate(bounds):
                    left, right = number == 0, number == len(begins)
                    if (left and begins[0] == 0) or (right and ends[-1] == last):
                        continue
                    away = not all(there[begin:end])
                    gaps.append((one, other, time[begin], time[end], left, right, away))
    found = graph.contacts.drop(columns="duration")
    assert list(found.itertuples(index=False, name=None)) == wanted
    assert list(graph.gaps.drop(columns="duration").itertuples(index=False, name=None)) == gaps
    for table in (graph.contacts, graph.gaps):
        assert (table["duration"] == table["end"] - table["begin"]).all()


@settings(deadline=None)
@given(seed=seeds, one=st.booleans())
def test_time_since_contact_counts_from_the_last_frame_in_contact(seed: int, one: bool) -> None:
    position, reach = _walk(seed)
    graph = of_positions(2.0 * np.arange(len(position)), position, reach)
    networks = [network.to_undirected(reciprocal=True) for network in _networks(position, reach)]
    found = graph.time_since_contact(0 if one else None)
    for row in range(len(reach)):
        last = None
        for frame, network in enumerate(networks):
            if network.has_edge(row, 0) if one else row in network and network.degree(row):
                last = frame
            expected = np.nan if last is None or row not in network else 2.0 * (frame - last)
            assert found[frame, row] == expected or (np.isnan(expected) and np.isnan(found[frame, row]))


def test_links_that_break_at_random_live_as_long_as_they_should() -> None:
    """Two-state Markov links: lifetimes are geometric with mean 1/q, gaps with mean 1/p; 6.5 standard errors."""
    rng, frames, pairs = np.random.default_rng(5), 4_000, 60
    ends, begins = 0.2, 0.05
    state = rng.random(pairs) < begins / (begins + ends)
    position = np.zeros((frames, 2 * pairs, 2))
    position[:, :, 0] = np.repeat(10.0 * np.arange(pairs), 2)
    for frame in range(frames):
        position[frame, 1::2, 1] = np.where(state, 0.5, 3.0)
        state = np.where(state, rng.random(pairs) >= ends, rng.random(pairs) < begins)
    graph = of_positions(np.arange(frames), position, 1.0)
    whole = graph.contacts[(graph.contacts["began_by"] == "range") & (graph.contacts["ended_by"] == "range")]
    gaps = graph.gaps[~graph.gaps["left_censored"] & ~graph.gaps["right_censored"]]
    for durations, chance in ((whole["duration"], ends), (gaps["duration"], begins)):
        spread = np.sqrt(1 - chance) / chance / np.sqrt(len(durations))
        # Leaving out censored ones shortens the mean by less than a tenth of this.
        assert abs(durations.mean() - 1 / chance) < 6.5 * spread
        longer = float((durations > 10).mean())
        expected = (1 - chance) ** 10
        assert abs(longer - expected) < 6.5 * np.sqrt(expected * (1 - expected) / len(durations))


def test_a_robot_that_fails_ends_its_contacts() -> None:
    position = np.zeros((6, 3, 2))
    position[:, 2] = 0.5
    position[2:4, 2] = np.nan
    graph = of_positions(range(6), position, 1.0, identity=["a", "b", "c"])
    rows = graph.contacts[["one", "other", "begin", "end", "began_by", "ended_by"]].to_numpy().tolist()
    assert rows == [
        ["a", "b", 0.0, 5.0, "record", "record"],
        ["a", "c", 0.0, 2.0, "record", "presence"],
        ["a", "c", 4.0, 5.0, "presence", "record"],
        ["b", "c", 0.0, 2.0, "record", "presence"],
        ["b", "c", 4.0, 5.0, "presence", "record"],
    ]
    assert graph.gaps["absence"].tolist() == [True, True]
    network = to_networkx(graph)
    assert network.nodes["c"]["present"] == [(0.0, 2.0), (4.0, 5.0)]
    assert network.edges["a", "c"] == {"contacts": [(0.0, 2.0), (4.0, 5.0)], "total": 3.0}
    assert np.isnan(graph.time_since_contact()[2:4, 2]).all()
    assert graph.components["largest"].tolist() == [3, 3, 2, 2, 3, 3]


def test_a_world_is_its_recording() -> None:
    world = World(Disc(2.0), rng=1)
    prey = world.add(Target, 4, policy="random-walk", name="prey")
    for name, team, size in (("first", "ours", 5), ("second", "ours", 4), ("rivals", "theirs", 3)):
        world.senses(world.add(Robot, size, policy="random-walk", name=name, team=team), prey)
    world.recording.record_positions()
    degrees = []
    for _ in range(20):
        world.run(1)
        degrees.append(np.diff(world.neighbours.start))
    graph = of_world(world)
    assert graph.identity.tolist() == sorted(world.teammates.identity.tolist())
    order = np.argsort(world.teammates.identity)
    assert graph.degree.tolist() == [degree[order].tolist() for degree in degrees]
    assert of_world(world, "theirs").robots == 3
    only = of_trajectory(world.recording.trajectory, {"rivals": 1.0})
    assert only.contacts.equals(of_world(world, "theirs").contacts)


@pytest.mark.parametrize("directed", [False, True])
def test_a_log_of_contacts_is_the_graph_of_the_positions(directed: bool) -> None:
    world = World(Disc(1.5), rng=4)
    robots = world.add(Robot, 8, policy="random-walk", name="robots", awareness_range=np.linspace(0.4, 1.2, 8))
    log = world.log_contacts(robots)
    world.recording.record_positions()
    world.run(30)
    found = of_log(log.contacts, robots.identity, directed=directed)
    order = np.argsort(robots.identity)
    frames = world.recording.trajectory.pivot(index="time", columns="identity", values=["x", "y"])
    position = np.stack([frames["x"].to_numpy(), frames["y"].to_numpy()], axis=-1)
    reach = np.asarray(robots.awareness_range)[order]
    wanted = of_positions(range(1, 31), position, reach, identity=np.sort(robots.identity), directed=directed)
    assert found.time.tolist() == list(range(31))
    assert found.identity.tolist() == wanted.identity.tolist()
    for frame in range(30):
        assert np.array_equal(found.pairs_at(frame + 1)[:2], wanted.pairs_at(frame)[:2])
    assert found.components["largest"].tolist()[1:] == wanted.components["largest"].tolist()
    assert contacts.draw(found).startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="lacks robot"):
        of_log(log.contacts, [1])


@pytest.mark.parametrize("seed", [1, 2])
def test_a_log_shows_failures_one_frame_before_the_positions(seed: int) -> None:
    model = CMOMMT(robots=10, radius=2.0, policy="random-walk", rng=seed)
    model.attach(Failures(30.0, 15.0), model.robots)
    model.recording.record_positions()
    links = model.log_contacts(model.robots)
    model.run(100)
    world, log = of_world(model), of_log(links.contacts, model.robots.identity)
    assert (world.time[0], log.time[0], world.time[-1], log.time[-1]) == (1, 0, 100, 100)
    # After a step and its events: two are in contact at t if they were after the step and both work before the next one.
    works = np.vstack([world.present[1:], world.present[-1:]])
    for frame in range(99):
        after = set(zip(*(side.tolist() for side in world.pairs_at(frame)[:2]), strict=True))
        logged = set(zip(*(side.tolist() for side in log.pairs_at(frame + 1)[:2]), strict=True))
        stay = {(one, other) for one, other in after if works[frame, one] and works[frame, other]}
        assert stay <= logged
        # Others were repaired at that tick.
        assert all(not world.present[frame, [one, other]].all() for one, other in logged - stay)
    assert (world.contacts[["began_by", "ended_by"]] == "presence").any().all()
    table = log.contacts
    assert set(table["began_by"]) | set(table["ended_by"]) == {"unknown", "record"}
    assert log.gaps["absence"].isna().all()
    assert world.gaps["absence"].any()


def test_the_picture_is_drawn_whatever_there_is() -> None:
    model = CMOMMT(robots=12, radius=2.0, rng=3)
    model.recording.record_positions(every=2)
    model.run(40)
    graph = of_world(model)
    picture = contacts.draw(graph, contacts.percolation(graph.position))
    assert picture.startswith(b"\x89PNG")
    alone = of_positions(range(3), np.zeros((3, 1, 2)), 1.0)
    assert contacts.draw(alone).startswith(b"\x89PNG")


def test_the_picture_shows_units_the_range_and_a_median_of_zero() -> None:
    from teamsight.analysis.contacts.figure import draw_on_canvas

    model = CMOMMT(robots=12, radius=2.0, policy="random-walk", rng=3)
    model.recording.record_positions()
    links = model.log_contacts(model.robots)
    model.run(40)
    graph = of_world(model)
    panels = draw_on_canvas(graph, contacts.percolation(graph.position)).axes
    assert [panel.get_xlabel() for panel in panels[:3]] == ["duration  [ticks]", "time  [ticks]", "time  [ticks]"]
    median = next(line for line in panels[2].lines if line.get_label() == "median robot")
    assert np.nanmin(median.get_ydata()) > panels[2].get_ylim()[0]
    (marked,) = (line for line in panels[3].lines if "awareness range" in str(line.get_label()))
    assert list(marked.get_xdata()) == [1.0, 1.0]
    log = of_log(links.contacts)
    assert (log.unit, log.awareness_range) == ("ticks", None)
    unequal = of_positions(range(3), np.zeros((3, 2, 2)), [1.0, 2.0])
    assert (unequal.unit, unequal.awareness_range) == ("", None)


@pytest.mark.parametrize("shape", [(0, 0, 2), (0, 3, 2), (3, 0, 2), (1, 1, 2)])
def test_nobody_and_nothing(shape: tuple[int, int, int]) -> None:
    graph = of_positions(np.arange(shape[0]), np.zeros(shape), 1.0)
    assert isinstance(graph, TemporalGraph)
    assert (len(graph.contacts), len(graph.gaps), len(graph.components)) == (0, 0, shape[0])
    assert graph.time_since_contact().shape == shape[:2]
    assert len(to_networkx(graph)) == shape[1]


def test_wrong_input_is_named() -> None:
    place = np.zeros((2, 3, 2))
    half = place.copy()
    half[0, 0, 0] = np.nan
    for wrong, text in (
        (lambda: of_positions([0, 1], np.zeros((2, 3)), 1.0), r"shape \(2, 3\); give positions"),
        (lambda: of_positions([1, 1], place, 1.0), "2 finite, ascending times"),
        (lambda: of_positions([0, 1], place, [1.0, 2.0]), r"awareness_range: has the shape \(2,\).*3"),
        (lambda: of_positions([0, 1], place, -1.0), "at least 0"),
        (lambda: of_positions([0, 1], half, 1.0), "NaN in both coordinates"),
        (lambda: of_positions([0, 1], place, 3.0, Torus(4.0, 4.0)), "3"),
        (lambda: snapshot(of_positions([0, 1], place, 1.0), -1), "before the first frame, 0; give a later"),
        (lambda: of_positions([0, 1], place, 1.0).time_since_contact("x"), "not in the record; known are 0, 1, 2"),
        (lambda: of_world(CMOMMT(robots=2, rng=1)), "record_positions"),
    ):
        with pytest.raises(ValueError, match=text):
            wrong()


def test_pairs_are_taken_once() -> None:
    graph = of_positions([0], np.zeros((1, 5, 2)), 1.0)
    assert list(zip(*graph.pairs_at(0)[:2], strict=True)) == list(combinations(range(5), 2))


def test_contacts_of_square_ranges() -> None:
    position = np.array([[[0.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.1, 0.0]]])
    edges = {
        shape: len(of_positions([0.0, 1.0], position, 1.0, range_shape=shape, directed=False).edges.frame)
        for shape in ("disc", "square")
    }
    assert edges == {"disc": 0, "square": 1}


def test_a_world_of_square_ranges_has_the_contacts_of_its_robots() -> None:
    world = World(Disc(2.0), rng=4)
    robots = world.add(Robot, 6, policy="random-walk", awareness_range=0.8, range_shape="square")
    world.recording.record_positions()
    world.run(20)
    graph = contacts.of_world(world)
    last = {tuple(sorted((one.unique_id, other.unique_id))) for one in robots for other in one.neighbours}
    rows = graph.edges.frame == graph.edges.frame.max()
    found = {tuple(sorted(pair)) for pair in zip(graph.identity[graph.edges.one[rows]].tolist(), graph.identity[graph.edges.other[rows]].tolist(), strict=True)}
    assert found == last
    world.add(Robot, 1, policy="random-walk", name="round")
    world.run(1)
    with pytest.raises(ValueError, match="'robots', 'round' have disc and square ranges; give team, or use contacts.of_log"):
        contacts.of_world(world)
