"""Pictures in every format: the same bytes each time, a description, and a mark by which they are recognised."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from teamsight.analysis.plot.style import FORMATS, canvas, minus, to_picture
from teamsight.analysis.runs.files import check_replaceable, write_bytes

BEGINNINGS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF-"}


def picture(kind: str) -> bytes:
    figure = canvas(4, 3)
    axes = figure.add_subplot()
    axes.fill_between([0, 1], [0, 1], [1, 2])
    axes.set_title("gain − loss, 10²³")
    return to_picture(figure, "seed 2000", kind)


def test_the_formats_are_known() -> None:
    assert set(FORMATS) == set(BEGINNINGS)


@pytest.mark.parametrize("kind", FORMATS)
def test_a_picture_has_a_mark_and_no_time(kind: str, tmp_path: Path) -> None:
    content = picture(kind)
    assert content == picture(kind)
    assert content.startswith(BEGINNINGS[kind])
    assert b"seed 2000" in content
    assert not re.search(rb"CreationDate|20\d\d-\d\d-\d\d", content)
    write_bytes(tmp_path / "picture", content)
    check_replaceable(tmp_path / "picture")
    (tmp_path / "picture").write_bytes(content.replace(b"teamsight", b"something"))
    with pytest.raises(ValueError, match="holds something else"):
        check_replaceable(tmp_path / "picture")


def test_numbers_get_a_minus_sign_and_words_keep_their_hyphen() -> None:
    assert minus("Q-learning: -0.3 (-1.2 to +0.5), 2-3") == "Q-learning: −0.3 (−1.2 to +0.5), 2-3"
