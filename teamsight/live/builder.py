"""Builds worlds in a thread of its own while others run: kernels may have to be compiled for them, which takes long."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Any, NamedTuple

from teamsight.core.kernel.report import listening
from teamsight.live.protocol import Message
from teamsight.live.track import LiveTrack
from teamsight.live.worlds import Worlds


class Job(NamedTuple):
    """Worlds to build.

    Attributes
    ----------
    what : str
        What they are built for, as the page says it.
    settings : list of dict
        The arguments of each world.
    seed, every : int
        As for `Worlds.build`.
    then : callable
        Called by the session with the worlds, ready to run.
    replaces : bool
        Whether they take the place of those that run.
    message : Message, optional
        What a page has asked for.
    """

    what: str
    settings: list[dict[str, Any]]
    seed: int
    every: int
    then: Callable[[list[LiveTrack]], None]
    replaces: bool = True
    message: Message | None = None


class Builder:
    """Builds the worlds of one job at a time.

    Parameters
    ----------
    worlds : Worlds
        What builds.
    wake : callable
        Called by the thread when there is something to say, or the worlds are there.

    Attributes
    ----------
    job : Job or None
        The present job.
    is_busy : bool
        Whether there is one, or what it has built, and what has waited for it, is being carried out.
    waiting : dict of Message
        Messages that wait until it is done; see `keep`.
    said : str
        Which kernel is being compiled; empty if none is.
    """

    def __init__(self, worlds: Worlds, wake: Callable[[], None]) -> None:
        self._worlds, self._wake = worlds, wake
        self.job: Job | None = None
        self.is_busy = False
        self.waiting: dict[Hashable, Message] = {}
        self.said = ""
        self._outcome: list[LiveTrack] | BaseException | None = None

    def start(self, job: Job) -> None:
        """Begin a job; there must be none."""
        self.job, self.is_busy = job, True
        threading.Thread(target=self._build, args=(job,), name="teamsight builder", daemon=True).start()

    def take(self) -> tuple[Job, list[LiveTrack] | BaseException, list[Message]] | None:
        """Return the job, its worlds or why there are none, and the messages that have waited; None if it goes on."""
        job, outcome, waiting = self.job, self._outcome, list(self.waiting.values())
        if job is None or outcome is None:
            return None
        self.job, self._outcome, self.waiting = None, None, {}
        return job, outcome, waiting

    @property
    def wanted(self) -> list[Message]:
        """The settings that pages have asked for, and that do not hold yet."""
        messages = [self.job.message, *self.waiting.values()] if self.job else []
        return [one for one in messages if one is not None and one.type == "set"]

    def _build(self, job: Job) -> None:
        def say(number: str) -> None:
            self.said = f"Compiling {job.what}, once on this machine ({number})"
            self._wake()

        outcome: list[LiveTrack] | BaseException
        try:
            with listening(say):
                outcome = self._worlds.build(job.settings, job.seed, job.every)
        except (Exception, SystemExit) as error:  # of a model, for whatever reason
            outcome = error
        self.said, self._outcome = "", outcome
        self._wake()
