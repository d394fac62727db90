"""The common style of all figures."""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

#: Colour maps of quantities from 0 upwards, and of differences around 0.
SEQUENTIAL, DIVERGING = "viridis", "RdBu"
#: After M. Okabe and K. Ito: distinguishable without colour vision.
COLOURS = ("#767676", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
#: The colour of each degree of awareness.
DEGREE = dict(zip(("none", "ring", "pairwise", "shared", "nearest", "relayed"), COLOURS, strict=False))
#: The colour of each policy of robots, in every figure: none is that of a degree of awareness.
POLICY = {
    "random-walk": "#999933",
    "stationary": "#bbbbbb",
    "a-cmommt": "#882255",
    "b-cmommt": "#AA4499",
    "p-cmommt": "#332288",
    "centroid": "#117733",
    "evolved": "#44AA99",
    "lazy-cooperative": "#661100",
    "lazy-collective": "#CC6677",
    "lattice-walk": "#DDCC77",
    "ppo": "#6699CC",
    "group-forces": "#994F00",
    "adaptive-forces": "#5D3A9B",
}
#: The colour of targets, which is that of no policy and no degree.
TARGETS = "#d1242f"
INK, FAINT = "#1a1a1a", "#5f5f5f"
_DPI = 110
# The usual compression takes half as long again, and makes files smaller by 6 %.
_SAVING: dict[str, dict[str, Any]] = {"png": {"pil_kwargs": {"compress_level": 3}}}
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Formats of pictures, with their metadata: the mark of this program, the description, and no time.
FORMATS: dict[str, dict[str, str | None]] = {
    "png": {"Software": "teamsight", "Description": "{}"},
    "svg": {"Creator": "teamsight", "Description": "{}", "Date": None},
    "pdf": {"Creator": "teamsight", "Subject": "{}", "CreationDate": None},
}

RADIUS_LABEL = "arena radius R  [sensing ranges]"
ROBOTS_LABEL = "robots N"


def colours_of(names: Sequence[str]) -> list[str]:
    """Return a colour for each name: that of the degree or the policy, if all are such; else the first `COLOURS`."""
    for known in (DEGREE, POLICY):
        if set(names) <= set(known):
            return [known[name] for name in names]
    return list(itertools.islice(itertools.cycle(COLOURS[1:] + COLOURS[:1]), len(names)))


def shades(count: int) -> list[str]:
    """Return colours of ordered levels, from light to dark, none of which is that of a degree or a policy."""
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    found = LinearSegmentedColormap.from_list("levels", ("#dadaeb", "#3f007d"))
    return [to_hex(found((number + 1) / count)) for number in range(count)]


def canvas(width: float, height: float) -> Canvas:
    """Return an empty figure of this size [inches] without a window."""
    from matplotlib.figure import Figure as Canvas

    return Canvas(figsize=(width, height), facecolor="white", dpi=_DPI)


def head(figure: Canvas, title: str, subtitle: str) -> None:
    """Write title and subtitle at the top left of a figure."""
    height = figure.get_figheight()
    figure.text(0.4 / figure.get_figwidth(), 1 - 0.42 / height, title, size=15, weight="bold", color=INK)
    figure.text(0.4 / figure.get_figwidth(), 1 - 0.72 / height, subtitle, size=10, color=FAINT)


def plain(axes: Axes) -> None:
    """Remove the top and right sides of the frame, and draw a faint grid behind the data."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e4e4e4", linewidth=0.8)
    axes.set_axisbelow(True)


def to_picture(figure: Canvas, description: str = "", kind: str = "png") -> bytes:
    """Return the figure in one of `FORMATS`; the same figure gives the same bytes.

    Parameters
    ----------
    figure : matplotlib Figure
        The figure.
    description : str
        Written into the metadata, beside the name of this program; by default the label of the figure, its title.
    kind : str
        A name in `FORMATS`.
    """
    import matplotlib

    buffer = io.BytesIO()
    description = description or str(figure.get_label())
    metadata = {name: value.format(description) if value else None for name, value in FORMATS[kind].items()}
    # The identifiers in SVG are random without a salt.
    with matplotlib.rc_context({"svg.hashsalt": "teamsight"}):
        figure.savefig(buffer, format=kind, dpi=figure.dpi, metadata=metadata, **_SAVING.get(kind, {}))
    return buffer.getvalue()


def superscript(digits: str) -> str:
    """Return digits, and minus signs, as superscripts."""
    return digits.translate(_SUPERSCRIPTS)


def minus(text: str) -> str:
    """Return a text whose negative numbers have a minus sign; hyphens in words stay."""
    return re.sub(r"(?<!\w)-(?=\d)", "−", text)


def signed(value: float) -> str:
    """Return a number with its sign, and up to 10 with one decimal; a number that rounds to 0 has no sign."""
    digits = 1 if abs(value) < 9.95 else 0
    rounded = round(float(value), digits)
    return f"{rounded:+.{digits}f}".replace("-", "−") if rounded else f"{0:.{digits}f}"
