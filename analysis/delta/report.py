"""The report on δ: an estimate as text, tables, a picture and files."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.analysis.delta import report_text
from teamsight.analysis.delta.estimate import DeltaEstimate
from teamsight.analysis.runs import files

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

_TABLES = ("exceedance", "maxima", "ring", "merging", "cost", "over_time", "groups", "group_maxima")
# Attributes that are stored with each table.
_STORED = (
    "source", "subject", "robots", "awareness_range", "risk", "confidence", "independent", "length", "trial",
    "cautions",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class DeltaReport(DeltaEstimate):
    """An estimate of δ that can be printed and saved; see `DeltaEstimate` for its attributes."""

    def sentences(self) -> list[str]:
        """Return the conclusions, the most important first."""
        return report_text.sentences(self)

    def to_markdown(self) -> str:
        """Return the report as Markdown."""
        return report_text.markdown(self)

    def to_png(self) -> bytes:
        """Return a plot of the exceedance curve with its bounds and the prediction as PNG."""
        from teamsight.analysis.delta.figure import draw

        return draw(self)

    def save(
        self, folder: str | os.PathLike[str], *, force: bool = False, settings: Mapping[str, Any] | None = None
    ) -> list[Path]:
        """Write the tables as Parquet, the report as Markdown and the curve as PNG; return the paths.

        Parameters
        ----------
        folder : path
            Folder of the files; created if it does not exist.
        force : bool
            Replace any files; otherwise only a report of the same settings is replaced.
        settings : mapping, optional
            Settings of the command, as JSON values; stored with the tables.

        Raises
        ------
        ValueError
            If the folder cannot be made or written, or a file in it must stay.
        """
        place = files.prepare_folder(folder)
        about = {name: getattr(self, name) for name in _STORED}
        tables = {name: getattr(self, name) for name in _TABLES}
        about |= {"settings": dict(settings or {})}
        check_report(place, about if settings is None else {"settings": settings}, force=force)
        written = []
        for name, table in tables.items():
            if table is not None:
                written.append(place / f"delta_{name}.parquet")
                files.write_table(written[-1], table, about, force=force)
        written += [place / "delta_exceedance.png", place / "delta.md"]
        files.write_bytes(written[-2], self.to_png(), force=force)
        files.write_page(written[-1], self.to_markdown(), force=force)
        return written

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield from report_text.rich_parts(self)

    def __str__(self) -> str:
        from rich.console import Console

        text = io.StringIO()
        Console(file=text, width=110, color_system=None).print(self)
        return text.getvalue().rstrip()


def check_report(
    folder: str | os.PathLike[str], about: Mapping[str, Any] | None = None, *, force: bool = False
) -> None:
    """Raise an error if a file that must not be replaced stands where a report is to be saved.

    Parameters
    ----------
    folder : path
        Folder of the report.
    about : mapping, optional
        Settings that its tables will store, as JSON values; without them any report may be replaced.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If a file is not a report, or a report of other settings.
    """
    *tables, picture, page = files_in(folder)
    for table in tables:
        files.check_replaceable(table, about, force=force)
    files.check_replaceable(picture, force=force)
    files.check_replaceable(page, force=force)


def files_in(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the files that a report may write in a folder: the tables, the picture and the page."""
    names = [*(f"delta_{name}.parquet" for name in _TABLES), "delta_exceedance.png", "delta.md"]
    return [Path(folder) / name for name in names]
