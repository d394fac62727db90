"""The frame recorder: a watcher that copies what a page draws, after each step of a world."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.watching import Bound, Watcher
from teamsight.agents.recording.frame_chunk import SERIES, Chunk, Space, link_lists
from teamsight.agents.recording.frame_kernel import (
    BODIES,
    FRAMES,
    LINKS,
    NO_FRAME,
    RECORD_FRAME,
    SLACK,
    BodyArrays,
    FrameArrays,
)
from teamsight.agents.recording.frame_layout import Layout, LinkLayout, link_arrays, link_layouts, most_bytes
from teamsight.agents.recording.scene_of import Backdrop, scene_of, slots_of
from teamsight.agents.world_data import WorldData
from teamsight.view.frame import MOST_PART, Frame
from teamsight.view.scene import MOST_SLOTS, LinkList, Scene, Slot

# More links than any frame has.
_ANY_NUMBER = 2**62
# The size of the first chunk, and of the largest; each is twice as large as the one before [bytes].
_FIRST, _LARGEST = 2**20, 2**25


class FrameRecorder(Watcher):
    """Records frames of a world from now on; begin with `begin`, end with `end`.

    A frame is recorded at each tick that `every` divides, and of the present at the beginning. It shows the world as it
    was when the next step began: after the events of its tick, and after all changes that were made between the steps.

    Parameters
    ----------
    data : WorldData
        The data of the world.
    engine : Engine
        Its engine.
    model : str
        The class of the world, for the scene.
    every : int
        Ticks from one frame to the next.
    title : str, optional
        What is recorded, for people; by default made of the class, the policy and the seed.

    Attributes
    ----------
    most_links : int
        How many links of a relation a frame holds; of more it holds none, and says how many there are.
    when_closed : callable
        Called without arguments when the world is closed; by default `end`.
    """

    entry = RECORD_FRAME
    sees_changes = True
    most_links = _ANY_NUMBER

    def __init__(
        self, data: WorldData, engine: Engine, model: str, *, every: int = 1, title: str | None = None
    ) -> None:
        self._data, self._engine, self._model = data, engine, model
        self.every, self.title = every, title
        self._chunks: list[Chunk] = []
        self._slot_of: dict[int, int] = {}
        self._slots: list[Slot] = []
        self._seed, self._room, self._taken = data.seed, _FIRST, 0
        self._backdrop = Backdrop(data.arena)
        self._scene: Scene | None = None
        self.when_closed: Callable[[], object] = self.end
        low, high = data.arena.bounds
        self._space = Space(low.copy(), high - low, data.arena.period)

    def begin(self) -> None:
        """Record the present, and every step from now on."""
        self._engine.watch(self)
        try:
            self.update()
        except BaseException:
            self._engine.unwatch(self)
            raise

    def end(self) -> None:
        """Record no more."""
        self._engine.unwatch(self)

    def release(self) -> None:
        """Forget all frames, after the end."""
        for chunk in self._chunks:
            chunk.release()
        self._chunks = []

    def close(self) -> None:
        """Record no more, since the world is closed."""
        self.when_closed()

    @property
    def is_recording(self) -> bool:
        """Whether steps are recorded."""
        return any(watcher is self for watcher in self._data.watchers)

    def update(self) -> None:
        """Record what has changed since the last step; nothing within a step."""
        if self.is_recording and not self._data.timeline.inside:
            self._engine.look()

    def __len__(self) -> int:
        self.update()
        return len(self._numbers())

    def _numbers(self) -> list[tuple[Chunk, int]]:
        """Return for each frame its chunk and its number there; of several of one tick only the last."""
        latest: dict[int, tuple[Chunk, int]] = {}
        for chunk in self._chunks:
            latest.update({tick: (chunk, k) for k, tick in enumerate(chunk.ticks[: len(chunk)].tolist())})
        return list(latest.values())

    @property
    def frames(self) -> list[Frame]:
        """The frames so far, in order of time."""
        self.update()
        lists = self.links
        made = {id(chunk): chunk.frames(lists, self._space) for chunk in self._chunks}
        return [made[id(chunk)][k] for chunk, k in self._numbers()]

    def take(self) -> list[Frame]:
        """Return the frames since the last call, and forget them; for a page that shows a run as it goes on."""
        frames = self.frames
        self._taken += len(frames)
        del self._chunks[:-1]
        for chunk in self._chunks:
            chunk.state[:] = 0, self._taken, chunk.state[2] + 1
        return frames

    @property
    def links(self) -> tuple[LinkList, ...]:
        """The lists of links that each frame has."""
        return link_lists([chunk.layout for chunk in self._chunks])

    @property
    def scene(self) -> Scene:
        """The scene of the frames so far; the same object as long as nothing in it has changed."""
        groups = self._data.groups
        for group in groups:
            for slot in slots_of(group):
                if (number := self._slot_of.get(slot.id)) is not None:
                    self._slots[number] = slot
        scene = scene_of(
            self._backdrop, groups, self._slots, title=self.title, model=self._model, seed=self._data.seed,
            every=self.every, series=SERIES, links=self.links,
        )  # fmt: skip
        if self._scene is None or self._scene != scene:
            self._scene = scene
        return self._scene

    def bind(self, bound: Bound) -> None:
        """Find out whose words are where, and make room for a frame."""
        layouts = link_layouts(bound.relations, bound.first_body, self._data.arena, self.most_links)
        arrays = [link_arrays(relation, one) for relation, one in zip(bound.relations, layouts, strict=True)]
        bodies = sum(map(len, bound.groups))
        layout = self._layout(layouts)
        if layout.size > MOST_SLOTS:
            self._give_up()
            return
        chunk = self._chunk(layout, 2 * bodies + sum(map(most_bytes, arrays)) + SLACK)
        records = zip(bound.relations, bound.relation_records, strict=True)
        met = next((record.value.met for relation, record in records if relation.counts), np.zeros(bodies, np.int64))
        groups = [
            BODIES.pack(BodyArrays(one.position.reshape(-1), one.heading.reshape(-1), one.active))
            for one in (group.bodies for group in bound.groups)
        ]
        self.record = FRAMES.pack(FrameArrays(
            bound.moment, self.every, groups, [LINKS.pack(one) for one in arrays], met,
            self._space.low, MOST_PART / self._space.size,
            chunk.state, chunk.ticks, chunk.begins, chunk.fixed, chunk.stream, chunk.most,
            chunk.layout.is_conditional,
        ))  # fmt: skip

    def _layout(self, links: tuple[LinkLayout, ...]) -> Layout:
        """Return the present layout; bodies that are new get the next slots."""
        slots = []
        for group in self._data.groups:
            for slot in slots_of(group):
                if slot.id not in self._slot_of:
                    self._slot_of[slot.id] = len(self._slots)
                    self._slots.append(slot)
                slots.append(self._slot_of[slot.id])
        is_conditional = any(group.has_conditions for group in self._data.groups)
        return Layout(np.array(slots, np.int64), len(self._slots), is_conditional, links)

    def _chunk(self, layout: Layout, most: int) -> Chunk:
        """Return the chunk for the next frame: the last one, if it has the layout and room."""
        if self._chunks:
            last = self._chunks[-1]
            is_like = last.layout.is_like(layout)
            last.most = max(last.most, most) if is_like else last.most
            if is_like and not last.is_full:
                return last
            if is_like:
                self._room = min(2 * self._room, _LARGEST)
            if not len(last):
                self._chunks.pop()
            elif not is_like:
                last.close()
        earlier = self._taken + sum(map(len, self._chunks))
        self._chunks.append(Chunk(layout, most, self._room, earlier))
        return self._chunks[-1]

    def _give_up(self) -> None:
        """Record no more frames, since further bodies would have no slots."""
        if self.entry is not NO_FRAME:
            self.entry = NO_FRAME
            warnings.warn(
                f"the recording ends at tick {self._data.timeline.tick:,}: more than {MOST_SLOTS:,} agents have come, "
                "and no more can be recorded; record shorter runs",
                stacklevel=2,
            )

    def happened(self) -> None:
        """Begin another chunk, since the last one is full."""
        self._engine.rewatch()

    def forget(self) -> None:
        """Drop the frames from the present tick on, which another run now replaces; all if it has another seed."""
        tick = self._data.timeline.tick
        is_same = self._data.seed == self._seed
        self._seed = self._data.seed
        for chunk in self._chunks:
            chunk.cut(tick if is_same else -1)
        self._chunks = [chunk for chunk in self._chunks if len(chunk)]
        self._taken = 0
        if not self._chunks:
            self._slot_of, self._slots, self._room, self.entry = {}, [], _FIRST, RECORD_FRAME
        self._engine.rewatch()
