"""The notebook of the tutorial: its cells run in order, and twice, in one namespace, and print what they show."""

from __future__ import annotations

import json
import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pages
import pytest

CI = pages.DOCS.parent / ".ci"


def made() -> Any:
    spec = spec_from_file_location("tutorial_notebook", CI / "tutorial_notebook.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def code_of(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def shown_by(cell: dict[str, Any]) -> str:
    text = "".join(output["text"] for output in cell["outputs"] if output.get("name") == "stdout")
    # Commands of a kernel run on a terminal, and show how far they are.
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|\r", "", text)


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")


def run(cell: dict[str, Any], session: pages.Session) -> str:
    """Run a cell as a notebook does, and return what it printed."""
    source = cell["source"]
    if source.startswith("%%writefile "):
        first, _, content = source.partition("\n")
        (session.folder / first.split()[1]).write_text(content, encoding="utf-8")
        return ""
    if source.startswith("!"):
        return "".join(session.command(line.removeprefix("!")) for line in source.splitlines())
    return session.python(source)


def test_it_has_all_of_the_page() -> None:
    text = (pages.DOCS / "tutorial.md").read_text(encoding="utf-8")
    notebook = json.loads(made().content())
    blocks = [block for block in pages.blocks_of(pages.DOCS / "tutorial.md") if block.language in ("python", "toml", "sh")]
    assert len(code_of(notebook)) == len(blocks) > 9
    prose = "\n".join(cell["source"] for cell in notebook["cells"] if cell["cell_type"] == "markdown")
    for line in text.splitlines():
        if line.startswith("#") and not line.startswith("# teams"):
            assert line in prose
    assert ".md)" not in prose
    assert len({cell["id"] for cell in notebook["cells"]}) == len(notebook["cells"])


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_its_cells_print_what_they_show_also_a_second_time(tmp_path: Path) -> None:
    session = pages.Session("tutorial_cells", tmp_path)
    for cell in code_of(json.loads(made().content())):
        first = run(cell, session)
        agrees = pages.contains if cell["source"].startswith("!") else pages.matches
        assert agrees(first, shown_by(cell)), f"{cell['source']}\nprints\n{first}"
        if not cell["source"].startswith("!"):
            assert agrees(run(cell, session), shown_by(cell)), f"{cell['source']}\nprints something else when it is run again"


def test_a_kernel_runs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbclient = pytest.importorskip("nbclient", reason="needs nbclient, of the extra test")
    pytest.importorskip("ipykernel", reason="needs ipykernel, of the extra test")
    import nbformat

    # Commands of the cells are those of this Python.
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")
    expected = made().notebook((pages.DOCS / "tutorial.md").read_text(encoding="utf-8"))
    notebook = nbformat.from_dict(expected)
    nbformat.validate(notebook)
    client = nbclient.NotebookClient(notebook, timeout=1800, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    for before, cell in zip(code_of(expected), code_of(notebook), strict=True):
        agrees = pages.matches if not before["source"].startswith(("!", "%%")) else pages.contains
        assert agrees(shown_by(cell), shown_by(before)), f"{cell['source']}\nprints\n{shown_by(cell)}"
