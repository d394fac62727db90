"""``teamsight demo``: two teams side by side, in the browser or as a recording."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.cli.options import File, Writes
from teamsight.core.component import Flag, Seed

if TYPE_CHECKING:
    from teamsight.view.replay import Replay

_WORLD: dict[str, Any] = {"robots": 10, "targets": 15, "radius": 4.0}
# Their worlds have the same seed, so both teams meet the same targets.
_TEAMS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("Blind to teammates", {"policy": "a-cmommt", "awareness": "none"}),
    ("Aware of teammates", {"policy": "a-cmommt", "awareness": "pairwise"}),
)
# A minute at the frames a second at which a recording plays.
_STEPS, _PER_SECOND = 1200, 20
# A GIF is large: it shows the beginning, every fourth step of it, and stays below 2.5 MB.
_GIF_STEPS, _GIF_EVERY = 300, 4
_GIF_SIZE: dict[str, Any] = {"width": 640, "scale": 2, "fps": 10}
_FILE = Path("teamsight-demo.html")


@dataclass(frozen=True, kw_only=True)
class DemoSettings(Writes):
    """Options of ``teamsight demo``.

    Parameters
    ----------
    seed : int
        Seed of both worlds.
    no_browser : bool
        Open no browser; write the recording instead.
    record : Path, optional
        Write the recording to this file, which ends in .html, .gif, .mp4 or .png.
    """

    seed: Seed = 1
    no_browser: Flag = False
    record: File | None = None


def demo(settings: DemoSettings) -> None:
    """Show two teams side by side for a minute: one that is blind to teammates, and one that is aware of them.

    Without the extra 'live' the browser shows a recording; without a browser the recording is written. Both worlds have
    the same seed, and so the same targets.

    \b
    Examples:
      teamsight demo
      teamsight demo --no-browser
      teamsight demo --record two-teams.gif
    """
    from teamsight.core import browsers

    is_shown = not settings.no_browser and settings.record is None and browsers.has_browser()
    if is_shown and find_spec("websockets") is not None:
        _watch(settings.seed)
        return
    place = settings.record or _FILE
    _prepare(place, settings.force)
    is_gif = place.suffix.lower() == ".gif"
    steps, every, size = (_GIF_STEPS, _GIF_EVERY, _GIF_SIZE) if is_gif else (_STEPS, 1, {})
    _make_recording(settings.seed, steps, every).save(place, force=settings.force, **size)
    _say_where(place, is_shown and browsers.show(place.absolute().as_uri()))


def _watch(seed: int) -> None:
    """Serve the live page until Ctrl-C."""
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.live import watch

    (_, first), (_, second) = _TEAMS
    watch(CMOMMT, {**_WORLD, **first, "seed": seed}, beside=second, rate=_PER_SECOND, port=0, wait=True)


def _prepare(place: Path, force: bool) -> None:
    """Refuse a file that cannot be written or must not be replaced, before the work."""
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.view.page import check_replaceable
    from teamsight.view.replay import check_ending

    check_ending(place)
    prepare_folder(place.parent)
    check_replaceable(place, force=force)


def _make_recording(seed: int, steps: int, every: int) -> Replay:
    """Run both worlds and return their recording, side by side."""
    from teamsight.agents.cmommt import CMOMMT

    first, second = (
        CMOMMT(**_WORLD, **team, rng=seed).record(steps=steps, every=every, title=name) for name, team in _TEAMS
    )
    return first.beside(second)


def _say_where(place: Path, is_open: bool) -> None:
    from teamsight.cli.show import say
    from teamsight.core.extras import installing

    say(f"the recording is in {place}")
    if place.suffix.lower() == ".html":
        say("it is open in the browser" if is_open else f"open it in a browser: {place.absolute().as_uri()}")
    if find_spec("websockets") is None:
        say(f"for a live page, in which you can change the teams: {installing('live')}")
