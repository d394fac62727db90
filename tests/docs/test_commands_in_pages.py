"""Commands in blocks of the pages exist, with the options that they are given."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from teamsight.cli.main import commands
from teamsight.cli.options import Command, parameter_of

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def lines_of(page: Path) -> Iterator[list[str]]:
    """Yield the words of each line in a block, and of each cell of a table, that calls teamsight, without the program."""
    for cell in re.findall(r"(?<=\| )`teamsight (\w[^`]*)`(?= \|)", page.read_text(encoding="utf-8")):
        yield shlex.split(cell)
    for block in re.findall(r"^ *```(?:sh)?\n(.*?)^ *```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE):
        for line in block.replace("\\\n", " ").splitlines():
            # What follows belongs to the shell.
            called = re.match(r" *(?:\S*/)?teamsight (\w.*?)(?: (?:&&|[|>&;]) ?.*)?$", line)
            if called:
                yield shlex.split(called[1], comments=True)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_commands_and_options_exist(page: Path) -> None:
    for words in lines_of(page):
        command: click.Command = commands
        rest = list(words)
        while isinstance(command, click.Group):
            # Of the papers, one is meant where none is named.
            default = getattr(command, "default", "")
            if default and (not rest or rest[0] not in command.commands):
                rest.insert(0, default)
            if not rest or rest[0].startswith("-"):
                break
            name = rest.pop(0)
            assert name in command.commands, f"teamsight {' '.join(words)}"
            command = command.commands[name]
        parameters = list(command.params)
        if isinstance(command, Command):
            # A task brings options of its own.
            parameters += map(parameter_of, command.settings.brings(rest).values())
        known = {option for parameter in parameters for option in (*parameter.opts, *parameter.secondary_opts)}
        for word in rest:
            if re.match(r"--?[a-zA-Z]", word):
                assert word.partition("=")[0] in {*known, "-h", "--help"}, f"teamsight {' '.join(words)}"


def test_the_commands_of_pages_are_found() -> None:
    found = [words for page in PAGES for words in lines_of(page)]
    assert ["sweep", "study.toml", "--out", "results"] in found
    assert len(found) > 60
