"""The gallery: MkDocs runs the code of docs/gallery.md and puts the recordings that it writes on the site.

Recordings of the site share one script and one style. Those whose names differ in a number, as in `delta=8.html`,
become one page with a slider. Each part of "Recordings" becomes a page, with a card that links to it in the gallery;
the card shows a film, a strip of frames.
"""

from __future__ import annotations

import contextlib
import html
import io
import json
import posixpath
import re
import runpy
import tempfile
import warnings
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from PIL import Image

from teamsight.view.drawing import _CHART, _HEAD, _LEGEND, Drawing
from teamsight.view.page import asset
from teamsight.view.replay import Replay

ROOT = Path(__file__).resolve().parents[1]
GALLERY = "gallery.md"
# The frames of a film and its size [pixels]; a card plays them in two seconds.
FRAMES, EVERY, WIDTH, HEIGHT = 24, 3, 320, 240
# Names of numbers that a slider changes, where they are not those of the files.
SYMBOLS = {"delta": "δ"}
# A page that is opened from a folder has no origin, so its files are allowed by their scheme.
POLICY = "default-src 'none'; script-src 'self' file:; style-src 'self' file:; img-src data: blob:"
SECTION = re.compile(r"^### (?P<title>.+)\n(?P<body>(?:(?!^##).*\n?)*)", re.MULTILINE)
WORDS = re.compile(r"^\*Words: (.+)\.\*$", re.MULTILINE)
LINK = re.compile(r"\[([^\]]+)\]\(([^)\s]+)\)")


class Entry(NamedTuple):
    """A part of the gallery: its title, its text in Markdown, the name of its recording, and words to find it by."""

    title: str
    body: str
    name: str
    words: list[str]

    @property
    def slug(self) -> str:
        """The anchor of its title."""
        return self.title.lower().replace(" ", "-").replace("'", "")

    @property
    def place(self) -> str:
        """Its page of the site, less its ending."""
        return f"gallery/code/{self.slug}"

    @property
    def sentence(self) -> str:
        """Its first paragraph, as text."""
        return LINK.sub(r"\1", " ".join(self.body.strip().split("\n\n")[0].split()))


def entries(text: str) -> list[Entry]:
    """Return the parts of the gallery that have words.

    Parameters
    ----------
    text : str
        The gallery, in Markdown.

    Raises
    ------
    ValueError
        If one has no words, or not one recording.
    """
    found = []
    for part in SECTION.finditer(text):
        words, names = WORDS.findall(part["body"]), re.findall(r'<iframe src="gallery/([\w-]+)\.html"', part["body"])
        if len(words) != 1 or len(names) != 1:
            raise ValueError(f"{GALLERY}: {part['title']!r} needs one recording, and one line *Words: task, box.*")
        found.append(Entry(part["title"], part["body"], names[0], LINK.sub(r"\1", words[0]).split(", ")))
    return found


@cache
def recordings() -> tuple[dict[str, str], dict[str, bytes]]:
    """Return the pages that the code of the gallery writes and the films, by names. Each build makes them once."""
    text = (ROOT / "docs" / GALLERY).read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE))
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        # A file, because kernels are looked up by their source.
        script = Path(folder) / "gallery.py"
        script.write_text(code, encoding="utf-8")
        with warnings.catch_warnings():
            # Policies in Python make their steps one by one.
            warnings.simplefilter("ignore")
            runpy.run_path(str(script))
        files = sorted(Path(folder).glob("*.html"))
        films = {file.stem: film(Replay.open(file)) for file in files if "=" not in file.stem}
        return site_pages({file.stem: file.read_text(encoding="utf-8") for file in files}), films


def site_pages(pages: dict[str, str]) -> dict[str, str]:
    """Return recordings as pages that share their script; those whose names differ in a number as one page.

    Parameters
    ----------
    pages : dict of str
        The pages that teamsight wrote, by their names.
    """
    made: dict[str, str] = {}
    families: dict[str, dict[float, dict[str, Any]]] = {}
    for name, page in pages.items():
        title = html.unescape(page[page.index("<title>") + 7 : page.index("</title>")])
        start = page.index('id="replay">') + len('id="replay">')
        data = _rounded(json.loads(page[start : page.index("</script>", start)]))
        family, _, number = name.partition("=")
        if number:
            families.setdefault(family, {})[float(number)] = data["tracks"][0]
        else:
            made[name] = _page(title, "replay", data)
    for family, runs in families.items():
        label = SYMBOLS.get(family, family.capitalize())
        numbers = sorted(runs)
        data = {"label": label, "values": [f"{one:g}" for one in numbers], "runs": [runs[one] for one in numbers]}
        made[family] = _page(label, "runs", data, "slider")
    return made


