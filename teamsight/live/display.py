"""What the pages are to show of the worlds: written to the board."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from typing import Any

from teamsight.live import protocol
from teamsight.live.board import Board, Frames, Scenes
from teamsight.live.controls import Control
from teamsight.live.protocol import Message
from teamsight.live.track import LiveTrack
from teamsight.view.scene import Scene

# Bytes of the frames of each world that a new page gets.
_MOST_HISTORY = 4 * 2**20


class Display:
    """Writes frames, scenes, the state, the controls and the event logs to a board.

    Parameters
    ----------
    board : Board
        The board.
    controls : iterable of Control
        What pages can set.
    """

    def __init__(self, board: Board, controls: Iterable[Control]) -> None:
        self._board, self._controls = board, list(controls)
        self._number = self._version = self._run = 0
        # Another value shows pages that another server has answered.
        self._server = secrets.token_hex(4)
        self._scenes: list[Scene] = []

    def begin(self, tracks: list[LiveTrack]) -> None:
        """Show worlds that have just been built; pages drop the frames of those before."""
        self._run += 1
        self._scenes = []
        self.frames(tracks)

    def frames(self, tracks: list[LiveTrack], *, again: bool = False) -> None:
        """Show the present frames.

        Parameters
        ----------
        tracks : list of LiveTrack
            The worlds.
        again : bool
            Whether the last frames showed the same moment.
        """
        self._number += 1
        blocks = [track.look(again=again) for track in tracks]
        scenes = [track.scene for track in tracks]
        if list(map(id, scenes)) != list(map(id, self._scenes)):
            self._post_scenes(scenes)
        messages = tuple(protocol.frame_message(i, self._number, block) for i, block in enumerate(blocks))
        self._board.post_frames(Frames(self._number, self._version, messages))

    def history(self, tracks: list[LiveTrack]) -> list[str | bytes]:
        """Return the messages of what a new page has missed: the scenes, then the newest frames; for other threads.

        If the worlds are built anew meanwhile, the scenes that follow make the page drop them.
        """
        messages: list[str | bytes] = []
        run, newest = self._run_name, [track.newest(_MOST_HISTORY) for track in tracks]
        for i, (scene, _) in enumerate(newest):
            messages.append(_scene_message(scene, i, len(tracks), run))
        messages += [protocol.history_message(i, blocks) for i, (_, blocks) in enumerate(newest) if blocks]
        return messages

    @property
    def _run_name(self) -> str:
        return f"{self._server}-{self._run}"

    def _post_scenes(self, scenes: list[Scene]) -> None:
        self._version += 1
        self._scenes = scenes
        texts = tuple(_scene_message(scene, i, len(scenes), self._run_name) for i, scene in enumerate(scenes))
        self._board.post_scenes(Scenes(self._version, self._run, texts))

    def state(self, tracks: list[LiveTrack], facts: dict[str, Any]) -> None:
        """Show the state and the event logs.

        Parameters
        ----------
        tracks : list of LiveTrack
            The worlds.
        facts : dict of str to object
            What else belongs to the state.
        """
        self._board.post("state", protocol.text("state", **facts, tracks=[track.state() for track in tracks]))
        self._board.post("events", protocol.text("events", tracks=[track.events() for track in tracks]))

    def controls(self, tracks: list[LiveTrack], seed: int, wanted: Iterable[Message] = ()) -> None:
        """Show the controls and their values.

        Parameters
        ----------
        tracks : list of LiveTrack
            The worlds.
        seed : int
            Their seed.
        wanted : iterable of Message
            Values that were chosen, and hold soon.
        """
        values = [
            {one.name: one.shown(seed if one.name == "seed" else track.value(one.name)) for one in self._controls}
            for track in tracks
        ]
        for fields in (one.fields for one in wanted):
            track = fields["track"]
            for shown in values if track is None else values[track : track + 1]:
                shown[fields["name"]] = fields["value"]
        controls = [one.as_json() for one in self._controls]
        self._board.post("controls", protocol.text("controls", controls=controls, values=values))

    def error(self, message: str) -> None:
        """Show an error on all pages."""
        self._board.post("error", protocol.text("error", message=" ".join(message.split())))


def _scene_message(scene: Scene, track: int, tracks: int, run: str) -> str:
    return protocol.text("scene", track=track, tracks=tracks, run=run, scene=scene.as_json())
