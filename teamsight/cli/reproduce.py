"""``teamsight reproduce``: a paper's runs, figures and claims; its options are the fields of its plan."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from teamsight.analysis.papers import DEFAULT, PAPERS
from teamsight.cli.options import Command, Divides, Folder, Format, Group, LazyCommands, Writes
from teamsight.core import checks
from teamsight.core.component import Allowed, Flag

if TYPE_CHECKING:
    from teamsight.analysis.papers.reproduction import Reproduction


@dataclass(frozen=True, kw_only=True)
class PaperSettings(Divides, Writes):
    """Options of the command of each paper, beside the fields of its plan.

    Parameters
    ----------
    out : Path
        Folder for the results.
    format : sequence of str
        Formats of the pictures, with commas between them.
    quick : bool
        Make a coarse result.
    """

    out: Folder = Path("results")
    format: Annotated[tuple[Format, ...], Allowed()] = ("png",)
    quick: Flag = False


class Papers(Group):
    """The group of the papers; the paper of 2000 is meant where none is named.

    Attributes
    ----------
    default : str
        The command that is meant.
    """

    default = DEFAULT

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = args[0] if args else ""
        if named in (*self.commands, "-h", "--help"):
            return super().parse_args(ctx, args)
        # An option is no misspelt command, however close: --out stands in "touzet2000".
        if named and not named.startswith("-"):
            _check_figure(named, self.commands, ctx.find_root().command)
        return super().parse_args(ctx, [self.default, *args])


def _check_figure(named: str, papers: Iterable[str], program: Any) -> None:
    """Refuse the name of neither a figure nor a paper, which may be near one, or near a command of the program."""
    from teamsight.analysis.papers.touzet2000 import names

    figures = names()
    if named in figures:
        return
    near = checks.suggestion(named, (*papers, *figures, *program.commands))
    if near and near not in (checks.suggestion(named, papers), checks.suggestion(named, figures)):
        near = near.replace("'", "'teamsight ", 1)
    what = "figures" if near == checks.suggestion(named, figures) else "command"
    raise ValueError(
        f"{what}={checks.shown(named)}: unknown; {near}known are the figures {', '.join(figures)} and the papers "
        f"{', '.join(papers)}"
    )


@cache
def command_of(name: str) -> Command:
    """Return the command of a paper: the fields of its plan are options, and the text of its file is the help."""
    paper = PAPERS[name]
    settings = type(f"Settings of {name}", (paper.plan, PaperSettings), {"__annotations__": {}})

    def work(settings: Any) -> None:
        _reproduce(name, settings)

    work.__name__, work.__doc__ = name, import_module(paper.plan.__module__).__doc__
    return Command(work, dataclass(frozen=True, kw_only=True)(settings))


def _reproduce(name: str, settings: Any) -> None:
    """Make the results of a paper, and say what they are."""
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import kept_in, say, working

    paper = PAPERS[name]
    plan = plan_in(settings, paper)
    folder = prepare_folder(settings.out)
    began = time.perf_counter()
    with working(settings, lambda: kept_in(folder, paper.checkpoint(folder).count())) as (watch, pool):
        found = paper.reproduce(plan, folder, pool, watch, settings.format, force=settings.force)
    for line in paper.summary(found, plan):
        say(line)
    say(f"{paper.title(plan)} in {folder} after {time.perf_counter() - began:.0f} s")


def plan_in(settings: Any, paper: Reproduction[Any, Any]) -> Any:
    """Return the plan of a paper in the settings of its command."""
    values = {one.name: getattr(settings, one.name) for one in fields(paper.plan)}
    with paper.blamed("quick"):
        paper.plan(**paper.quick)  # also without --quick: a mistake in it is found in any case
    coarse = paper.quick if settings.quick else {}
    return paper.plan(**values | {name: value for name, value in coarse.items() if name not in settings.given})


def _command(name: str) -> Command:
    try:
        return command_of(name)
    except Exception as error:
        # All papers are imported for the help of one.
        raise ValueError(f"the paper {name!r} cannot be read: {type(error).__name__}: {error}") from error


@click.group("reproduce", cls=Papers, section="Check", made=LazyCommands(PAPERS, _command))
def papers() -> None:
    """Reproduce a paper: its runs, its figures and its claims.

    Without the name of a paper, that of Touzet (2000), whose figures have numbers.

    \b
      teamsight reproduce                       all its figures, and its claims
      teamsight reproduce 4 5                   two of its figures
      teamsight reproduce tan1993 --quick       another paper, coarse and fast
      teamsight reproduce tan1993 --help        its options
    """
