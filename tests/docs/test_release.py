"""What a release needs: versions that agree, a changelog with a section for each, a citation that can be read."""

from __future__ import annotations

import datetime
import re
import tomllib
from pathlib import Path

import teamsight

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CITATION = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
VERSION = re.compile(r"\d+\.\d+\.\d+")
KINDS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def values(key: str) -> list[str]:
    """Return the values of a key of the citation that is not inside another."""
    return re.findall(rf"^{key}: (.*)$", CITATION, re.MULTILINE)


def test_versions_agree() -> None:
    assert [PROJECT["version"]] == values("version") == [teamsight.__version__]
    assert VERSION.fullmatch(PROJECT["version"])


def test_the_citation_has_what_its_format_requires() -> None:
    assert values("cff-version") == ["1.2.0"]
    assert values("type") == ["software"]
    assert values("title") == [PROJECT["name"]]
    assert values("license") == [PROJECT["license"]]
    assert len(values("message")) == 1
    assert re.search(r"^authors:\n  - ", CITATION, re.MULTILINE)
    for date in values("date-released"):
        datetime.date.fromisoformat(date)
    known = {
        "abstract", "authors", "cff-version", "date-released", "doi", "keywords", "license", "message", "references",
        "repository-code", "title", "type", "url", "version",
    }  # fmt: skip
    assert set(re.findall(r"^([\w-]+):", CITATION, re.MULTILINE)) <= known


def test_the_changelog_has_versions_in_order() -> None:
    sections = re.findall(r"^## (.*)$", CHANGELOG, re.MULTILINE)
    assert sections[0] == "[Unreleased]"
    released = [re.fullmatch(r"\[(\d+)\.(\d+)\.(\d+)\] – (\d{4}-\d\d-\d\d)", section) for section in sections[1:]]
    assert all(released), sections
    numbers = [tuple(map(int, found.groups()[:3])) for found in released if found]
    dates = [datetime.date.fromisoformat(found[4]) for found in released if found]
    assert numbers == sorted(set(numbers), reverse=True)
    assert dates == sorted(dates, reverse=True)
    # Either the version is the last that was released, or the section says that it will be the next.
    next_one = re.search(rf"Will be released as {re.escape(PROJECT['version'])}\.", CHANGELOG)
    assert (".".join(map(str, numbers[0])) == PROJECT["version"] if numbers else False) or next_one


def test_the_changelog_has_the_usual_kinds_of_changes_once_each() -> None:
    for section in re.split(r"^## ", CHANGELOG, flags=re.MULTILINE)[1:]:
        kinds = re.findall(r"^### (.*)$", section, re.MULTILINE)
        assert len(kinds) == len(set(kinds))
        assert set(kinds) <= KINDS


def test_the_checklist_names_files_that_exist() -> None:
    page = (ROOT / "docs" / "releasing.md").read_text(encoding="utf-8")
    named = re.findall(r"(?<![\w/])((?:\.ci/|teamsight/|tests/)[\w./]+)", page)
    assert {".ci/run", ".ci/check_build.py", ".ci/check_site.py", "teamsight/core/version.py"} <= set(named)
    for name in named:
        assert (ROOT / name).exists(), name


def test_the_sdist_holds_what_its_tests_and_its_site_need() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    held = project["tool"]["hatch"]["build"]["targets"]["sdist"]["only-include"]
    assert {"tests", "docs", "examples", "mkdocs.yml", ".ci"} <= set(held)
