"""Fixtures for tests in a real browser: `page`, `new_page`, `problems`, `shot`, `chromium`.

Each worker of pytest starts one browser, on first use; each page has a context of its own. Without a browser the tests
are skipped with a reason. After a failed test the pictures of its pages are in its ``tmp_path``.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import browsing
import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from teamsight.live import LivePage

_FAILED = pytest.StashKey[bool]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    report = yield
    if report.when == "call":
        item.stash[_FAILED] = report.failed
    return report


@pytest.fixture(scope="session")
def _started() -> Iterator[tuple[Browser, asyncio.AbstractEventLoop]]:
    if reason := browsing.missing():
        browsing.skip_or_fail(reason)
    from playwright.sync_api import Error

    with contextlib.ExitStack() as stack:
        try:
            found = stack.enter_context(browsing.started())
        except Error as error:
            browsing.skip_or_fail(f"the browser does not start: {str(error).splitlines()[0]}")
        yield found


@pytest.fixture(scope="session")
def _compiled(_started: object) -> None:
    """Compile first what worlds of pages need: on an empty cache that takes longer than a test waits for a page."""
    from teamsight import CMOMMT
    from teamsight.agents.awareness.registry import AWARENESS

    small = {"robots": 2, "targets": 2, "rng": 1}
    policies = ("a-cmommt", "centroid", "random-walk", "stationary")
    for settings in (*({"policy": name} for name in policies), *({"awareness": name} for name in AWARENESS)):
        CMOMMT(**small, **settings).record(steps=1)


@pytest.fixture
def chromium(_started: tuple[Browser, asyncio.AbstractEventLoop]) -> Iterator[Browser]:
    """The browser, which this worker started once."""
    browser, loop = _started
    with browsing.driving(loop):
        yield browser


@pytest.fixture
def problems() -> browsing.Problems:
    """What went wrong on the pages of this test; ``problems.expect(pattern)`` accepts what must happen."""
    return browsing.Problems()


@pytest.fixture
def new_page(
    chromium: Browser, _compiled: None, problems: browsing.Problems, request: pytest.FixtureRequest, tmp_path: Path
) -> Iterator[browsing.Pages]:
    """Makes further pages: ``new_page(size=browsing.PHONE, dark=True, reduced_motion=True)``."""
    pages = browsing.Pages(chromium, problems)
    try:
        yield pages
        if request.node.stash.get(_FAILED, False):
            _take_pictures(pages.made, tmp_path)
            print("\n".join(problems.found))
    finally:
        pages.close()
    # Else the reason of the failure would stand below its consequences.
    if not request.node.stash.get(_FAILED, False):
        assert not problems.unexpected()


@pytest.fixture
def page(new_page: browsing.Pages) -> Page:
    """A new page, wide and light."""
    return new_page()


@pytest.fixture
def shot(request: pytest.FixtureRequest) -> Callable[[Page, str], None]:
    """Takes a picture of a whole page, ``shot(page, "name")``, into the folder TEAMSIGHT_SCREENSHOTS, if that is set."""
    folder = os.environ.get("TEAMSIGHT_SCREENSHOTS")

    def take(page: Page, name: str) -> None:
        if folder:
            page.screenshot(path=Path(folder) / f"{name}.png", full_page=True)

    return take


def _take_pictures(pages: list[Page], folder: Path) -> None:
    for number, page in enumerate(pages):
        with contextlib.suppress(Exception):
            page.screenshot(path=folder / f"failed-{number}.png", full_page=True)
            print(f"picture of the page: {folder / f'failed-{number}.png'}")


@pytest.fixture
def live(problems: browsing.Problems) -> Iterator[Callable[..., LivePage]]:
    """Serves live pages on free ports, and closes them."""
    from teamsight import CMOMMT
    from teamsight.live import watch

    made: list[LivePage] = []

    def serve(model: Any = None, parameters: Any = None, **how: Any) -> LivePage:
        how = {"port": 0, "running": False} | how
        made.append(watch(model or CMOMMT, {"seed": 5} | (parameters or {}), browser=False, wait=False, **how))
        return made[-1]

    yield serve
    # Pages that outlive their server try to connect again.
    problems.expect("ERR_CONNECTION_REFUSED")
    for one in made:
        one.close()
