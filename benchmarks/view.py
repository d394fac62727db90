"""Recordings, the live page and the environments: what it costs to watch a team and to learn on it."""

from __future__ import annotations

from measure import Row


def measure_view(rounds: int, quick: bool) -> list[Row]:
    """Measure all of it; what needs a package or a browser that is missing is left out, and says so.

    Parameters
    ----------
    rounds : int
        How often each program is measured.
    quick : bool
        Whether to measure shorter runs.
    """
    # They need extras, which the other parts do not.
    from environments import measure_environments
    from live import measure_live
    from recordings import measure_recordings
    from replay_page import measure_replay_page

    pages = [*measure_replay_page(quick), *measure_live(quick)]
    return [*measure_recordings(rounds), *pages, *measure_environments(rounds)]
