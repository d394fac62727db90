"""The messages of pages that wait to be carried out: few, and of those that set the same thing only the last."""

from __future__ import annotations

import threading
from collections.abc import Hashable

from teamsight.live.protocol import Message

#: Messages that wait, at most.
MOST_WAITING = 64


def keep(waiting: dict[Hashable, Message], message: Message) -> None:
    """Let a message wait after others. It replaces one of the same: a slider sends more values than can be used.

    Raises
    ------
    ValueError
        If too many wait.
    """
    kind, fields = message
    # Each step counts: three are three.
    key = object() if kind == "step" else (kind, fields["name"], fields["track"]) if kind == "set" else kind
    if key not in waiting and len(waiting) >= MOST_WAITING:
        raise ValueError(f"{kind}: {MOST_WAITING} messages wait already; try again when they are done")
    waiting.pop(key, None)
    waiting[key] = message


class Commands:
    """Messages, put by connections and taken by the thread of the worlds."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._waiting: dict[Hashable, Message] = {}
        self._is_woken = False
        self._taken = 0

    def __len__(self) -> int:
        """The number of messages that wait or are being carried out."""
        return len(self._waiting) + self._taken

    def put(self, message: Message) -> None:
        """Let a message wait, as `keep` does."""
        with self._news:
            keep(self._waiting, message)
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
