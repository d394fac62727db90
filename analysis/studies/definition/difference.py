"""How the study of a folder and another one differ; a study may grow."""

from __future__ import annotations

from collections.abc import Iterator

from teamsight.analysis.studies.definition.recording import Record
from teamsight.analysis.studies.definition.values import text_of
from teamsight.analysis.studies.study import Study
from teamsight.core import checks
from teamsight.core.component import declared

# Values of a parameter that a line names.
_MOST_SHOWN = 5


def difference(old: Study, new: Study) -> list[str]:
    """Return a line for each difference; none if `new` is equal, or only adds settings or replicates.

    A study may grow: more replicates, more values, and a fixed parameter that becomes an axis with its value among
    others. Until when replicates are added may change freely, since it decides only how many there are. With anything
    else, the results are those of another study. The name and the folder of the study file do not matter.

    Parameters
    ----------
    old : Study
        The study of the folder.
    new : Study
        The study that shall continue it.

    Returns
    -------
    list of str
        Lines such as ``steps: 600 in the folder, 800 now``.
    """
    if old == new:
        return []
    lines = [
        _line(name, getattr(old, name), getattr(new, name))
        for name in ("model", "steps", "seed", "pairing")
        if getattr(old, name) != getattr(new, name)
    ]
    lines += _recorded(old.record, new.record)
    if new.replicates < old.replicates:
        lines.append(f"{_line('replicates', old.replicates, new.replicates)}, which is fewer")
    return lines + _settings(old, new)


def _line(name: str, old: object, new: object) -> str:
    return f"{name}: {checks.shown(old)} in the folder, {checks.shown(new)} now"


def _recorded(old: Record, new: Record) -> list[str]:
    return [
        _line(f"record.{name}", getattr(old, name), getattr(new, name))
        for name in declared(Record)
        if getattr(old, name) != getattr(new, name)
    ]


def _settings(old: Study, new: Study) -> list[str]:
    """Return lines about parameters, if some settings of the folder are not planned any more."""
    before, now = old.plan(), new.plan()
    lines = []
    for name in dict.fromkeys((*before.names, *now.names)):
        if name not in now.names:
            lines.append(f"{name}: {_shown(before.values(name))} in the folder, not given now")
        elif name not in before.names:
            lines.append(f"{name}: not given in the folder, {_shown(now.values(name))} now")
        else:
            lines.extend(_values(name, before.values(name), now.values(name)))
    gone = int((now.index_of(before.ids) < 0).sum())
    if gone and not lines:
        lines.append(f"settings: {gone:,} of {before.settings:,} in the folder are not planned now")
    return lines


def _values(name: str, old: list[object], new: list[object]) -> Iterator[str]:
    """Yield lines about values of a parameter that are gone, or of another type than before."""
    planned = set(map(text_of, new))
    gone = [value for value in old if text_of(value) not in planned]
    if gone:
        yield f"{name}: {_shown(gone)} in the folder, not among {_shown(new)} now"
    elif _word(old) != _word(new):
        yield f"{name}: {_word(old)} in the folder, {_word(new)} now; a column has one type"


def _word(values: list[object]) -> str:
    kinds = set(map(type, values))
    return "numbers" if kinds <= {int, float} else "booleans" if kinds == {bool} else "texts"


def _shown(values: list[object]) -> str:
    shown = [checks.shown(value) for value in values[:_MOST_SHOWN]]
    return ", ".join(shown) + (f" and {len(values) - _MOST_SHOWN} more" if len(values) > _MOST_SHOWN else "")
