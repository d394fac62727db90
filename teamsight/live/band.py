"""The band: what worlds of other seeds observe, beside those of a page, and with the same settings."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import closing
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.references import failure
from teamsight.live.controls import model_name, seed_name
from teamsight.live.protocol import LEAST_RUNS, MOST_TICKS
from teamsight.live.worlds import Worlds

#: Runs × ticks × agents of all worlds together.
MOST_WORK = 10**9
#: The part of the runs at each tick that lies in the band [%], from the 5th to the 95th percentile.
INTERVAL = 90
_LOW, _HIGH = 50 - INTERVAL / 2, 50 + INTERVAL / 2
# Ticks that are shown: a chart has no more pixels.
_MOST_SHOWN = 1_000
# Agents × ticks between two looks at whether the band is still wanted: milliseconds in compiled code.
_PART = 100_000

Reals = npt.NDArray[np.float64]


class Band:
    """Runs worlds in a thread of its own, beside those of the page, and posts how far it is and what it found.

    Runs begin with the settings as they are now. Run k of n has the seed of the page plus k, the same for both worlds.

    Parameters
    ----------
    worlds : Worlds
        Those of the page.
    runs : int
        The number of runs of each.
    ticks : int
        The length of each run.
    post : callable
        Called with a kind of message and its fields, as `teamsight.live.protocol.text`; from the thread.

    Raises
    ------
    ValueError
        If the model has no seed, or the runs are too much work.
    """

    def __init__(self, worlds: Worlds, runs: int, ticks: int, post: Callable[..., object]) -> None:
        self._model, self._settings, self._seed = worlds.model, [dict(one) for one in worlds.settings], worlds.seed
        self._runs, self._post = runs, post
        if seed_name(self._model) is None:
            raise ValueError(f"{model_name(self._model)}: has no parameter seed, so all runs are alike; add one")
        if ticks < 1:
            raise ValueError("ticks=0: nothing has been run yet; run the model first, or give a number of ticks")
        checks.count("ticks", ticks, most=MOST_TICKS)
        # Agents that may come later cost more, and the thread can be stopped.
        self._agents = max(sum(map(len, track.world.groups)) for track in worlds.tracks)
        work = runs * ticks * sum(sum(map(len, track.world.groups)) for track in worlds.tracks)
        if work > MOST_WORK:
            raise ValueError(
                f"band: {runs} runs of {ticks:,} ticks are {work:,} agent-ticks, at most {MOST_WORK:,}; ask for fewer "
                "runs or ticks"
            )
        self._ticks = np.unique(np.linspace(0, ticks, min(ticks, _MOST_SHOWN) + 1).round().astype(np.int64))
        # A model that returned one of these would be run by two threads.
        self._known: list[World] = [track.world for track in worlds.tracks]
        # Held while something is posted, so that nothing is after `cancel`.
        self._lock, self._is_wanted = threading.Lock(), True
        self._thread = threading.Thread(target=self._work, name="teamsight band", daemon=True)

    def start(self) -> None:
        """Begin the runs."""
        self._report(0)
        self._thread.start()

    def cancel(self) -> None:
        """Let the thread end soon, and post nothing more. Idempotent."""
        with self._lock:
            self._is_wanted = False

    def _report(self, done: int, bands: list[dict[str, Any]] | None = None) -> None:
        with self._lock:
            if self._is_wanted:
                self._post(
                    "band", runs=self._runs, done=done, ticks=int(self._ticks[-1]), interval=INTERVAL,
                    first=str(self._seed + 1), last=str(self._seed + self._runs), bands=bands or [],
                )  # fmt: skip

    def _work(self) -> None:
        found = np.full((len(self._settings), self._runs, len(self._ticks)), np.nan)
        seed = self._seed
        try:
            for number in range(self._runs):
                seed = self._seed + number + 1
                for world, parameters in enumerate(self._settings):
                    observed = self._observed(parameters, seed)
                    if observed is None:
                        return
                    shown = self._ticks[self._ticks < len(observed)]
                    found[world, number, : len(shown)] = observed[shown]
                self._report(number + 1)
            self._report(self._runs, [_summary(self._ticks, one) for one in found])
        except BaseException as error:  # of a model, for whatever reason
            with self._lock:
                if self._is_wanted:
                    self._post("band", runs=0)
                    said = f"band: the run of seed {seed} failed: {failure(error)}"
                    self._post("error", message=" ".join(said.split()))

    def _observed(self, parameters: dict[str, Any], seed: int) -> Reals | None:
        """Return the observed fraction at the start and after each step of a run, or None if nobody wants it."""
        world = self._model(**parameters, **{str(seed_name(self._model)): seed})
        if any(world is other for other in self._known):
            raise ValueError("returns a world that it returned before; build one on each call")
        self._known[len(self._settings) :] = [world]
        with closing(world):
            start, left = float(world.observed), int(self._ticks[-1])
            while left and world.running:
                if not self._is_wanted:
                    return None
                steps = min(left, max(_PART // max(self._agents, 1), 1))
                world.run(steps, progress=False)
                left -= steps
            return np.concatenate([[start], world.recording.history["observed"].to_numpy(float)])


def _summary(ticks: npt.NDArray[np.int64], found: Reals) -> dict[str, list[Any]]:
    """Return the mean over runs and the limits of the band at each tick, and of how many runs they are.

    A run has no value after it has stopped, or while there is nothing to observe. Those that go on may be others than
    those that stop, so a page says how many there are; where fewer are left than can be asked for, there is no band.
    """
    count = np.isfinite(found).sum(axis=0)
    shown = count >= LEAST_RUNS
    values = np.full((3, len(ticks)), np.nan)
    if shown.any():
        some = found[:, shown]
        values[0, shown] = np.nanmean(some, axis=0)
        values[1:, shown] = np.nanpercentile(some, [_LOW, _HIGH], axis=0)
    mean, low, high = values.tolist()
    return {"ticks": ticks.tolist(), "mean": mean, "low": low, "high": high, "count": count.tolist()}
