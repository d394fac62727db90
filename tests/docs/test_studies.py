"""The page about studies: its files are written and its commands and code run, in its order, in one folder."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import teamsight
from teamsight.cli import main

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
def test_the_study_of_the_examples_is_a_study() -> None:
    assert teamsight.Study.from_file(ROOT / "examples" / "study.toml").runs == 200


def said_by(work: Callable[[], object]) -> tuple[int, str]:
    """Do something in this process, and return with which status it ends and what it prints."""
    status, out = 0, io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        try:
            work()
        except SystemExit as left:
            status = int(left.code or 0)
    return status, out.getvalue()


def test_all_commands_and_code_of_the_page_work_as_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "teamsight").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m teamsight "$@"\n')
    (programs / "teamsight").chmod(0o755)
    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PATH", os.pathsep.join((str(programs), os.environ["PATH"])))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("MPLBACKEND", "agg")

    def run(line: str) -> tuple[int, str]:
        program, *arguments = shlex.split(line, comments=True)
        if program == "teamsight" and not {"&", "|", ">"} & set(arguments):
            # To start Python, also for workers, takes longer than most of the work.
            return said_by(lambda: main([*arguments, *(["--workers", "1"] if arguments[0] == "sweep" and "--workers" not in arguments else [])]))
        done = subprocess.run(["bash", "-c", line], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        return done.returncode, done.stdout

    said = ""
    try:
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
                    status, output = run(line)
                    assert status in statuses_of(line), (line, status, output)
                    said += output
                    if "kill -KILL" in line:
                        status, output = run("teamsight status results --json")
                        assert 350 < json.loads(output)["done"] < 3_500
            elif language == "python":
                said_by(lambda: exec(content, {"__name__": "studies"}))
            elif language == "text":
                assert has_in_order(said, content), (content, said)
    finally:
        sys.modules.pop("parts", None)
    for picture in ("heat-map.png", "partial.png", "gain.png", "lines.svg", "drawn.png", "from-python.png"):
        assert (folder / picture).stat().st_size > 5_000
