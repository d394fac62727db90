"""The blocks of each page run, in order, and print what the page shows below them."""

from __future__ import annotations

import re
from pathlib import Path

import pages
import pytest

from teamsight import TASKS

# The commands of studies.md are killed and continued, see test_studies.py; the gallery is below.
ELSEWHERE = {"studies.md", "gallery.md"}
WITH_CODE = [
    page
    for page in sorted(pages.DOCS.rglob("*.md"))
    if page.name not in ELSEWHERE and any(block.language == "python" for block in pages.blocks_of(page))
]
# They show what is printed.
WITH_OUTPUT = [
    page
    for page in WITH_CODE
    if page.relative_to(pages.DOCS).parts[0] in ("index.md", "tutorial.md", "coming-from")
]
# Too slow for the part of the suite that is repeated on other Python versions.
SLOW = {"delta.md"}


def name_of(page: Path) -> str:
    return page.relative_to(pages.DOCS).with_suffix("").as_posix()


def check(page: Path, folder: Path) -> None:
    for shown, printed, by in pages.run_page(page, folder):
        agrees = pages.matches if by.language == "python" else pages.contains
        assert agrees(printed, shown.content), f"{page.name}:{shown.line} shows\n{shown.content}\nbut it is\n{printed}"


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[] if page.name in SLOW else pytest.mark.short, id=name_of(page))
        for page in WITH_CODE
        if page not in WITH_OUTPUT
    ],
)
def test_the_code_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    check(page, tmp_path)


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
@pytest.mark.parametrize("page", WITH_OUTPUT, ids=name_of)
def test_a_page_prints_what_it_shows(page: Path, tmp_path: Path) -> None:
    assert any(block.language == "text" for block in pages.blocks_of(page))
    check(page, tmp_path)


@pytest.mark.parametrize("page", WITH_OUTPUT, ids=name_of)
def test_what_is_printed_is_shown(page: Path) -> None:
    blocks = pages.blocks_of(page)
    for block, after in zip(blocks, [*blocks[1:], None], strict=True):
        if block.language == "python" and re.search(r"^ *print\(", block.content, re.MULTILINE):
            assert after is not None
            assert after.language == "text", f"{page.name}:{block.line}"


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_the_gallery_makes_the_recordings_that_it_shows(tmp_path: Path) -> None:
    page = pages.DOCS / "gallery.md"
    shown = re.findall(r'<iframe src="gallery/([^"]+)" title="[^"]+" loading="lazy"', page.read_text(encoding="utf-8"))
    list(pages.run_page(page, tmp_path))
    made = {file.stem for file in tmp_path.glob("*.html")}
    # Those that differ in a number are one page, with a slider.
    assert {f"{name.partition('=')[0]}.html" for name in made} == set(shown)
    assert [sum(name.startswith(f"{family}=") for name in made) for family in ("delta", "radius")] == [5, 5]
    assert set(TASKS) - {"cmommt"} <= made


def test_no_page_with_code_is_left_out() -> None:
    assert {"tutorial", "tasks/catalogue", "policies", "sensors"} <= {name_of(page) for page in WITH_CODE}


@pytest.mark.parametrize(
    ("printed", "shown", "same"),
    [
        ("a 1\nb\n", "a 1\nb\n", True),
        ("90 runs made in 1.2 s; done\n", "90 runs made in … s; done\n", True),
        ("a 1\nb\n", "a 1\n", False),
        ("a.1\n", "a 1\n", False),
        ("", "a\n", False),
    ],
)
def test_outputs_are_compared_line_by_line(printed: str, shown: str, same: bool) -> None:
    assert pages.matches(printed, shown) is same


def test_a_page_that_shows_what_is_not_printed_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```python\nx = 2\n```\n\n```python\nprint(x)\n```\n\n```text\n3\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError, match="page.md:9 shows"):
        check(page, tmp_path)
    page.write_text("```python\nprint(y)\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError, match="block of line 1: name 'y' is not defined"):
        check(page, tmp_path)
