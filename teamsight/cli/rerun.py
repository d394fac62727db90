"""``teamsight rerun``: repeat one run of a study in this process."""

from __future__ import annotations

import shlex
import sys
import traceback
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from teamsight.cli.options import Options
from teamsight.cli.values import StudyFolder
from teamsight.core.component import Allowed, Flag

if TYPE_CHECKING:
    from teamsight.analysis.studies.rerun import PlannedRun, Rerun


@dataclass(frozen=True, kw_only=True)
class RerunSettings(Options):
    """Options of ``teamsight rerun``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    run : str
        The id of the run.
    pdb : bool
        Open the debugger where the run fails.
    """

    folder: StudyFolder
    run: Annotated[str, Allowed(metavar="RUN_ID", is_argument=True)]
    pdb: Flag = False


def rerun(settings: RerunSettings) -> int:
    """Repeat one run of a study in this process, and compare it with what is stored.

    Prints what was measured. The exit status is 1 if the run fails or differs from what is stored. With --pdb, Python's
    debugger opens where the run fails. The table of a study, and teamsight status, show the ids of runs.

    \b
    Examples:
      teamsight rerun results 0123456789abcdef-7
      teamsight rerun results 0123456789abcdef-7 --pdb
    """
    from teamsight.analysis.studies.rerun import planned_run
    from teamsight.cli.show import say

    planned = planned_run(settings.folder, settings.run)
    values_of = ", ".join(f"{name}={value}" for name, value in planned.parameters.items())
    say(f"run {planned.run}: {values_of}, steps={planned.study.steps}, rng={planned.seed}")
    for name in planned.changed:
        say(f"note: {name} has changed since the sweep")
    try:
        found = planned.make()
    except Exception as error:
        return _show_failure(planned, error, settings)
    _show(found)
    return 1 if found.differing else 0


def _show_failure(planned: PlannedRun, error: Exception, settings: RerunSettings) -> int:
    from teamsight.analysis.studies.shard import failure_of
    from teamsight.cli.show import say

    traceback.print_exception(error)
    if settings.pdb:
        import pdb

        pdb.post_mortem(error.__traceback__)
        return 1
    text = failure_of(error).error
    stored = "is done in the folder" if planned.stored is not None else "is missing in the folder"
    if planned.error is not None:
        stored = "as it did in the sweep" if planned.error == text else f"in the sweep it failed with: {planned.error}"
    say(f"failed: {text}; {stored}")
    sys.stdout.flush()
    say(f"next: teamsight rerun {shlex.quote(str(settings.folder))} {planned.run} --pdb")
    return 1


def _show(found: Rerun) -> None:
    from teamsight.cli.show import say

    for name, value in found.measures.items():
        note = ""
        if name in found.differing:
            note = f"   stored: {(found.stored or {}).get(name)!r}"
        say(f"{name} = {value!r}{note}")
    for name in found.differing:
        if name not in found.measures:
            say(f"{name} is stored as {(found.stored or {})[name]!r} and was not measured now")
    if found.error is not None:
        say(f"it failed in the sweep: {found.error}")
    elif found.stored is None:
        say("nothing is stored of this run")
    elif found.differing:
        say("differs from what is stored")
    else:
        say("the same as what is stored, to the last bit")
