"""``teamsight sweep``: make the runs of a study that are missing in its folder."""

from __future__ import annotations

from pathlib import Path

from teamsight.cli import values
from teamsight.cli.options import Settings

_ENGINES = ("local", "dask")
_ON_ERROR = ("continue", "stop")


class SweepSettings(Settings):
    """Settings of ``teamsight sweep``."""

    study: Path = values.input_file("STUDY")
    out: Path = values.folder(None, "Folder of the study; created if it does not exist.", required=True)
    workers: int | None = values.workers()
    engine: str = values.choice("local", "What makes the runs: {names}.", lambda: _ENGINES)
    scheduler: str | None = values.text("Address of a Dask scheduler.", "a local cluster", metavar="ADDRESS")
    tls_ca: Path | None = values.file("Certificate authority of the Dask cluster.")
    tls_cert: Path | None = values.file("Certificate for the Dask cluster.")
    tls_key: Path | None = values.file("Key of the certificate.")
    on_error: str = values.choice("continue", "After a run that fails: {names}.", lambda: _ON_ERROR)
    shard: tuple[int, int] | None = values.shard("Make shard i of n only, as in 1/8: for a job array.", "all")
    wait: bool = values.flag("Wait until another sweep of the folder has ended.")
    mixed_code: bool = values.flag("Go on although runs in the folder were made by other code.")
    retry_failed: bool = values.flag("Make failed runs again.")


def sweep(settings: SweepSettings) -> None:
    """Make the runs of a study that are missing in its folder.

    \b
    Examples:
      teamsight sweep study.toml --out results
      teamsight sweep study.toml --out results --workers 8 --on-error stop
      teamsight sweep study.toml --out results --engine dask --scheduler tcp://10.0.0.1:8786
    """
    raise NotImplementedError
