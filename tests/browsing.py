"""A browser for tests: finding it, starting it, and noticing everything on a page that should not happen."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import shutil
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Request

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
#: The sizes of a screen [pixels].
WIDE, PHONE = (1280, 800), (360, 740)

# Nothing but loopback is resolved, whatever a page asks for; the renderer is the same on every machine.
_ARGUMENTS = [
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE localhost, EXCLUDE 127.0.0.1, EXCLUDE [::1]",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage",
    "--disable-gpu", "--force-color-profile=srgb", "--js-flags=--expose-gc", "--enable-precise-memory-info",
]  # fmt: skip
_ALLOWED = re.compile(r"(file|data|blob|about):|(https?|wss?)://(127\.0\.0\.1|localhost|\[::1\])([:/]|$)")
# A violation of the policy also prints to the console, but not where a page only reports it.
_WATCH_POLICY = """addEventListener("securitypolicyviolation", event =>
  console.error(`policy violated: ${event.violatedDirective} by ${event.blockedURI}`))"""
_PATIENCE = 300_000  # milliseconds, against a hang: two busy cores start a page slowly


def missing() -> str | None:
    """Return why there is no browser for tests, or None if there is one."""
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return "playwright is not installed; pip install -e '.[test]'"
    if executable() is None:
        return f"no browser: none of {', '.join(NAMES)} is on the path; apt-get install chromium"
    return None


def executable() -> str | None:
    """Return the path of the browser, or None if there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@contextlib.contextmanager
def started() -> Iterator[tuple[Browser, asyncio.AbstractEventLoop]]:
    """Start the browser and yield it with the event loop that drives it.

    The loop is not the running one: playwright leaves it so as long as the browser lives, and asyncio.run and Dask
    refuse to work then. `driving` makes it so.
    """
    from playwright.sync_api import sync_playwright

    browsers = sync_playwright().start()
    loop = asyncio.get_running_loop()
    try:
        root = getattr(os, "geteuid", lambda: 1)() == 0
        browser = browsers.chromium.launch(
            executable_path=executable(), args=[*_ARGUMENTS, *(["--no-sandbox"] if root else [])]
        )
        asyncio._set_running_loop(None)
        yield browser, loop
        asyncio._set_running_loop(loop)
        browser.close()
    finally:
        asyncio._set_running_loop(loop)
        browsers.stop()
        asyncio._set_running_loop(None)


@contextlib.contextmanager
def driving(loop: asyncio.AbstractEventLoop) -> Iterator[None]:
    """Make the loop of a browser the running one."""
    asyncio._set_running_loop(loop)
    try:
        yield
    finally:
        asyncio._set_running_loop(None)


