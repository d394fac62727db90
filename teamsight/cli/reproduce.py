"""``teamsight reproduce``: a paper's runs, figures and claims; its options are the fields of its plan."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from teamsight.agents.settings import PRESETS
from teamsight.analysis.papers import PAPERS
from teamsight.analysis.runs.limits import Steps
from teamsight.cli.options import CellRuns, Command, Folder, Format, Group, Works, Writes
from teamsight.core import checks
from teamsight.core.component import Allowed, Flag, Seed

if TYPE_CHECKING:
    from teamsight.analysis.papers.reproduction import Paper
    from teamsight.analysis.papers.touzet2000.reproduce import Plan

_LEDGER = "ledger"
#: The paper whose figures have numbers.
_FIRST = "touzet2000"


def _figures() -> Iterable[str]:
    from teamsight.analysis.papers.touzet2000.figures import FIGURES

    return (*FIGURES, _LEDGER)


_Figure = Annotated[str, Allowed(choices=_figures)]


@dataclass(frozen=True, kw_only=True)
class PaperSettings(Works, Writes):
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


@dataclass(frozen=True, kw_only=True)
class ReproduceSettings(PaperSettings):
    """Options of ``teamsight reproduce touzet2000``.

    Parameters
    ----------
    figures : sequence of str
        Which figures.
    runs : int
        Number of runs of each cell.
    steps : int
        Number of steps of each run.
    seed : int
        Seed of all runs.
    preset : str
        Settings with which figures are drawn, or 'defaults' for the default of every parameter.
    """

    figures: Annotated[tuple[_Figure, ...], Allowed(metavar="[FIGURE]...", is_argument=True, is_repeated=True)] = ()
    runs: CellRuns = 5
    steps: Steps = 600
    seed: Seed = 2000
    preset: Annotated[str, Allowed(choices=(*PRESETS, "defaults"))] = "touzet2000"


class _Commands(Mapping[str, click.Command]):
    """The commands of all papers; each is made, and its file imported, when it is asked for."""

    def __iter__(self) -> Iterator[str]:
        return iter((_FIRST, *PAPERS))

    def __len__(self) -> int:
        return 1 + len(PAPERS)

    def __getitem__(self, name: str) -> click.Command:
        return Command(touzet2000, ReproduceSettings) if name == _FIRST else command_of(name)


class Papers(Group):
    """The group of the papers; the paper of 2000 is meant where none is named.

    Attributes
    ----------
    default : str
        The command that is meant.
    """

    default = _FIRST

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.commands: Any = _Commands()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = args[0] if args else ""
        is_command = named in (*self.commands, "-h", "--help")
        # An option or a figure is no misspelt command, however close: --out stands in "touzet2000".
        if not is_command and not named.startswith("-") and checks.suggestion(named, self.commands):
            is_command = named not in _figures()
        return super().parse_args(ctx, args if named and is_command else [self.default, *args])


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
    paper.check(plan, folder, settings.format, force=settings.force)
    began = time.perf_counter()
    with working(settings, lambda: kept_in(folder, paper.checkpoint(folder).count())) as (watch, pool):
        found = paper.reproduce(plan, folder, pool, watch, settings.format, force=settings.force)
    for line in paper.summary(found, plan):
        say(line)
    say(f"{name} in {folder} after {time.perf_counter() - began:.0f} s")


def plan_in(settings: Any, paper: Paper[Any, Any]) -> Any:
    """Return the plan of a paper in the settings of its command."""
    values = {one.name: getattr(settings, one.name) for one in fields(paper.plan)}
    coarse = paper.quick if settings.quick else {}
    return paper.plan(**values | {name: value for name, value in coarse.items() if name not in settings.given})


def touzet2000(settings: ReproduceSettings) -> None:
    """Touzet (2000): the figures, and a ledger of which claims hold.

    FIGURE is the number of a figure of the paper, 'delta' (observed targets against δ) or 'ledger' (the claims alone);
    by default all are made. Each figure is written as a picture and a Parquet table with the seed of every run. The
    ledger lists which of the paper's claims hold, and by which rule, for the preset and for the default settings. After
    an interruption the same command continues from there. The name of the paper can be left out.

    \b
    Examples:
      teamsight reproduce                         everything, to results/
      teamsight reproduce 4 5 --out neighbours    the two figures on neighbours
      teamsight reproduce 11                      what lazy learning gains
      teamsight reproduce --quick --workers 1     coarse and fast
      teamsight reproduce ledger --seed 7         the claims with other noise
    """
    from teamsight.analysis.papers.touzet2000.reproduce import check_results, checkpoint_in
    from teamsight.analysis.papers.touzet2000.reproduce import reproduce as make
    from teamsight.analysis.runs.files import prepare_folder
    from teamsight.cli.show import kept_in, say, show_ledger, working

    folder = prepare_folder(settings.out)
    plan = plan_of(settings)
    check_results(plan, folder, force=settings.force)
    began = time.perf_counter()
    with working(settings, lambda: kept_in(folder, checkpoint_in(folder).count())) as (watch, pool):
        ledger = make(plan, folder, pool, watch, force=settings.force)
    if ledger is not None:
        show_ledger(ledger)
    for line in _summaries(plan, folder):
        say(line)
    made = [f"figure {name}" for name in plan.figures] + (["ledger"] if ledger else [])
    say(f"{', '.join(made)} in {folder} after {time.perf_counter() - began:.0f} s")


def plan_of(settings: ReproduceSettings) -> Plan:
    """Return the plan that the settings describe."""
    from teamsight.analysis.papers.touzet2000.figures import FIGURES
    from teamsight.analysis.papers.touzet2000.reproduce import Plan
    from teamsight.analysis.runs.experiment import PAPER, QUICK

    everything = not settings.figures
    return Plan(
        settings={settings.preset: PRESETS.get(settings.preset, {}), "defaults": {}},
        figures=tuple(name for name in FIGURES if everything or name in settings.figures),
        ledger=everything or _LEDGER in settings.figures,
        grid=QUICK if settings.quick else PAPER,
        runs=settings.runs,
        steps=settings.steps,
        root=settings.seed,
        formats=settings.format,
    )


def _summaries(plan: Plan, folder: Path) -> Iterator[str]:
    import pandas as pd

    from teamsight.analysis.papers.touzet2000.figures import FIGURES

    for name in plan.figures:
        if summarise := FIGURES[name].summarise:
            found = folder.glob(f"figure-{name}-*.parquet")
            tables = {file.stem.removeprefix(f"figure-{name}-"): pd.read_parquet(file) for file in found}
            yield f"figure {name}: {summarise(tables)}"
