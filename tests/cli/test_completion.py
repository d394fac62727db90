"""Shells complete commands, options, and the names that options take."""

from __future__ import annotations

import pytest
from click.shell_completion import ShellComplete

from teamsight.cli.main import commands


def completed(*arguments: str) -> set[str]:
    *before, incomplete = arguments
    shell = ShellComplete(commands, {}, "teamsight", "_TEAMSIGHT_COMPLETE")
    return {item.value for item in shell.get_completions(before, incomplete)}


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (("",), {"demo", "watch", "run", "benchmark", "warm"}),
        (("be",), {"benchmark"}),
        (("learn", ""), {"explore", "evaluate", "imagine", "figure", "diagnose", "curve"}),
        (("run", "--aw"), {"--awareness", "--awareness-range"}),
        (("run", "--awareness", "r"), {"ring", "relayed"}),
        (("run", "--policy", "ev"), {"evolved", "evasive"}),
        (("learn", "curve", "--task", "pu"), {"pursuit", "push"}),
        (("learn", "curve", "--format", "png,s"), {"png,svg"}),
    ],
)
def test_a_shell_completes(arguments: tuple[str, ...], found: set[str]) -> None:
    assert found <= completed(*arguments)


def test_it_offers_only_what_fits() -> None:
    assert completed("run", "--awareness", "re") == {"relayed"}
