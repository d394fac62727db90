"""What MkDocs does beyond its plugins: pages of files outside docs/ to which pages link, and nothing of other hosts.

The pages link to files of the repository as they lie in it, so that links also work where the repository is shown. On
the site such a file is a page: CHANGELOG.md and CONTRIBUTING.md as they are, source code in a block.
"""

from __future__ import annotations

import posixpath
import re
import shutil
import sys
from collections.abc import Iterator
from html import escape
from pathlib import Path
from urllib.parse import urljoin

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

sys.path.append(str(Path(__file__).parent))
import tutorial_notebook  # beside this file, which MkDocs loads by its path

ROOT = Path(__file__).resolve().parents[1]
# Pages outside docs/ that have a place of their own in the navigation.
TOP = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md", "README.md": "index.md"}
LINK = re.compile(r"(\]\()([^)\s#]+)(#[^)\s]*)?(\))")
# Addresses that the scripts of the theme would load if a page had a diagram, a repository, or an old browser.
FOREIGN = re.compile(rb"https://(?:unpkg\.com|api\.github\.com|\$\{\w+\}/api)/")
NOT_FOUND_BY_SEARCH = "search:\n  exclude: true\n"
# What counts more, or less, among the pages that a search finds.
BOOSTS = {
    "tutorial.md": 8.0, "studies.md": 6.0, "policies.md": 4.0, "sensors.md": 4.0, "delta.md": 4.0, "recordings.md": 4.0,
    "watch.md": 4.0, "learning.md": 2.0, "benchmarks.md": 0.7, "reference/": 0.5, "gallery/": 0.5, "changelog.md": 0.2,
}  # fmt: skip
# What people type that pages say otherwise.
SOUGHT = {"delta.md": ["delta"], "studies.md": ["study"]}
# The tutorial as a notebook, beside its page.
NOTEBOOK = "tutorial.ipynb"
# Code is wide, and needs no table of contents.
WIDE = "---\nhide:\n  - navigation\n  - toc\n{}---\n\n"


def place_on_site(path: str) -> str:
    """Return which page of the site shows a file or folder of the repository.

    Parameters
    ----------
    path : str
        Where it is, from the root of the repository.
    """
    if path in TOP:
        return TOP[path]
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if (ROOT / path).is_dir():
        return f"source/{path}/index.md"
    return f"source/{path}.md"


def linked(path: str, text: str) -> Iterator[tuple[re.Match[str], str]]:
    """Yield each link of a page to a file or folder of the repository, with its path from the root."""
    for found in LINK.finditer(text):
        if "://" in found[2] or found[2].startswith("mailto:"):
            continue
        yield found, posixpath.normpath(posixpath.join(posixpath.dirname(path), found[2]))


def rewritten(path: str, page: str, text: str) -> str:
    """Return the text of a page with its links to files of the repository made links to pages of the site.

    Parameters
    ----------
    path : str
        The file of the repository from which the links lead.
    page : str
        The page of the site that shows it.
    text : str
        Its content.
    """
    for found, target in reversed(list(linked(path, text))):
        if (ROOT / target).exists() and (path in TOP or not target.startswith("docs/")):
            link = posixpath.relpath(place_on_site(target), posixpath.dirname(page) or ".")
            text = text[: found.start(2)] + link + text[found.end(2) :]
    return text


