"""How many steps come before the next frame, and when."""

from __future__ import annotations

#: Pages draw at most this many frames a second, so more are not made.
FRAMES_A_SECOND = 60.0
# Seconds that a part of a stretch may take, after which messages of pages are read.
_PART = 0.015
# A simulation that is late by more than this does not catch up [s].
_LATEST = 0.25
_MOST_STEPS = 10**6


class Pacer:
    """Says how many steps to make at once, and how long to wait before.

    Parameters
    ----------
    rate : float or None
        Steps a second; None for as many as possible.
    every : int
        Steps from one frame to the next, at least.

    Attributes
    ----------
    rate, every
        The parameters; assign new ones at any time.
    """

    def __init__(self, rate: float | None, every: int) -> None:
        self.rate, self.every = rate, every
        self._due = -1.0
        self.forget()

    def forget(self) -> None:
        """Forget what steps cost, since the worlds are others now."""
        # Seconds that a step takes, as measured; a slow one at first, so that the first part is short.
        self._cost = _PART

    def stretch(self) -> int:
        """Return the number of steps from this frame to the next, a multiple of `every`."""
        fastest = 1 / self._cost
        wanted = (fastest if self.rate is None else self.rate) / FRAMES_A_SECOND
        return self.every * max(int(min(wanted, _MOST_STEPS) / self.every + 1e-9), 1)

    def part(self) -> int:
        """Return how many steps to make before messages of pages are read again."""
        return max(int(min(_PART / self._cost, _MOST_STEPS)), 1)

    def took(self, steps: int, seconds: float) -> None:
        """Note how long steps took, frames included."""
        self._cost += 0.3 * (max(seconds / max(steps, 1), 1e-7) - self._cost)

    def wait(self, now: float) -> float:
        """Return how long to wait before the next stretch [s]; 0 if it is due.

        Parameters
        ----------
        now : float
            The time of a clock that never goes back [s].
        """
        return 0.0 if self.rate is None else max(self._due - now, 0.0)

    def begin(self, now: float, steps: int) -> None:
        """Note that a stretch begins; the next one is due when it should take `steps` to be over."""
        if self.rate is not None:
            # Late ones catch up a little, so that the mean rate is right.
            self._due = max(self._due, now - _LATEST) + steps / self.rate
