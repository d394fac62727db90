"""Film the moving picture of the README: `.venv/bin/python .ci/film.py`; `.ci/pictures.py two-teams.webp` marks it.

It is the page that `teamsight demo` shows, of seed 1, the seed of that command: Chromium takes a picture of every third
step, in pixels of a screen that has two for each one of a page. What nobody can press is left out, and letters are
larger than on a page that one reads.
"""

from __future__ import annotations

import io
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ROOT = Path(__file__).resolve().parents[1]
FILM = ROOT / "docs" / "images" / "two-teams.webp"
STEPS = range(0, 241, 3)
SIZE = {"width": 640, "height": 100}
# How long a picture is shown, and the last [ms].
_MS, _LAST_MS = 80, 1500
_COLOURS = 32
_STYLE = """
body { overflow: hidden; }
.ts { height: auto; padding: 12px; }
.ts-body { display: block; }
.ts .ts-canvas { max-height: none; }
:is(.ts-head, .ts-side, .ts-scale, .ts-smooth, .ts-chart + .ts-chart, .ts-legend li:nth-child(n + 4)) { display: none; }
.ts-top { flex-direction: column; }
.ts .ts-caption { padding: 0 !important; font-size: 18px !important; }
.ts .ts-observed { font-size: 24px; }
.ts .ts-legend { display: flex; justify-content: center; gap: 22px; font-size: 15px; }
.ts-legend svg { width: 22px; height: 22px; }
.ts-chart figcaption { font-size: 14px; }
"""
_ARRANGE = "document.querySelector('.ts-transport').replaceWith(document.querySelector('.ts-legend'))"
_SHOW = """async (step) => {
  teamsight.view.show(step);
  await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
}"""


def pictures(browser: Browser, steps: Iterable[int] = STEPS) -> Iterator[Image.Image]:
    """Yield the pictures of the film.

    Parameters
    ----------
    browser : playwright.sync_api.Browser
        The browser that takes them.
    steps : iterable of int
        The ticks that they show.
    """
    from teamsight.cli import demo

    # Under reduced motion a page does not play by itself; it allows no other style than its own.
    context = browser.new_context(viewport=SIZE, device_scale_factor=2, reduced_motion="reduce", bypass_csp=True)
    page = context.new_page()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "demo.html"
        demo._make_recording(seed=1, steps=STEPS[-1], every=1).save(file)
        page.goto(file.as_uri())
    page.wait_for_selector("[data-state=ready] .ts-legend")
    page.add_style_tag(content=_STYLE)
    page.evaluate(_ARRANGE)
    # The sizes of the style reach the page after a picture.
    page.evaluate(_SHOW, 0)
    for step in steps:
        page.evaluate(_SHOW, step)
        yield Image.open(io.BytesIO(page.locator("#teamsight").screenshot())).convert("RGB")
    context.close()


def film(frames: list[Image.Image]) -> bytes:
    """Return pictures as an animated WebP that repeats, in the colours that most of their pixels have.

    Parameters
    ----------
    frames : list of PIL.Image.Image
        The pictures.
    """
    codes = np.concatenate([np.asarray(frame).reshape(-1, 3) @ (65536, 256, 1) for frame in frames[::8]])
    colours, counts = np.unique(codes, return_counts=True)
    palette = Image.new("P", (1, 1))
    most = colours[np.argsort(-counts)][:_COLOURS]
    palette.putpalette([part for code in most for part in int(code).to_bytes(3, "big")])
    few = [frame.quantize(palette=palette, dither=Image.Dither.NONE).convert("RGB") for frame in frames]
    lasting, buffer = [*[_MS] * (len(few) - 1), _LAST_MS], io.BytesIO()
    # Without key frames inside, which nobody seeks.
    how = {"lossless": True, "quality": 60, "method": 6, "kmin": len(few), "kmax": len(few) + 1}
    few[0].save(buffer, "webp", save_all=True, append_images=few[1:], duration=lasting, loop=0, **how)
    return buffer.getvalue()


def main() -> None:
    """Write the film."""
    sys.path.append(str(ROOT / "tests"))
    import browsing

    with browsing.started() as (browser, loop), browsing.driving(loop):
        frames = list(pictures(browser))
    FILM.write_bytes(film(frames))


if __name__ == "__main__":
    main()
