"""Imports: no module imports itself through others, and a model imports only what it uses."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import teamsight

ROOT = Path(teamsight.__file__).resolve().parent.parent
FOLDERS = ("agents", "policies", "world", "analysis")

# The paper's model imports 107 modules of the package, 14 of them policies and their interface.
MOST_MODULES, MOST_POLICIES = 115, 18


def modules() -> dict[str, Path]:
    """Return the file of every module of the package by its name."""
    places = [(ROOT / "teamsight", "teamsight"), *((ROOT / name, f"teamsight.{name}") for name in FOLDERS)]
    found = {}
    for folder, package in places:
        for path in folder.rglob("*.py"):
            parts = path.relative_to(folder).with_suffix("").parts
            if package != "teamsight" or parts[0] not in FOLDERS:
                found[".".join([package, *parts]).removesuffix(".__init__")] = path
    return found


def imports(path: Path, known: set[str]) -> set[str]:
    """Return the modules of the package that a file imports, also within functions, but not for types only."""
    found = set()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    blocks = [node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    for_types = {id(node) for block in blocks for part in block.body for node in ast.walk(part)}
    for node in ast.walk(tree):
        if id(node) in for_types:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= names if names <= known else {*names, node.module}
    return found & known


def cycle_in(graph: dict[str, set[str]]) -> list[str]:
    """Return a circle of modules that import each other; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


@pytest.mark.short
def test_no_modules_import_each_other_in_a_circle() -> None:
    found = modules()
    assert {"teamsight", "teamsight.agents.world", "teamsight.core.kernel"} <= set(found)
    graph = {name: imports(path, set(found)) - {name} for name, path in found.items()}
    assert graph["teamsight.agents.cmommt"] >= {"teamsight.agents.world", "teamsight.world.placement"}
    assert cycle_in(graph) == []


def test_imports_within_functions_count_and_those_for_types_only_do_not(tmp_path: Path) -> None:
    texts = {
        "a": "if TYPE_CHECKING:\n    from c import x\nelse:\n    from b import x\n",
        "b": "def f():\n    import c\n",
        "c": "from a import y\n",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.py").write_text(text)
    graph = {name: imports(tmp_path / f"{name}.py", set(texts)) for name in texts}
    assert set(cycle_in(graph)) == {"a", "b", "c"}
    assert graph["a"] == {"b"}
    assert cycle_in(graph | {"b": set()}) == []


def test_a_model_imports_what_it_uses() -> None:
    code = (
        "import json, sys; from teamsight import CMOMMT; CMOMMT(rng=1).run(1);"
        "print(json.dumps([name for name in sys.modules if name.partition('.')[0] == 'teamsight']))"
    )
    environment = dict(os.environ, PYTHONPATH=str(ROOT))
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    loaded = json.loads(done.stdout or "[]")
    assert "teamsight.policies.handmade.a_cmommt" in loaded, done.stderr
    assert "teamsight.analysis" not in loaded
    policies = [name for name in loaded if name.startswith("teamsight.policies")]
    assert not [name for name in policies if name.split(".")[2:3] in (["lazy"], ["eager"], ["memory"], ["evolved"])]
    assert len(policies) <= MOST_POLICIES, sorted(policies)
    assert len(loaded) <= MOST_MODULES, sorted(loaded)


def test_the_package_imports_its_dependencies_alone() -> None:
    """What only the tests install would be missing from a wheel; modules that import an extra say so."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    optional = ("dask", "env", "evolve", "live", "video", "xarray")
    listed = [*project["dependencies"], *(line for name in optional for line in extras[name])]
    declared = {re.match(r"[\w-]+", line)[0].replace("-", "_") for line in listed}  # type: ignore[index]
    # numba comes with llvmlite, matplotlib with mpl_toolkits and Pillow, the extra `viz` with altair; notebooks run in
    # IPython; type checkers bring typing_extensions; stable-baselines3 brings PyTorch, too large for an extra.
    allowed = declared | set(sys.stdlib_module_names) | {"teamsight", "llvmlite", "mpl_toolkits", "PIL", "altair"}
    allowed |= {"IPython", "stable_baselines3", "typing_extensions"}
    for path in modules().values():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module]
            wrong = {name.partition(".")[0] for name in names} - allowed
            assert not wrong, f"{path}: imports {wrong}"
