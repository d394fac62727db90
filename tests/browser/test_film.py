"""The moving picture of the README is what the page shows today."""

from __future__ import annotations

import io
import runpy
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image, ImageFilter

if TYPE_CHECKING:
    from playwright.sync_api import Browser

FILM = runpy.run_path(str(Path(__file__).resolve().parents[2] / ".ci" / "film.py"))
# The rows of the arenas: letters of the rest are others where there are other fonts.
ROWS = slice(150, 750)


def seen(picture: Image.Image) -> npt.NDArray[np.int64]:
    """Return the pixels of the arenas, blurred: edges are elsewhere by parts of a pixel in another browser."""
    return np.asarray(picture.convert("RGB").filter(ImageFilter.GaussianBlur(3)), np.int64)[ROWS]


@pytest.mark.usefixtures("_compiled")
def test_the_film_shows_the_page_of_today(chromium: Browser) -> None:
    steps = FILM["STEPS"]
    with Image.open(FILM["FILM"]) as film:
        assert film.n_frames == len(steps)
        for number, today in zip((20, len(steps) - 1), FILM["pictures"](chromium, (steps[20], steps[-1])), strict=True):
            film.seek(number)
            assert film.size == today.size
            assert (np.abs(seen(film) - seen(today)).max(axis=2) > 32).sum() <= 3000


def test_a_film_keeps_its_pictures() -> None:
    frames = []
    for x in range(12):
        frames.append(Image.new("RGB", (40, 30), "white"))
        frames[-1].paste((200, 30, 0), (x, 0, x + 10, 10))
    with Image.open(io.BytesIO(FILM["film"](frames))) as film:
        assert (film.n_frames, film.size, film.info["loop"]) == (12, (40, 30), 0)
        film.seek(7)
        np.testing.assert_array_equal(film.convert("RGB"), frames[7])
