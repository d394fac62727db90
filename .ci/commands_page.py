"""Write docs/commands.md: every command of teamsight with its options, from their declarations.

Run it with the Python of the checkout: `.venv/bin/python .ci/commands_page.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent

import click

from teamsight.analysis.plot import markdown
from teamsight.cli.main import commands


def main() -> None:
    """Write the page."""
    place = Path(__file__).resolve().parents[1] / "docs" / "commands.md"
    place.write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page."""
    parts = [
        "# Commands",
        "All commands of teamsight with their options. This page is made by `python .ci/commands_page.py` from the "
        "declarations that `--help` shows too. Results depend on the settings and the seed only, not on the number of "
        "workers. Ctrl-C or SIGTERM ends a command with status 130, wrong input with status 2. "
        "An error is one line; with TEAMSIGHT_TRACEBACK=1 in the environment, Python's traceback is shown as well.",
    ]
    for name, command in leaves("teamsight", commands):
        parts += [f"## {name}", *_help(command), _table(command)]
    return markdown.page(*parts)


def leaves(path: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
    """Yield each command that is no group, with its full name."""
    if not isinstance(command, click.Group):
        yield path, command
        return
    for name, inner in sorted(command.commands.items()):
        yield from leaves(f"{path} {name}", inner)


def _help(command: click.Command) -> Iterator[str]:
    for paragraph in (command.help or "").strip().split("\n\n"):
        lines = paragraph.splitlines()
        if lines[0].strip() == "\b":
            yield "\n".join(["```", dedent("\n".join(lines[2:])), "```"])
        else:
            yield " ".join(line.strip() for line in lines)


def _table(command: click.Command) -> str:
    context = click.Context(command)
    records = [record for one in command.params if (record := one.get_help_record(context)) and record[1]]
    return markdown.table(("option", "meaning"), [(f"`{names}`", help) for names, help in records])


if __name__ == "__main__":
    main()
