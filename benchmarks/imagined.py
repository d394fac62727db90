"""What 9,600 transitions give a team that imagines worlds: `learn_model` and `imagine`, in five worlds, with controls.

Each exploration is made in the world in which the team then acts. Nothing was chosen on the root seed "imagination:
report". The searches are kept in the folder, so that an interrupted command continues.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.awareness import RingAwareness
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.learning.evaluation import BY_HAND
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.imagination import WorldModel, imagine, learn_model
from teamsight.analysis.learning.plans import EXPLORED, Imagining
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import minus
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.experiment import Experiment, Variant, make_tables
from teamsight.analysis.runs.files import prepare_folder, write_json
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies import ACmommt
from teamsight.policies.group_forces import BY_HAND as START
from teamsight.policies.group_forces import GroupForces

ROOT = root("imagination: report")
GRID = Grid((5, 10, 15, 20, 25, 30), tuple(float(radius) for radius in range(2, 10)))
RUNS, STEPS = 16, 600
#: Explorations of the default world, and of each other.
EXPLORATIONS, ELSEWHERE = 12, 3
#: Searches in guessed worlds, which need no exploration; each stands beside several explorations.
GUESSES = 4
#: The worlds that are compared: what differs from the default.
WORLDS: Mapping[str, Mapping[str, Any]] = {
    "nothing": {},
    "sensing range halved": {"sensing_range": 0.5},
    "sensing range doubled": {"sensing_range": 2.0},
    "awareness range halved": {"awareness_range": 0.5},
    "awareness range doubled": {"awareness_range": 2.0},
}
DEFAULT = next(iter(WORLDS))
#: A model that nobody learned: the default world's with speeds and turns half as large again.
GUESS = WorldModel(0.15, 0.1125, 1.0, 0.075, EXPLORED["radius"])
#: How the shipped constants were sought, in worlds of a learned model.
SHIPPED = Imagining(generations=60, robots=(5, 10, 15, 20, 25, 30))
LEARNED, LEARNED_ELSEWHERE, GUESSED, UNLEARNED = "learned", "learned in the default world", "guessed model", "start"
DESIGNED, EVOLVED, STRONGEST = "by hand, f = d", "evolved", "strongest A-CMOMMT"


@dataclass(frozen=True)
class Search:
    """One exploration, its model and the search in the worlds that this imagines; without a world, in guessed ones."""

    world: str
    number: int
    # Each is a chunk of its own.
    cost = 250_000.0

    @property
    def key(self) -> tuple[str, ...]:
        """See `Job`."""
        return "imagined", self.world, str(WORLDS.get(self.world, GUESS)), str(self.number), str(Imagining()), str(RUNS)

    def describe(self) -> str:
        """See `Job`."""
        return f"{self.world}, exploration {self.number}"

    def make(self, worlds: ReusedWorlds) -> dict[str, list[float]]:
        """Return the numbers of the model and the constants of the policy."""
        seed, model = model_seed(ROOT, self.number, 5, 10, 3.0), GUESS
        if self.world in WORLDS:
            model = learn_model(explore(Exploration(seed=seed, runs=RUNS, world=WORLDS[self.world])))
        policy = imagine(model, Imagining(seed=self.number))
        return {"model": list(model), "constants": list(policy.constants)}


def main() -> None:
    """Parse the command line, search, simulate and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("imagined"), help="folder for what is kept, and a row a run")
    parser.add_argument("--worlds", type=int, default=len(WORLDS), help="only the first so many")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--parts", action="store_true", help="only: what each part of the shipped constants is worth")
    parser.add_argument("--guess", type=Path, help="only: write here what the shipped search finds in guessed worlds")
    options = parser.parse_args()
    if options.guess:
        with WorkerPool(options.workers) as pool:
            constants = GroupForces.parts(imagine(GUESS, SHIPPED, EXPLORED["radius"], pool).constants)
        write_json(options.guess, {"constants": {name: part.tolist() for name, part in constants.items()}})
        return
    folder, names = prepare_folder(options.out), list(WORLDS)[: options.worlds]
    if options.parts:
        rows = parts()
        rows.to_parquet(folder / "imagined-parts.parquet", index=False)
        print(parts_table(rows))
        return
    count = dict.fromkeys(names, ELSEWHERE) | {DEFAULT: EXPLORATIONS}
    jobs = [Search(name, number) for name, several in {**count, GUESSED: GUESSES}.items() for number in range(several)]
    with WorkerPool(options.workers) as pool:
        found = run_all(jobs, pool, checkpoint=Checkpoint(folder / "imagined.checkpoint"), progress=_show)
        made = {(job.world, job.number): one for job, one in zip(jobs, found, strict=True)}
        asked = [(WORLDS[name], experiments(name, made, count[name])) for name in names]
        tables = make_tables(asked, pool, root=ROOT, runs=1, steps=STEPS)
    rows = pd.concat([_rows(of_world, world=name) for name, of_world in zip(names, tables, strict=True)])
    rows.to_parquet(folder / "imagined.parquet", index=False)
    (folder / "constants.json").write_text(json.dumps({str(key): one for key, one in made.items()}))
    print(report(rows), models(made), sep="\n\n")


