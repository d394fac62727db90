"""``teamsight rerun``: repeat one run of a study in this process."""

from __future__ import annotations

from pathlib import Path

from teamsight.cli import values
from teamsight.cli.options import Settings


class RerunSettings(Settings):
    """Settings of ``teamsight rerun``."""

    folder: Path = values.input_folder("DIR")
    run: str = values.word("RUN_ID")
    pdb: bool = values.flag("Open the debugger where the run fails.")


def rerun(settings: RerunSettings) -> None:
    """Repeat one run of a study in this process, and compare it with what is stored.

    \b
    Examples:
      teamsight rerun results 0123456789abcdef-7
      teamsight rerun results 0123456789abcdef-7 --pdb
    """
    raise NotImplementedError
