"""Where temporal graphs come from: positions, trajectories, worlds that record theirs, and logs of contacts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from teamsight.analysis.contacts.frames import Edges, FrameSearch, all_edges, mutual
from teamsight.analysis.contacts.temporal_graph import TemporalGraph

if TYPE_CHECKING:
    from teamsight.agents.events.contact_log import Contacts
    from teamsight.agents.world import World
    from teamsight.world.arena import Arena


def of_positions(
    time: ArrayLike,
    position: ArrayLike,
    awareness_range: float | ArrayLike,
    arena: Arena | None = None,
    *,
    range_shape: str = "disc",
    identity: ArrayLike | None = None,
    team: ArrayLike | None = None,
    directed: bool = False,
) -> TemporalGraph:
    """Return the temporal graph of recorded positions.

    Parameters
    ----------
    time : array_like of float, shape (frames,)
        Times of the frames, ascending.
    position : array_like of float, shape (frames, n, 2)
        Positions [length]; NaN while a robot is not there, because it has failed, has not come yet or has left.
    awareness_range : float or array_like of float, shape (n,)
        Distance within which each robot senses others [length].
    arena : Arena, optional
        Changes distances only if it is periodic, as a torus is.
    range_shape : {"disc", "square"}
        The shape of ranges. In a square are robots at most the range away along either axis.
    identity : array_like, shape (n,), optional
        Names of the robots; 0 .. n − 1 by default.
    team : array_like, shape (n,), optional
        Team of each robot; robots of different teams are not neighbours. By default all are on one team.
    directed : bool
        Whether edges lead from the robot that senses to the one that is sensed; by default they are the mutual ones.

    Raises
    ------
    ValueError
        If a shape is wrong, times do not ascend, a range is negative or, on a torus, above half a side, or a position
        is infinite, or NaN in one coordinate only.
    """
    place = np.ascontiguousarray(position, float)
    if place.ndim != 3 or place.shape[2] != 2:
        raise ValueError(f"position: has the shape {place.shape}; give positions of shape (frames, robots, 2)")
    frames, size = place.shape[:2]
    when = np.array(time, float)
    if when.shape != (frames,) or np.any(np.diff(when) <= 0) or not np.isfinite(when).all():
        raise ValueError(f"time: of shape {when.shape}; give {frames} finite, ascending times, one for each frame")
    reach = _one_each("awareness_range", np.asarray(awareness_range, float), size).astype(float)
    if not np.isfinite(reach).all() or np.any(reach < 0):
        raise ValueError("awareness_range: must be a finite number of at least 0 for every robot")
    missing = np.isnan(place)
    if np.any(missing[..., 0] != missing[..., 1]) or np.isinf(place).any():
        raise ValueError("position: must be finite, or NaN in both coordinates where a robot is not there")
    if arena is not None:
        arena.check_reach(float(reach.max(initial=0.0)))
    names = np.arange(size) if identity is None else _one_each("identity", np.asarray(identity), size)
    teams = None if team is None else np.unique(_one_each("team", np.asarray(team), size), return_inverse=True)[1]
    edges = all_edges(FrameSearch(place, reach, arena, range_shape), teams, directed=directed)
    same = float(reach[0]) if size and reach.min() == reach.max() else None
    return TemporalGraph(when, names, place, edges, directed=directed, awareness_range=same)


def _one_each(name: str, given: NDArray[np.generic], size: int) -> NDArray[np.generic]:
    if given.shape not in ((), (size,)):
        raise ValueError(f"{name}: has the shape {given.shape}; give one value, or {size}, one for each robot")
    return np.array(np.broadcast_to(given, size))


def of_trajectory(
    trajectory: pd.DataFrame,
    awareness_range: float | Mapping[str, float],
    arena: Arena | None = None,
    *,
    range_shape: str = "disc",
    team: Mapping[str, str] | None = None,
    directed: bool = False,
) -> TemporalGraph:
    """Return the temporal graph of a trajectory, in which robots may come and go.

    Parameters
    ----------
    trajectory : DataFrame
        Columns time, identity (or robot), x, y: one row a robot and time, from ``model.recording.trajectory``. A robot
        is not there at times without a row, or where x and y are NaN.
    awareness_range : float or mapping of str to float
        Distance within which robots sense each other [length]; or that of each group, by its name in the column group.
        Other groups are left out.
    arena, range_shape, directed
        See `of_positions`.
    team : mapping of str to str, optional
        The team of each group; by default all are on one.

    Raises
    ------
    ValueError
        If the trajectory holds several runs, or several groups with one range, or lacks a column or a group; or as
        `of_positions`.
    """
    name = "identity" if "identity" in trajectory else "robot"
    if lacking := [column for column in ("time", name, "x", "y") if column not in trajectory]:
        raise ValueError(f"the trajectory has no column {lacking[0]}; give time, identity, x and y")
    if "run" in trajectory and trajectory["run"].nunique() > 1:
        first = trajectory["run"].iloc[0]
        raise ValueError(
            f"the trajectory holds {trajectory['run'].nunique()} runs: select one, as in "
            f"trajectory[trajectory.run == {first!r}]"
        )
    held = trajectory["group"].unique().tolist() if "group" in trajectory else []
    reach: float | NDArray[np.float64]
    if not isinstance(awareness_range, Mapping):
        if len(held) > 1:
            raise ValueError(
                f"the trajectory holds the groups {', '.join(map(str, held))}: select one, as in "
                f"trajectory[trajectory.group == {held[0]!r}]; or give the range of each group, as in "
                f"awareness_range={{{held[0]!r}: {awareness_range}, …}}"
            )
    elif missing := [group for group in awareness_range if group not in held]:
        known = ", ".join(map(repr, held)) or "none"
        raise ValueError(f"awareness_range: names the group {missing[0]!r}; the trajectory holds {known}")
    else:
        trajectory = trajectory[trajectory["group"].isin(list(awareness_range))]
    frame, when = pd.factorize(trajectory["time"], sort=True)
    row, names = pd.factorize(trajectory[name], sort=True)
    position = np.full((len(when), len(names), 2), np.nan)
    position[frame, row] = trajectory[["x", "y"]].to_numpy(float)
    teams = None
    if isinstance(awareness_range, Mapping):
        # A robot stays in its group.
        groups = trajectory["group"].astype(str).to_numpy()[np.unique(row, return_index=True)[1]]
        reach = np.array([awareness_range[one] for one in groups], float)
        teams = None if team is None else np.array([team.get(one, "") for one in groups])
    else:
        reach = awareness_range
    return of_positions(
        when, position, reach, arena, range_shape=range_shape, identity=names, team=teams, directed=directed
    )


def of_world(world: World, team: str | None = None, *, directed: bool = False) -> TemporalGraph:
    """Return the temporal graph of a world since ``world.recording.record_positions()``.

    Parameters
    ----------
    world : World
        All agents on a team count, whatever their group; agents of different teams are not neighbours.
    team : str, optional
        The only team that counts; by default all do.
    directed : bool
        See `of_positions`.

    Raises
    ------
    ValueError
        If nothing is recorded, no group is on a team, the ranges differ within a group, or their shapes between groups.

    Notes
    -----
    Ranges are the present ones of each group, also for robots that have left.
    """
    from teamsight.agents.teammates import of_team
    from teamsight.analysis.teams import check_team

    check_team(world, team, f"the world at tick {world.tick}")
    trajectory = world.recording.trajectory
    groups = of_team(world.groups, team)
    trajectory = trajectory[trajectory["group"].isin([group.name for group in groups])]
    if trajectory.empty:
        raise ValueError(
            "the world has recorded no positions of robots; call world.recording.record_positions() before world.run"
        )
    recorded = set(trajectory["group"])
    ranges, teams = dict[str, float](), dict[str, str]()
    for group in groups:
        reach = np.unique(group.bodies.awareness_range)
        if len(reach) > 1:
            raise ValueError(
                f"group {group.name!r}: has awareness ranges from {reach[0]:g} to {reach[-1]:g}; give those of each "
                "robot to contacts.of_positions"
            )
        if group.name in recorded:
            if not len(reach):
                raise ValueError(
                    f"group {group.name!r}: all its robots have left, so their range is unknown; give it to "
                    "contacts.of_trajectory"
                )
            ranges[group.name], teams[group.name] = float(reach[0]), str(group.team)
    shapes = sorted({group.range_shape for group in groups})
    if len(shapes) > 1:
        raise ValueError(
            f"range_shape: the groups {', '.join(repr(group.name) for group in groups)} have {' and '.join(shapes)} "
            "ranges; give team, or use contacts.of_log"
        )
    graph = of_trajectory(
        trajectory, ranges, world.arena, range_shape=shapes[0], team=teams, directed=directed
    )
    graph.unit = "ticks"
    return graph


def of_log(log: Contacts, identity: ArrayLike | None = None, *, directed: bool = False) -> TemporalGraph:
    """Return the temporal graph of a contact log, in which every step counts but positions are unknown.

    Parameters
    ----------
    log : Contacts
        ``links.contacts`` of the log ``links = world.log_contacts(robots)``.
    identity : array_like of int, shape (n,), optional
        The `unique_id` of all robots; by default of those that have a contact.
    directed : bool
        See `of_positions`. Mutual contacts need the logs of both robots, so those of one group.

    Raises
    ------
    ValueError
        If a robot of the log is not among `identity`.

    Notes
    -----
    A log does not say why a contact begins or ends: all robots count as present, also those that have failed, and
    causes are "unknown". It differs from `of_world` in two ways. Its first frame is `log.since`, before any step, while
    positions are recorded after steps. And it holds what robots perceive: what an event before the step from tick t
    changes (a failure, a repair, an arrival) is in the frame of t, while the positions after that step show it in the
    frame of t + 1.
    """
    met = np.unique(np.concatenate([log.observer, log.observed]))
    names = met if identity is None else np.unique(np.asarray(identity))
    if len(lost := np.setdiff1d(met, names)):
        raise ValueError(f"identity: lacks robot {lost[0]}, which is in the log; give the unique_id of all robots")
    ticks = np.arange(log.since, log.until + 1)
    size = max(len(names), 1)
    pair = np.searchsorted(names, log.observer) * size + np.searchsorted(names, log.observed)
    # Rows of a pair in turn begin and end; one that has not ended lasts until the last tick.
    order = np.lexsort((log.tick, pair))
    pair, tick, begun = pair[order], log.tick[order], log.begun[order]
    ended = np.append((pair[1:] == pair[:-1]) & ~begun[1:], False)[: len(begun)]
    until = np.where(ended, np.append(tick[1:], 0)[: len(tick)], log.until + 1)[begun]
    pair, first = pair[begun], tick[begun]
    length = until - first
    frame = (
        np.repeat(first - log.since, length) + np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    )
    one, other = np.divmod(np.repeat(pair, length), size)
    order = np.lexsort((other, one, frame))
    edges = Edges(frame[order], one[order], other[order], np.full(len(order), np.nan))
    shape = len(ticks), len(names)
    return TemporalGraph(
        ticks.astype(float),
        names,
        np.full((*shape, 2), np.nan),
        edges if directed else mutual(edges, size),
        directed=directed,
        knows_presence=False,
        unit="ticks",
    )
