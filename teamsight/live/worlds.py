"""The worlds of a page: one, or two with the same seed that make the same number of steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.core.references import failure
from teamsight.live.controls import model_name
from teamsight.live.track import LiveTrack


class StoppedError(Exception):
    """A world makes no further step: its model failed or stopped."""


class Worlds:
    """One world, or two side by side.

    Parameters
    ----------
    model : callable
        A class or function that builds a world.
    settings : list of dict
        The arguments of each world.
    seed : int
        The seed of all.

    Attributes
    ----------
    tracks : list of LiveTrack
        The worlds; none before `replace`, which replaces the list.
    seed : int
        The present seed.
    made : int
        The number of steps that all have made, or are to make before the next.
    """

    def __init__(self, model: Callable[..., World], settings: list[dict[str, Any]], seed: int) -> None:
        self._model, self._first, self.seed = model, settings, seed
        self.made = 0
        self.tracks: list[LiveTrack] = []

    @property
    def settings(self) -> list[dict[str, Any]]:
        """The arguments of each world, as they are now."""
        return [track.parameters for track in self.tracks] or self._first

    def build(self, settings: list[dict[str, Any]], seed: int, every: int) -> list[LiveTrack]:
        """Return new worlds for which everything is compiled; those that run stay as they are, and may run meanwhile.

        Parameters
        ----------
        settings, seed
            As for the constructor.
        every : int
            Ticks from one frame to the next.
        """
        tracks: list[LiveTrack] = []
        for one in settings:
            known = [track.world for track in (*self.tracks, *tracks)]
            tracks.append(LiveTrack(self._model, one, seed, every, known))
        for track in tracks:
            track.compile()
        return tracks

    def replace(self, tracks: list[LiveTrack], seed: int) -> None:
        """Put new worlds in place of those that there are."""
        before, self.tracks, self.seed, self.made = self.tracks, tracks, seed, 0
        self._entitle()
        for track in before:
            track.close()

    def run(self, steps: int) -> None:
        """Let all worlds make steps; one that had stayed behind after an error makes more.

        Raises
        ------
        StoppedError
            If one fails, or stops before.
        """
        target = self.made + steps
        for track in self.tracks:
            try:
                track.run(max(target - track.made, 0))
            except (Exception, SystemExit) as error:  # whatever the code of a user raises
                self._catch_up()
                raise StoppedError(f"The model failed at tick {track.world.tick}: {failure(error)}") from error
            if track.made < target:
                self._catch_up()
                raise StoppedError(f"The model stopped at tick {track.world.tick}")
        self.made = target

    def change(self, tracks: list[LiveTrack], name: str, value: Any) -> None:
        """Change a parameter of running worlds; if one refuses it, of none.

        Parameters
        ----------
        tracks : list of LiveTrack
            Which worlds.
        name, value
            The parameter, and its value.
        """
        before = [track.value(name) for track in tracks]
        for number, track in enumerate(tracks):
            try:
                track.set(name, value)
            except Exception:
                for earlier, old in zip(tracks[:number], before, strict=False):
                    earlier.set(name, old)
                raise
        self._entitle()

    def with_value(self, tracks: list[LiveTrack], name: str, value: Any) -> list[dict[str, Any]]:
        """Return the arguments of all worlds, with another value of a parameter in some of them."""
        return [one.with_value(name, value) if one in tracks else one.parameters for one in self.tracks]

    def _entitle(self) -> None:
        """Let the titles of two worlds say in what they differ."""
        names = dict.fromkeys(name for track in self.tracks for name in track.parameters)
        shown = [{name: checks.shown(track.value(name)).strip("'") for name in names} for track in self.tracks]
        differing = [name for name in names if len({one[name] for one in shown}) > 1]
        for track, values in zip(self.tracks, shown, strict=True):
            parts = [f"{name} {values[name]}" for name in differing]
            title = ", ".join([model_name(self._model), *parts, f"seed {track.world.seed_used}"])
            track.entitle(title if differing else None)

    def _catch_up(self) -> None:
        # Worlds that did not come as far as others follow before the next step.
        self.made = max(track.made for track in self.tracks)
