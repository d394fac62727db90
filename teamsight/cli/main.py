"""The commands and their options, and how errors leave: one line each, no traceback.

Nothing slow is imported here: each command imports what it needs when it is called, so that help answers at once.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

import click

from teamsight import __version__
from teamsight.cli import streams
from teamsight.cli.errors import one_line
from teamsight.cli.learn_commands import learn
from teamsight.cli.options import Commands, text

#: Exit statuses.
WRONG_INPUT, INTERRUPTED = 2, 130

_CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 110, "show_default": True}


@click.group(
    cls=Commands,
    context_settings=_CONTEXT,
    epilog="Every result depends on its settings and its seed alone, not on the number of workers.",
)
@click.version_option(__version__, prog_name="teamsight", message="%(prog)s %(version)s")
def commands() -> None:
    """How much must each robot of a team know of its teammates?

    teamsight simulates teams of mobile robots that observe moving targets (CMOMMT), after C. Touzet, "Robot Awareness
    in Cooperative Mobile Robot Learning" (2000).

    \b
      teamsight run --robots 10 --radius 5           one world: how much does the team see?
      teamsight delta --robots 30 --radius 5         how many neighbours must a robot be ready for?
      teamsight reproduce --quick                    the paper's figures on a coarse grid, in half a minute
      teamsight reproduce                            all of them, and which claims hold: about two minutes
      teamsight learn explore --out m.safetensors    let robots act at random, and keep what they met
    """


commands.add_command(learn)


@commands.command()
@click.argument("figures", nargs=-1, metavar="[FIGURE]...")
@text("--out", default="results", metavar="FOLDER", help="Where to write.")
@text("--runs", default=5, metavar="INTEGER", help="Runs of each cell.")
@text("--steps", default=600, metavar="INTEGER", help="Steps of each run.")
@text("--workers", metavar="INTEGER", help="Processes.  [default: the cores of this machine]")
@text("--seed", default=2000, metavar="INTEGER", help="Seed of everything.")
@text("--preset", default="touzet2000", metavar="NAME", help="Setting to draw; 'defaults' draws the default setting.")
@click.option("--quick", is_flag=True, help="A coarse grid of team sizes and radii.")
@click.option("--force", is_flag=True, help="Replace files in FOLDER that teamsight did not write.")
def reproduce(**given: Any) -> None:
    """Draw the paper's figures and check its claims.

    FIGURE is 2 to 11, 'delta' (observed targets against δ), or 'ledger' (the claims alone); without any, all are made.
    Each figure becomes a PNG and a tidy Parquet table with every run's seed. The ledger tells which of the paper's
    claims hold, by which rule, for the preset and for the default setting. Interrupted, the same command goes on.

    \b
    Examples:
      teamsight reproduce                         everything, into results/
      teamsight reproduce 4 5 --out neighbours    the two figures on neighbours
      teamsight reproduce 11                      lazy learning: what awareness adds
      teamsight reproduce --quick --workers 1     a first look
      teamsight reproduce ledger --seed 7         do the claims hold on other noise?
    """
    from teamsight.cli import reproduce as command

    command.execute(**given)


@commands.command()
@text("--robots", metavar="INTEGER", help="Robots of the team.  [default: 30]")
@text("--targets", metavar="INTEGER", help="Targets, which matter to policies that follow them.  [default: 15]")
@text("--radius", metavar="NUMBER", help="Radius of the arena, in sensing ranges.  [default: 5]")
@text("--policy", metavar="NAME", help="What the robots do meanwhile.  [default: random-walk]")
@text("--preset", metavar="NAME", help="What calibration found for what the paper leaves open: touzet2000.")
@text("--awareness-range", metavar="NUMBER", help="Who is nearer is a neighbour.  [default: 1; needed with --tracks]")
@text("--risk", metavar="NUMBER", help="Accepted probability that a run has more neighbours.  [default: 0.01]")
@text("--runs", metavar="INTEGER", help="Runs to explore with.  [default: 10 / risk]")
@text("--steps", metavar="INTEGER", help="Steps of each run.  [default: 600]")
@text("--seed", metavar="INTEGER", help="Seed of the exploration.  [default: 0]")
@text("--tracks", metavar="FILE", help="Recorded positions: CSV or Parquet; columns time, robot, x, y, optionally run.")
@text("--window", metavar="NUMBER", help="Length of a stretch of the record for which the risk is stated.")
@click.option("--sort", is_flag=True, default=None, help="Sort recorded positions whose times go back.")
@text("--out", metavar="FOLDER", help="Write tables, report and picture there.")
@click.option("--force", is_flag=True, default=None, help="Replace what stands there, whatever it is.")
def delta(**given: Any) -> None:
    """Choose δ: how many neighbours must a robot be ready for?

    Explores the world, or reads recorded positions, and tells the smallest δ such that in a run no robot has more
    than δ neighbours but for the risk, with its uncertainty; how many of them a ring of δ sensors shows; and what δ
    costs in inputs, compared with the other degrees of awareness.

    \b
    Examples:
      teamsight delta --robots 30 --radius 5
      teamsight delta --robots 30 --radius 2 --policy a-cmommt --risk 0.001
      teamsight delta --tracks tracks.csv --awareness-range 1.0 --window 60
    """
    from teamsight.cli import delta as command

    command.execute(**given)


@commands.command()
@text("--robots", default=10, metavar="INTEGER", help="Robots of the team.")
@text("--targets", default=15, metavar="INTEGER", help="Targets to observe.")
@text("--radius", default=5.0, metavar="NUMBER", help="Radius of the arena, in sensing ranges.")
@text("--policy", default="a-cmommt", metavar="NAME", help="What the robots do, such as a-cmommt, centroid or learned.")
@text(
    "--awareness", default="pairwise", metavar="NAME", help="What is known of teammates: none, ring, pairwise, shared."
)
@text("--delta", metavar="INTEGER", help="Sectors of the ring.  [default: 16]")
@text("--awareness-range", default=1.0, metavar="NUMBER", help="How far teammates are perceived, in sensing ranges.")
@text("--steps", default=600, metavar="INTEGER", help="Steps to run.")
@text("--seed", default=0, metavar="INTEGER", help="Seed of the world.")
@text("--preset", metavar="NAME", help="What calibration found for what the paper leaves open: touzet2000.")
@text("--save", metavar="FILE", help="Write the history, one row a step, as Parquet.")
@click.option("--force", is_flag=True, help="Replace what stands there, whatever it is.")
def run(**given: Any) -> None:
    """Run one world and tell how much its team observes.

    \b
    Examples:
      teamsight run --policy a-cmommt --robots 10 --radius 5
      teamsight run --policy centroid --awareness none --robots 30 --radius 3 --seed 7
      teamsight run --awareness ring --delta 8 --steps 2000 --save run.parquet
    """
    from teamsight.cli import run as command

    command.execute(**given)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit.

    0 when all went well; 2 when the input is wrong, or results cannot be written; 130 after Ctrl-C. There is no other
    status: a reader of standard output that goes away, such as head, is no error, since all files are written before
    anything is printed; and where standard error cannot be written, the status alone tells what happened.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # δ, and names of files, on a terminal or in a pipe that cannot encode them: no reason to lose the results.
        sys.stdout.reconfigure(errors="backslashreplace")
    output = sys.stdout
    try:
        status = commands.main(args=arguments, prog_name="teamsight", standalone_mode=False)
        streams.flush(output)
    except (click.Abort, KeyboardInterrupt) as stop:
        if isinstance(stop.__cause__, EOFError):
            # click takes any end of a file for one of the terminal.
            _fail(stop.__cause__)
        # click puts its own error around the one that a command may have said more with.
        kept = str(stop.__cause__ or stop) or "every file written so far is complete"
        _leave([f"interrupted; {kept}"], INTERRUPTED)
    except click.ClickException as error:
        context = error.ctx if isinstance(error, click.UsageError) else None
        hint = f"; see {context.command_path} --help" if context else ""
        _leave([error.format_message().rstrip(".") + hint], WRONG_INPUT)
    except SystemExit:
        # What click makes of a pipe that nobody reads; those to workers do not come this far.
        _leave([], 0)
    except Exception as error:
        if _is_interrupt(error):
            _leave(["interrupted; every file written so far is complete"], INTERRUPTED)
        failure = streams.failure_of(output, error) if isinstance(error, OSError) else None
        if isinstance(failure, BrokenPipeError):
            _leave([], 0)
        _fail(failure or error)
    _leave([], status or 0)


def _fail(error: Exception) -> NoReturn:
    if os.environ.get("TEAMSIGHT_TRACEBACK"):
        raise error
    from teamsight.cli.errors import lines

    _leave(lines(error), WRONG_INPUT)


def _is_interrupt(error: BaseException | None) -> bool:
    """Say whether this is what Python or a library made of an interrupt, and not an error in handling one."""
    if isinstance(error, OSError | ValueError):
        return False
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _leave(messages: Sequence[str], status: int) -> NoReturn:
    with contextlib.suppress(OSError):
        for message in messages:
            click.echo(f"teamsight: {one_line(message)}", err=True)
    streams.settle()
    sys.exit(status)
