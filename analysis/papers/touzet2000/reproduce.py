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
from teamsight.analysis.papers.reproduction import Paper, Plan
from teamsight.analysis.runs.grid import PAPER as PAPER_GRID
from teamsight.analysis.runs.grid import QUICK, Grid
from teamsight.analysis.runs.limits import CellRuns, Steps
from teamsight.analysis.runs.seeds import root
from teamsight.core.component import Allowed, Seed
from teamsight.core.version import __version__

if TYPE_CHECKING:
    import pandas as pd

    from teamsight.analysis.papers.touzet2000.figures import Conditions
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
class Touzet(Plan):
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
    grid : Grid
        Team sizes and radii of the surfaces.
    """

    figures: Annotated[tuple[_Figure, ...], Allowed(metavar="[FIGURE]...", is_argument=True, is_repeated=True)] = ()
    runs: CellRuns = 5
    steps: Steps = 600
    seed: Seed = root("reproduce")
    preset: Annotated[str, Allowed(choices=(*PRESETS, "defaults"))] = "touzet2000"
    grid: Grid = PAPER_GRID

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

    @property
    def common(self) -> Conditions:
        """What all runs of a figure have in common."""
        from teamsight.analysis.papers.touzet2000.figures import Conditions

        return Conditions(self.preset, self.settings[self.preset], self.seed, self.runs, self.steps)

    def conditions(self) -> dict[str, Any]:
        """Return the conditions that all results have in common, fit for JSON."""
        robots, radius = self.grid
        return {
            "seed": self.seed,
            "runs": self.runs,
            "steps": self.steps,
            "robots": f"{len(robots)} team sizes, {min(robots)} to {max(robots)}",
            "radius": f"{len(radius)} radii, {min(radius):g} to {max(radius):g}",
            "settings": {name: dict(setting) for name, setting in self.settings.items()},
        }


class Results(NamedTuple):
    """The tables of experiments, by name of the setting, and the ledger, None if it is not asked for."""

    tables: Mapping[str, Mapping[str, pd.DataFrame]]
    ledger: Ledger | None


@dataclass(frozen=True)
class TouzetPaper(Paper[Touzet, Results]):
    """The reproduction, whose plan says which figures are drawn, and whether the claims are judged."""

    def checkpoint(self, folder: Path) -> Checkpoint:
        from teamsight.analysis.runs.checkpoint import Checkpoint
        from teamsight.analysis.runs.run import OUTCOMES

        return Checkpoint(folder / ".checkpoint", OUTCOMES)

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
    ) -> Iterator[tuple[dict[str, Content], dict[str, Any]]]:
        import pandas as pd

        from teamsight.analysis.papers.touzet2000.claims import needed
        from teamsight.analysis.papers.touzet2000.figures import FIGURES, Job, make
        from teamsight.analysis.runs.executor import results_of

        tables = found.tables[plan.preset]
        jobs = [
            Job(name, {need: tables[need] for need in FIGURES[name].needs}, plan.common, tuple(formats))
            for name in plan.drawn
        ]
        number = count(1)
        progress = lambda _: watch("drawing", next(number), len(jobs))  # noqa: E731
        drawn = results_of(pool, make, jobs, progress, lambda job: f"figure {job.name}") if pool else map(make, jobs)
        for name, (made, pictures) in zip(plan.drawn, drawn, strict=True):
            contents: dict[str, Content] = {
                f"figure-{name}{suffix and '-'}{suffix}.parquet": table for suffix, table in made.items()
            }
            contents |= {f"figure-{name}.{kind}": picture for kind, picture in pictures.items()}
            yield contents, {"figure": name, "title": FIGURES[name].title, "setting": plan.preset}
        if found.ledger is not None:
            claimed = needed()
            runs = [
                table.assign(setting=setting, experiment=name)
                for setting, by_name in found.tables.items()
                for name, table in by_name.items()
                if name in claimed
            ]
            markdown, json = found.ledger.to_markdown(), found.ledger.to_json()
            yield {
                "ledger.parquet": pd.concat(runs, ignore_index=True), "ledger.md": markdown, "ledger.json": json,
            }, {}  # fmt: skip

    def summary(self, found: Results, plan: Touzet) -> list[str]:
        from textwrap import wrap

        from teamsight.analysis.papers.touzet2000.figures import FIGURES

        lines, tables = [], found.tables[plan.preset]
        if (ledger := found.ledger) is not None:
            lines += [*ledger.lines(), "", *(part for text in ledger.summaries() for part in wrap(text, 80))]
        for name in plan.drawn:
            if summarise := (figure := FIGURES[name]).summarise:
                made = figure.tabulate({need: tables[need] for need in figure.needs}, plan.common)
                lines.append(f"figure {name}: {summarise(made)}")
        return lines


def simulate(plan: Touzet, pool: Any, watch: Watch, checkpoint: Checkpoint | None) -> Results:
    """Make the experiments that the figures and claims of a plan read, and judge the claims."""
    from teamsight.analysis.papers.touzet2000.claims import needed
    from teamsight.analysis.papers.touzet2000.experiments import make_chosen
    from teamsight.analysis.papers.touzet2000.figures import FIGURES

    claimed = needed() if LEDGER in plan.made else set[str]()
    first, *others = plan.settings.values()
    drawn = {name for figure in plan.drawn for name in FIGURES[figure].needs}
    made = make_chosen(
        [(first, claimed | drawn), *((setting, claimed) for setting in others)], plan.grid, pool,
        root=plan.seed, runs=plan.runs, steps=plan.steps, checkpoint=checkpoint,
        progress=partial(watch, "simulating"), later=partial(watch, "measuring"),
    )  # fmt: skip
    tables = dict(zip(plan.settings, made, strict=True))
    if LEDGER not in plan.made:
        return Results(tables, None)
    return Results(tables, judged(plan, tables, repeated(plan, pool, tables, watch, checkpoint)))


def repeated(
    plan: Touzet, pool: Any, tables: Mapping[str, Any], watch: Watch, checkpoint: Checkpoint | None
) -> dict[tuple[str, str], float]:
    """Return, by setting and claim, the share of further root seeds under which those near their limit hold."""
    from teamsight.analysis.papers.touzet2000.claims import CLAIMS, needed
    from teamsight.analysis.papers.touzet2000.experiments import make_chosen
    from teamsight.analysis.papers.touzet2000.ledger import SEEDS

    held = {
        (setting, name): 0
        for setting, made in tables.items()
        for name, claim in CLAIMS.items()
        if claim.is_near(made, plan.runs)
    }
    names = needed((CLAIMS[name] for _, name in held), beside=False)
    for number in range(1, SEEDS + 1) if held else ():
        made = make_chosen(
            [(setting, names) for setting in plan.settings.values()], plan.grid, pool,
            root=plan.seed + number, runs=plan.runs, steps=plan.steps, checkpoint=checkpoint,
        )  # fmt: skip
        found = dict(zip(plan.settings, made, strict=True))
        for setting, name in held:
            held[setting, name] += bool(CLAIMS[name].judge(found[setting]).holds)
        watch("repeating", number, SEEDS)
    return {one: count / SEEDS for one, count in held.items()}


def judged(plan: Touzet, tables: Mapping[str, Any], shares: Mapping[tuple[str, str], float]) -> Ledger:
    """Return the ledger: the verdict on each claim under each setting."""
    from teamsight.analysis.papers.touzet2000.claims import CLAIMS
    from teamsight.analysis.papers.touzet2000.ledger import Ledger, options, scenario

    verdicts = {
        setting: {
            name: claim.judge(made, beside=True)._replace(share=shares.get((setting, name)))
            for name, claim in CLAIMS.items()
        }
        for setting, made in tables.items()
    }
    scenarios = {name: scenario(claim, tables, plan.steps) for name, claim in CLAIMS.items()}
    in_force = {
        setting: {name: options(claim, given) for name, claim in CLAIMS.items()}
        for setting, given in plan.settings.items()
    }
    return Ledger(verdicts, plan.conditions() | {"version": __version__}, scenarios, in_force)


PAPER = TouzetPaper(Touzet, LEDGER, "", lambda results, plan: {}, {}, make=simulate, quick={"grid": QUICK})
