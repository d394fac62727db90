"""Preparing a folder for a sweep: a new one gets a manifest, an old one must be that of the same study."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teamsight.analysis.studies.folder import origin, parts
from teamsight.analysis.studies.folder.belonging import check_belongs
from teamsight.analysis.studies.folder.layout import KINDS, MANIFEST, foreign_parts, is_own, make_folder
from teamsight.analysis.studies.folder.manifest import Manifest, read_manifest, write_manifest
from teamsight.analysis.studies.folder.parts import DamagedError
from teamsight.analysis.studies.folder.sweeps import read_sweeps
from teamsight.core import files

if TYPE_CHECKING:
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

# Lines of the difference of two studies that an error shows.
_MOST_LINES = 6


def check_own(folder: Path) -> None:
    """Raise an error if a folder holds something else than a study.

    Raises
    ------
    UnwritableError
        If it does, or it cannot be examined.
    """
    files.check_name(folder)
    try:
        if os.path.lexists(folder / MANIFEST):
            return
        foreign = sorted(_foreign(folder))
    except FileNotFoundError:
        return
    except NotADirectoryError:
        raise files.UnwritableError(f"{folder}: is a file; give a folder") from None
    except OSError as error:
        raise files.unwritable(folder, error) from error
    if foreign:
        more = f" and {len(foreign) - 1} more" if len(foreign) > 1 else ""
        raise files.UnwritableError(
            f"{folder}: holds something else ({foreign[0]}{more}); give an empty or a new folder"
        )


def _foreign(folder: Path) -> Iterator[str]:
    """Yield what is in a folder, and in its folders of parts, that is not of a study."""
    for name in os.listdir(folder):
        if not is_own(name):
            yield name
        elif name in KINDS:
            yield from foreign_parts(folder, name)


def make_own_folder(folder: Path) -> None:
    """Create the folder of a study, unless it is there.

    Raises
    ------
    UnwritableError
        If it cannot be created or holds something else.
    """
    check_own(folder)
    make_folder(folder, parents=True)


def prepared(
    folder: Path,
    study: Study,
    plan: Plan,
    code: str,
    sources: Mapping[str, str],
    types: Mapping[str, str],
    mixed_code: bool,
) -> Manifest:
    """Create or check a folder; see `StudyFolder.prepare`."""
    make_own_folder(folder)
    if not os.path.lexists(folder / MANIFEST):
        check_belongs(folder, study, plan)
        _check_recorded_code(folder, code, mixed_code)
        return _created(folder, study, code, sources, types)
    found = read_manifest(folder)
    wanted = _grown(folder, found, study, types)
    wanted = _with_code(folder, wanted, code, sources, mixed_code)
    if wanted != found:
        wanted = wanted._replace(changed=_now())
        write_manifest(folder, wanted)
    return wanted


def _created(folder: Path, study: Study, code: str, sources: Mapping[str, str], types: Mapping[str, str]) -> Manifest:
    place = None if study.path is None else Path(study.path)
    now = _now()
    made = Manifest(
        _values(study), dict(types), code, dict(sources), _held(folder), (), origin.versions(), origin.commits(place),
        origin.machine(), now, now,
    )  # fmt: skip
    write_manifest(folder, made)
    return made


def _held(folder: Path) -> dict[str, str]:
    """Return what measured columns hold in the undamaged parts of a folder whose manifest is lost."""
    found: dict[str, str] = {}
    for part in parts.listed(folder, "runs"):
        with contextlib.suppress(DamagedError):
            found = {**parts.noted(part, parts.load(part), parts.HOLDS), **found}
    return found


def settled(folder: Path, kinds: Mapping[str, str | None]) -> Mapping[str, str]:
    """Take over what measured columns hold, where it is not decided, and return what is decided now."""
    found = read_manifest(folder)
    holds = {**{name: kind for name, kind in kinds.items() if kind is not None}, **found.holds}
    if holds != found.holds:
        write_manifest(folder, found._replace(holds=holds))
    return holds


def _grown(folder: Path, found: Manifest, study: Study, types: Mapping[str, str]) -> Manifest:
    """Return the manifest with the additions of a study to that of the folder."""
    from teamsight.analysis.studies.definition.check import difference
    from teamsight.analysis.studies.study import Study

    lines = difference(Study.from_dict(found.study), study)
    lines += [
        f"type of {name}: {old} in the folder, {types[name]} now"
        for name, old in found.types.items()
        if name in types and types[name] != old
    ]
    if lines:
        more = [f"and {len(lines) - _MOST_LINES} more"] if len(lines) > _MOST_LINES else []
        raise ValueError(
            f"{folder}: is the folder of another study ({'; '.join([*lines[:_MOST_LINES], *more])}); give another "
            "folder, or the study that it was made with"
        )
    return found._replace(study=_values(study), types=dict(types))


def _with_code(folder: Path, found: Manifest, code: str, sources: Mapping[str, str], mixed_code: bool) -> Manifest:
    """Return the manifest with the code that makes runs now, if it is the same or may differ."""
    changed = [name for name, digest in found.sources.items() if sources.get(name, digest) != digest]
    wanted = found._replace(code=code, sources={**found.sources, **sources})
    if found.code == code and not changed:
        return wanted
    if not mixed_code:
        what = f"module {changed[0]!r}" if found.code == code else "teamsight"
        old, new = (found.code, code) if found.code != code else (found.sources[changed[0]], sources[changed[0]])
        raise _other_code(folder, what, old, new)
    before = {"code": found.code, "sources": dict(found.sources), "until": _now()}
    return wanted._replace(earlier=(*found.earlier, before))


def _check_recorded_code(folder: Path, code: str, mixed_code: bool) -> None:
    """Refuse other code than that of earlier sweeps, where the manifest that says so is lost."""
    used = [record["code"] for record in read_sweeps(folder) if "code" in record]
    if used and code not in used and not mixed_code:
        raise _other_code(folder, "teamsight", str(used[-1]), code)


def _other_code(folder: Path, what: str, old: str, new: str) -> ValueError:
    return ValueError(
        f"{folder}: its runs were made by another version of {what} ({old}, now {new}); give another folder, use that "
        "version, or accept a mixture with --mixed-code (in Python, mixed_code=True)"
    )


def _values(study: Study) -> dict[str, Any]:
    """Return the values of a study, with a folder that is found from everywhere."""
    place = None if study.path is None else os.path.abspath(study.path)
    return {**study.as_dict(), "path": place}


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
