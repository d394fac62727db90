"""Options are the fields of components: what a command shows, takes and refuses follows from their declarations."""

from __future__ import annotations

import dataclasses
import inspect
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Annotated, Any

import click
import pytest

from teamsight.analysis.learning.plans import Curves, Diagnosis, Training
from teamsight.cli import delta, evolve, learn
from teamsight.cli.main import commands
from teamsight.cli.options import Command, File, InputError, Options, Works, default_of, help_of, metavar_of
from teamsight.core.component import Allowed, Count, Flag, Index

ROOT = Path(__file__).parents[2]


def leaves(group: click.Group = commands) -> Iterator[Command]:
    for command in group.commands.values():
        if isinstance(command, click.Group):
            yield from leaves(command)
        else:
            assert isinstance(command, Command)
            yield command


def defaults_of(made: Any) -> dict[str, Any]:
    """Return the defaults of a function or of a dataclass or named tuple."""
    if dataclasses.is_dataclass(made):
        return {field.name: field.default for field in dataclasses.fields(made)}
    if hasattr(made, "_field_defaults"):
        return dict(made._field_defaults)
    return {name: one.default for name, one in inspect.signature(made).parameters.items()}


def in_python() -> dict[type[Options], Mapping[str, Any]]:
    """Return the defaults in Python of what commands call that would be slow to import for their help."""
    from teamsight.agents.cmommt import DEFAULTS
    from teamsight.analysis.delta.choose import choose_delta
    from teamsight.analysis.delta.from_trajectories import delta_from_trajectories
    from teamsight.analysis.papers.evolution import Comparison

    chosen = defaults_of(choose_delta)
    recorded = defaults_of(delta_from_trajectories)
    assert recorded["risk"] == chosen["risk"]
    return {
        delta.DeltaSettings: {"steps": chosen["steps"], "runs": chosen["runs"], "risk": chosen["risk"],
                              "window": recorded["window"], "targets": DEFAULTS["targets"],
                              "awareness_range": DEFAULTS["awareness_range"]},
        evolve.TestSettings: defaults_of(Comparison),
    }  # fmt: skip


def test_a_default_is_the_same_on_the_command_line_and_in_python() -> None:
    for settings, python in in_python().items():
        options = settings.options()
        shared = options.keys() & python.keys()
        assert len(shared) >= 2, settings
        differing = {name for name in shared if options[name].default != python[name]}
        assert not differing, f"{settings.__name__}: {differing}"


def test_the_options_of_learning_are_those_of_its_plans() -> None:
    from teamsight.analysis.learning.explore import Exploration

    assert learn.FigureSettings.read({}, {}).part(Curves) == Curves()
    assert learn.DiagnoseSettings.read({}, {}).part(Diagnosis) == Diagnosis()
    assert learn.CurveSettings.read({}, {}).part(Training) == Training()
    plan = learn.ExploreSettings.read({"out": "x"}, {}).plan()
    assert plan.settings() == Exploration().settings()


@pytest.mark.parametrize("command", list(leaves()), ids=lambda command: command.name)
def test_each_option_has_a_meaning_and_its_default_is_allowed(command: Command) -> None:
    context = click.Context(command)
    shown = dict(record for one in command.params if (record := one.get_help_record(context)))
    for name, one in command.settings.options().items():
        assert one.meaning, name
        if one.default not in (None, MISSING, (), {}) and one.kind != "flag":
            text = ",".join(map(str, one.default)) if isinstance(one.default, tuple) else str(one.default)
            assert one.parsed(text) == one.default, name
        if not one.allowed.is_argument:
            value = "" if one.kind == "flag" else f" {metavar_of(one)}"
            assert shown[f"--{name.replace('_', '-')}{value}"].startswith(help_of(one)), name
            assert default_of(one) in shown[f"--{name.replace('_', '-')}{value}"]


@dataclass(frozen=True, kw_only=True)
class Sample(Works):
    """Options of every kind.

    Parameters
    ----------
    robots, targets : int
        Numbers.
    quick : bool
        Be quick.
    merge : sequence of Path
        Files.
    """

    robots: Annotated[int, Allowed(least=1, most=9)] = 3
    targets: Annotated[Count | None, Allowed()] = None
    quick: Flag = False
    merge: Annotated[tuple[File, ...], Allowed(is_repeated=True)] = ()

    def check(self) -> None:
        if self.quick and self.robots > 5:
            raise ValueError("robots: too many")


@dataclass(frozen=True, kw_only=True)
class Child(Sample):
    """Declares one anew.

    Parameters
    ----------
    seed : int
        A seed.
    robots : int
        Fewer.
    """

    seed: Index = 0
    robots: Count = 2


def test_options_of_a_parent_class_come_first_and_can_be_declared_anew() -> None:
    assert list(Child.options()) == [*Works.options(), "robots", "targets", "quick", "merge", "seed"]
    assert (Child().robots, Sample().robots, Child.options()["robots"].meaning) == (2, 3, "Fewer.")


def test_all_that_is_wrong_is_reported_at_once_and_before_what_options_must_satisfy_together() -> None:
    with pytest.raises(InputError) as found:
        Sample.read({"robots": "10", "targets": "x", "quick": True, "merge": ()}, {})
    assert [message.partition(":")[0] for message in found.value.messages] == ["robots=10", "targets='x'"]
    with pytest.raises(ValueError, match="too many"):
        Sample.read({"robots": "6", "quick": True}, {})


def test_settings_know_what_was_given() -> None:
    settings = Sample.read({"robots": "3", "targets": None, "quick": False, "merge": ("a", "b")}, {})
    assert settings.given == {"robots", "merge"}
    assert (settings.robots, settings.targets, settings.quick) == (3, None, False)
    assert settings.merge == (Path("a"), Path("b"))
    assert settings.values(without=("merge", *Works.options())) == {"robots": 3, "quick": False}
    assert settings.values(("robots",)) == {"robots": 3}


def test_help_imports_nothing_slow() -> None:
    commands = ["", "run", "delta", "plot", "learn", "learn explore", "learn evaluate", "learn imagine", "learn figure", "learn diagnose", "learn curve", "evolve train", "reproduce", "reproduce tan1993", "reproduce gathering"]
    # In one process, which one alone would spoil for all others: the first line with a slow import names it.
    code = f"""
import sys, teamsight.cli as c
for command in {commands}:
    try: c.main([*command.split(), '--help'])
    except SystemExit: pass
    print(command, *{{'pandas', 'numba', 'mesa', 'rich', 'matplotlib'}} & {{*sys.modules}}, file=sys.stderr, sep=':')
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert found.stdout.count("Usage: teamsight") == len(commands)
    assert found.stderr.splitlines() == commands
