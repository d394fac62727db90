"""Whether everybody can use the pages: axe-core's rules of WCAG 2.1 A and AA, and what such rules do not see.

axe-core comes from npm and is no part of this repository: TEAMSIGHT_AXE is the path of its ``axe.min.js``. `.ci/run`
fetches it. The pages of the documentation site are tested where TEAMSIGHT_PAGES is the folder of a built one.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import browsing
import pytest
from replaying import opened, recorded, written

from teamsight import CMOMMT
from teamsight.live import LivePage

if TYPE_CHECKING:
    from playwright.sync_api import Page

RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]
LOOKS = [(size, dark) for size in (browsing.WIDE, browsing.PHONE) for dark in (False, True)]
NAMES = [f"{'phone' if size == browsing.PHONE else 'wide'}-{'dark' if dark else 'light'}" for size, dark in LOOKS]
#: Pages of the site, one of each kind.
PAGES = ["index", "gallery", "tutorial", "tasks/index", "reference/index", "watch", "relatives"]

looks = pytest.mark.parametrize(("size", "dark"), LOOKS, ids=NAMES)


@pytest.fixture(scope="session")
def axe() -> str:
    """The script of axe-core."""
    path = os.environ.get("TEAMSIGHT_AXE")
    if not path:
        pytest.skip("no axe-core: set TEAMSIGHT_AXE to the axe.min.js of `npm pack axe-core`")
    return Path(path).read_text(encoding="utf-8")


def violations(page: Page, axe: str) -> list[str]:
    """Return what axe-core finds on a page.

    The debugging protocol evaluates the script: a tag of a script would violate the policy of our pages.
    """
    session = page.context.new_cdp_session(page)
    options = {"runOnly": {"type": "tag", "values": RULES}, "resultTypes": ["violations"], "iframes": False, "preload": False}
    session.send("Runtime.evaluate", {"expression": axe})
    expression = f"axe.run(document, {json.dumps(options)}).then(found => JSON.stringify(found.violations))"
    answer = session.send("Runtime.evaluate", {"expression": expression, "awaitPromise": True, "returnByValue": True})
    assert "exceptionDetails" not in answer, answer
    return [
        f"{rule['id']}: {node['html'][:160]} ({' '.join(node['failureSummary'].split())[:300]})"
        for rule in json.loads(answer["result"]["value"])
        for node in rule["nodes"]
    ]


def shown(page: Page, server: LivePage) -> Page:
    """Open a live page and wait until it has drawn a frame."""
    page.goto(server.url)
    page.wait_for_function(
        "() => teamsight.view?.tracks.length && teamsight.view.tracks.every(({ frames }) => frames.length)"
        " && teamsight.live.state?.tracks.length && !document.querySelector('.ts-controls').inert"
    )
    return page


@looks
def test_a_live_page_keeps_the_rules(
    new_page: browsing.Pages, live: Callable[..., LivePage], axe: str, size: tuple[int, int], dark: bool
) -> None:
    page = shown(new_page(size=size, dark=dark), live(running=True, rate=5.0))
    assert violations(page, axe) == []


@looks
def test_two_worlds_with_events_keep_the_rules(
    new_page: browsing.Pages, live: Callable[..., LivePage], axe: str, shot: Any, size: tuple[int, int], dark: bool
) -> None:
    page = shown(new_page(size=size, dark=dark), live(beside={"policy": "centroid", "awareness": "none"}))
    page.wait_for_function("() => teamsight.view.tracks.length === 2")
    rows = [[1.5, "fail", "robots", 3, {"cause": "battery"}]]
    page.evaluate("rows => teamsight.live.log.show([{ rows, total: 1 }, { rows: [], total: 0 }])", rows)
    page.evaluate("() => teamsight.view.select(0, 0)")
    page.evaluate("() => teamsight.live.fail('Something was refused: give another value')")
    shot(page, f"two-worlds-{size == browsing.PHONE}-{dark}")
    assert violations(page, axe) == []


@looks
def test_a_recording_keeps_the_rules(
    new_page: browsing.Pages, tmp_path: Path, axe: str, shot: Any, size: tuple[int, int], dark: bool
) -> None:
    one, other = CMOMMT(rng=1), CMOMMT(policy="random-walk", rng=1)
    file = written(tmp_path, recorded(one, 20), recorded(other, 20))
    page = opened(new_page(size=size, dark=dark), file)
    page.evaluate("teamsight.view.select(0, 2)")
    assert violations(page, axe) == []
    page.evaluate("teamsight.view.help()")
    assert violations(page, axe) == []


@looks
@pytest.mark.parametrize("name", PAGES)
def test_the_site_keeps_the_rules(
    new_page: browsing.Pages, axe: str, shot: Any, name: str, size: tuple[int, int], dark: bool
) -> None:
    folder = os.environ.get("TEAMSIGHT_PAGES")
    if not folder:
        pytest.skip("no site: set TEAMSIGHT_PAGES to the folder that `mkdocs build` wrote")
    page = new_page(size=size, dark=dark)
    page.goto((Path(folder).resolve() / f"{name}.html").as_uri())
    page.wait_for_selector("html[data-reach]")
    assert violations(page, axe) == []
