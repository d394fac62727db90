"""The site is built strictly, loads nothing from other hosts, and has a reference of all public names."""

from __future__ import annotations

import importlib
import os
import re
import runpy
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CHECK = runpy.run_path(str(ROOT / ".ci" / "check_site.py"))
# What users import. The parts of other packages are reached through these.
PUBLIC = (
    "teamsight", "teamsight.agents", "teamsight.agents.awareness", "teamsight.agents.components",
    "teamsight.agents.events", "teamsight.agents.sensing", "teamsight.analysis.contacts", "teamsight.analysis.delta",
    "teamsight.analysis.papers.gathering", "teamsight.env", "teamsight.live", "teamsight.policies", "teamsight.tasks",
    "teamsight.view", "teamsight.world",
)  # fmt: skip
NEEDED = ("mkdocs", "material", "mkdocstrings")


@pytest.mark.skipif(
    not all(map(find_spec, NEEDED)), reason="the site is built by the extra docs: pip install 'teamsight[docs]'"
)
def test_the_site_is_built_strictly_and_is_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    site = tmp_path / "site"
    environment = dict(os.environ, PYTHONPATH=str(ROOT), NO_MKDOCS_2_WARNING="1", http_proxy="http://127.0.0.1:9")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(site)]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert CHECK["main"](site) == 0, capsys.readouterr().out
    page = (site / "sensors.html").read_text(encoding="utf-8")
    assert 'href="reference/teamsight.agents.sensing.View.html#teamsight.agents.sensing.View"' in page
    # Each class has a page; the page of its topic lists it.
    worlds = (site / "reference" / "teamsight.World.html").read_text(encoding="utf-8")
    listed = (site / "reference" / "worlds.html").read_text(encoding="utf-8")
    assert '<a href="teamsight.World.html"><code>World</code></a>: ' in listed
    assert 'id="teamsight.World"' not in listed
    for method in ("add", "run", "step", "record", "senses", "attach"):
        assert f'id="teamsight.World.{method}"' in worlds
    # The values of defaults, not the names of private constants.
    for reference in (site / "reference").glob("*.html"):
        text = re.sub(r"<[^>]+>", "", reference.read_text(encoding="utf-8"))
        assert not re.search(r"(?:default:\s*|(?<!check)(?<!parse)=\s?)_[A-Za-z]\w*", text), reference.name
    settings = (site / "reference" / "teamsight.agents.settings.Settings.html").read_text(encoding="utf-8")
    assert re.search(r"<b><code>radius</code></b>[^–]*default:\s*<code>.*5\.0.*</code>", settings)
    # Parameters that share an entry have the default of each.
    assert re.search(r"<b><code>targets</code></b>[^–]*default:\s*<code>15</code>", settings)
    assert (site / "source" / "examples" / "predators.py.html").is_file()
    shown = (site / "gallery.html").read_text(encoding="utf-8")
    for name in re.findall(r'<iframe[^>]* src="(gallery/[^"]+)"', shown):
        assert (site / name).stat().st_size > 10_000
    cards = re.findall(r'<a class="ts-card" id="[^"]+" href="([^"]+)"><span class="ts-film"><img src="([^"]+)"', shown)
    assert len(cards) == shown.count("ts-card\"") >= 20
    for page, film in cards:
        text = (site / page).read_text(encoding="utf-8")
        assert "<iframe" in text
        assert "record(" in re.sub(r"<[^>]+>", "", text)
        assert (site / film).stat().st_size < 150_000
    # Source code is found by its reference.
    index = (site / "search" / "search_index.json").read_text(encoding="utf-8")
    assert '"location":"source/' not in index.replace(" ", "")
    assert '"location":"tutorial.html' in index.replace(" ", "")
    # A class is found once, by the names of its parts too.
    assert '"location":"reference/teamsight.World.html#' not in index.replace(" ", "")
    assert "count_observations" in index
    # Recordings share their script.
    assert (site / "gallery" / "failures.html").stat().st_size < 90_000


