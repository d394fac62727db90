"""The endings of recordings: what is refused, and what is suggested instead."""

from __future__ import annotations

import pytest

from teamsight.view.replay import ENDINGS, check_ending


@pytest.mark.parametrize("ending", ENDINGS)
def test_known_endings_are_accepted_in_any_case(ending: str) -> None:
    assert check_ending(f"a.b{ending.upper()}") == ending


@pytest.mark.parametrize(
    ("given", "near"),
    [(".htm", ".html"), (".hmtl", ".html"), (".giff", ".gif"), (".gfi", ".gif"), (".mp3", ".mp4"), (".pmg", ".png")],
)
def test_a_slip_is_answered_with_what_was_meant(given: str, near: str) -> None:
    with pytest.raises(ValueError, match=rf"^run\{given}: must end in .*; did you mean '\{near}'\? give such a name"):
        check_ending(f"run{given}")


@pytest.mark.parametrize("given", [".bmp", ".jpg", ".pdf", ".txt", ".webm", ".avi", ".mov", ".tiff", ".svg", "."])
def test_other_kinds_of_files_are_not_taken_for_slips(given: str) -> None:
    with pytest.raises(ValueError, match=r"must end in \.html, \.gif, \.mp4, \.png") as found:
        check_ending(f"run{given}")
    assert "did you mean" not in str(found.value)
