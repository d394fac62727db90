"""Whether this machine has a browser that a person sees, and opening it."""

from __future__ import annotations

import os
import sys

_IN_A_TERMINAL = ("www-browser", "links", "elinks", "lynx", "w3m")


def has_browser() -> bool:
    """Return whether a page can be opened on the screen of the person who typed the command.

    There is none over SSH, or on Linux without a graphical session, unless the variable BROWSER names one.
    Browsers that show text in a terminal do not count.
    """
    import webbrowser

    if not os.environ.get("BROWSER"):
        screen = any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))
        windows_or_mac = sys.platform in ("win32", "darwin")
        if not screen and (not windows_or_mac or os.environ.get("SSH_CONNECTION")):
            return False
    try:
        found = webbrowser.get()
    except webbrowser.Error:
        return False
    return os.path.basename(getattr(found, "name", "")) not in _IN_A_TERMINAL


def show(address: str) -> bool:
    """Open an address in the browser, and return whether that was possible.

    Parameters
    ----------
    address : str
        An address that begins with ``http:`` or ``file:``.
    """
    import webbrowser

    if not has_browser():
        return False
    try:
        return webbrowser.open(address)
    except (webbrowser.Error, OSError):
        return False
