"""The notebook of the tutorial: its cells run in order, and twice, in one namespace, and print what they show."""

from __future__ import annotations

import json
import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from textwrap import dedent
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


CELLS = {
    "begin": """
        import os, signal
        import teamsight.core.kernel.entry
        from teamsight import CMOMMT, Disc, Robot, Study, World, run_many
        from teamsight.agents import stepping
        from teamsight.analysis.runs import progress_line
        from teamsight.core import status_line
        teamsight.core.kernel.entry.announce = lambda name: None
        status_line.PATIENCE = stepping._EVERY = progress_line._EVERY = 0.0
        def rule(percept, rng):
            if percept.time == 3 and events:
                events.pop()()
            return 0.1, 0.01
        events = []""",
    "world": """
        world = World(Disc(2.0), rng=1)
        world.add(Robot, 2, policy=rule)
        world.run(6)
        world""",
    "raises": """
        def fail(): raise OSError("the user's")
        events.append(fail)
        world = World(Disc(2.0), rng=1)
        world.add(Robot, 2, policy=rule)
        world.run(6)""",
    "after an error": "world.tick, world.run(3), world.tick, world.robots if hasattr(world, 'robots') else None",
    "interrupted": """
        events.append(lambda: os.kill(os.getpid(), signal.SIGINT))
        world = World(Disc(2.0), rng=1)
        world.add(Robot, 2, policy=rule)
        world.run(6)""",
    "after it": "world.run(6 - world.tick); print([round(float(x), 6) for x in world.groups[0].position.ravel()]); world",
    "the same": "again = World(Disc(2.0), rng=1); again.add(Robot, 2, policy=rule); again.run(6); print([round(float(x), 6) for x in again.groups[0].position.ravel()])",
    "many": "len(run_many({'robots': 2, 'targets': 2, 'radius': 1.5}, steps=5, replicates=4, rng=1))",
    "study": "Study(fixed={'robots': 2, 'targets': 2, 'radius': 1.5}, steps=5, replicates=4).run('out').frame.shape[0]",
    "many fails": """
        def measure(world, steps): raise RuntimeError("of the user")
        run_many({'robots': 2, 'targets': 2, 'radius': 1.5}, steps=5, replicates=4, rng=1, measure=measure)""",
    "many stop": """
        def stop(world, steps): os.kill(os.getpid(), signal.SIGINT)
        run_many({'robots': 2, 'targets': 2, 'radius': 1.5}, steps=5, replicates=4, rng=1, measure=stop, workers=1)""",
    "clean": "status_line.shown_lines",
}  # fmt: skip


@pytest.mark.filterwarnings("ignore")
def test_errors_interrupts_and_cells_that_run_twice_leave_a_kernel_as_it_was(tmp_path: Path) -> None:
    nbclient = pytest.importorskip("nbclient", reason="needs nbclient, of the extra test")
    pytest.importorskip("ipykernel", reason="needs ipykernel, of the extra test")
    import nbformat

    order = ["begin", "world", "world", "raises", "raises", "after an error", "interrupted", "after it", "world", "the same",
             "many", "many", "many fails", "many stop", "study", "clean"]  # fmt: skip
    cells = [nbformat.v4.new_code_cell(dedent(CELLS[name]).strip()) for name in order]
    notebook = nbformat.v4.new_notebook(cells=cells)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=1800, resources=resources, allow_errors=True).execute()
    errors = {}
    for name, cell in zip(order, cells, strict=True):
        found = [output for output in cell["outputs"] if output["output_type"] == "error"]
        errors.setdefault(name, []).extend(output["ename"] for output in found)
        # A line of progress is gone, whatever became of the cell.
        progress = [output["data"]["text/plain"] for output in cell["outputs"] if output["output_type"] == "display_data"]
        assert not any(progress), (name, progress)
        if name in ("world", "many", "study", "interrupted"):
            assert progress, f"{name} showed no progress"
    failing = {name: kinds for name, kinds in errors.items() if kinds}
    assert failing.pop("many fails")[0] in ("RuntimeError", "JobError")
    assert failing == {"raises": ["OSError", "OSError"], "interrupted": ["KeyboardInterrupt"], "many stop": ["KeyboardInterrupt"]}
    card = cells[order.index("world")]["outputs"][-1]["data"]["text/html"]
    assert cells[order.index("world") + 1]["outputs"][-1]["data"]["text/html"] == card
    # A world that was interrupted goes on, and ends where it would have.
    assert "<svg" in cells[order.index("after it")]["outputs"][-1]["data"]["text/html"]
    assert shown_by(cells[order.index("after it")]) == shown_by(cells[order.index("the same")]) != ""
    assert cells[-1]["outputs"][-1]["data"]["text/plain"] == "[]"


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
