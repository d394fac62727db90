"""The command line: all commands. Nothing slow is imported here, so that ``--help`` answers at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NoReturn

import click

from teamsight import __version__
from teamsight.cli import calibrate, delta, demo, evolve, look, reproduce, study, warm
from teamsight.cli import learn as learning
from teamsight.cli.exits import run_and_exit
from teamsight.cli.options import Command, Group, Options

# What stands there for somebody who types the name of the program and nothing else.
_FIRST = """\
teamsight demo                            watch two teams side by side
teamsight watch                           watch a team, and change it
teamsight run --robots 10 --radius 5      how much does a team observe?
teamsight delta --robots 30 --radius 5    how many neighbours at most?
teamsight --help                          all commands"""


@click.group(
    cls=Group,
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


@click.group(cls=Group, section="Learn")
def learn() -> None:
    """Explore once, and learn from the recorded transitions.

    \b
      teamsight learn explore --out m.safetensors  600 transitions
      teamsight learn evaluate m.safetensors       what a team learns from them
      teamsight learn figure --out curves          how many awareness needs
      teamsight learn diagnose --out diagnosis     what a learner makes of them
      teamsight learn curve --task pursuit         teams that learn as they act
    """


@click.group("evolve", cls=Group, section="Learn")
def evolution() -> None:
    """Find the constants of the policy 'evolved', and compare it with A-CMOMMT.

    \b
      teamsight evolve train    find constants, or continue to do so
      teamsight evolve test     compare them with the best A-CMOMMT
    """


@click.group("reproduce", cls=reproduce.Papers, section="Reproduce")
def papers() -> None:
    """Reproduce a paper: its runs, its figures and its claims.

    Without the name of a paper, that of Touzet (2000), whose figures have numbers.

    \b
      teamsight reproduce                       all its figures, and its claims
      teamsight reproduce 4 5                   two of its figures
      teamsight reproduce tan1993 --quick       another paper, coarse and fast
      teamsight reproduce tan1993 --help        its options
    """


_COMMANDS: dict[str, tuple[Any, ...]] = {
    "Look": (
        (demo.demo, demo.DemoSettings), (look.watch, look.WatchSettings), (look.run, look.RunSettings),
        (look.tasks, look.TasksSettings), (look.plugins, Options),
    ),
    "Measure": ((delta.delta, delta.DeltaSettings),),
    "Study": (
        (study.sweep, study.SweepSettings), (study.status, study.StatusSettings), (study.plot, study.PlotSettings),
        (study.rerun, study.RerunSettings), (study.verify, study.VerifySettings),
        (study.submit, study.SubmitSettings), (study.schema, Options),
    ),
    "Learn": (learn, evolution),
    "Reproduce": (papers, (calibrate.calibrate, calibrate.CalibrateSettings)),
    "Set up": ((warm.warm, Options),),
}  # fmt: skip
_LEARN: tuple[tuple[Any, type[Options]], ...] = (
    (learning.explore, learning.ExploreSettings), (learning.evaluate, learning.EvaluateSettings),
    (learning.figure, learning.FigureSettings), (learning.diagnose, learning.DiagnoseSettings),
    (learning.curve, learning.CurveSettings),
)  # fmt: skip

for _section, _made in _COMMANDS.items():
    for _command in _made:
        if isinstance(_command, tuple):
            _command = Command(_command[0], _command[1], _section)
        commands.add_command(_command)
for _work, _settings in _LEARN:
    learn.add_command(Command(_work, _settings))
evolution.add_command(Command(evolve.train, evolve.TrainSettings))
evolution.add_command(Command(evolve.test, evolve.TestSettings))


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; see `teamsight.cli.exits`."""
    run_and_exit(commands, arguments)