def test_every_public_name_is_in_the_reference() -> None:
    pages = "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "reference").glob("*.md"))
    shown = [line.removeprefix("::: ") for line in pages.splitlines() if line.startswith("::: ")]
    assert len(shown) == len(set(shown))
    objects = [_object(name) for name in shown]
    for module in map(importlib.import_module, PUBLIC):
        for name in module.__all__:
            if name != "__version__":
                assert any(getattr(module, name) is one for one in objects), f"{module.__name__}.{name}"


def _object(name: str) -> object:
    home, _, last = name.rpartition(".")
    try:
        return getattr(importlib.import_module(home), last)
    except AttributeError:
        return importlib.import_module(name)


def test_every_page_is_in_the_navigation() -> None:
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    listed = re.findall(r"^ *- (?:[^:\n]*: )?(\S+\.md)$", text[text.index("\nnav:") :], re.MULTILINE)
    made = {"changelog.md", "contributing.md"}
    pages = {page.relative_to(ROOT / "docs").as_posix() for page in (ROOT / "docs").rglob("*.md")}
    assert sorted(listed) == sorted(pages | made)


def site_of(folder: Path, **files: str) -> Path:
    """Write a site of some files; their names have no dots, and _ is one."""
    (folder / "search").mkdir(parents=True)
    names = {name.replace("_", "."): text for name, text in files.items()}
    docs = ", ".join(f'{{"location": "{name}"}}' for name in names)
    (folder / "search" / "search_index.json").write_text(f'{{"docs": [{docs}]}}')
    for name, text in names.items():
        (folder / name).write_text(text)
    return folder


GOOD = {
    "index_html": '<link rel="stylesheet" href="a.css"><h1 id="top">x</h1><a href="b.html#here">b</a>',
    "b_html": '<a id="here" href="https://example.org">elsewhere</a><script>var space = "http://www.w3.org/2000/svg"</script>',
    "a_css": "body { background: url(data:image/png;base64,AA) }",
}


def test_a_whole_site_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert CHECK["main"](site_of(tmp_path / "site", **GOOD)) == 0
    assert capsys.readouterr().out.startswith("2 pages, 0.0 MB; nothing is loaded")


@pytest.mark.parametrize(
    ("file", "text", "fault"),
    [
        ("b_html", '<p id="here"><img src="https://example.org/a.png">', "b.html: loads https://example.org/a.png"),
        ("b_html", '<p id="here"><link rel="preconnect" href="//fonts.example.org">', "b.html: loads //fonts"),
        ("b_html", '<p id="here"><script>fetch("https://example.org/x")</script>', "b.html: loads https://example"),
        ("b_html", '<p id="here" style="background: url(http://example.org/a)">', "b.html: loads http://example"),
        ("a_css", '@import "https://fonts.example.org/css";', "a.css: loads https://fonts.example.org/css"),
        ("c_js", "import('https://unpkg.com/x')", "c.js: may load https://unpkg.com/x"),
        ("b_html", "<p>", "index.html: b.html#here: no such anchor"),
        ("b_html", '<p id="here"><a href="c.html">', "b.html: c.html does not exist"),
        ("b_html", '<p id="here"><a href="/index.html">', "b.html: /index.html works at the root of a host only"),
    ],
)
def test_a_fault_of_a_site_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], file: str, text: str, fault: str
) -> None:
    assert CHECK["main"](site_of(tmp_path / "site", **(GOOD | {file: text}))) == 1
    assert fault in capsys.readouterr().out


def test_a_page_that_the_search_does_not_know_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    site = site_of(tmp_path / "site", **GOOD)
    (site / "c.html").write_text("<p>")
    assert CHECK["main"](site) == 1
    assert capsys.readouterr().out == "c.html: not in the search\n"
    assert CHECK["main"](tmp_path) == 1
    assert "is not a built site" in capsys.readouterr().out
