"""Opening a page in the user's browser."""

from __future__ import annotations

import os
import sys

_DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def show(url: str) -> bool:
    """Open an address in the browser; return whether there is one.

    Without a display, as over SSH, nothing is opened: a browser in the terminal would show no canvas.

    Parameters
    ----------
    url : str
        The address.
    """
    if sys.platform not in ("win32", "darwin") and not any(map(os.environ.get, _DISPLAYS)):
        return False
    import webbrowser

    try:
        return webbrowser.open(url)
    except webbrowser.Error:
        return False
