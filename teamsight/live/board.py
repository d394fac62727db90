"""What the pages are to show: the newest message of each kind, which the simulation writes and the connections read.

Nothing waits in a queue: a message that was not read in time is replaced by a newer one. So a slow page skips frames,
costs no memory, and never holds up the simulation.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import NamedTuple


class Frames(NamedTuple):
    """The messages of one moment, one for each world.

    Attributes
    ----------
    number : int
        The number of the frame, which pages acknowledge.
    scenes : int
        The version of the scenes that the frames need.
    messages : tuple of bytes
        One for each world.
    """

    number: int
    scenes: int
    messages: tuple[bytes, ...]


class Scenes(NamedTuple):
    """The messages that describe the worlds.

    Attributes
    ----------
    version : int
        Grows with each change.
    run : int
        Grows when the worlds start again; the page then drops its frames.
    texts : tuple of str
        One for each world.
    """

    version: int
    run: int
    texts: tuple[str, ...]


class News(NamedTuple):
    """What is on the board: texts by kind with the number of their versions, the scenes, and the newest frames."""

    texts: dict[str, tuple[int, str]]
    scenes: Scenes | None
    frames: Frames | None


class Board:
    """The newest messages, for any number of connections."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._texts: dict[str, tuple[int, str]] = {}
        self._scenes: Scenes | None = None
        self._frames: Frames | None = None
        self._wake: Callable[[], object] | None = None
        self._is_waking = False

    def listen(self, wake: Callable[[], object] | None) -> None:
        """Call `wake` after a change, once for all changes until the board is read; None ends that."""
        with self._lock:
            self._wake, self._is_waking = wake, False

    def post(self, kind: str, text: str) -> None:
        """Put a message up in place of the last one of its kind, unless both are equal."""
        with self._lock:
            version, before = self._texts.get(kind, (0, ""))
            if text == before and kind != "error":
                return
            self._texts[kind] = version + 1, text
        self._changed()

    def post_scenes(self, scenes: Scenes) -> None:
        """Put the descriptions of the worlds up."""
        with self._lock:
            self._scenes = scenes
        self._changed()

    def post_frames(self, frames: Frames) -> None:
        """Put the frames of a moment up."""
        with self._lock:
            self._frames = frames
        self._changed()

    def read(self) -> News:
        """Return what is on the board."""
        with self._lock:
            self._is_waking = False
            return News(dict(self._texts), self._scenes, self._frames)

    def _changed(self) -> None:
        with self._lock:
            if self._wake is None or self._is_waking:
                return
            self._is_waking, wake = True, self._wake
        wake()
