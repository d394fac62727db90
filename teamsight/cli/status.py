"""``teamsight status``: how far a study is."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from teamsight.cli import values
from teamsight.cli.options import Options
from teamsight.core.component import Flag

if TYPE_CHECKING:
    from teamsight.analysis.studies.folder.status import Running, Status
    from teamsight.analysis.studies.folder.study_folder import Manifest, StudyFolder

_FEW = 5


@dataclass(frozen=True, kw_only=True)
class StatusSettings(Options):
    """Options of ``teamsight status``.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    failed : bool
        List all failed runs, with their seeds and errors.
    json : bool
        Print JSON.
    """

    folder: values.StudyFolder
    failed: Flag = False
    json: Flag = False


def status(settings: StatusSettings) -> None:
    """Show how many runs of a study are done, running, failed and missing, and the time left.

    DIR is the folder of a study, which another process may be filling; nothing is written. The exit status is 0 also
    if runs are missing or have failed.

    \b
    Examples:
      teamsight status results
      teamsight status results --failed
      teamsight status results --json
    """
    from teamsight.analysis.studies.folder.status import status as find
    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.cli.show import say

    place = StudyFolder(settings.folder)
    manifest, found = place.manifest, find(settings.folder)
    failures = _failures(place) if found.failed else []
    if settings.json:
        say(json.dumps(_as_json(place, manifest, found, failures)))
        return
    for line in (
        *_counts(settings.folder, place, manifest, found), *_sweeps(settings.folder, found),
        *_damaged(settings.folder, found), *_failed(settings, failures), _origin(manifest),
    ):  # fmt: skip
        say(line)


def _counts(folder: Path, place: StudyFolder, manifest: Manifest, found: Status) -> list[str]:
    from teamsight.analysis.studies.standing import not_finite_note, wide_note

    name = f"{manifest.study['name']!r} " if manifest.study["name"] else ""
    lines = [f"study {name}in {folder}: {found.planned:,} runs of {manifest.study['model']}"]
    if manifest.study["until"]:
        lines[0] += " so far, as many as the intervals need"
    running = f", of which {found.running:,} running" if found.running else ""
    for what, count, more in (
        ("done", found.done, ""), ("failed", found.failed, ""), ("missing", found.missing, running),
    ):  # fmt: skip
        lines.append(f"  {what:<8} {count:>12,}  {_share(count, found.planned):>6}{more}")
    study = place.study
    notes = wide_note(found.wide, study.settings, study.until), not_finite_note(found.not_finite)
    return [*lines, *filter(None, notes)]


def _share(count: int, planned: int) -> str:
    """Return a share in percent; 100 % only if that is exact, and so 0 %."""
    share = 100 * count / planned if planned else 0.0
    text = f"{share:.1f} %"
    if text == "100.0 %" and count < planned:
        return "99.9 %"
    return "0.1 %" if text == "0.0 %" and count else text


def _sweeps(folder: Path, found: Status) -> list[str]:
    from teamsight.core.status_line import seconds

    if not found.sweeps:
        if not found.missing:
            return ["no sweep is running, and nothing is left to do"]
        return [f"no sweep is running; to continue: teamsight sweep STUDY --out {folder}"]
    lines = [f"running: {each.holder}{_engine(each)}" for each in found.sweeps]
    if found.rate and found.seconds_left is not None:
        lines.append(f"{found.rate:.3g} runs per second, {seconds(found.seconds_left)} left")
    return lines


def _engine(running: Running) -> str:
    from teamsight.cli.show import plural

    progress = running.progress
    return f" ({progress.engine}, {plural(progress.workers, 'worker')})" if progress else ""


def _damaged(folder: Path, found: Status) -> list[str]:
    lines = [f"damaged: {each.kind}/{each.name} {each.reason}" for each in found.damaged[:_FEW]]
    return [*lines, f"to set damaged parts aside and repeat their runs: teamsight verify {folder}"] if lines else []


def _failures(place: StudyFolder) -> list[dict[str, object]]:
    """Return run id, seed and error of each failed run."""
    table = place.read("failed", ["run", "seed", "error"], skip_damaged=True)
    return sorted(table.to_pylist(), key=lambda row: str(row["run"]))


def _failed(settings: StatusSettings, failures: list[dict[str, object]]) -> list[str]:
    most = len(failures) if settings.failed else _FEW
    lines = [f"failed: run {each['run']}, seed {each['seed']}: {each['error']}" for each in failures[:most]]
    if len(failures) > most:
        lines.append(f"and {len(failures) - most:,} more; --failed lists all")
    if failures:
        lines.append(f"to repeat one alone: teamsight rerun {settings.folder} {failures[0]['run']}")
    return lines


def _origin(manifest: Manifest) -> str:
    versions = manifest.versions
    commit = manifest.commits.get("teamsight", {}).get("commit", "")
    mixed = "; runs of several versions of the code" if manifest.earlier else ""
    return (
        f"made with teamsight {versions.get('teamsight')}{f' ({commit[:12]})' if commit else ''}, Python "
        f"{versions.get('python')}; begun {manifest.created}, last changed {manifest.changed}{mixed}"
    )


def _as_json(
    place: StudyFolder, manifest: Manifest, found: Status, failures: list[dict[str, object]]
) -> dict[str, object]:
    counts = {name: getattr(found, name) for name in ("planned", "done", "failed", "missing", "running")}
    sweeps = [
        each.holder._asdict() | (each.progress._asdict() if each.progress else {}) for each in found.sweeps
    ]  # fmt: skip
    about = {name: getattr(manifest, name) for name in ("code", "versions", "commits", "machine", "created", "changed")}
    return {
        "folder": str(place.path), "name": manifest.study["name"], **counts, "rate": found.rate,
        "seconds_left": found.seconds_left, "sweeps": sweeps, "damaged": [each._asdict() for each in found.damaged],
        "failures": failures, "wide": found.wide, "not_finite": found.not_finite, **about,
    }  # fmt: skip
