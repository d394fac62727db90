"""Progress: the heartbeat of a running sweep, and how fast it is."""

from __future__ import annotations

from pathlib import Path


class Heartbeat:
    """Writes how far a sweep is, at most once a second; errors of writing are ignored.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def update(self, done: int, total: int, *, failed: int = 0, running: int = 0, made: int = 0) -> None:
        """Take note of how far the sweep is.

        Parameters
        ----------
        done, failed : int
            Runs of the study that are done and that have failed, those of earlier sweeps included.
        total : int
            Runs that this sweep wants done in the end, those of earlier sweeps included.
        running : int
            Runs that workers have now.
        made : int
            Runs that this sweep has made, done or failed.
        """

    @property
    def seconds_left(self) -> float | None:
        """Time until all runs are made at the present rate [s]; None until the rate is known."""
        return None
