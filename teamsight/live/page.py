"""The page as HTML: one file with its styles and scripts, and the headers that let it do nothing else."""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from html import escape
from importlib import resources

_TEMPLATE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>{view_css}</style>
<style>{live_css}</style>
</head>
<body>
<main id="teamsight"></main>
<script>{view_js}</script>
<script>{live_js}</script>
</body>
</html>
"""


@cache
def _asset(package: str, name: str) -> str:
    return (resources.files(package) / "assets" / name).read_text(encoding="utf-8")


def _assets() -> dict[str, str]:
    return {
        "view_css": _asset("teamsight.view", "view.css"),
        "live_css": _asset("teamsight.live", "live.css"),
        "view_js": _asset("teamsight.view", "view.js"),
        "live_js": _asset("teamsight.live", "live.js"),
    }


def html(title: str) -> str:
    """Return the page.

    Parameters
    ----------
    title : str
        Its title.
    """
    return _TEMPLATE.format(title=escape(title), **_assets())


def headers(host: str) -> dict[str, str]:
    """Return the headers of the page: only its own scripts and styles, and only its own socket.

    Parameters
    ----------
    host : str
        The Host header of the request, which has been checked.
    """
    assets = _assets()
    scripts, styles = (
        " ".join(f"'sha256-{_digest(assets[name])}'" for name in names)
        for names in (("view_js", "live_js"), ("view_css", "live_css"))
    )
    policy = (
        f"default-src 'none'; script-src {scripts}; style-src {styles}; img-src data: blob:; "
        f"connect-src ws://{host} wss://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return {
        "Content-Type": "text/html; charset=utf-8",
        "Content-Security-Policy": policy,
        **SAFE,
    }


#: Headers of all answers.
SAFE = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def _digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
