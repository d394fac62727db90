"""The states of many worlds in one block of memory. A built world makes their steps, one world after the other.

Worlds of the same settings differ in their seed and in what has happened since. So only that is kept of each: a row of
the block, with what a step reads of the step before. Each step copies the row into the arrays of the built world, calls
the same entries as for a world with arrays of its own, and copies what has changed back. All else, and the room for
neighbours and percepts, is there once, and stays in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain, islice, takewhile
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.mesa import compat as mesa_compat
from teamsight.core.interrupts import deferred
from teamsight.core.kernel.record import address_of
from teamsight.env.loop import (
    BEGIN_ROWS,
    BLOCK,
    END,
    KEEP,
    LOAD,
    MOVE_ROW,
    ROW,
    START,
    BlockArrays,
    RowArrays,
    StartArrays,
)
from teamsight.world.motion import BODIES
from teamsight.world.noise import key_of
from teamsight.world.placement import Starts

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.core.kernel import Packed
    from teamsight.env.batch import Place, Shown

Array = npt.NDArray[Any]
# Columns of bodies that no step changes in a world without events and interactions.
_SAME = {field.name for field in BODIES} - {"position", "heading", "moved", "speed", "aim", "distance"}
# The starts that are computed in one call.
_STARTS = 64
_WORD = 8
# Numbers of a history that fit into 16 bits: a pair of bodies, in both directions, is an edge each.
_MOST_BODIES = 256


def stands_for_others(place: Place) -> bool:
    """Whether nothing of a world, before its first step, can need Python in an episode, or depend on the room there is.

    Readings on their way lie in arrays whose rows are as long as there is room for neighbours.
    """
    world = place._world
    data = world._data
    return data.is_rewritable and not (
        world._stepper.needs_python() or data.watchers or data.interactions or data.solid or data.conditions
        or data.sources.attached or data.timeline.clock.pending or mesa_compat.has_events(world)
        or any(group.readings for group in data.groups)
        or any(relation.detection for relation in world._engine.relations if relation.observers is not place.group)
    )  # fmt: skip


class Live(NamedTuple):
    """All that a step of a world reads of the step before, and that can be looked at after it.

    Attributes
    ----------
    whole : list of ndarray
        What is kept as it is.
    lists : list of tuple of ndarray
        Neighbour lists: an array whose last element is the number of entries, and those with an entry each.
    """

    whole: list[Array]
    lists: list[tuple[Array, ...]]

    @classmethod
    def of(cls, place: Place) -> Live:
        """Return that of a built world."""
        world, sight = place._world, place.sight.value
        data, binding = world._data, world._engine._binding
        whole = [binding.state, data.key, data.moment, data.time, sight.before, sight.is_new, *binding._met.values()]
        for group, record in zip(data.groups, binding._group_records, strict=True):
            # Of robots that are steered, the lidar is shown at once.
            left_out = {*_SAME, "lidar"} if group is place.group else _SAME
            whole += [group.bodies[name] for name in group.bodies.fields if name not in left_out]
            whole += [group._numbers, record.value.block]
        lists: list[tuple[Array, ...]] = [(sight.kept_start, sight.kept_index)]
        for relation in world._engine.relations:
            # Robots that are steered decide without what they sense, and it is searched for again within the step.
            if relation.observers is not place.group:
                lists.append((*relation.search.room, relation.identity))
        return cls([array for array in whole if array.size], lists)

    @property
    def spans(self) -> list[tuple[int, int, int]]:
        """Those of `BlockArrays`."""
        found = [(address_of(array), array.nbytes, 0) for array in self.whole]
        for start, *entries in self.lists:
            found.append((address_of(start), start.nbytes, 0))
            count = address_of(start[-1:])
            found += [(address_of(array), array.nbytes // len(array), count) for array in entries if len(array)]
        return found

    @property
    def words(self) -> int:
        """The most words that a row has."""
        arrays = [*self.whole, *(array for one in self.lists for array in one)]
        return sum(-(-array.nbytes // _WORD) for array in arrays)


class Block:
    """The memory of the worlds: a row of each, and the history of its episode.

    Parameters
    ----------
    worlds : int
        Their number.
    steps : int
        The number of steps for which the history has room at first.

    Attributes
    ----------
    rows : ndarray, shape (worlds, words), int64
        See `BlockArrays`.
    log : ndarray
        As in `BlockArrays`.
    """

    def __init__(self, worlds: int, steps: int, place: Place) -> None:
        shape = place._world._engine.stretch.present.shape
        bodies = sum(map(len, place.groups))
        self.rows = np.zeros((worlds, 0), np.int64)
        self.log: Array = np.zeros((worlds, steps, *shape, 1 if bodies <= _MOST_BODIES else 2), np.uint16)
        self.built: list[BuiltWorld] = []

    def make_room(self, words: int) -> None:
        """Let rows have so many words."""
        if words > self.rows.shape[1]:
            wider = np.zeros((len(self.rows), words), np.int64)
            wider[:, : self.rows.shape[1]] = self.rows
            self.rows = wider

    def is_full(self, cycles: npt.NDArray[np.int64]) -> bool:
        """Whether the history has no room for a step of a world after so many."""
        return bool(cycles.max() >= self.log.shape[1])

    def make_steps(self, most: int) -> None:
        """Let the history have room for twice as many steps, at most these."""
        worlds, steps, *shape = self.log.shape
        longer: Array = np.zeros((worlds, min(2 * steps, most), *shape), np.uint16)
        longer[:, :steps] = self.log
        self.log = longer
        for one in self.built:
            one.bind()

    def history(self, world: int, steps: int) -> npt.NDArray[np.int64]:
        """Return the history of the episode of a world, shape (steps, relations, columns)."""
        parts = self.log[world, :steps].astype(np.int64)
        return parts @ (1 << 16 * np.arange(parts.shape[-1]))


class BuiltWorld:
    """A built world, and those whose steps it makes.

    Parameters
    ----------
    place : Place
        The built world, before its first step.
    block : Block
        The memory.
    worlds : slice
        Its part of the worlds.
    shown : Shown
        The arrays into which is written what is shown of all worlds.

    Attributes
    ----------
    place : Place
        The built world.
    record : Packed of BlockArrays
        What compiled code knows of it; numbers of worlds begin with the first of its part.
    """

    def __init__(self, place: Place, block: Block, worlds: slice, shown: Shown) -> None:
        self.place, self._block, self._part, self._shown = place, block, worlds, shown
        self._world: World = place._world
        self._data = data = self._world._data
        self._states = data.first_states()
        # What is drawn for each seed, beside places and headings, is drawn in Python.
        draws_speeds = isinstance(self._world, CMOMMT) and self._world.settings["uniform_target_speed"]
        self._is_drawn = draws_speeds or any(group.timetable for group in data.groups)
        bodies = sum(map(len, data.groups))
        self._next, self._last = np.zeros(1, np.int64), np.zeros(1, np.int64)
        self._rows, self._runs = np.zeros(_STARTS, np.int64), np.zeros(_STARTS, np.int64)
        # The starts that are computed, and where that of each seed is.
        self._keys, self._computed = np.zeros((_STARTS, 2), np.uint64), dict[int, int]()
        self._position, self._heading = np.zeros((_STARTS, bodies, 2)), np.zeros((_STARTS, bodies, 2))
        place.show_in(shown.of(worlds.start))
        self.record: Packed[BlockArrays] = BLOCK.pack(self._arrays())
        self._begin_world(0, data.start_of(key_of(0)[np.newaxis]), 0)
        self.place.sight.value.is_new[0] = 1
        self._take_template()
        self._start: Packed[StartArrays] = START.pack(self._starts())
        block.built.append(self)

    def bind(self) -> None:
        """Bind the records to the present arrays, after some have grown or were replaced."""
        rows = self._block.rows
        self._put()
        if self._block.rows is not rows:
            for one in self._block.built:
                one._put()

    def _put(self) -> None:
        self.record.put(self._arrays())
        self._start.put(self._starts())

    def _arrays(self) -> BlockArrays:
        place, block, first = self.place, self._block, self._part.start
        self._live = live = Live.of(place)
        block.make_room(live.words)
        seen, row = place.sight.value.seen, block.rows[0].nbytes
        # The word of each, its value for the first world, and its change.
        words: list[tuple[Packed[Any], str, int, int]] = [
            (place.sight, "number", first, 1),
            *(
                (record, name, address_of(array[first:]), array[0].nbytes)
                for record, name, array in (
                    (seen, "situation", self._shown.observations), (place.sight, "of_world", self._shown.of_worlds)
                )
            ),
        ]  # fmt: skip
        shown = np.array([
            (record.address + _WORD * record.record.leaves[name].slot, value, change)
            for record, name, value, change in words
        ])
        return BlockArrays(
            place.sight, address_of(block.rows) + first * row, row, np.array(live.spans), shown, block.log[self._part]
        )  # fmt: skip

    def _take_template(self) -> None:
        """Keep the state with which all episodes begin, but for the noise and the places of bodies."""
        block = self._block
        kept = block.rows[self._part.start].copy()
        self._move(0, KEEP)
        self._template, block.rows[self._part.start] = block.rows[self._part.start].copy(), kept

    def _starts(self) -> StartArrays:
        binding = self._world._engine._binding
        see = np.array([(phase.entry.address, phase.record.address) for phase in binding.see])
        template = 0 if self._is_drawn else address_of(self._template)
        return StartArrays(
            self.record, template, see, self._next, self._last, self._rows, self._runs, self._keys, self._position,
            self._heading, self._data.key, binding._group_records,
        )  # fmt: skip

    def _move(self, row: int, what: int) -> None:
        MOVE_ROW(ROW.pack(RowArrays(self.record, row, what)))

    def _begin_world(self, seed: int, start: Any, run: int) -> None:
        self._world._engine.stretch.steps.cut(0)
        self._world._begin(seed, start, run, self._states)
        self._data.moment[0] = 0

    def begin(self, seeds: Mapping[int, int], following: Iterable[int]) -> None:
        """Begin episodes in some of its worlds.

        Parameters
        ----------
        seeds : mapping of int to int
            The seed of each world.
        following : iterable of int
            Seeds of coming episodes, in the order in which they are likely to begin.
        """
        left, starts = list(seeds.items()), Starts(self._position, self._heading)
        while left:
            if left[0][1] not in self._computed:
                self._compute(islice(chain((seed for _, seed in left), following), _STARTS))
            ready = list(islice(takewhile(lambda one: one[1] in self._computed, left), _STARTS))
            del left[: len(ready)]
            for number, (world, seed) in enumerate(ready):
                self._rows[number], self._runs[number] = world - self._part.start, self._computed[seed]
            if not self._is_drawn:
                self._begin_rows(0, len(ready))
                continue
            for number, (_, seed) in enumerate(ready):
                self._begin_world(seed, starts, self._computed[seed])
                self.place.sight.value.is_new[0] = 1
                self._begin_rows(number, number + 1)

    def _compute(self, seeds: Iterable[int]) -> None:
        """Compute the starts of some seeds."""
        self._computed = {seed: run for run, seed in enumerate(dict.fromkeys(seeds))}
        keys = self._keys[: len(self._computed)]
        keys[:] = [key_of(seed) for seed in self._computed]
        self._position[: len(keys)], self._heading[: len(keys)] = self._data.start_of(keys)

    def _begin_rows(self, first: int, last: int) -> None:
        place, engine = self.place, self._world._engine
        self._next[0], self._last[0] = first, last
        with deferred():
            while stopped := BEGIN_ROWS(self._start):
                engine._call(engine._binding.see)
                place.show_in(self._shown.of(self._part.start + stopped - 1))
                self.bind()
                self._move(stopped - 1, KEEP)

    def go_on(self, world: int, status: int) -> None:
        """Complete the step of a world that compiled code could not make alone, since a buffer was full."""
        # What completes it in Python needs the tick, which the noise of sensors depends on.
        self._world._engine._read_back()
        self.place.go_on(status, self._shown.of(world))
        self.bind()
        self._move(world - self._part.start, END)

    def look(self, world: int) -> Place:
        """Return the built world in the state of one of its worlds, to look at it before the next step."""
        self._move(world - self._part.start, LOAD)
        engine = self._world._engine
        with deferred():
            engine._call(engine._binding.see)
        return self.place

    def put_into(self, place: Place, world: int) -> None:
        """Put the state of a world into one with arrays of its own that has just begun its episode."""
        self._move(world - self._part.start, LOAD)
        engine, steps = place._world._engine, int(self._world._engine._binding.progress["tick"][0])
        place.bind_to(self._shown.of(world))
        engine._make_room(steps)
        engine.stretch.steps.whole("found")[:steps] = self._block.history(world, steps)
        for mine, its in zip(Live.of(place).whole, self._live.whole, strict=True):
            mine[...] = its
        engine._binding.progress["row"] = steps
        engine._read_back()
        # The lists of neighbours, for which there may be too little room.
        engine.is_seen = False
        engine.prepare()
        place.sync()
        place.bind_to(self._shown.of(world))
        for its_list, my_list in zip(self._live.lists, Live.of(place).lists, strict=True):
            size = int(its_list[0][-1])
            my_list[0][:] = its_list[0]
            for mine, its in zip(my_list[1:], its_list[1:], strict=True):
                mine[:size] = its[:size]
