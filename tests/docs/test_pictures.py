"""Every picture of the documentation is the one that its command makes today, and every table has today's settings."""

from __future__ import annotations

import io
import runpy
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from PIL import Image, ImageFilter

ROOT = Path(__file__).resolve().parents[2]
PICTURES = runpy.run_path(str(ROOT / ".ci" / "pictures.py"))
IMAGES, DRAWN, RUN = (PICTURES[name] for name in ("IMAGES", "DRAWN", "RUN"))
# Compressed pictures have fewer colours: so many pixels may differ by more than `_SHADE` of 255.
_PIXELS, _SHADE = 20, 32


def differing(one: bytes, other: bytes, blur: float = 0) -> float:
    """Return the number of pixels that differ; that of all if the sizes differ."""
    pictures = [Image.open(io.BytesIO(content)).convert("RGB") for content in (one, other)]
    if pictures[0].size != pictures[1].size:
        return float(np.prod(pictures[0].size))
    first, second = (np.asarray(picture.filter(ImageFilter.GaussianBlur(blur)), np.int64) for picture in pictures)
    return float((np.abs(first - second).max(axis=2) > _SHADE).sum())


def test_every_picture_has_a_command() -> None:
    assert {file.name for file in IMAGES.iterdir()} == {*DRAWN, *RUN}


@pytest.mark.parametrize("name", DRAWN)
def test_a_picture_is_what_its_command_draws(name: str) -> None:
    shipped, drawn = (IMAGES / name).read_bytes(), PICTURES["_small"](DRAWN[name]())
    if PICTURES["mark_of"](shipped) == f"matplotlib {matplotlib.__version__}":
        assert differing(shipped, drawn) <= _PIXELS, f"{name}: run .ci/pictures.py {name}"
    else:
        # Another version places letters and edges differently, by parts of a pixel.
        assert differing(shipped, drawn, blur=3) <= 3000, f"{name}: run .ci/pictures.py {name}"


@pytest.mark.parametrize("name", RUN)
def test_a_picture_is_marked_with_what_makes_it(name: str) -> None:
    found = PICTURES["mark_of"]((IMAGES / name).read_bytes())
    assert found == PICTURES["made_by"](name), f"{name}: run what makes it, then .ci/pictures.py {name}"


def test_a_difference_is_found() -> None:
    content = (IMAGES / "figure-3.png").read_bytes()
    moved = Image.open(io.BytesIO(content)).convert("RGB")
    # As if a robot stood elsewhere.
    moved.paste((0, 114, 178), (300, 300, 312, 312))
    other = io.BytesIO()
    moved.save(other, "png")
    assert differing(content, content) == 0
    assert differing(content, other.getvalue()) > _PIXELS


@pytest.mark.parametrize("name", ["figure-3.png", "two-teams.webp"])
def test_marks_do_not_change_a_picture(name: str) -> None:
    content = (IMAGES / name).read_bytes()
    twice = PICTURES["marked"](PICTURES["marked"](content, "first"), "second")
    assert PICTURES["mark_of"](twice) == "second"
    assert twice.count(b"teamsight-made-by") == 1
    shown = [Image.open(io.BytesIO(one)) for one in (content, twice)]
    assert [getattr(one, "n_frames", 1) for one in shown] == [getattr(shown[0], "n_frames", 1)] * 2
    assert differing(content, twice) == 0
