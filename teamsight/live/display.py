"""What the pages are to show of the worlds: written to the board."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from typing import Any

from teamsight.live import protocol
from teamsight.live.board import Board, Frames, Scenes
from teamsight.live.controls import Control
from teamsight.live.track import LiveTrack
from teamsight.view.scene import Scene


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

    def _post_scenes(self, scenes: list[Scene]) -> None:
        self._version += 1
        self._scenes = scenes
        run = f"{self._server}-{self._run}"
        texts = tuple(
            protocol.text("scene", track=i, tracks=len(scenes), run=run, scene=scene.as_json())
            for i, scene in enumerate(scenes)
        )
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

    def controls(self, tracks: list[LiveTrack], seed: int) -> None:
        """Show the controls and their values.

        Parameters
        ----------
        tracks : list of LiveTrack
            The worlds.
        seed : int
            Their seed.
        """
        values = [
            {one.name: seed if one.name == "seed" else one.shown(track.value(one.name)) for one in self._controls}
            for track in tracks
        ]
        controls = [one.as_json() for one in self._controls]
        self._board.post("controls", protocol.text("controls", controls=controls, values=values))

    def error(self, message: str) -> None:
        """Show an error on all pages."""
        self._board.post("error", protocol.text("error", message=" ".join(message.split())))
