"""The check for words that are not used finds them in names and text, and leaves legitimate uses alone."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

CHECK = runpy.run_path(str(Path(__file__).resolve().parents[2] / ".ci" / "check_words.py"))


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("policies/lazy/lazy_q.py", "def learn(pairs, k):"),
        ("policies/lazy/lazy_q.py", "n_pairs = 3"),
        ("agents/world.py", "self._told = message"),
        ("agents/world.py", "# Objects are told what they see."),
        ("docs/delta.md", "teamsight delta --tracks tracks.csv"),
        ("docs/evolved.md", 'the policy="learned" wins'),
        ("analysis/learning/curves.py", "gamma: float = 0.7"),
        ("docs/model.md", "Two roads, one answer"),
    ],
)


def test_a_word_that_is_not_used_is_found_with_its_place_and_cure(path: str, line: str) -> None:
    (found,) = CHECK["found_in"](path, f"\n{line}\n")
    assert found.startswith(f"{path}:2: ")
    assert ": write " in found


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("world/search.py", "pairs = compare(position)"),
        ("agents/world.py", "the untold story of stagehands"),
        ("policies/handmade/a_cmommt.py", "target_tracks = TargetTracks()"),
        ("analysis/plot/style.py", "axes.plot(x, y, alpha=0.5)"),
        ("analysis/runs/seeds.py", 'person=b"teamsight-stage"'),
        ("docs/delta.md", "settings whose ranges overlap are not told apart"),
        ("docs/policies.md", "colorbar"),
    ],
)


def test_legitimate_uses_are_left_alone(path: str, line: str) -> None:
    assert list(CHECK["found_in"](path, line)) == []


def test_every_folder_of_the_code_is_searched() -> None:
    searched = {path.relative_to(CHECK["ROOT"]).parts[0] for path in CHECK["files"]()}
    assert {"agents", "analysis", "policies", "world", "teamsight", "tests", "docs", "README.md"} <= searched
