"""Touzet (2000): the figures, and a ledger of which claims hold.

FIGURE is the number of a figure of the paper, 'delta' (observed targets against δ) or 'ledger' (the claims alone);
by default all are made. Each figure is written as a picture and its Parquet tables; runs have their seeds. The
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

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from teamsight.agents.presets import PRESETS
from teamsight.analysis.papers.reproduction import Contents, PaperPlan, Reproduction
from teamsight.analysis.runs.grid import FULL, QUICK, Grid
from teamsight.analysis.runs.limits import CellRuns, Steps
from teamsight.analysis.runs.seeds import root
from teamsight.core.component import Allowed, NonNegative, Seed

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.papers.touzet2000.ledger import Ledger
    from teamsight.analysis.runs.checkpoint import Checkpoint
    from teamsight.analysis.runs.files import Content
    from teamsight.analysis.runs.simulate import Watch

LEDGER = "ledger"


def names() -> tuple[str, ...]:
    """Return what can be made: the figures, and the ledger."""
    from teamsight.analysis.papers.touzet2000.figures import FIGURES

    return (*FIGURES, LEDGER)


_Figure = Annotated[str, Allowed(choices=names)]


@dataclass(frozen=True)
class Touzet(PaperPlan):
    """What to reproduce.

    Parameters
    ----------
    figures : tuple of str
        Which figures.
    runs : int
        Number of runs of each cell.
    steps : int
        Number of steps of each run.
    seed : int
        Seed of all runs.
    preset : str
        Settings with which figures are drawn, or 'defaults' for the default of every parameter.
    interval : float
        Explorations are added to a cell of Figure 11 until the 95 % interval of its gain is at most this wide
        [percentage points], or there are five for each of its runs; 0 makes all of them.
    grid : Grid
        Team sizes and radii of the surfaces.
    """

    figures: Annotated[tuple[_Figure, ...], Allowed(metavar="[FIGURE]...", is_argument=True, is_repeated=True)] = ()
    runs: CellRuns = 5
    steps: Steps = 600
    seed: Seed = root("reproduce")
    preset: Annotated[str, Allowed(choices=(*PRESETS, "defaults"))] = "touzet2000"
    interval: NonNegative = 8.0
    grid: Grid = FULL

    @property
    def made(self) -> list[str]:
        """What is made, in the order of `names`."""
        return [name for name in names() if name in (self.figures or names())]

    @property
    def drawn(self) -> list[str]:
        """The names of the figures that are drawn."""
        return [name for name in self.made if name != LEDGER]

    @property
    def settings(self) -> dict[str, Mapping[str, Any]]:
        """The settings by name: figures are drawn for the first, claims are judged for all."""
        return {self.preset: PRESETS.get(self.preset, {}), "defaults": {}}

    def in_words(self, runs: str = "") -> str:
        """Return what all runs of a figure have in common on one line, with the runs of each cell."""
        return f"{runs or self.runs} runs of {self.steps} steps, setting {self.preset}, seed {self.seed}"

    def conditions(self) -> dict[str, Any]:
        """Return the conditions that all results have in common, fit for JSON."""
        robots, radius = self.grid
        return {
            "seed": self.seed,
            "runs": self.runs,
            "steps": self.steps,
            "interval": self.interval,
            "robots": f"{len(robots)} team sizes, {min(robots)} to {max(robots)}",
            "radius": f"{len(radius)} radii, {min(radius):g} to {max(radius):g}",
            "settings": {name: dict(setting) for name, setting in self.settings.items()},
        }

    def tables(
        self, names: Sequence[set[str]], pool: Any, checkpoint: Checkpoint | None, further: int = 0, **progress: Any
    ) -> dict[str, dict[str, pd.DataFrame]]:
        """Make experiments, and return their tables by the name of the setting.

        Parameters
        ----------
        names : sequence of set of str
            The experiments of each setting.
        pool, checkpoint, **progress
            See `make_tables`.
        further : int
            How far the root seed is from that of the plan.
        """
        from teamsight.analysis.papers.touzet2000.experiments import experiments_of
        from teamsight.analysis.runs.experiment import make_tables

        asked = [(one, experiments_of(which)) for one, which in zip(self.settings.values(), names, strict=True)]
        how: dict[str, Any] = {"root": self.seed + further, "runs": self.runs, "steps": self.steps}
        how |= {"grid": self.grid, "interval": self.interval}
        made = make_tables(asked, pool, checkpoint=checkpoint, **how, **progress)
        return dict(zip(self.settings, made, strict=True))


class Results(NamedTuple):
    """The tables of the figures, by name and suffix; the runs behind the claims; the ledger, None if not asked for."""

    figures: Mapping[str, Mapping[str, pd.DataFrame]]
    runs: pd.DataFrame | None = None
    ledger: Ledger | None = None


@dataclass(frozen=True, kw_only=True)
class TouzetPaper(Reproduction[Touzet, Results]):
    """The reproduction, whose plan says which figures are drawn, and whether the claims are judged."""

    def names(self, plan: Touzet, folder: Path, formats: Sequence[str]) -> list[str]:
        files = [f"figure-{name}.{kind}" for name in plan.drawn for kind in ("parquet", *formats)]
        files += [file.name for name in plan.drawn for file in sorted(folder.glob(f"figure-{name}-*.parquet"))]
        return files + [f"ledger.{kind}" for kind in ("parquet", "md", "json") if LEDGER in plan.made]

    def about(self, plan: Touzet) -> dict[str, Any]:
        return plan.conditions()

    def title(self, plan: Touzet) -> str:
        return ", ".join(name if name == LEDGER else f"figure {name}" for name in plan.made)

    def contents(
        self, found: Results, plan: Touzet, formats: Sequence[str], pool: Any, watch: Watch
    ) -> Iterator[Contents]:
        from teamsight.analysis.papers.touzet2000.figures import FIGURES, pictures
        from teamsight.analysis.runs.executor import results_of

        jobs, number = [(name, tables, plan, formats) for name, tables in found.figures.items()], count(1)
        progress = lambda _: watch("drawing", next(number), len(jobs))  # noqa: E731
        name_of = lambda job: f"figure {job[0]}"  # noqa: E731
        drawn = results_of(pool, pictures, jobs, progress, name_of) if pool else map(pictures, jobs)
        for (name, tables), made in zip(found.figures.items(), drawn, strict=True):
            files: dict[str, Content] = {
                f"figure-{name}{suffix and '-'}{suffix}.parquet": table for suffix, table in tables.items()
            }
            files |= {f"figure-{name}.{kind}": picture for kind, picture in made.items()}
            yield files, {"figure": name, "title": FIGURES[name].title, "setting": plan.preset}
        if found.ledger is not None and found.runs is not None:
            text, values = found.ledger.to_markdown(), found.ledger.to_json()
            yield {"ledger.parquet": found.runs, "ledger.md": text, "ledger.json": values}, {}

    def summary(self, found: Results, plan: Touzet) -> list[str]:
        from teamsight.analysis.papers.touzet2000.figures import FIGURES

        lines: list[str] = []
        if (ledger := found.ledger) is not None:
            lines += [*ledger.summaries(), "", *ledger.lines()]
        said = {name: FIGURES[name].summarise for name in found.figures}
        return lines + [f"figure {name}: {say(found.figures[name])}" for name, say in said.items() if say]


def simulate(plan: Touzet, pool: Any, watch: Watch, checkpoint: Checkpoint | None) -> Results:
    """Make the experiments that the figures and claims of a plan read, the tables of figures, and the ledger."""
    import pandas as pd

    from teamsight.analysis.papers.touzet2000.claims import needed
    from teamsight.analysis.papers.touzet2000.figures import FIGURES
    from teamsight.analysis.papers.touzet2000.ledger import Ledger

    claimed = needed() if LEDGER in plan.made else set[str]()
    read = {name for figure in plan.drawn for name in FIGURES[figure].needs}
    tables = plan.tables(
        [claimed | (read if name == plan.preset else set()) for name in plan.settings], pool, checkpoint,
        progress=partial(watch, "simulating"), later=partial(watch, "measuring"),
    )  # fmt: skip
    figures = {name: FIGURES[name].tabulate(tables[plan.preset], plan) for name in plan.drawn}
    if not claimed:
        return Results(figures)
    runs = [
        table.assign(setting=setting, experiment=name)
        for setting, made in tables.items()
        for name, table in made.items()
        if name in claimed
    ]
    ledger = Ledger.of(plan, tables, repeated(plan, pool, tables, watch, checkpoint))
    return Results(figures, pd.concat(runs, ignore_index=True), ledger)


def repeated(
    plan: Touzet, pool: Any, tables: Mapping[str, Any], watch: Watch, checkpoint: Checkpoint | None
) -> dict[tuple[str, str], float]:
    """Return, by setting and claim, the share of further root seeds under which those near their limit hold."""
    from teamsight.analysis.papers.touzet2000.claims import CLAIMS, needed
    from teamsight.analysis.papers.touzet2000.ledger import SEEDS

    held = {
        (setting, name): 0
        for setting, made in tables.items()
        for name, claim in CLAIMS.items()
        if claim.is_near(made, plan.runs)
    }
    read = needed((CLAIMS[name] for _, name in held), beside=False)
    for number in range(1, SEEDS + 1) if held else ():
        found = plan.tables([read] * len(plan.settings), pool, checkpoint, number)
        for setting, name in held:
            held[setting, name] += bool(CLAIMS[name].judge(found[setting]).holds)
        watch("repeating", number, SEEDS)
    return {one: times / SEEDS for one, times in held.items()}


# The checkpoint and the files have no name of their own.
PAPER = TouzetPaper(plan=Touzet, name="", make=simulate, quick={"grid": QUICK, "interval": 0.0})
