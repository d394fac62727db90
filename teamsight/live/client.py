"""A connection: what it has shown of the board, and how many frames are on their way to its page."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

from teamsight.live.board import Board, News

#: Frames that a page has been sent and has not acknowledged.
MOST_UNDER_WAY = 2
#: Messages that are wrong, after which a connection is closed.
MOST_WRONG = 100


class Client:
    """One page.

    Attributes
    ----------
    wrong : int
        How many of its messages could not be read.
    """

    def __init__(self, board: Board) -> None:
        self._board = board
        self._news = asyncio.Event()
        self._seen: dict[str, int] = {}
        self._scenes = self._run = -1
        self._sent = -1
        self._under_way: list[int] = []
        self.wrong = 0
        self._news.set()
        # An error that somebody else has made, perhaps long ago.
        if "error" in (texts := board.read().texts):
            self._seen["error"] = texts["error"][0]

    def wake(self) -> None:
        """Look at the board again."""
        self._news.set()

    def acknowledge(self, number: int) -> None:
        """Note that the page has drawn a frame, and all before it."""
        self._under_way = [other for other in self._under_way if other > number]
        self._news.set()

    async def news(self) -> list[str | bytes]:
        """Wait for messages that the page has not had, and return them."""
        while True:
            await self._news.wait()
            self._news.clear()
            if messages := list(self._unseen(self._board.read())):
                return messages

    def _unseen(self, news: News) -> Iterator[str | bytes]:
        frames = news.frames
        if news.scenes is not None and news.scenes.version != self._scenes:
            self._scenes = news.scenes.version
            yield from news.scenes.texts
        for kind, (version, text) in news.texts.items():
            if self._seen.get(kind) != version:
                self._seen[kind] = version
                yield text
        is_new = frames is not None and frames.number > self._sent and frames.scenes == self._scenes
        if frames is not None and is_new and len(self._under_way) < MOST_UNDER_WAY:
            self._sent = frames.number
            self._under_way.append(frames.number)
            yield from frames.messages
