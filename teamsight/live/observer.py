"""What a page shows of a world now: its scene and its frame."""

from __future__ import annotations

from dataclasses import replace

from teamsight.agents.engine.records import Bound
from teamsight.agents.recording.frames import RECORD_FRAME, FrameRecorder
from teamsight.agents.world import World
from teamsight.view.scene import MOST_LINKS, MOST_SLOTS, Frame, Scene

# Ticks between frames that are recorded unasked: none is.
_NEVER = 2**62


class Observer(FrameRecorder):
    """Makes frames of the present state of a world, when it is asked for one.

    Parameters
    ----------
    world : World
        The world.
    every : int
        What its scene says about the ticks from one frame to the next.
    """

    # Ranges that controls allow make millions of links, of four bytes each, which no page could draw.
    most_links = MOST_LINKS

    def __init__(self, world: World, every: int) -> None:
        super().__init__(world._data, world._engine, type(world).__name__, every=_NEVER)
        self.shown_every = every
        self._is_rebound = True
        self._present: Scene | None = None
        self.begin()

    def bind(self, bound: Bound) -> None:
        """Pack the record again; bodies, ranges or rules may have changed, and with them the scene."""
        super().bind(bound)
        self._is_rebound = True
        # Only the newest frame is ever read.
        del self._chunks[:-1]

    def frame(self) -> Frame:
        """Return the present frame.

        Raises
        ------
        ValueError
            If more agents have come so far than frames can number.
        """
        self._engine.prepare()
        if self.entry is not RECORD_FRAME:
            raise ValueError(f"agents: more than {MOST_SLOTS:,} have come, and a page can number no more; watch fewer")
        chunk = self._chunks[-1]
        chunk.state[:2] = 0
        RECORD_FRAME(self.record)
        chunk.state[2] += 1
        return chunk.frames(self.links, self._space)[-1]

    def changed(self) -> None:
        """Note that the scene has changed in what needs no binding, such as speeds."""
        self._is_rebound = True

    @property
    def present(self) -> Scene:
        """The scene of the newest frame; the same object as long as nothing in it has changed."""
        if self._present is None or self._is_rebound:
            self._is_rebound = False
            scene = replace(self.scene, every=self.shown_every)
            if scene != self._present:
                self._present = scene
        assert self._present is not None
        return self._present