def _rows(tables: Mapping[str, pd.DataFrame], **columns: str) -> pd.DataFrame:
    """Return a row for each run of some teams."""
    kept = ["robots", "targets", "radius", "replicate", "seed", "observed_fraction"]
    return pd.concat([table[kept].assign(team=team, **columns) for team, table in tables.items()])


def _show(done: float, total: float) -> None:
    print(f"{done / total:.0%} of the searches", end="\r", flush=True)


def experiments(name: str, made: Mapping[tuple[str, int], Any], count: int) -> list[Experiment]:
    """Return the teams of a world; each exploration runs every cell once."""
    others = {
        UNLEARNED: (GroupForces(GroupForces.vector(START)), RingAwareness()),
        DESIGNED: BY_HAND[DESIGNED],
        EVOLVED: ("evolved", "ring"),
        STRONGEST: (ACmommt(idle="wander", weights="shared", turn_probability=0, gain=4), "pairwise"),
    }
    searched = {LEARNED: name, LEARNED_ELSEWHERE: DEFAULT, GUESSED: GUESSED}
    found = []
    for team, world in searched.items():
        several = [one for (of, _), one in made.items() if of == world]
        policies = [GroupForces(tuple(several[number % len(several)]["constants"])) for number in range(count)]
        found.append(Experiment(team, partial(_variant, policies), GRID.cells, replicates=count))
    return found + [
        Experiment(team, {"policy": policy, "awareness": degree}, GRID.cells, replicates=count)
        for team, (policy, degree) in others.items()
    ]


def _variant(policies: list[GroupForces], setting: object, number: int) -> Variant:
    return Variant({"policy": policies[number], "awareness": "ring"}, {"exploration": number})


#: Which team is compared with which.
COMPARED = (
    (LEARNED, DESIGNED), (LEARNED, GUESSED), (LEARNED, LEARNED_ELSEWHERE), (LEARNED, EVOLVED), (LEARNED, STRONGEST),
    (UNLEARNED, DESIGNED),
)  # fmt: skip


def report(runs: pd.DataFrame) -> str:
    """Return the paired differences between teams in each world, with intervals over explorations, as Markdown."""
    tables = dict(iter(runs.groupby("world", sort=False)))
    gains = np.array([[_gains(of_world, *teams)[:ELSEWHERE] for teams in COMPARED] for of_world in tables.values()])
    rows = []
    for name, of_world in tables.items():
        designed = of_world[of_world["team"] == DESIGNED]["observed_fraction"].mean()
        each = [
            written(_by_search(gains) if GUESSED in teams else gains)
            for teams in COMPARED for gains in [_gains(of_world, *teams)]
        ]  # fmt: skip
        rows.append([name, f"{100 * designed:.1f}", *each])
    rows.append([f"mean, {ELSEWHERE} explorations each", "", *map(written, gains.mean(axis=0))])
    heads = (f"{one} minus {other} [pp]" for one, other in COMPARED)
    return markdown.table(["what is different", f"{DESIGNED} [%]", *heads], rows)


