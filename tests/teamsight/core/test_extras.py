"""Packages that are extras: those that are not installed are named with the extra that installs them."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight.core.extras import extra, installing

pytestmark = pytest.mark.short


def test_an_extra_that_is_installed_is_returned() -> None:
    import numpy

    assert extra("numpy", "a sum", "sums") is numpy


def test_an_extra_that_is_not_installed_is_named_with_the_cure() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"a sum needs the package not_there: .*pip install 'teamsight\[sums\]'"):
        extra("not_there", "a sum", "sums")


@pytest.mark.parametrize("is_active", [True, False])
def test_the_cure_is_for_the_python_that_runs(is_active: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("own", "other"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "pip").touch(mode=0o755)
    python = str(tmp_path / "own" / "python")
    monkeypatch.setattr("sys.executable", python)
    monkeypatch.setenv("PATH", str(tmp_path / ("own" if is_active else "other")))
    assert installing("live") == f"{'pip' if is_active else f'{python} -m pip'} install 'teamsight[live]'"


def test_what_an_extra_itself_lacks_is_another_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lacking_one.py").write_text("import not_there\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ModuleNotFoundError, match="No module named 'not_there'"):
        extra("lacking_one", "a sum", "sums")
