"""The gallery: MkDocs runs the code of docs/gallery.md and puts the recordings that it writes on the site."""

from __future__ import annotations

import contextlib
import re
import runpy
import tempfile
import warnings
from functools import cache
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]


@cache
def recordings() -> dict[str, str]:
    """Return the pages that the code of the gallery writes, by the names of their files. Each build makes them once."""
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE))
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        # A file, because kernels are looked up by their source.
        script = Path(folder) / "gallery.py"
        script.write_text(code, encoding="utf-8")
        with warnings.catch_warnings():
            # Policies in Python make their steps one by one.
            warnings.simplefilter("ignore")
            runpy.run_path(str(script))
        return {page.name: page.read_text(encoding="utf-8") for page in sorted(Path(folder).glob("*.html"))}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the recordings to the site."""
    for name, page in recordings().items():
        files.append(File.generated(config, f"gallery/{name}", content=page))
    return files
