"""``teamsight calibrate``: search the constants that the paper leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from teamsight.cli.options import Divides, Folder, Writes


@dataclass(frozen=True, kw_only=True)
class CalibrateSettings(Divides, Writes):
    """Options of ``teamsight calibrate``.

    Parameters
    ----------
    out : Path
        Folder for the table and the page.
    """

    out: Folder = Path("results")


def calibrate(settings: CalibrateSettings) -> None:
    """Search the constants that the paper leaves open.

    These are speeds, idle behaviour, weights and gain of A-CMOMMT; the preset touzet2000 has the best of them. Writes a
    table of all trials and a page about them. Changes no default. After an interruption the same command continues from
    there.

    \b
    Example:
      teamsight calibrate --out calibration --workers 2
    """
    from teamsight.analysis.papers.calibration import SEARCH
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import kept_in, say, working

    folder, plan = prepare_folder(settings.out), SEARCH.plan()
    with working(settings, lambda: kept_in(folder, SEARCH.checkpoint(folder).count())) as (watch, pool):
        SEARCH.reproduce(plan, folder, pool, watch, force=settings.force)
    say(", ".join(str(folder / name) for name in SEARCH.names(plan, folder, ())))
