"""Colours of the page stand out, light and dark, as WCAG 2.1 asks: texts 4.5 : 1, and lines, icons and shapes 3 : 1."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import pytest

import teamsight

ASSETS = Path(teamsight.__file__).parent / "view" / "assets"
#: What is drawn in pictures, where colour is needed to see it; `grid` and `obstacle` are only a ground.
DRAWN = ["wall", "marker", "difference", "blocked", "track 0", "track 1", "text", "soft"]


def palette(name: str) -> dict[str, str]:
    """Return the colours that the script gives a palette."""
    found = re.search(rf"^const {name} = \{{(.*?)^\}};", (ASSETS / "view.js").read_text("utf-8"), re.DOTALL | re.MULTILINE)
    assert found, name
    colours = dict(re.findall(r'(\w+): "(#\w{6})"', found[1]))
    tracks = re.search(r'tracks: \["(#\w{6})", "(#\w{6})"\]', found[1])
    assert tracks, name
    return colours | {f"track {t}": colour for t, colour in enumerate(tracks.groups())}


def styles(scheme: str) -> dict[str, str]:
    """Return the variables of the style sheet that hold in a scheme."""
    text = (ASSETS / "view.css").read_text("utf-8")
    first = re.search(r"^:root \{(.*?)\}", text, re.DOTALL | re.MULTILINE)
    own = re.search(rf'^:root\[data-scheme="{scheme}"\] \{{(.*?)\}}', text, re.DOTALL | re.MULTILINE)
    assert first
    assert own
    return dict(re.findall(r"--([\w-]+): (#\w{6})", first[1] + own[1]))


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of two colours, as WCAG defines it."""

    def luminance(colour: str) -> float:
        values = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
        red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    low, high = sorted(map(luminance, (one, other)))
    return (high + 0.05) / (low + 0.05)


def test_the_ratio_is_that_of_the_definition() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
    # The lightest grey that WCAG allows for a text on white.
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.005)


@pytest.mark.parametrize("name", ["LIGHT", "DARK"])
def test_what_is_drawn_stands_out(name: str) -> None:
    colours = palette(name)
    low = [(one, ground) for one, ground in product(DRAWN, ("page", "arena")) if contrast(colours[one], colours[ground]) < 3]
    assert low == []
    assert min(contrast(colours[one], colours[ground]) for one, ground in product(("text", "soft"), ("page", "arena"))) >= 4.5


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_styles_stand_out(scheme: str) -> None:
    colours = styles(scheme)
    texts = ["text", "soft", "accent", "track-0", "track-1", "difference"]
    low = [(one, ground) for one, ground in product(texts, ("page", "surface")) if contrast(colours[one], colours[ground]) < 4.5]
    low += [("edge", ground) for ground in ("page", "surface") if contrast(colours["edge"], colours[ground]) < 3]
    assert low == []
    assert contrast(colours["on-accent"], colours["accent"]) >= 4.5