def written(gains: npt.NDArray[np.float64]) -> str:
    """Return the mean with half its 95 % interval; nothing for a team that is compared with itself."""
    one = interval_of(gains)
    return minus(f"{one.mean:+.2f} ± {one.high - one.mean:.2f}") if gains.any() else ""


def _gains(runs: pd.DataFrame, team: str, other: str) -> npt.NDArray[np.float64]:
    """Return by how much a team exceeds another on the mean of the grid [percentage points], by exploration."""
    one, two = (
        runs[runs["team"] == name].groupby("replicate")["observed_fraction"].mean() for name in (team, other)
    )
    return 100 * np.asarray(one - two, float)


def _by_search(gains: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the means of the explorations beside which the same guessed search stands: only these are independent."""
    return np.array([gains[number::GUESSES].mean() for number in range(min(GUESSES, len(gains)))])


#: The parts of the constants in words.
PARTS = {
    "law": "law of the distance", "margin": 'soft edge of "own"', "bias": 'advance for "own"',
    "held": "keeping what one held", "company": "company of own targets", "rivals": "number of rivals",
    "away": "target that moves away", "lead": "lead of a moving target", "decay": "memory of lost targets",
    "idle_taken": "taken targets and the group of the rival, idle robots",
    "busy_taken": "taken targets, robots with targets", "idle_teammate": "teammates, idle robots",
    "busy_teammate": "teammates, robots with targets", "idle_forward": "forward, idle robots",
    "busy_forward": "forward, others",
}  # fmt: skip
WHOLE, NONE = "nothing", "everything"


def parts() -> pd.DataFrame:
    """Return runs of the shipped constants, and of those of which a part is as it was at the start, on other worlds."""
    shipped, degree = GroupForces.parts(GroupForces().constants), RingAwareness()
    changed = {PARTS[name]: GroupForces(GroupForces.vector({**shipped, name: START[name]})) for name in shipped}
    policies = {WHOLE: GroupForces(), **changed, NONE: GroupForces(GroupForces.vector(START))}
    teams = [
        Experiment(name, {"policy": one, "awareness": degree}, GRID.cells, replicates=EXPLORATIONS)
        for name, one in policies.items()
    ]
    by_hand = Experiment(DESIGNED, dict(zip(("policy", "awareness"), BY_HAND[DESIGNED], strict=True)), GRID.cells,
                         replicates=EXPLORATIONS)  # fmt: skip
    (tables,) = make_tables([({}, [*teams, by_hand])], root=root("imagination: parts"), runs=1, steps=STEPS)
    return _rows(tables)


def parts_table(runs: pd.DataFrame) -> str:
    """Return what is lost without each part, as Markdown; that without which most is lost first."""
    ordered = sorted(PARTS.values(), key=lambda name: _gains(runs, name, WHOLE).mean())
    rows = [
        [name, *(written(_gains(runs, name, other)) for other in (DESIGNED, WHOLE))]
        for name in (WHOLE, *ordered, NONE)
    ]
    return markdown.table(["as at the start", f"minus {DESIGNED} [pp]", "minus the whole [pp]"], rows)


def models(made: Mapping[tuple[str, int], Any]) -> str:
    """Return the mean and standard deviation of each learned number, as Markdown."""
    rows = []
    for name in dict.fromkeys(world for world, _ in made):
        values = np.array([one["model"] for (world, _), one in made.items() if world == name])
        spread = values.std(axis=0, ddof=1)
        rows.append([name, *(f"{m:.3f} ± {s:.3f}" for m, s in zip(values.mean(axis=0), spread, strict=True))])
    return markdown.table(["what is different", *WorldModel._fields], rows)


if __name__ == "__main__":
    main()
