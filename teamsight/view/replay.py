"""A replay: a recorded run that can be watched."""

from __future__ import annotations

import html
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from teamsight.core.checks import shown
from teamsight.core.files import open_regular
from teamsight.view.page import Track, check_replaceable, page, tracks_in, write
from teamsight.view.scene import Frame, Scene

#: The files that a replay can be saved as, by the endings of their names.
ENDINGS = (".html", ".gif", ".mp4", ".png")
# Tracks that fit side by side, and the largest page that a notebook gets [characters].
_MOST_TRACKS, _MOST_SHOWN = 2, 50_000_000
_HEIGHT = 560


@dataclass(frozen=True, eq=False)
class RecordedTrack:
    """A scene and its frames, complete."""

    scene: Scene
    frames: Sequence[Frame]


class Replay:
    """A recorded run that can be watched: saved as a page, a picture or a film, and shown by a notebook.

    Parameters
    ----------
    tracks : sequence of Track
        One run, or two side by side.
    title : str, optional
        The title of its page; by default those of the scenes.

    Attributes
    ----------
    tracks : tuple of Track
        Its runs: each has a `scene` and `frames`.
    """

    def __init__(self, tracks: Sequence[Track], *, title: str | None = None) -> None:
        if not 1 <= len(tracks) <= _MOST_TRACKS:
            raise ValueError(f"tracks: {len(tracks)} runs, and a replay has one or two side by side; leave some out")
        for track in tracks:
            if not (hasattr(track, "scene") and hasattr(track, "frames")):
                raise TypeError(
                    f"tracks: {shown(track)} has no scene and no frames; record a World by world.record(): its agents "
                    "have positions in an arena, and those of a plain mesa model have none"
                )
        self.tracks: tuple[Track, ...] = tuple(tracks)
        self._title = title

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Replay:
        """Read a replay from a page that was saved.

        Parameters
        ----------
        path : path
            An HTML file of teamsight.

        Raises
        ------
        ValueError
            If there is no such file, or it is another page, or damaged.
        """
        name = os.fspath(path)
        try:
            with open_regular(path) as file:
                content = file.read()
        except OSError as error:
            raise ValueError(f"{name}: cannot be read ({error.strerror}); give a saved page") from error
        try:
            found = tracks_in(content.decode("utf-8"))
            return Replay([RecordedTrack(scene, frames) for scene, frames in found])
        except UnicodeDecodeError as error:
            raise ValueError(f"{name}: is no page (not UTF-8); give a page that replay.save wrote") from error
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error

    @property
    def scene(self) -> Scene:
        """The scene of its first run."""
        return self.tracks[0].scene

    @property
    def frames(self) -> Sequence[Frame]:
        """The frames of its first run, in order of time."""
        return self.tracks[0].frames

    @property
    def title(self) -> str:
        """The title of its page."""
        return " · ".join(track.scene.title for track in self.tracks) if self._title is None else self._title

    def __len__(self) -> int:
        return max(len(track.frames) for track in self.tracks)

    def __repr__(self) -> str:
        return f"<Replay of {self.title}: {len(self):,} frames>"

    def beside(self, other: Replay) -> Replay:
        """Return a replay of this run and another one, side by side.

        Parameters
        ----------
        other : Replay
            A replay of one run.

        Raises
        ------
        TypeError, ValueError
            If it is not a replay, or there would be more than two runs.
        """
        if not isinstance(other, Replay):
            raise TypeError(f"beside({shown(other)}): must be a replay, such as world.record(steps=600)")
        return Replay([*self.tracks, *other.tracks])

    def stop(self) -> Self:
        """Record no more; a replay that is complete stays as it is."""
        return self

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        force: bool = False,
        frame: int = -1,
        fps: float = 20.0,
        width: int | None = None,
        scale: int = 1,
    ) -> Path:
        """Write the replay to a file, and return its path.

        Parameters
        ----------
        path : path
            The file. Its ending says what it is: ``.html`` is a page that plays in any browser without network,
            ``.gif`` and ``.mp4`` are films, and ``.png`` is a picture of one frame. A GIF has at most 300 frames: of
            more it shows every second, third and so on. A file that is there is replaced
            only if teamsight has written it as a recording.
        force : bool
            Replace any regular file.
        frame : int
            The number of the frame in a picture; negative ones count from the end.
        fps : float
            Frames a second in a film.
        width : int, optional
            The width of films and pictures [pixels]; by default 480 for each run in a GIF, else 800.
        scale : int
            How many times finer films and pictures are, 1 to 4: 2 is sharp on a screen with two pixels for each one of
            a page, and makes them twice as wide.

        Raises
        ------
        ValueError
            If the ending is unknown, a value is outside its limits, or the file cannot be written or must not be
            replaced.
        ImportError
            For ``.mp4``, if imageio-ffmpeg is not installed.
        """
        ending = check_ending(path)
        check_replaceable(path, force=force)
        if ending == ".html":
            # Half a character in a title or a name is no reason to lose a run.
            content = self.page().encode(errors="replace")
        else:
            from teamsight.view.animation import rendered

            content = rendered(self.tracks, ending, frame=frame, fps=fps, width=width, scale=scale, title=self.title)
        write(path, content, force=force)
        return Path(path)

    def page(self) -> str:
        """Return the page that plays it: one self-contained HTML file, as a text."""
        return page(self.tracks, title=self.title)

    def _repr_html_(self) -> str:
        text = self.page()
        if len(text) > _MOST_SHOWN:
            return f"<p>{html.escape(repr(self))}: too large for a notebook; save it, as in replay.save('run.html')</p>"
        return (
            f'<iframe title="{html.escape(self.title)}" sandbox="allow-scripts allow-downloads" width="100%" '
            f'height="{_HEIGHT}" style="border:0" srcdoc="{html.escape(text)}"></iframe>'
        )


def check_ending(path: str | os.PathLike[str]) -> str:
    """Return the ending of the name of a file, in lower case.

    Raises
    ------
    ValueError
        If a replay cannot be saved as such a file.
    """
    ending = os.path.splitext(os.fsdecode(path))[1].lower()
    if ending not in ENDINGS:
        raise ValueError(
            f"{os.fsdecode(path)}: must end in {', '.join(ENDINGS)}, which says what is written; give such a name, as "
            "in run.html"
        )
    return ending
