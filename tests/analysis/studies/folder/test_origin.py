"""Where a study comes from: asking git about a folder runs nothing that the folder names."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from teamsight.analysis.studies.folder.progress import commits

pytestmark = [
    pytest.mark.short,
    pytest.mark.skipif(os.name == "nt" or shutil.which("git") is None, reason="needs git and a POSIX shell"),
]


def test_no_program_of_the_studys_git_configuration_is_run(tmp_path: Path) -> None:
    folder, traces = tmp_path / "study", tmp_path / "traces"
    traces.mkdir()

    def git(*arguments: str) -> str:
        identity = ("-c", "user.name=a", "-c", "user.email=a@example.org")
        return subprocess.run(
            ["git", "-C", str(folder), *identity, *arguments], check=True, capture_output=True, text=True
        ).stdout

    folder.mkdir()
    git("init", "--quiet")
    (folder / "study.toml").write_text("seed = 1\n")
    (folder / ".gitattributes").write_text("*.toml filter=own\n")
    git("add", ".")
    git("commit", "--quiet", "-m", "one")
    for key, name in (("core.fsmonitor", "monitor"), ("filter.own.clean", "clean"), ("core.hooksPath", "hooks")):
        program = tmp_path / name
        if name == "hooks":
            program.mkdir()
            program /= "post-index-change"
        program.write_text(f"#!/bin/sh\ntouch {traces}/{name}\ncat\n")
        program.chmod(0o755)
        git("config", key, str(tmp_path / name))
    # Another size than git has noted: a comparison of files would read this one, through the filter.
    (folder / "study.toml").write_text("seed = 2 # changed\n")
    found = commits(folder)
    assert list(traces.iterdir()) == []
    assert found["study"] == {"commit": git("rev-parse", "HEAD").strip()}
