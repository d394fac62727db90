"""Check a built site: it loads nothing from other hosts, its links lead somewhere, and its search knows the pages.

Run it as ``python .ci/check_site.py build/site``. It prints one line for each fault and exits with 1 if there is any.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes that load what they name; a link that a reader may follow is not among them.
LOADS = {
    "audio": ("src",), "embed": ("src",), "iframe": ("src",), "img": ("src", "srcset"), "input": ("src",),
    "link": ("href",), "object": ("data",), "script": ("src",), "source": ("src", "srcset"), "video": ("src", "poster"),
}  # fmt: skip
# `rel` of links that load nothing.
HARMLESS = {"next", "prev", "canonical", "author", "license"}
IN_STYLE = re.compile(r"""(?:url\(\s*["']?|@import\s+["'])((?:https?:)?//[^"')\s]+)""")
# Scripts name other hosts in comments on their licence, and in the names of XML languages.
IN_SCRIPT = re.compile(r"""["'`](https?://(?!www\.w3\.org/)[^"'`\s]+)""")


class Page(HTMLParser):
    """What a page loads, where its links lead, and the anchors that it has.

    Parameters
    ----------
    text : str
        The page.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.scripts = ""
        self.inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.inside = tag
        self.anchors.update(given[name] for name in ("id", "name") if name in given)
        if not (tag == "link" and set(given.get("rel", "").split()) <= HARMLESS):
            self.loads += [given[name] for name in LOADS.get(tag, ()) if name in given]
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        self.loads += IN_STYLE.findall(given.get("style", ""))

    def handle_data(self, data: str) -> None:
        if self.inside == "style":
            self.loads += IN_STYLE.findall(data)
        elif self.inside == "script":
            self.scripts += data

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""


def is_foreign(address: str) -> bool:
    """Return whether an address is on another host."""
    parts = urlsplit(address)
    return bool(parts.netloc) or parts.scheme not in ("", "data", "blob")


def loaded(site: Path) -> Iterator[str]:
    """Yield a line for each thing that a file of the site would load from another host."""
    for file in sorted(site.rglob("*")):
        name = file.relative_to(site).as_posix()
        if file.suffix == ".html":
            page = Page(file.read_text(encoding="utf-8"))
            scripts = re.sub(r'^\s*\{.*\}\s*$', "", page.scripts, flags=re.DOTALL)
            for address in [*filter(is_foreign, page.loads), *IN_SCRIPT.findall(scripts)]:
                yield f"{name}: loads {address}"
        elif file.suffix == ".css":
            for address in IN_STYLE.findall(file.read_text(encoding="utf-8")):
                yield f"{name}: loads {address}"
        elif file.suffix == ".js" and not name.startswith("search/"):
            for address in IN_SCRIPT.findall(file.read_text(encoding="utf-8")):
                yield f"{name}: may load {address}"


def broken(site: Path) -> Iterator[str]:
    """Yield a line for each link within the site that leads nowhere, and for each that needs an address of the site."""
    pages = {file: Page(file.read_text(encoding="utf-8")) for file in site.rglob("*.html")}
    for file, page in sorted(pages.items()):
        name = file.relative_to(site).as_posix()
        for link in (*page.links, *page.loads):
            parts = urlsplit(link)
            if is_foreign(link) or parts.scheme:
                continue
            # The page for addresses that do not exist is served under any of them.
            if link.startswith("/") and name != "404.html":
                yield f"{name}: {link} works at the root of a host only"
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            if name == "404.html":
                continue
            if not target.is_file():
                yield f"{name}: {link} does not exist"
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                yield f"{name}: {link}: no such anchor"


def unknown_to_search(site: Path) -> Iterator[str]:
    """Yield a line for each page of the navigation that the search does not know."""
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    known = {entry["location"].partition("#")[0] for entry in index["docs"]}
    for file in sorted(site.rglob("*.html")):
        name = file.relative_to(site).as_posix()
        if name not in known and name != "404.html" and not name.startswith(("source/", "gallery/")):
            yield f"{name}: not in the search"


def main(site: Path) -> int:
    """Print what is wrong with a site, and return the exit status."""
    site = site.resolve()
    if not (site / "index.html").is_file():
        print(f"{site}: is not a built site; build it with mkdocs build")
        return 1
    faults = [*loaded(site), *broken(site), *unknown_to_search(site)]
    pages = sum(1 for _ in site.rglob("*.html"))
    size = sum(file.stat().st_size for file in site.rglob("*") if file.is_file())
    print("\n".join(faults) or f"{pages} pages, {size / 1e6:.1f} MB; nothing is loaded from other hosts")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
