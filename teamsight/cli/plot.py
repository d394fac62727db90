"""``teamsight plot``: pictures of a study, also while it is incomplete."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from teamsight.cli.options import Writes
from teamsight.cli.values import File, Folder, registry
from teamsight.core import checks
from teamsight.core.component import Allowed


def _chosen(texts: tuple[str, ...]) -> dict[str, str]:
    """Return axes and their values, which were given as NAME=VALUE."""
    found: dict[str, str] = {}
    for text in texts:
        axis, sign, value = text.partition("=")
        if not sign or not axis or not value:
            raise ValueError(f"where={checks.shown(text)}: must be NAME=VALUE, as in policy=a-cmommt")
        if axis in found:
            raise ValueError(f"where={checks.shown(text)}: {axis} is given twice; leave one out")
        found[axis] = value
    return found


@dataclass(frozen=True, kw_only=True)
class PlotSettings(Writes):
    """Options of ``teamsight plot``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    out : Path, optional
        The picture, a PNG, SVG or PDF by its suffix.
    kind : str
        Kind of picture.
    measure : str, optional
        What is drawn.
    x : str, optional
        Axis along the horizontal direction.
    y : str, optional
        Axis along the vertical direction, or of which each value is a line.
    where : mapping of str to str
        Draw only settings with this value of an axis; may be repeated.
    minus : Path, optional
        Subtract this study, run by run, where both have the same noise.
    across : sequence of str
        With --minus: subtract runs although this parameter differs, or the 'model'; may be repeated.
    """

    folder: Annotated[Folder, Allowed(is_argument=True)]
    out: Annotated[File | None, Allowed(shown="name of the folder, with .png, in the current folder")] = None
    kind: Annotated[str, Allowed(choices=registry("teamsight.analysis.studies.figures.choose", "KINDS"))] = "auto"
    measure: Annotated[str | None, Allowed(metavar="NAME", shown="the first measure")] = None
    x: Annotated[str | None, Allowed(metavar="NAME", shown="the first that suits")] = None
    y: Annotated[str | None, Allowed(metavar="NAME", shown="the next")] = None
    where: Annotated[Mapping[str, str], Allowed(parse=_chosen)] = field(default_factory=dict)
    minus: Annotated[Folder | None, Allowed(shown="nothing")] = None
    across: Annotated[tuple[str, ...], Allowed(metavar="NAME", is_repeated=True)] = ()


def plot(settings: PlotSettings) -> None:
    """Draw a study: a heat map with intervals, lines, a distribution.

    Further axes become panels. A study that is not complete is drawn and marked as partial. The difference of two
    studies is that of their runs under the same noise, so that its intervals are narrow; it needs studies of the same
    seed, steps and model. A parameter that one of them varies and that has another value in the other is refused,
    unless --where chooses a value or --across names it, as for a baseline.

    \b
    Examples:
      teamsight plot study --out study.png
      teamsight plot study --kind lines --x robots --y policy --where radius=3
      teamsight plot aware --minus unaware --out gain.svg
      teamsight plot policies --minus random --across policy --out gains.svg
    """
    from teamsight.analysis.studies.figures.draw import check_picture
    from teamsight.analysis.studies.results import open_study
    from teamsight.cli.show import say

    out = settings.out or Path(f"{settings.folder.resolve().name or 'study'}.png")
    check_picture(out, force=settings.force)
    results = open_study(settings.folder)
    results.plot(
        out, kind=settings.kind, x=settings.x, y=settings.y, measure=settings.measure, minus=settings.minus,
        across=settings.across, where=dict(settings.where), force=settings.force,
    )  # fmt: skip
    say(f"{out}: {results.warning or f'all {results.planned:,} runs'}")
