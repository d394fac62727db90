"""The browser of the tests notices what should not happen on a page, and disturbs no other test."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path
from typing import TYPE_CHECKING

import browsing
import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

HEAD = "<!doctype html><meta charset='utf-8'><title>t</title>"


def open_with(page: Page, folder: Path, more: str = "") -> None:
    file = folder / "page.html"
    file.write_text(f"{HEAD}{more}<main>here</main>", encoding="utf-8")
    page.goto(file.as_uri())


def test_a_page_opens_from_a_file(page: Page, tmp_path: Path, problems: browsing.Problems) -> None:
    open_with(page, tmp_path, "<script>console.log('fine')</script>")
    assert page.text_content("main") == "here"
    assert problems.found == []


@pytest.mark.parametrize(
    ("more", "found"),
    [
        ("<script>console.error('oh no')</script>", "console: oh no"),
        ("<script>throw new Error('wrong')</script>", "error of a script: .*wrong"),
        ("<script>Promise.reject(new Error('later'))</script>", "error of a script: .*later"),
        ("<img src='http://example.com/picture.png'>", "request that leaves the machine: http://example.com/"),
        ("<script>new WebSocket('ws://192.0.2.1/')</script>", "socket that leaves the machine: ws://192.0.2.1/"),
        (
            "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'\"><script>1</script>",
            "policy violated: script-src|violates the following Content Security Policy",
        ),
    ],
)
def test_a_problem_is_noticed(page: Page, tmp_path: Path, problems: browsing.Problems, more: str, found: str) -> None:
    open_with(page, tmp_path, more)
    for _ in range(10_000):
        if problems.found:
            break
        page.wait_for_timeout(50)
    assert any(re.search(found, text) for text in problems.unexpected()), problems.found
    problems.expect("")
    assert problems.unexpected() == []


def test_a_problem_that_is_expected_is_accepted(page: Page, tmp_path: Path, problems: browsing.Problems) -> None:
    problems.expect("oh no")
    open_with(page, tmp_path, "<script>console.error('oh no')</script>")
    assert problems.unexpected() == []


def test_a_phone_that_prefers_dark_and_little_motion(new_page: browsing.Pages, tmp_path: Path) -> None:
    page = new_page(size=browsing.PHONE, dark=True, reduced_motion=True)
    open_with(page, tmp_path, "<meta name='viewport' content='width=device-width'>")
    asked = "query => matchMedia(query).matches"
    for query in ("(prefers-color-scheme: dark)", "(prefers-reduced-motion: reduce)", "(pointer: coarse)"):
        assert page.evaluate(asked, query), query
    assert page.evaluate("innerWidth") == browsing.PHONE[0]


def test_asyncio_works_beside_the_browser_of_another_test() -> None:
    async def answer() -> int:
        return 3

    assert asyncio.run(answer()) == 3


def test_the_browser_works_after_asyncio(page: Page, tmp_path: Path) -> None:
    open_with(page, tmp_path)
    assert page.title() == "t"
