"""The page about studies: its files are written and its commands and code run, in its order, in one folder."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import teamsight

ROOT = Path(teamsight.__file__).resolve().parent.parent
PAGE = (Path(__file__).resolve().parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")


def blocks() -> list[tuple[str, str]]:
    """Return language and content of each block."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)


def statuses_of(command: str) -> set[int]:
    """Return the exit statuses with which a line may end."""
    said = re.search(r"# exit status (\d)", command)
    return {int(said[1]) if said else 0}


def has_in_order(output: str, said: str) -> bool:
    """Return whether the lines of a block occur in an output, in their order; … stands for anything within a line."""
    lines = [r"[^\n]*".join(map(re.escape, line.split("…"))) for line in said.strip().splitlines()]
    return re.search(r"\n(?:.*\n)?".join(lines), output, re.DOTALL) is not None


@pytest.mark.short
def test_the_study_of_the_readme_and_of_the_examples_are_studies(tmp_path: Path) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (tmp_path / "study.toml").write_text(re.findall(r"^```toml\n(.*?)^```$", readme, re.DOTALL | re.MULTILINE)[0])
    assert teamsight.Study.from_file(tmp_path / "study.toml").runs == 3_500
    assert teamsight.Study.from_file(ROOT / "examples" / "study.toml").runs == 200


def test_all_commands_and_code_of_the_page_work_as_written(tmp_path: Path) -> None:
    programs = tmp_path / "programs"
    programs.mkdir()
    # On one core there is one worker, unless a command asks for more: to start Python takes most of the time here.
    pinned = f"taskset -c {min(os.sched_getaffinity(0))} " if shutil.which("taskset") else ""
    (programs / "teamsight").write_text(f'#!/bin/sh\nexec {pinned}"{sys.executable}" -m teamsight "$@"\n')
    (programs / "teamsight").chmod(0o755)
    path = os.pathsep.join((str(programs), os.environ["PATH"]))
    environment = dict(os.environ, PYTHONPATH=str(ROOT), PATH=path, MPLBACKEND="agg")
    folder = tmp_path / "work"
    folder.mkdir()

    def run(*command: str) -> tuple[int, str]:
        done = subprocess.run(
            command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        return done.returncode, done.stdout

    said = ""
    for language, content in blocks():
        named = re.match(r"# (\w+\.(?:py|toml))\n", content)
        if named:
            (folder / named[1]).write_text(content)
        elif language == "sh":
            said = ""
            # A command in the background belongs to the line after it, which ends it.
            for line in content.replace("\\\n", " ").replace(" &\n", " & ").splitlines():
                if "RUN_ID" in line:
                    line = line.replace("RUN_ID", re.findall(r"teamsight rerun own (\w+-\d+)", said)[-1])
                status, output = run("bash", "-c", line)
                assert status in statuses_of(line), (line, status, output)
                said += output
                if "kill -KILL" in line:
                    status, output = run("teamsight", "status", "results", "--json")
                    assert 350 < json.loads(output)["done"] < 3_500
        elif language == "python":
            status, output = run(sys.executable, "-c", content)
            assert status == 0, output
        elif language == "text":
            assert has_in_order(said, content), (content, said)
    for picture in ("heat-map.png", "partial.png", "gain.png", "lines.svg", "drawn.png", "from-python.png"):
        assert (folder / picture).stat().st_size > 5_000
