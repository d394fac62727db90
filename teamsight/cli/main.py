"""The command line: all commands. Nothing slow is imported here, so that ``--help`` answers at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

import click

from teamsight import __version__
from teamsight.cli.exits import run_and_exit
from teamsight.cli.options import Group, LazyCommands, command_in

# What stands there for somebody who types the name of the program and nothing else.
_FIRST = """\
teamsight demo                            watch two teams side by side
teamsight watch                           watch a team, and change it
teamsight run --robots 10 --radius 5      how much does a team observe?
teamsight delta --robots 30 --radius 5    how many neighbours at most?
teamsight --help                          all commands"""


# The section of each command in the help, and where it is; those of groups are below.
_COMMANDS = {
    "demo": ("See a team", "demo.demo"), "watch": ("See a team", "look.watch"), "run": ("Run", "look.run"),
    "sweep": ("Run", "study.sweep"), "status": ("Run", "study.status"), "plot": ("Run", "study.plot"),
    "submit": ("Run", "study.submit"), "delta": ("Choose δ", "delta.delta"),
    "learn": ("Learn", "main.learn"), "evolve": ("Learn", "main.evolution"),
    "benchmark": ("Compare", "benchmark.benchmark"), "ceilings": ("Compare", "ceilings.ceilings"),
    "reproduce": ("Check", "reproduce.papers"), "calibrate": ("Check", "calibrate.calibrate"),
    "rerun": ("Check", "study.rerun"), "verify": ("Check", "study.verify"),
    "tasks": ("List and set up", "look.tasks"), "plugins": ("List and set up", "look.plugins"),
    "schema": ("List and set up", "study.schema"), "warm": ("List and set up", "warm.warm"),
}  # fmt: skip
_LEARN = ("explore", "evaluate", "imagine", "figure", "diagnose", "curve")
_EVOLVE = ("train", "test")


def _command(name: str) -> click.Command:
    section, place = _COMMANDS[name]
    return command_in(place, section)


def _learn(name: str) -> click.Command:
    return command_in(f"learn.{name}")


def _evolve(name: str) -> click.Command:
    return command_in(f"evolve.{name}")


@click.group(
    cls=Group,
    made=LazyCommands(_COMMANDS, _command),
    alone=_FIRST,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Results depend on the settings and the seed only, not on the number of workers. With TEAMSIGHT_TRACEBACK=1 "
    "in the environment, an error is shown with Python's traceback.",
)
@click.version_option(__version__, prog_name="teamsight", message="%(prog)s %(version)s")
def commands() -> None:
    """How much must each robot of a team know of its teammates?

    teamsight simulates teams of mobile robots that observe moving targets, after C. Touzet, "Robot Awareness in
    Cooperative Mobile Robot Learning" (2000).

    \b
      teamsight demo                               two teams side by side
      teamsight watch                              a team that you change
      teamsight run --robots 10 --radius 5         how much does it observe?
      teamsight delta --robots 30 --radius 5       how many neighbours at most?
      teamsight reproduce --quick                  the figures on a coarse grid
      teamsight reproduce                          all figures, and the claims
      teamsight sweep study.toml --out results     thousands of your own runs
      teamsight learn explore --out m.safetensors  record transitions
    """


@click.group(cls=Group, section="Learn", made=LazyCommands(_LEARN, _learn))
def learn() -> None:
    """Explore once, and learn from the recorded transitions.

    \b
      teamsight learn explore --out m.safetensors  600 transitions
      teamsight learn evaluate m.safetensors       what a team learns from them
      teamsight learn imagine m.safetensors        a policy from imagined worlds
      teamsight learn figure --out curves          how many awareness needs
      teamsight learn diagnose --out diagnosis     what a learner makes of them
      teamsight learn curve --task pursuit         teams that learn as they act
    """


@click.group("evolve", cls=Group, section="Learn", made=LazyCommands(_EVOLVE, _evolve))
def evolution() -> None:
    """Find the constants of the policy 'evolved', and compare them.

    \b
      teamsight evolve train    find constants, or continue to do so
      teamsight evolve test     compare them with the best A-CMOMMT
    """


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; see `teamsight.cli.exits`."""
    run_and_exit(commands, arguments)
