"""Packages that are extras: those that are not installed are named with the extra that installs them."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight.core.extras import extra

pytestmark = pytest.mark.short


def test_an_extra_that_is_installed_is_returned() -> None:
    import numpy

    assert extra("numpy", "a sum", "sums") is numpy


def test_an_extra_that_is_not_installed_is_named_with_the_cure() -> None:
    with pytest.raises(
        ModuleNotFoundError, match=r"a sum needs the package not_there: pip install 'teamsight\[sums\]'"
    ):
        extra("not_there", "a sum", "sums")


def test_what_an_extra_itself_lacks_is_another_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lacking_one.py").write_text("import not_there\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ModuleNotFoundError, match="No module named 'not_there'"):
        extra("lacking_one", "a sum", "sums")
