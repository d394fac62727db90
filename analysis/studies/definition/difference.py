"""How the study of a folder and another one differ; a study may grow."""

from __future__ import annotations


from teamsight.analysis.studies.study import Study


def difference(old: Study, new: Study) -> list[str]:
    """Return a line for each difference; none if `new` is equal, or only adds settings or replicates.

    Parameters
    ----------
    old : Study
        The study of the folder.
    new : Study
        The study that shall continue it.
    """
    lines = []
    for name in ("model", "steps", "seed", "pairing", "record"):
        if getattr(old, name) != getattr(new, name):
            lines.append(f"{name}: {getattr(old, name)} in the folder, {getattr(new, name)} now")
    if new.replicates < old.replicates:
        lines.append(f"replicates: {old.replicates} in the folder, {new.replicates} now")
    if (new.plan().index_of(old.plan().ids) < 0).any():
        lines.append("settings: some settings of the folder are not planned now")
    return lines