def source_page(path: str) -> str:
    """Return a page that shows a file of source code, or lists the Python files of a folder."""
    if (ROOT / path).is_dir():
        rows = [f"- [`{file.name}`]({file.name}.md)" for file in sorted((ROOT / path).glob("*.py"))]
        return f"{WIDE.format(NOT_FOUND_BY_SEARCH)}# `{path}/`\n\n" + "\n".join(rows) + "\n"
    file = ROOT / path
    try:
        text = file.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        text = f"{file.stat().st_size:,} bytes that are not text"
    language = {".py": "python", ".toml": "toml"}.get(file.suffix, "text")
    return f"{WIDE.format(NOT_FOUND_BY_SEARCH)}# `{path}`\n\n`````{language}\n{text}`````\n"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of files outside docs/: those of `TOP`, and all to which a page links."""
    pages = {f"docs/{file.src_uri}": file.content_string for file in files.documentation_pages()}
    for path in TOP:
        text = (ROOT / path).read_text(encoding="utf-8")
        if path != "README.md":
            pages[path] = text
            files.append(File.generated(config, TOP[path], content=rewritten(path, TOP[path], text)))
    files.append(File.generated(config, NOTEBOOK, content=tutorial_notebook.content()))
    wanted = {target for path, text in pages.items() for _, target in linked(path, text) if (ROOT / target).exists()}
    wanted = {path for path in wanted if path not in TOP and path.split("/")[0] not in ("docs", "..")}
    folders = [path for path in wanted if (ROOT / path).is_dir()]
    wanted |= {f"{folder}/{file.name}" for folder in folders for file in (ROOT / folder).glob("*.py")}
    for path in sorted(wanted):
        files.append(File.generated(config, place_on_site(path), content=source_page(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Make links to files outside docs/ links to their pages on the site, and say how much the search counts a page."""
    place = page.file.src_uri
    for beginning, boost in BOOSTS.items():
        if place.startswith(beginning):
            page.meta.setdefault("search", {}).setdefault("boost", boost)
    if place in SOUGHT:
        page.meta["tags"] = SOUGHT[place]
    # Those that were made here have been rewritten, from where their files are.
    if place.startswith("source/") or place in (TOP["CHANGELOG.md"], TOP["CONTRIBUTING.md"]):
        return markdown
    if place == "tutorial.md":
        # In the repository there is no such file.
        first, _, rest = markdown.partition("\n")
        markdown = f"{first}\n\nThis page is also [a notebook]({NOTEBOOK}){{ download }}, with the same code.\n{rest}"
    return rewritten(f"docs/{place}", place, markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let the names of settings break over lines at the heads of tables, between their words."""

    def breaking(found: re.Match[str]) -> str:
        return found[1] + re.sub("[_(=]", r"\g<0><wbr>", found[2])

    return re.sub(r"(<th\b[^>]*>)([^<]*)(?=</th>)", breaking, html)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Name the file in links to the first page, which lead to a folder: opened from a disk, it would be listed.

    If the address of the site is known, links to a page show a card elsewhere, whose picture needs a full address.
    """
    output = re.sub(r'href="(\.\.?(?:/\.\.)*)"', r'href="\1/index.html"', output)
    if not config.site_url:
        return output
    card = {
        "og:type": "website",
        "og:title": config.site_name if page.is_homepage else f"{page.title} · {config.site_name}",
        "og:url": page.canonical_url,
        "og:description": config.site_description, "og:image": urljoin(config.site_url, "images/social-card.png"),
        "twitter:card": "summary_large_image",
    }  # fmt: skip
    tags = [f'<meta property="{name}" content="{escape(str(value))}">' for name, value in card.items()]
    return output.replace("</head>", "\n".join([*tags, "</head>"]), 1)


def on_post_build(config: MkDocsConfig) -> None:
    """Remove from the scripts of the theme the addresses of other hosts, and the maps of their source code.

    The search of the theme also needs all words of a query.
    """
    scripts = Path(config.site_dir) / "assets" / "javascripts"
    # Only the search of sites in other languages loads these.
    shutil.rmtree(scripts / "lunr", ignore_errors=True)
    for script in scripts.rglob("*.js"):
        code = FOREIGN.sub(b"about:blank#", script.read_bytes())
        script.write_bytes(re.sub(rb"//# sourceMappingURL=\S+", b"", code))
    (worker,) = scripts.glob("workers/search.*.js")
    worker.write_bytes((ROOT / ".ci" / "site_search.js").read_bytes() + worker.read_bytes())
    for source_map in [*(Path(config.site_dir) / "assets").rglob("*.map")]:
        source_map.unlink()
