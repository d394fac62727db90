"""Make a Jupyter notebook of docs/tutorial.md, so that there is no second text: `tutorial_notebook.py FILE.ipynb`.

The site has it as a download; see site_hooks.py. Its cells show what the page shows until they are run.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "docs" / "tutorial.md"
_FENCE = re.compile(r"^```(\w*)\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)
_NAMED = re.compile(r"# ([\w-]+\.\w+)\n")
_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:)[^)]+\)")


def notebook(text: str) -> dict[str, Any]:
    """Return a page as a notebook of format 4.5.

    Parameters
    ----------
    text : str
        The page. Its Python blocks become cells of code, blocks of text below them their outputs; a block that begins
        with the name of a file writes it, and one of sh runs commands.
    """
    cells: list[dict[str, Any]] = []
    end = 0
    for found in _FENCE.finditer(text):
        language, content = found.groups()
        between = text[end : found.start()].strip()
        if language == "text" and not between and cells and cells[-1]["cell_type"] == "code":
            output = {"output_type": "stream", "name": "stdout", "text": content}
            cells[-1]["outputs"] = [output]
            end = found.end()
            continue
        code = _code(language, content)
        if code is None:
            # It stays in the text, as how to install.
            continue
        if between:
            cells.append(_cell("markdown", between))
        cells.append(_cell("code", code) | {"execution_count": None, "outputs": []})
        end = found.end()
    if rest := text[end:].strip():
        cells.append(_cell("markdown", rest))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    for number, cell in enumerate(cells):
        cell["id"] = f"tutorial-{number}"
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def _code(language: str, content: str) -> str | None:
    """Return the cell of a block; None if it stays text."""
    if language == "python":
        return content.rstrip()
    if named := _NAMED.match(content):
        return f"%%writefile {named[1]}\n{content[named.end() :].rstrip()}"
    if language == "sh":
        return "\n".join(f"!{line}" for line in content.splitlines() if line.strip())
    return None


def _cell(kind: str, source: str) -> dict[str, Any]:
    # Links lead to pages, which are not beside a file that somebody has downloaded.
    text = _LINK.sub(r"\1", source) if kind == "markdown" else source
    return {"cell_type": kind, "metadata": {}, "source": text}


def content() -> str:
    """Return the notebook of the tutorial as the content of a file."""
    return json.dumps(notebook(PAGE.read_text(encoding="utf-8")), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(content(), encoding="utf-8")
