"""The replay of a world: it grows while the world runs, and writes its file at the end."""

from __future__ import annotations

import atexit
import contextlib
import os
from pathlib import Path
from types import TracebackType
from typing import Self

from teamsight.agents.engine.engine import Engine
from teamsight.agents.recording.frames import FrameRecorder
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.view.page import check_replaceable
from teamsight.view.replay import RecordedTrack, Replay, check_ending
from teamsight.view.scene import MOST_SLOTS

# Replays that must still be written, by their files: a world that nobody refers to has a file all the same.
_open: dict[str, WorldReplay] = {}


class WorldReplay(Replay):
    """A replay that grows with the run of a world; `World.record` makes it.

    It ends with `stop`, with its ``with`` block, when the world is closed, or when the program ends. Then it writes its
    file, if it has one, and no longer refers to the world.

    Parameters
    ----------
    data, engine
        Those of the world.
    model : str
        The class of the world.
    file : path, optional
        The file to write at the end; see `Replay.save`.
    every : int
        Ticks from one frame to the next.
    title : str, optional
        What is recorded, for people.
    force : bool
        Replace any regular file.
    """

    def __init__(
        self,
        data: WorldData,
        engine: Engine,
        model: str,
        *,
        file: str | os.PathLike[str] | None = None,
        every: int = 1,
        title: str | None = None,
        force: bool = False,
    ) -> None:
        _check_agents(data)
        self._force, self._place, self._process = checks.flag("force", force), "", os.getpid()
        if title is not None and not isinstance(title, str):
            raise TypeError(f"title={checks.shown(title)}: must be a string, such as 'two robots'")
        recorder = FrameRecorder(data, engine, model, every=checks.count("every", every), title=title)
        if file is not None:
            self._place = _checked_place(file, force=force)
        recorder.when_closed = self.stop
        self._recorder: FrameRecorder | None = recorder
        super().__init__([recorder])
        recorder.begin()
        if self._place:
            _open[self._place] = self

    @property
    def is_recording(self) -> bool:
        """Whether it still grows."""
        return self._recorder is not None and self._recorder.is_recording

    def stop(self) -> Self:
        """Record no more, and write the file, if there is one. Idempotent.

        Raises
        ------
        ValueError
            If the file cannot be written; the replay can then be saved elsewhere.
        """
        recorder = self._recorder
        if recorder is None:
            return self
        # A world whose last step has failed raises its error again; what was recorded before stays.
        with contextlib.suppress(Exception):
            recorder.update()
        recorder.end()
        self._recorder = None
        self.tracks = (RecordedTrack(recorder.scene, recorder.frames),)
        place = self._place
        self._forget_file()
        if place:
            self.save(place, force=self._force)
        return self

    def discard(self) -> None:
        """Record no more, and write no file. Idempotent."""
        self._forget_file()
        if self._recorder is not None:
            self._recorder.end()

    def _forget_file(self) -> None:
        if _open.get(self._place) is self:
            del _open[self._place]
        self._place = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.stop()
        except Exception as problem:
            if error is None:
                raise
            # The exception of the block goes on, and says that the file is missing.
            error.add_note(f"The recording could not be written: {problem}")

    def __len__(self) -> int:
        return len(self.tracks[0].frames) if self._recorder is None else len(self._recorder)

    def __repr__(self) -> str:
        state = ", recording" if self.is_recording else ""
        return f"<Replay of {self.title}: {len(self):,} frames{state}>"


def _check_agents(data: WorldData) -> None:
    """Refuse a world in which nothing could be drawn, or too much."""
    agents = sum(map(len, data.groups))
    if not agents:
        raise ValueError(
            "record(): the world has no agents, so its recording would be empty; add them first, as in "
            "world.add(Robot, 10, policy='random-walk')"
        )
    if agents > MOST_SLOTS:
        raise ValueError(f"record(): the world has {agents:,} agents, and at most {MOST_SLOTS:,} can be recorded")


def _checked_place(file: str | os.PathLike[str], *, force: bool) -> str:
    """Return the absolute path of a file that can be written; an open replay with this file is ended first."""
    if not isinstance(file, str | os.PathLike):
        raise TypeError(f"file={checks.shown(file)}: must be a path, such as 'run.html', or None")
    if check_ending(file) == ".mp4":
        from teamsight.view.animation import check_video

        check_video()
    check_replaceable(file, force=force)
    place = os.path.abspath(os.fsdecode(file))
    earlier = _open.get(place)
    if earlier is not None:
        earlier.stop()
    return place


@atexit.register
def _stop_all() -> None:
    """Write what was not yet written when the program ends; a copy of this process leaves that to it."""
    for replay in list(_open.values()):
        if replay._process != os.getpid():
            continue
        try:
            replay.stop()
        except Exception as error:
            # Nobody can catch it any more.
            print(f"teamsight: the recording {Path(replay._place).name} could not be written: {error}")