class Problems:
    """What went wrong on pages: errors of scripts and on the console, violated policies, requests that leave the machine.

    A test fails at its end if there is any that it did not expect.
    """

    def __init__(self) -> None:
        self.found: list[str] = []
        self._expected: list[str] = []

    def expect(self, pattern: str) -> None:
        """Accept problems in whose text the regular expression is found."""
        self._expected.append(pattern)

    def unexpected(self) -> list[str]:
        """Return the problems that were not expected."""
        return [text for text in self.found if not any(re.search(pattern, text) for pattern in self._expected)]

    @contextlib.contextmanager
    def watch(self, context: BrowserContext) -> Iterator[None]:
        """Note the problems of all pages of a context meanwhile."""
        watched = {
            "console": self._on_console,
            "weberror": lambda error: self.found.append(f"error of a script: {error.error}"),
            "request": self._on_request,
            "page": self._on_page,
        }
        for name, heard in watched.items():
            context.on(name, heard)
        yield
        for name, heard in watched.items():
            context.remove_listener(name, heard)

    def _on_page(self, page: Page) -> None:
        page.on("websocket", lambda socket: self._on_address("socket", socket.url))
        page.on("crash", lambda page: self.found.append("the page crashed"))

    def _on_console(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.found.append(f"console: {message.text} ({message.location.get('url')})")

    def _on_request(self, request: Request) -> None:
        self._on_address("request", request.url)

    def _on_address(self, kind: str, address: str) -> None:
        if not _ALLOWED.match(address):
            self.found.append(f"{kind} that leaves the machine: {address[:200]}")


class Pages:
    """Makes pages, each in a context that no other open page is in; another test may have used it before.

    Pages keep nothing in it, neither cookies nor a storage.
    """

    _FREE: ClassVar[dict[tuple[Any, ...], list[BrowserContext]]] = {}

    def __init__(self, browser: Browser, problems: Problems) -> None:
        self._browser = browser
        self.problems = problems
        self.made: list[Page] = []
        self._used: list[tuple[tuple[Any, ...], BrowserContext]] = []
        self._watched = contextlib.ExitStack()

    def __call__(self, *, size: tuple[int, int] = WIDE, dark: bool = False, reduced_motion: bool = False) -> Page:
        """Return a new page.

        Parameters
        ----------
        size : (int, int)
            Width and height of the screen [pixels]; `PHONE` is also touched instead of clicked.
        dark, reduced_motion : bool
            What the person prefers.
        """
        is_phone = size == PHONE
        facts: dict[str, Any] = {
            "viewport": {"width": size[0], "height": size[1]},
            "color_scheme": "dark" if dark else "light",
            "reduced_motion": "reduce" if reduced_motion else "no-preference",
            "has_touch": is_phone, "is_mobile": is_phone, "device_scale_factor": 2 if is_phone else 1,
            "locale": "en-GB",
        }  # fmt: skip
        key = (self._browser, size, dark, reduced_motion)
        free = self._FREE.setdefault(key, [])
        context = free.pop() if free else self._browser.new_context(**facts)
        # A blank page that is never closed keeps the window, which takes the longest to make.
        if not context.pages:
            context.add_init_script(_WATCH_POLICY)
            context.new_page()
        self._used.append((key, context))
        self._watched.enter_context(self.problems.watch(context))
        context.set_default_timeout(_PATIENCE)
        self.made.append(context.new_page())
        return self.made[-1]

    def close(self) -> None:
        """Close all pages and leave their contexts, empty, to other tests."""
        for key, context in self._used:
            for page in context.pages[1:]:
                page.close()
            self._FREE[key].append(context)
        self._watched.close()


def unreached(page: Page, inside: str = "body") -> list[str]:
    """Go through what a selector finds by Tab; return controls that are not reached or whose focus cannot be seen.

    Of radio buttons of one name the chosen one is a stop.
    """
    count = page.evaluate("""(inside) => {
        window.stops = [...document.querySelectorAll('a[href], button, input, select, textarea, summary, [tabindex="0"]')]
            .filter((one) => !one.disabled && one.tabIndex >= 0 && one.checkVisibility({ visibilityProperty: true })
                && one.closest(inside) && !one.closest('[inert]') && !(one.type === 'radio' && !one.checked));
        window.seen = new Set();
        document.activeElement.blur();
        if (inside !== 'body') window.stops[0].focus();
        return window.stops.length;
    }""", inside)  # fmt: skip
    if inside != "body":
        # Back to what comes before.
        page.keyboard.press("Shift+Tab")
    unseen = []
    for _ in range(count + 5):
        page.keyboard.press("Tab")
        # A focus that cannot be seen helps nobody.
        unseen += page.evaluate("""() => {
            const one = document.activeElement;
            if (!window.stops.includes(one)) return [];
            window.seen.add(one);
            const { outlineStyle, outlineWidth, boxShadow } = getComputedStyle(one);
            return outlineStyle !== 'none' && outlineWidth !== '0px' || boxShadow !== 'none' ? [] : [one.outerHTML.slice(0, 90)];
        }""")
    missed = "() => window.stops.filter((one) => !window.seen.has(one)).map((one) => one.outerHTML.slice(0, 90))"
    return [f"no focus is seen: {one}" for one in unseen] + [f"not reached: {one}" for one in page.evaluate(missed)]


def skip_or_fail(reason: str) -> None:
    """Skip a test that needs a browser; where TEAMSIGHT_BROWSER is "required", as in CI that has one, fail instead."""
    if os.environ.get("TEAMSIGHT_BROWSER") == "required":
        pytest.fail(reason)
    pytest.skip(reason)
