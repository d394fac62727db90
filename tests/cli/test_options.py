"""Every option is declared once: its default is the same in the help, in Python and on the page of the commands."""

from __future__ import annotations

import dataclasses
import inspect
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click
import pytest

from teamsight.cli import delta, evolve, learn_evaluate, learn_explore, learn_figure, reproduce, run
from teamsight.cli.main import commands
from teamsight.cli.options import InputError, Option, Settings
from teamsight.cli.values import count, file, flag

ROOT = Path(__file__).parents[2]


def leaves(group: click.Group = commands) -> Iterator[click.Command]:
    for command in group.commands.values():
        if isinstance(command, click.Group):
            yield from leaves(command)
        else:
            yield command


def defaults_of(made: Any) -> dict[str, Any]:
    """Return the defaults of a function or of a dataclass or named tuple."""
    if dataclasses.is_dataclass(made):
        return {field.name: field.default for field in dataclasses.fields(made)}
    if hasattr(made, "_field_defaults"):
        return dict(made._field_defaults)
    return {name: one.default for name, one in inspect.signature(made).parameters.items()}


def in_python() -> dict[type[Settings], Mapping[str, Any]]:
    """Return the defaults in Python of what each command calls, by the names of its options."""
    from teamsight.agents.cmommt import DEFAULTS
    from teamsight.analysis.delta.choose import choose_delta
    from teamsight.analysis.delta.from_trajectories import delta_from_trajectories
    from teamsight.analysis.evolution.cma import Evolution
    from teamsight.analysis.evolution.evolve import evaluate
    from teamsight.analysis.learning.curves import Curves
    from teamsight.analysis.learning.evaluation import Scenario
    from teamsight.analysis.learning.explore import Exploration
    from teamsight.analysis.learning.learners import Objective
    from teamsight.analysis.paper.reproduce import Plan

    chosen = defaults_of(choose_delta)
    recorded = defaults_of(delta_from_trajectories)
    assert recorded["risk"] == chosen["risk"]
    plan = defaults_of(Plan)
    return {
        # The events of a model are what it attaches; those of the command are what it prints.
        run.RunSettings: {name: value for name, value in DEFAULTS.items() if name != "events"}
        | {"cycle": DEFAULTS["cycle"].period},
        delta.DeltaSettings: {"steps": chosen["steps"], "runs": chosen["runs"], "risk": chosen["risk"],
                              "window": recorded["window"], "targets": DEFAULTS["targets"],
                              "awareness_range": DEFAULTS["awareness_range"]},
        reproduce.ReproduceSettings: {"runs": plan["runs"], "steps": plan["steps"], "seed": plan["root"]},
        learn_explore.ExploreSettings: {
            **{name: value for name, value in defaults_of(Exploration).items() if name not in ("awareness", "policy")},
            "robot_speed": DEFAULTS["robot_speed"], "delta": DEFAULTS["delta"],
        },
        learn_evaluate.EvaluateSettings: {
            **{name: value for name, value in defaults_of(Scenario).items() if name not in ("robots", "steps")},
            "reward": Objective().reward, "k": Objective().k, "discount": Objective().discount,
        },
        learn_figure.FigureSettings: defaults_of(Curves),
        evolve.TrainSettings: {"population": Evolution.population, "seed": Evolution.seed, "spread": Evolution.spread},
        evolve.TestSettings: defaults_of(evaluate),
    }  # fmt: skip


def test_a_default_is_the_same_on_the_command_line_and_in_python() -> None:
    for settings, python in in_python().items():
        options = settings.options()
        # On the command line these are a switch, and the period of a cycle.
        shared = (options.keys() & python.keys()) - {"events", "cycle"}
        assert len(shared) >= 2, settings
        differing = {name for name in shared if options[name].default != python[name]}
        assert not differing, f"{settings.__name__}: {differing}"


def test_without_a_task_policies_are_evaluated_for_the_steps_of_a_scenario() -> None:
    from teamsight.analysis.learning.evaluation import Scenario

    assert defaults_of(Scenario)["steps"] == learn_evaluate._STEPS


