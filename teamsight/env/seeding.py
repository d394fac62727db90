"""The seeds of the episodes of an environment."""

from __future__ import annotations

import hashlib

from teamsight.core import checks


class EpisodeSeeds:
    """The seeds of the episodes of one world: that which was given, then one after the other, derived from it.

    A seed is a function of the given one and the number of the episode, so it does not depend on other worlds.
    """

    def __init__(self) -> None:
        self._first: int | None = None
        self._episode = 0

    def next(self, seed: int | None = None) -> int:
        """Return the seed of the next episode.

        Parameters
        ----------
        seed : int, optional
            The seed with which to begin anew. Without one, the episodes continue; at first, one is drawn.
        """
        if seed is not None or self._first is None:
            self._first = checks.seed(None, seed)
            self._episode = 0
        else:
            self._episode += 1
        return episode_seed(self._first, self._episode)


def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of an episode; that of episode 0 is `seed` itself."""
    if episode == 0:
        return seed
    digest = hashlib.blake2b(f"episode {seed} {episode}".encode(), digest_size=8).digest()
    return int.from_bytes(digest, "big") % checks.MOST_SEED
