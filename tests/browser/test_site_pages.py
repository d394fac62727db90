"""What readers do on the pages of a built site: they search, and they use all by keyboard.

TEAMSIGHT_PAGES is the folder that `mkdocs build` wrote; without it these tests are skipped.
"""

from __future__ import annotations

import functools
import http.server
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import browsing
import pytest
from replaying import until

if TYPE_CHECKING:
    from playwright.sync_api import Page

PLAYS = """card => card.getAnimations({ subtree: true })
    .some(({ animationName, playState }) => animationName === "ts-film" && playState === "running")"""


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="session")
def folder() -> Path:
    """The folder of the site."""
    if not os.environ.get("TEAMSIGHT_PAGES"):
        pytest.skip("no site: set TEAMSIGHT_PAGES to the folder that `mkdocs build` wrote")
    return Path(os.environ["TEAMSIGHT_PAGES"]).resolve()


@pytest.fixture(scope="session")
def served(folder: Path) -> Iterator[str]:
    """The address of a server of the site."""
    handler = functools.partial(_Quiet, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def found(page: Page, query: str) -> tuple[int, list[str]]:
    """Type a query into the search of the site; return the number of pages found, and the first of them."""
    field = page.locator("[data-md-component=search-query]")
    for text in ("qqqq", query):
        field.fill(text)
        # The theme listens to keys.
        field.press("Shift")
        answer = "/^No m/" if text == "qqqq" else "/^[1-9]/"
        page.wait_for_function(f"{answer}.test(document.querySelector('.md-search-result__meta').innerText)")
    number = page.locator(".md-search-result__meta").inner_text().split()[0]
    links = page.locator(".md-search-result__item > a:first-child").evaluate_all("links => links.map(link => link.pathname)")
    return int(number), [link.rpartition("/")[2].removesuffix(".html") for link in links[:10]]


@pytest.mark.parametrize("scheme", ["http", "file"])
def test_the_search_finds_what_explains_first(page: Page, folder: Path, served: str, scheme: str) -> None:
    page.goto(f"{served}index.html" if scheme == "http" else (folder / "index.html").as_uri())
    page.locator("[data-md-component=search-query]").click()
    number, first = found(page, "number of robots")
    # Pages with all its words close together; 95 pages have one of them.
    assert number < 25
    assert first[0] == "tutorial"
    assert found(page, "delta")[1][0] == found(page, "δ")[1][0] == "delta"
    assert [found(page, word)[1][0] for word in ("study", "learning")] == ["studies", "learning"]
    assert found(page, "class World")[1][0] == "teamsight.World"
    assert found(page, "real robot")[1][0] == "controllers"
    # A beginning, another spelling, a plural.
    for query, wanted in {"hetero": "faq", "GPU": "faq", "neighbor": "contacts", "max neighbours": "tutorial"}.items():
        assert wanted in found(page, query)[1], query
    assert found(page, "radii") != found(page, "robots")
    assert found(page, "robots") == found(page, "robot")
    # Where none has all words, any will do.
    assert found(page, "zebra robots") == found(page, "robots")


@pytest.mark.parametrize("name", ["team", "delta", "radius"])
def test_a_recording_is_used_by_keyboard(new_page: browsing.Pages, served: str, name: str) -> None:
    page = new_page(reduced_motion=True)
    page.goto(f"{served}gallery/{name}.html")
    page.wait_for_selector("#teamsight[data-state=ready]")
    assert not page.evaluate("teamsight.view.playing")
    assert browsing.unreached(page) == []
    page.locator(".ts-scrub").focus()
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    until(page, "teamsight.view.shownTime === 1")
    before = page.evaluate("teamsight.view.selected.slot")
    page.keyboard.press("]")
    slot = page.evaluate("teamsight.view.selected.slot")
    assert slot == (0 if before is None else before + 1)
    until(page, f"document.querySelector('.ts-inspector').innerText.includes('robots · {slot + 1}')")
    if name != "team":
        slider = page.get_by_role("slider", name="δ" if name == "delta" else "Radius", exact=True)
        slider.focus()
        page.keyboard.press("Home")
        shown = slider.evaluate("one => [one.value, one.ariaValueText]")
        page.keyboard.press("ArrowRight")
        after = slider.evaluate("one => [one.value, one.ariaValueText]")
        assert (shown[0], after[0]) == ("0", "1")
        assert shown[1] != after[1]
        assert page.locator(".ts-choice .ts-chosen").first.inner_text() == after[1].split(" = ")[1].split(":")[0]
        # The tick and the body stay.
        assert page.evaluate("[teamsight.view.shownTime, teamsight.view.selected.slot]") == [1, slot]


@pytest.mark.parametrize("reduced", [False, True])
def test_cards_are_reached_and_rest_for_who_prefers_it(new_page: browsing.Pages, served: str, reduced: bool) -> None:
    page = new_page(reduced_motion=reduced)
    page.goto(f"{served}gallery.html")
    page.wait_for_selector("html[data-reach]")
    assert page.locator(".ts-card:visible").count() >= 20
    assert browsing.unreached(page, ".ts-filter, .ts-cards") == []
    page.get_by_role("searchbox", name="Filter the recordings").fill("torus")
    card = page.locator(".ts-card:visible").first
    assert not card.evaluate(PLAYS)
    card.focus()
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Tab")
    assert card.evaluate("card => card === document.activeElement")
    assert card.evaluate(PLAYS) is not reduced
    card.hover()
    assert card.evaluate(PLAYS) is not reduced
    page.keyboard.press("Enter")
    page.wait_for_url("**/gallery/code/*")
    page.frame_locator("iframe").locator("#teamsight[data-state=ready]").wait_for()


def test_tab_goes_through_a_recording_in_a_page(page: Page, served: str) -> None:
    page.goto(f"{served}recordings.html")
    page.wait_for_selector("html[data-reach]")
    frame = page.locator("iframe").first
    frame.scroll_into_view_if_needed()
    frame.content_frame.locator("#teamsight[data-state=ready]").wait_for()
    link = page.get_by_role("link", name="The code")
    link.focus()
    page.keyboard.press("Shift+Tab")
    seen = 0
    while page.evaluate("document.activeElement.tagName") == "IFRAME":
        page.keyboard.press("Shift+Tab")
        seen += 1
        assert seen < 100, "the keyboard does not leave the recording"
    assert seen > 10


# The pages with the widest tables.
@pytest.mark.parametrize("name", ["calibration", "reference-results", "relatives", "tasks/gathering", "tasks/pursuit"])
def test_tables_fit_a_screen_and_scroll_in_their_box_on_a_phone(
    new_page: browsing.Pages, served: str, name: str
) -> None:
    wider = "boxes => boxes.filter(box => box.scrollWidth > box.clientWidth).length"
    for size in (browsing.WIDE, browsing.PHONE):
        page = new_page(size=size)
        page.goto(f"{served}{name}.html")
        page.wait_for_selector("html[data-reach]")
        boxes = page.locator(".md-typeset__scrollwrap")
        assert boxes.count() > 0
        assert page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
        regions = page.get_by_role("region", name="Table ")
        if size == browsing.WIDE:
            assert boxes.evaluate_all(wider) == regions.count() == 0
            continue
        assert boxes.evaluate_all(wider) == regions.count() > 0
        regions.first.focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_function("() => document.activeElement.scrollLeft > 0")
        assert browsing.unreached(page, ".md-content") == []
