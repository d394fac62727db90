"""The messages of pages that wait to be carried out: few, and of those that set the same thing only the last."""

from __future__ import annotations

import threading
from collections.abc import Hashable

from teamsight.live.protocol import Message

#: Messages that wait, at most.
MOST_WAITING = 64


class Commands:
    """Messages, put by connections and taken by the thread of the worlds."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._waiting: dict[Hashable, Message] = {}
        self._is_woken = False
        self._count = self._taken = 0

    def __len__(self) -> int:
        """The number of messages that wait or are being carried out."""
        return len(self._waiting) + self._taken

    def put(self, message: Message) -> None:
        """Let a message wait. It replaces one that sets the same thing: a slider sends more values than can be used.

        Raises
        ------
        ValueError
            If too many wait.
        """
        with self._news:
            key = self._key(message)
            if key not in self._waiting and len(self._waiting) >= MOST_WAITING:
                raise ValueError(f"{message.type}: {MOST_WAITING} messages wait already; try again when they are done")
            self._waiting.pop(key, None)
            self._waiting[key] = message
            self._news.notify()

    def take(self, patience: float | None) -> list[Message]:
        """Return the messages that wait, in order; wait for some.

        Parameters
        ----------
        patience : float or None
            The longest wait [s]; None for as long as it takes.
        """
        with self._news:
            if not self._waiting and not self._is_woken and patience != 0.0:
                self._news.wait(patience)
            messages, self._waiting = list(self._waiting.values()), {}
            self._is_woken = False
            self._taken += len(messages)
        return messages

    def done(self) -> None:
        """Note that one of the messages taken was carried out."""
        self._taken -= 1

    def wake(self) -> None:
        """Let `take` return now."""
        with self._news:
            self._is_woken = True
            self._news.notify()

    def _key(self, message: Message) -> Hashable:
        if message.type == "set":
            return message.type, message.fields["name"], message.fields["track"]
        if message.type in ("rate", "every", "compare"):
            return message.type
        # Each of the others counts: three steps are three.
        self._count += 1
        return self._count
