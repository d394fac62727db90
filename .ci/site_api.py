"""A page for each class and function of the reference; the pages in docs/reference/ list them, a sentence for each.

Those pages say by lines `::: name` what is public and in which order, so that they also read well in the repository.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

REFERENCE = Path(__file__).resolve().parents[1] / "docs" / "reference"
# A name, and the options of its block.
BLOCK = re.compile(r"^::: (\S+)\n((?:    .*\n)*)", re.MULTILINE)
# A name in code, of several words: a method, a parameter or a setting.
NAME = re.compile(r"\b[a-z]\w*_\w+\b")
# A link to a name on one of those pages.
LINK = re.compile(r"\]\(((?:\.\./)*(?:reference/)?)(\w+)\.md#(teamsight[\w.]*)\)")


class Entry(NamedTuple):
    """A name that has a page: that on which it is listed, and the options of its block."""

    listed: str
    options: str


@cache
def entries() -> dict[str, Entry]:
    """Return all names of the reference."""
    pages = {page.stem: page.read_text(encoding="utf-8") + "\n" for page in sorted(REFERENCE.glob("*.md"))}
    return {name: Entry(stem, options) for stem, text in pages.items() for name, options in BLOCK.findall(text)}


@cache
def _package() -> Any:
    """Return the package as griffe reads it: importing its parts would need all extras."""
    constants = griffe.load_extensions(str(Path(__file__).with_name("site_constants.py")))
    loader = griffe.GriffeLoader(search_paths=[REFERENCE.parents[1]], extensions=constants)
    package = loader.load("teamsight")
    loader.resolve_aliases(implicit=True, external=False)
    return package


def _object(name: str) -> Any:
    found = _package()[name.removeprefix("teamsight.")]
    return found.final_target if found.is_alias else found


def _sentence(name: str) -> str:
    """Return the first sentence of the docstring of a name."""
    found = _object(name)
    text = " ".join((found.docstring.value if found.docstring else "").split("\n\n")[0].split())
    sentence = re.split(r"(?<=[.;:])(?<!Fig\.)(?<!Eq\.)\s", text + " ")[0].rstrip(".;: ")
    return sentence.replace("<", "&lt;")


def _listed(name: str) -> str:
    sentence = _sentence(name)
    return f"- [`{name.rpartition('.')[2]}`]({name}.md)" + (f": {sentence}." if sentence else "")


def _page(name: str, entry: Entry) -> str:
    title = re.search(r"^# (.+)$", (REFERENCE / f"{entry.listed}.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert title is not None
    options = entry.options or "    options:\n"
    return (
        f"---\ntitle: {name.rpartition('.')[2]}\n---\n\n[Reference](index.md) › [{title[1]}]({entry.listed}.md)\n\n"
        f"::: {name}\n{options}      heading_level: 1\n"
    )


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each name."""
    for name, entry in entries().items():
        files.append(File.generated(config, f"reference/{name}.md", content=_page(name, entry)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """List names in place of their blocks, and let links to them lead to their pages."""
    if page.file.src_uri.startswith("reference/") and Path(page.file.src_uri).stem not in entries():
        markdown = BLOCK.sub(lambda found: _listed(found[1]) + "\n", markdown + "\n")
        # One list, not one for each name.
        markdown = re.sub(r"(^- .*\n)\n+(?=- )", r"\1", markdown, flags=re.MULTILINE)
    known = sorted(entries(), key=len, reverse=True)

    def moved(found: re.Match[str]) -> str:
        owner = next((name for name in known if f"{found[3]}.".startswith(f"{name}.")), None)
        return found[0] if owner is None else f"]({found[1]}{owner}.md#{found[3]})"

    return LINK.sub(moved, markdown)


def on_post_build(config: MkDocsConfig) -> None:
    """Let the search find a name of the reference once, by it and by the names of its parts.

    Otherwise common words are found in the parameters of a hundred classes, beside what explains them. The sentence on
    each is found on the page that lists it.
    """
    place = Path(config.site_dir) / "search" / "search_index.json"
    index = json.loads(place.read_text(encoding="utf-8"))
    found: dict[str, dict[str, str]] = {}
    for entry in index["docs"]:
        page = entry["location"].partition("#")[0]
        if not page.startswith("reference/teamsight."):
            found[entry["location"]] = entry
            continue
        text = re.sub(r"<[^>]+>", " ", entry["text"])
        if page not in found:
            name = page.removeprefix("reference/").removesuffix(".html")
            kind = f"{_object(name).kind.value} {name.rpartition('.')[2]}"
            found[page] = {**entry, "location": page, "text": kind}
        first = found[page]
        first["text"] += " ".join(["", entry["title"], *dict.fromkeys(NAME.findall(text))])
    index["docs"] = list(found.values())
    content = json.dumps(index, ensure_ascii=False, separators=(",", ":"))
    place.write_text(content, encoding="utf-8")
    # The same for pages that are opened from a disk.
    place.with_suffix(".js").write_text(f"var __index = {content}", encoding="utf-8")
