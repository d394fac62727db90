"""The endings of recordings."""

from __future__ import annotations

import pytest

from teamsight.view.replay import ENDINGS, check_ending


@pytest.mark.parametrize("ending", ENDINGS)
def test_known_endings_are_accepted_in_any_case(ending: str) -> None:
    assert check_ending(f"a.b{ending.upper()}") == ending


@pytest.mark.parametrize("given", [".htm", ".gfi", ".mp3", ".jpg", ".webm", "."])
def test_other_endings_are_refused(given: str) -> None:
    with pytest.raises(ValueError, match=rf"^run\{given}: must end in \.html, \.gif, \.mp4, \.png, .* give such a name"):
        check_ending(f"run{given}")
