"""References: what can be named is found again, and what cannot is refused with the module, the reason and the cure."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from teamsight.core import checks, references
from teamsight.policies import ACmommt

pytestmark = pytest.mark.short


class Outer:
    class Inner:
        def method(self) -> int:
            return 1


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for modules whose names begin with "odd_", on the path."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    references.search_in([tmp_path])
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("odd_")]:
        del sys.modules[name]


@pytest.mark.parametrize("text", ["a:B", "a.b.c:D", "a:B.c", "_a._b:_C", "é.ß:Ñ"])
def test_references_have_a_module_and_a_name(text: str) -> None:
    assert references.is_reference(text)


@pytest.mark.parametrize("value", ["a", "a:", ":B", "a:B:C", "a b:C", "a.:B", ".a:B", "1a:B", "a:B()", "a/b:C", "a:B\n", "", "a:" + "b" * 999, 3, None, b"a:B"])
def test_other_texts_are_none(value: Any) -> None:
    assert not references.is_reference(value)
    with pytest.raises((TypeError, ValueError), match=r"^model=.*: (must be a text|is no reference).*'package\.module:Name'"):
        references.load(value, "model")


@pytest.mark.parametrize("option", ["", "--policy=", "--policy.inner="])
def test_an_object_in_a_file_is_named_by_its_path(option: str, folder: Path) -> None:
    (folder / "odd_file.py").write_text("class Thing:\n    pass\n", encoding="utf-8")
    assert references.from_file(f"{option}{folder}/odd_file.py:Thing") == f"{option}odd_file:Thing"
    assert references.load("odd_file:Thing").__name__ == "Thing"  # type: ignore[attr-defined]


def test_a_file_that_is_not_there_is_not_looked_for_elsewhere(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "odd_file.py").write_text("class Thing:\n    pass\n", encoding="utf-8")
    monkeypatch.chdir(folder)
    message = r"^sub/odd_file\.py:Thing: there is no file sub/odd_file\.py; give its path from here, .*" + folder.name
    with pytest.raises(ValueError, match=message):
        references.from_file("sub/odd_file.py:Thing")


@pytest.mark.parametrize("text", ["odd:Thing", "odd.py", "a=odd.py:Thing", "odd.py:", ".py:Thing", "odd.py:1", "x" * 999 + ".py:T"])
def test_other_arguments_stay(text: str) -> None:
    assert references.from_file(text) == text


@pytest.mark.parametrize("thing", [ACmommt, math.sqrt, references.load, dict, Path.exists])
def test_a_class_or_function_is_found_again(thing: Any) -> None:
    assert references.load(references.reference_to(thing)) is thing


def test_nested_classes_and_other_objects_can_be_named() -> None:
    assert references.reference_to(ACmommt) == "teamsight.policies.handmade.a_cmommt:ACmommt"
    assert references.load("math:pi") == math.pi
    assert references.load("collections:OrderedDict.fromkeys.__name__") == "fromkeys"


@pytest.mark.parametrize(
    ("thing", "error", "reason"),
    [
        (lambda: 1, ValueError, "is a lambda"),
        (type("Local", (), {"__module__": __name__, "__qualname__": "f.<locals>.Local"}), ValueError, "within a function"),
        (type("Script", (), {"__module__": "__main__"}), ValueError, "in the script that runs"),
        (type("ACmommt", (), {"__module__": ACmommt.__module__}), ValueError, "another object of the same name"),
        (type("Missing", (), {"__module__": "math"}), ValueError, "has no 'Missing'"),
        (ACmommt(), TypeError, "neither a class nor a function"),
        (3, TypeError, "neither a class nor a function"),
    ],
    ids=["lambda", "local", "script", "other", "missing", "object", "number"],
)  # fmt: skip
def test_what_another_process_cannot_import_is_refused(thing: Any, error: type[Exception], reason: str) -> None:
    with pytest.raises(error, match=rf"^policy=.*{reason}") as found:
        references.reference_to(thing)
    assert "\n" not in str(found.value)


def test_a_module_that_is_missing_is_named_with_the_cure() -> None:
    for reference, missing in (("nowhere_at_all.deep:X", "nowhere_at_all"), ("teamsight.core.nothing:X", "teamsight.core.nothing")):
        with pytest.raises(ValueError, match=rf"^sensor='{reference}': there is no module '{missing}'; .*PYTHONPATH"):
            references.load(reference, "sensor")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("x = 1\ny = x / 0\n", r"ZeroDivisionError: division by zero \(odd_broken\.py, line 2\); correct"),
        ("def f(:\n", r"SyntaxError: .*odd_broken\.py, line 1"),
        ("import nothing_of_this_name\n", r"ModuleNotFoundError: No module named 'nothing_of_this_name' \(odd_broken\.py, line 1\); install"),
        ("from math import nothing\n", r"ImportError: cannot import name 'nothing'.*\(odd_broken\.py, line 1\)"),
        ("import sys\nsys.exit('over')\n", r"SystemExit: over \(odd_broken\.py, line 2\)"),
        ("raise ValueError('two\\nlines')\n", r"ValueError: two lines \(odd_broken\.py, line 1\)"),
    ],
    ids=["raises", "syntax", "needs-a-module", "needs-a-name", "exits", "lines"],
)  # fmt: skip
def test_a_module_that_fails_is_named_with_its_error_and_line(folder: Path, text: str, reason: str) -> None:
    (folder / "odd_broken.py").write_text(text)
    with pytest.raises(ValueError, match=rf"^policy='odd_broken:X': module 'odd_broken' fails to import: {reason}") as found:
        references.load("odd_broken:X")
    assert "\n" not in str(found.value)


def test_ctrl_c_during_an_import_is_no_error_of_the_module(folder: Path) -> None:
    (folder / "odd_slow.py").write_text("raise KeyboardInterrupt\n")
    with pytest.raises(KeyboardInterrupt):
        references.load("odd_slow:X")


def test_a_name_that_is_missing_is_answered_with_the_nearest(folder: Path) -> None:
    (folder / "odd_names.py").write_text("class Flee: pass\n")
    (folder / "odd_empty.py").write_text("")
    with pytest.raises(ValueError, match=r"module 'odd_names' has no 'Fle'; did you mean 'Flee'\?$"):
        references.load("odd_names:Fle")
    with pytest.raises(ValueError, match=r"'Flee' has no 'zzz'; it is empty"):
        references.load("odd_names:Flee.zzz")
    with pytest.raises(ValueError, match=r"module 'odd_empty' has no 'Flee'; it is empty"):
        references.load("odd_empty:Flee")


def test_a_module_written_after_its_folder_was_listed_is_found(folder: Path) -> None:
    with pytest.raises(ValueError, match="no module 'odd_late'"):
        references.load("odd_late:x")
    (folder / "odd_late.py").write_text("x = 3\n")
    references.search_in([folder])
    assert references.load("odd_late:x") == 3


def test_folders_come_last_on_the_path_the_latest_first_and_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = list(sys.path)
    monkeypatch.setattr(sys, "path", list(before))
    # Other tests of this process may have added folders.
    monkeypatch.setattr(references, "_added", [])
    monkeypatch.setattr(references, "_latest", [])
    folders = [tmp_path / "b", tmp_path / "a"]
    for _ in range(2):
        references.search_in([*folders, tmp_path / "b", before[-1]])
    assert sys.path == [*before, *map(str, folders)]
    references.search_in([tmp_path / "c"])
    assert sys.path == [*before, *map(str, [tmp_path / "c", *folders])]
    references.search_in([tmp_path / "a"])
    assert sys.path == [*before, *(str(tmp_path / name) for name in "acb")]


def test_a_module_that_is_found_elsewhere_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file with a name of Python's own hides nothing, and is not mistaken for it; nor is that of another study."""
    for name in ("a/queue.py", "a/odd_twin.py", "b/odd_twin.py"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(f"x = {name!r}\n")
    references.search_in([folder / "a"])
    assert references.load("odd_twin:x") == "a/odd_twin.py"
    with pytest.raises(ValueError, match=r"module 'queue' is \S+queue.py in this process, not \S+queue.py; give that"):
        references.load("queue:x")
    assert references.load("json:dumps")
    references.search_in([folder / "b"])
    with pytest.raises(ValueError, match=r"module 'odd_twin' is \S+a\Wodd_twin.py in this process, not \S+b\Wodd_"):
        references.load("odd_twin:x")
    references.search_in([])
    assert references.load("odd_twin:x") == "a/odd_twin.py"


def test_what_teamsight_refuses_has_no_place_in_our_files() -> None:
    with pytest.raises(ValueError, match="must be at least 1") as raised:
        checks.count("n", 0)
    assert references.failure(raised.value) == "ValueError: n=0: must be at least 1"
    mine, library = ("/home/me/mine.py", 3), (checks.difflib.__file__, 9)
    ours = checks.__file__, 5
    assert references.place_of([ours, mine, library]) == mine
    assert references.place_of([mine, ours, library]) is None
