"""The page is one file that loads nothing, and gives back what it plays."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest

from teamsight.view import page as pages
from teamsight.view.page import asset, page, tracks_in
from teamsight.view.scene import Frame, Scene, SceneGroup, Slot

HOSTILE = "</script><script>alert(1)</script><!-- \u2028 & \" ' ü"


class Track(NamedTuple):
    scene: Scene
    frames: list[Frame]


@pytest.fixture(autouse=True)
def _assets(tmp_path, monkeypatch) -> Iterator[None]:
    (tmp_path / "view.js").write_text("'use strict';\n", "utf-8")
    (tmp_path / "view.css").write_text("main { color: black }\n", "utf-8")
    monkeypatch.setattr(pages, "_ASSETS", tmp_path)
    asset.cache_clear()
    yield
    asset.cache_clear()


def track() -> Track:
    words = [np.array([7], np.uint16)] * 4
    group = SceneGroup(HOSTILE, "robot", "#1f77b4")
    scene = Scene(HOSTILE, "CMOMMT", "0.1.0", 2**60, 1, (0, 0, 1, 1), groups=(group,), slots=(Slot(0, 1, 1.0, 1.0),))
    return Track(scene, [Frame(float(time), np.zeros(0, np.float32), *words) for time in range(3)])


def test_a_page_holds_its_tracks_whatever_their_names() -> None:
    text = page([track(), track()], title=HOSTILE)
    assert text.startswith(pages.MARK)
    assert text.count("</script>") == 2
    assert "alert(1)</script>" not in text
    for scene, frames in tracks_in(text):
        assert scene == track().scene
        assert [frame.time for frame in frames] == [0, 1, 2]
        assert frames[0].x.tolist() == [7]


def test_the_policy_allows_only_its_own_script_and_style() -> None:
    text = page([track()], title="a run")
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    parts = {"script-src": text.rpartition("<script>")[2].partition("</script>")[0], "style-src": text.partition("<style>")[2].partition("</style>")[0]}
    wanted = ["default-src 'none'"]
    wanted += [f"{kind} 'sha256-{base64.b64encode(hashlib.sha256(part.encode()).digest()).decode()}'" for kind, part in parts.items()]
    assert policy.split("; ") == [*wanted, "img-src data: blob:"]


@pytest.mark.parametrize("text", ["", "<!doctype html>", "PK", pages.MARK + '<script type="application/json" id="replay">{"tra</script>'])
def test_other_pages_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="record the run again|replay.save") as caught:
        tracks_in(text)
    assert "\n" not in str(caught.value)
