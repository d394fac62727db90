"""``teamsight plot``: pictures of a study, also while it is incomplete."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from teamsight.cli import paths, values
from teamsight.cli.options import Option, Settings
from teamsight.core import checks

_KINDS = values.registry("teamsight.analysis.studies.figures.choose", "KINDS")
_folder = partial(paths.path, wanted="a folder")


def _chosen(name: str, texts: tuple[str, ...]) -> dict[str, str]:
    """Return axes and their values, which were given as NAME=VALUE."""
    found: dict[str, str] = {}
    for text in texts:
        axis, sign, value = text.partition("=")
        if not sign or not axis or not value:
            raise ValueError(f"{name}={checks.shown(text)}: must be NAME=VALUE, as in policy=a-cmommt")
        if axis in found:
            raise ValueError(f"{name}={checks.shown(text)}: {axis} is given twice; leave one out")
        found[axis] = value
    return found


def _name(help: str, shown: str) -> Any:
    return Option(lambda name, text: str(text), None, help, "NAME", shown)


class PlotSettings(Settings):
    """Settings of ``teamsight plot``."""

    folder: Path = Option(_folder, None, "", "FOLDER", kind="argument", required=True)  # type: ignore[assignment]
    out: Path | None = values.file(
        "The picture, a PNG, SVG or PDF by its suffix.", shown="name of the folder, with .png, in the current folder"
    )
    kind: str = values.choice("auto", "Kind of picture: {names}.", _KINDS)
    measure: str | None = _name("What is drawn.", "the first measure")
    x: str | None = _name("Axis along the horizontal direction.", "the first that suits")
    y: str | None = _name("Axis along the vertical direction, or of which each value is a line.", "the next")
    where: dict[str, str] = Option(
        _chosen, (), "Draw only settings with this value of an axis; may be repeated.", "NAME=VALUE", many=True
    )  # type: ignore[assignment]
    minus: Path | None = Option(
        _folder, None, "Subtract this study, run by run, where both have the same noise.", "FOLDER", "nothing"
    )  # type: ignore[assignment]
    across: tuple[str, ...] = Option(
        lambda name, texts: tuple(texts), (), "With --minus: subtract runs although this parameter differs, or the "
        "'model'; may be repeated.", "NAME", many=True,
    )  # type: ignore[assignment]  # fmt: skip
    force: bool = values.flag("Replace a file that teamsight did not write.")


def plot(settings: PlotSettings) -> None:
    """Draw a study: a heat map with intervals, lines, a surface.

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
    from teamsight.analysis.studies.figures.save import check_picture
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
