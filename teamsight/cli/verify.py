"""``teamsight verify``: find damaged parts of a study, set them aside, and repeat their runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from teamsight.cli import values
from teamsight.cli.errors import when_stopped
from teamsight.cli.options import Works
from teamsight.core.component import Flag

if TYPE_CHECKING:
    from teamsight.analysis.studies.folder.verify import Verification

_FEW = 20
_DAMAGE_FOUND = 1


@dataclass(frozen=True, kw_only=True)
class VerifySettings(Works):
    """Options of ``teamsight verify``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    dry_run : bool
        Change nothing: only say what is damaged.
    no_rerun : bool
        Set damaged parts aside, but do not repeat their runs.
    mixed_code : bool
        Repeat runs although the others were made by other code.
    """

    folder: values.StudyFolder
    dry_run: Flag = False
    no_rerun: Flag = False
    mixed_code: Flag = False

    def check(self) -> None:
        """Refuse options of repeating runs where none are repeated."""
        if self.dry_run or self.no_rerun:
            option = "--dry-run" if self.dry_run else "--no-rerun"
            self.refuse(("workers", "mixed_code"), f"{option} repeats no runs")


def verify(settings: VerifySettings) -> int:
    """Find damaged parts of a study, set them aside, and repeat their runs.

    Reads every part in DIR, the folder of a study, and compares it with the digest in its name and with the study. What
    is damaged or belongs to another study is moved to DIR/damaged together with the other parts of its shard; nothing
    is deleted. Their runs are made again, and no others. The exit status is 0 if all parts are whole, otherwise 1.

    \b
    Examples:
      teamsight verify results --dry-run
      teamsight verify results
      teamsight verify results --no-rerun
    """
    from teamsight.analysis.studies.folder.verify import verify as examine
    from teamsight.cli.show import plural, say

    found = examine(settings.folder, repair=not settings.dry_run)
    for each in found.damaged:
        say(f"damaged: {each.kind}/{each.name} {each.reason}")
    for name in found.foreign[:_FEW]:
        say(f"{name}: is no part of this study; move it away, because other programs read all of the folder")
    if not found.damaged:
        say(f"{plural(found.parts, 'part')} in {settings.folder}: all whole")
        return 0
    say(f"{plural(found.parts, 'part')} in {settings.folder}: {len(found.damaged)} damaged")
    for line in _affected(found):
        say(line)
    if settings.dry_run:
        say(f"nothing was changed; to set them aside and repeat their runs: teamsight verify {settings.folder}")
    else:
        say(f"{plural(len(found.aside), 'part')} set aside in {settings.folder / 'damaged'}")
        _repeat(settings, found)
    return _DAMAGE_FOUND


def _affected(found: Verification) -> list[str]:
    """Return lines about the runs in damaged parts."""
    lines = []
    if found.runs:
        more = f" and {len(found.runs) - _FEW} more" if len(found.runs) > _FEW else ""
        lines.append(f"runs in them: {', '.join(found.runs[:_FEW])}{more}")
    if found.unnamed:
        lines.append(f"shards whose runs are not all known: {found.unnamed}")
    return lines


def _repeat(settings: VerifySettings, found: Verification) -> None:
    """Make the runs of the damaged parts again, as far as it is known which they are."""
    from teamsight.analysis.runs.processes import cores
    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.analysis.studies.folder.verify import runs_to_repeat
    from teamsight.analysis.studies.sweep import sweep
    from teamsight.cli.show import Watch, plural, say

    rest = f"teamsight sweep STUDY --out {settings.folder}"
    lost = runs_to_repeat(settings.folder, found)
    if settings.no_rerun or (lost is not None and not lost.size):
        say(f"to make the missing runs: {rest}")
        return
    with when_stopped(lambda: f"to make the missing runs: {rest}"), Watch() as watch:
        made = sweep(
            StudyFolder(settings.folder).study, settings.folder, workers=settings.workers or cores(), only=lost,
            mixed_code=settings.mixed_code, progress=lambda done, total, left: watch("runs", done, total),
            emit=watch.emit,
        )  # fmt: skip
    say(f"{plural(made.made, 'run')} made again")
    if found.unnamed and lost is not None:
        say(f"others may be missing; to make all that are: {rest}")