def test_every_default_passes_its_own_check_unless_nothing_stands_for_it() -> None:
    for command in leaves():
        settings = settings_of(command)
        for name, option in settings.options().items():
            if option.kind == "option" and option.default not in (None, (), {}):
                text = ",".join(map(str, option.default)) if isinstance(option.default, tuple) else str(option.default)
                assert option.check(name, text) == option.default, (settings, name)


def subclasses(parent: type[Settings]) -> Iterator[type[Settings]]:
    for one in parent.__subclasses__():
        yield one
        yield from subclasses(one)


def settings_of(command: click.Command) -> type[Settings]:
    """Return the settings class whose options a command has."""
    names = [parameter.name for parameter in command.params]
    (found,) = [
        one
        for one in subclasses(Settings)
        if one.__module__.startswith("teamsight.") and list(one.options()) == names
        # Several commands have no options.
        and (names or one.__name__.lower() == f"{command.name}settings")
    ]
    return found


@pytest.mark.parametrize("command", list(leaves()), ids=lambda command: command.name)
def test_the_help_shows_each_option_with_its_default(command: click.Command) -> None:
    context = click.Context(command)
    shown = dict(record for one in command.params if (record := one.get_help_record(context)))
    for name, option in settings_of(command).options().items():
        if option.kind == "option":
            record = shown[f"--{name.replace('_', '-')} {option.metavar}"]
            default = f"[default: {option.default_text()}]" if option.default_text() else ""
            assert record == "  ".join(filter(None, (option.help_text(), "[required]" if option.required else default)))
            # Without a default, leaving the option out means that there is no such thing.
            assert default or option.required or option.many or name in ("preset", "out", "record", "save", "save_events", "trajectories", "training", "further")


def test_options_of_a_parent_class_come_first_and_can_be_declared_anew() -> None:
    class Parent(Settings):
        steps: int = count(5, "Steps.")
        seed: int = count(0, "Seed.", least=0)

    class Child(Parent):
        workers: int = count(1, "Workers.")
        steps: int = count(7, "Steps.")

    assert list(Child.options()) == ["steps", "seed", "workers"]
    assert (Child().steps, Parent().steps, Child(seed="3").seed) == (7, 5, 3)


class Sample(Settings):
    """Options of every kind."""

    robots: int = count(3, "Number of robots.", most=9)
    targets: int | None = count(None, "Number of targets.")
    quick: bool = flag("Be quick.")
    merge: tuple[Path, ...] = file("A file.", many=True)

    def check(self) -> None:
        if self.quick and self.robots > 5:
            raise ValueError("robots: too many")


def test_all_that_is_wrong_is_reported_at_once_and_before_what_options_must_satisfy_together() -> None:
    with pytest.raises(InputError) as found:
        Sample(robots="10", targets="x", quick=True, merge=())
    assert [message.partition(":")[0] for message in found.value.messages] == ["robots=10", "targets='x'"]
    with pytest.raises(ValueError, match="too many"):
        Sample(robots="6", targets=None, quick=True, merge=())


def test_settings_know_what_was_given() -> None:
    settings = Sample(robots="3", targets=None, quick=False, merge=("a", "b"))
    assert settings.given == {"robots", "merge"}
    assert (settings.robots, settings.targets, settings.quick) == (3, None, False)
    assert settings.merge == (Path("a"), Path("b"))
    assert settings.values(without=("merge",)) == {"robots": 3, "quick": False}
    assert settings.values(("robots",)) == {"robots": 3}
    assert isinstance(Sample.robots, Option)


@pytest.mark.parametrize("command", ["", "run", "delta", "learn", "learn explore", "learn evaluate", "learn figure", "learn diagnose", "learn curve", "evolve train"])
def test_help_imports_nothing_slow(command: str) -> None:
    code = f"import sys, teamsight.cli as c\ntry: c.main({command.split()!r} + ['--help'])\nfinally: print(*sys.modules, file=sys.stderr)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert "Usage: teamsight" in found.stdout
    assert not {"pandas", "numba", "mesa", "rich", "matplotlib"} & set(found.stderr.split())
