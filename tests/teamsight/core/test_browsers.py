"""Whether there is a browser, and what happens if it does not open."""

from __future__ import annotations

import sys
import webbrowser
from typing import Any

import pytest

from teamsight.core import browsers

SCREEN = {"DISPLAY": ":0"}


@pytest.mark.parametrize(
    ("platform", "environment", "name", "expected"),
    [
        ("linux", {}, "xdg-open", False),
        ("linux", SCREEN, "xdg-open", True),
        ("linux", {"WAYLAND_DISPLAY": "wayland-0"}, "firefox", True),
        ("linux", SCREEN, "/usr/bin/www-browser", False),
        ("linux", SCREEN, "w3m", False),
        ("linux", SCREEN, None, False),
        ("linux", {"BROWSER": "/opt/helper"}, "/opt/helper", True),
        ("linux", {"BROWSER": "lynx"}, "lynx", False),
        ("linux", {"SSH_CONNECTION": "a b"}, "xdg-open", False),
        ("linux", {"SSH_CONNECTION": "a b", **SCREEN}, "firefox", True),
        ("darwin", {}, "default", True),
        ("darwin", {"SSH_CONNECTION": "a b"}, "default", False),
        ("win32", {}, "windows-default", True),
    ],
)
def test_a_browser_is_one_that_the_person_sees(
    monkeypatch: pytest.MonkeyPatch, platform: str, environment: dict[str, str], name: str | None, expected: bool
) -> None:
    for variable in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER", "SSH_CONNECTION"):
        monkeypatch.delenv(variable, raising=False)
    for variable, value in environment.items():
        monkeypatch.setenv(variable, value)
    monkeypatch.setattr(sys, "platform", platform)

    def get() -> Any:
        if name is None:
            raise webbrowser.Error("could not locate runnable browser")
        return webbrowser.GenericBrowser(name)

    monkeypatch.setattr(webbrowser, "get", get)
    assert browsers.has_browser() is expected


def test_a_browser_that_fails_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(address: str) -> bool:
        raise webbrowser.Error("could not locate runnable browser")

    monkeypatch.setattr(browsers, "has_browser", lambda: True)
    monkeypatch.setattr(webbrowser, "open", fail)
    assert browsers.show("http://127.0.0.1:1/") is False


def test_without_a_browser_nothing_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(browsers, "has_browser", lambda: False)
    monkeypatch.setattr(webbrowser, "open", lambda address: pytest.fail("opened"))
    assert browsers.show("http://127.0.0.1:1/") is False
