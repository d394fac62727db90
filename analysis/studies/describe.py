"""A study's results in words: what was run, and what is missing."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

from teamsight.analysis.studies.standing import wide_note

if TYPE_CHECKING:
    from teamsight.analysis.studies.results import StudyTables

# Characters of the parameters that are fixed.
_LONGEST = 90


def what_is_missing(results: StudyTables) -> str:
    """Return what is missing, on one line, as in "partial: 312 of 1,000 runs, 5 failed"; empty if nothing is."""
    failed = f", {results.failed:,} failed" if results.failed else ""
    failed += f", parts of {results.lost:,} lost" if results.lost else ""
    if results.missing:
        return f"partial: {results.done:,} of {results.planned:,} runs{failed}"
    return f"{results.failed:,} of {results.planned:,} runs failed" if failed else ""


def conditions(results: StudyTables) -> str:
    """Return the study and its conditions, on one line."""
    study = results.study
    fixed = ", ".join(f"{name} = {value}" for name, value in study.fixed.items())
    shown = fixed if len(fixed) <= _LONGEST else f"{fixed[: _LONGEST - 1]}…"
    model = "" if study.model == "cmommt" else f"{study.model}, "
    steps = f"{study.steps:,} {'step' if study.steps == 1 else 'steps'}"
    return f"{results.name}: {model}{shown}{', ' * bool(shown)}{steps}, seed {study.seed}"


def described(results: StudyTables, *, is_running: bool) -> str:
    """Return the lines of the repr."""
    lines = [f"  {name}: {text}" for name, text in _lines(results, is_running)]
    return "\n".join([f"StudyResults of {results.name!r}", *lines])


def described_in_html(results: StudyTables, *, is_running: bool) -> str:
    """Return a small table for notebooks."""
    rows = "".join(
        f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
        f"<td style='text-align:left'>{html.escape(text)}</td></tr>"
        for name, text in _lines(results, is_running)
    )
    return f"<table><caption>{html.escape(results.name)}</caption>{rows}</table>"


def _lines(results: StudyTables, is_running: bool) -> list[tuple[str, str]]:
    axes = [f"{', '.join(group)} ({len(results.plan.values(group[0])):,})" for group in results.groups]
    runs = f"{results.done:,} of {results.planned:,} done"
    if results.failed:
        runs += f", {results.failed:,} failed"
    if results.missing:
        how = "a sweep is running: open the study again" if is_running else "teamsight sweep continues"
        lost = f" (of {results.lost:,} a recorded part is lost)" if results.lost else ""
        runs += f", {results.missing:,} missing{lost}: {how}"
    wide = wide_note(results.wide, results.plan.settings, results.study.until)
    return [
        ("folder", str(results.folder)),
        ("axes", "; ".join(axes) or "none"),
        ("measures", ", ".join(results.measures) or "none yet"),
        ("runs", runs),
        *([("intervals", wide)] if wide else []),
    ]