def _rounded(value: Any) -> Any:
    """Return values of JSON whose fractions have five places: outlines of many corners take a third of the room."""
    if isinstance(value, float):
        return round(value, 5)
    if isinstance(value, list):
        return [_rounded(one) for one in value]
    return {key: _rounded(one) for key, one in value.items()} if isinstance(value, dict) else value


def _page(title: str, name: str, data: dict[str, Any], *more: str) -> str:
    """Return a page that plays the data of an element of this name."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    files = ("view", *more)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n"
        + "".join(f'<link rel="stylesheet" href="../assets/{file}.css">' for file in files)
        + '</head>\n<body><main id="teamsight"></main>\n'
        "<noscript>This recording plays in a browser that runs scripts.</noscript>\n"
        f'<script type="application/json" id="{name}">{text}</script>\n'
        + "".join(f'<script src="../assets/{file}.js"></script>' for file in files)
        + "</body></html>\n"
    )


def film(replay: Replay) -> bytes:
    """Return frames of a recording, one below the other, from a third of its length on; a WebP picture.

    Parameters
    ----------
    replay : Replay
        The recording.
    """
    def arena(drawing: Drawing, number: int) -> Image.Image:
        return Image.fromarray(drawing.show(number)[_HEAD : -(_CHART + _LEGEND)])

    drawing = Drawing(replay.tracks, WIDTH)
    height = arena(drawing, 0).height
    if height > HEIGHT:
        drawing = Drawing(replay.tracks, WIDTH * HEIGHT // height)
    strip = Image.new("RGB", (WIDTH, FRAMES * HEIGHT), "white")
    for number in range(FRAMES):
        picture = arena(drawing, min(len(replay) // 3 + EVERY * number, len(replay) - 1))
        strip.paste(picture, ((WIDTH - picture.width) // 2, number * HEIGHT + (HEIGHT - picture.height) // 2))
    buffer = io.BytesIO()
    strip.save(buffer, "webp", quality=60, method=4)
    return buffer.getvalue()


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the recordings, their films and the pages with their code to the site."""
    pages, films = recordings()
    for name, page in pages.items():
        files.append(File.generated(config, f"gallery/{name}.html", content=page))
    for name, picture in films.items():
        files.append(File.generated(config, f"gallery/films/{name}.webp", content=picture))
    for name in ("view.js", "view.css"):
        files.append(File.generated(config, f"assets/{name}", content=asset(name)))
    found = entries((ROOT / "docs" / GALLERY).read_text(encoding="utf-8"))
    for number, entry in enumerate(found):
        text = code_page(entry, found[number - 1], found[(number + 1) % len(found)])
        files.append(File.generated(config, f"{entry.place}.md", content=text))
    return files


def code_page(entry: Entry, before: Entry, after: Entry) -> str:
    """Return the page of an entry: its text, its recording and its code, with links to its neighbours."""
    folder = posixpath.dirname(entry.place)

    def moved(found: re.Match[str]) -> str:
        return f"[{found[1]}]({posixpath.relpath(found[2], folder)})" if "://" not in found[2] else found[0]

    body = LINK.sub(moved, entry.body).replace('src="gallery/', 'src="../')
    # It is why one has come here.
    body = re.sub(r"<details markdown=\"1\">\n<summary>.*</summary>\n|</details>\n", "", body)
    around = f"[← {before.title}]({before.slug}.md) · [Gallery](../../gallery.md) · [{after.title} →]({after.slug}.md)"
    return f"---\nhide:\n  - navigation\n  - toc\n---\n\n# {entry.title}\n{body}\n{around}\n"


def card(entry: Entry) -> str:
    """Return the link to an entry: its film, its title, a sentence and its words."""
    words = html.escape(" · ".join(entry.words))
    return (
        f'<a class="ts-card" id="{entry.slug}" href="{entry.place}.html">'
        f'<span class="ts-film"><img src="gallery/films/{entry.name}.webp" alt="" loading="lazy" width="{WIDTH}" '
        f'height="{HEIGHT * FRAMES}"></span><b>{html.escape(entry.title)}</b>'
        f"<span>{html.escape(entry.sentence)}</span><small>{words}</small></a>"
    )


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Show the parts of the gallery as cards."""
    if page.file.src_uri != GALLERY:
        return markdown
    cards = "\n".join(map(card, entries(markdown)))
    return SECTION.sub("", markdown).rstrip() + f'\n\n<div class="ts-cards">\n{cards}\n</div>\n'
