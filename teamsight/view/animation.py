"""Replays as films and pictures: GIF by Pillow, MP4 by imageio-ffmpeg, PNG by matplotlib."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.core import checks, interrupts
from teamsight.core.status_line import StatusLine, has_reader, seconds
from teamsight.core.version import __version__
from teamsight.view.page import SOFTWARE, Track

if TYPE_CHECKING:
    from PIL.Image import Image

    from teamsight.view.drawing import Drawing

Picture = npt.NDArray[np.uint8]
Progress: TypeAlias = Callable[[int, int], object] | None

_MARK = f"{SOFTWARE} {__version__}"
_WIDTHS = {".gif": 480, ".mp4": 800, ".png": 800}
_MOST_WIDTH, _LEAST_WIDTH = 4_000, 160
# More frames would take hours to draw.
MOST_FRAMES = 20_000
#: Of more frames a GIF shows every second, or third, and so on: it would take tens of megabytes.
MOST_IN_GIF = 300
#: Frames that a film shows in a second.
FPS = 20.0
_COLOURS = 32
_PATIENCE, _EVERY = 2.0, 0.25


def check_video() -> None:
    """Raise an error if films cannot be written as MP4.

    Raises
    ------
    ImportError
        If imageio-ffmpeg is not installed.
    """
    if importlib.util.find_spec("imageio_ffmpeg") is None:
        raise ImportError("an .mp4 needs imageio-ffmpeg: pip install 'teamsight[video]', or write a .gif or .html")


def width_of(ending: str, tracks: int, scale: int = 1) -> int:
    """Return how wide a film or a picture of so many tracks is, unless a width is given [pixels]."""
    return _WIDTHS[ending] * (tracks if ending == ".gif" else 1) * scale


def rendered(
    tracks: Sequence[Track],
    ending: str,
    *,
    frame: int = -1,
    fps: float = FPS,
    width: int | None = None,
    scale: int = 1,
    title: str = "",
    progress: Progress = None,
) -> bytes:
    """Return a replay as the content of a film or a picture.

    Parameters
    ----------
    tracks : sequence of Track
        One run, or two side by side.
    ending : {".gif", ".mp4", ".png"}
        What to make.
    frame : int
        The number of the frame in a picture; negative ones count from the end.
    fps : float
        Frames a second in a film, at most 50 in a GIF.
    width : int, optional
        The width [pixels], at a scale of 1.
    scale : int
        How many times finer, 1 to 4: 2 is sharp on a screen with two pixels for each one of a page.
    title : str
        The title of a film, in its metadata.
    progress : callable, optional
        Called before each frame of a film with the number of those that are drawn, and that of all; a terminal then
        shows nothing.

    Raises
    ------
    TypeError, ValueError
        If a number is of the wrong type or outside its limits.
    ImportError
        For ".mp4", if imageio-ffmpeg is not installed.
    """
    from teamsight.view.drawing import Drawing

    pixels = width_of(ending, len(tracks)) if width is None else width
    pixels = checks.count("width", pixels, least=_LEAST_WIDTH, most=_MOST_WIDTH, cure="it is a number of pixels")
    pixels -= pixels % 2
    scale = checks.count("scale", scale, least=1, most=4, cure="it multiplies the width")
    longest = max(len(track.frames) for track in tracks)
    if ending == ".png":
        chosen = checks.count("frame", frame, least=-longest, most=longest - 1, cure="the last one is −1") % longest
        content = io.BytesIO()
        Drawing(tracks, pixels, scale).save(content, chosen, _MARK)
        return content.getvalue()
    if longest > MOST_FRAMES:
        raise ValueError(f"frames: {longest:,} are too many for a film, at most {MOST_FRAMES:,}; record with every=10")
    if ending == ".gif":
        return _gif(Drawing(tracks, pixels, scale), checks.number("fps", fps, above=0, most=50), progress)
    check_video()
    return _mp4(Drawing(tracks, pixels, scale), checks.number("fps", fps, above=0, most=120), title, progress)


def _gif(drawing: Drawing, fps: float, progress: Progress) -> bytes:
    from PIL import Image

    count = drawing.frames
    # One palette for all, so that what does not move stays as it is. `optimize` then leaves it out, and the file is
    # smaller by two fifths.
    samples = [drawing.show(number) for number in sorted({0, count // 2, count - 1})]
    palette = Image.fromarray(np.concatenate(samples)).quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)

    def reduced() -> Iterator[Image.Image]:
        for picture in _pictures(drawing, -(-count // MOST_IN_GIF), progress):
            yield Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)

    pictures = reduced()
    content = io.BytesIO()
    # A GIF counts hundredths of a second.
    duration = 10 * max(round(100 / fps), 2)
    next(pictures).save(
        content, "GIF", save_all=True, append_images=pictures, duration=duration, loop=0, optimize=True,
        comment=_MARK.encode(),
    )  # fmt: skip
    return content.getvalue()


def _mp4(drawing: Drawing, fps: float, title: str, progress: Progress) -> bytes:
    import imageio_ffmpeg

    height, width = drawing.show(0).shape[:2]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "film.mp4"
        marks = ["-metadata", f"comment={_MARK}", "-metadata", f"title={title}", "-movflags", "+faststart"]
        writer = imageio_ffmpeg.write_frames(
            str(place), (width, height), fps=fps, macro_block_size=2, output_params=marks, ffmpeg_log_level="error"
        )
        # Also if `progress` ends it, since the program that writes would go on without a folder.
        with contextlib.closing(writer):
            writer.send(None)
            for picture in _pictures(drawing, 1, progress):
                # Of a part of a picture, after Ctrl-C, ffmpeg would print two lines.
                with interrupts.deferred():
                    writer.send(np.ascontiguousarray(picture))
        return place.read_bytes()


def _pictures(drawing: Drawing, every: int, progress: Progress) -> Iterator[Picture]:
    """Yield every k-th picture; `progress`, or after two seconds a terminal or a notebook, shows how far it is."""
    began = monotonic()
    due, line = began + _PATIENCE, None
    try:
        for number in range(0, drawing.frames, every):
            if progress is not None:
                progress(number, drawing.frames)
            elif monotonic() > due:
                line = line or (StatusLine() if has_reader() else None)
                due = monotonic() + (_EVERY if line else 1e9)
                if line:
                    taken = monotonic() - began
                    left = seconds(taken * (drawing.frames - number) / max(number, 1))
                    line.show(f"frame {number:,} of {drawing.frames:,} drawn, {left} left")
            yield drawing.show(number)
    finally:
        if line:
            line.close()
