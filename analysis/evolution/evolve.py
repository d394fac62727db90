"""Shape the learned rule (``train``), or measure the one shipped (``test``).

What ``train`` finds is copied by hand to ``policies/learned/constants.json``: which rule is shipped is a decision, not
a by-product.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.progress import Progress, TaskID

from teamsight import __version__
from teamsight.analysis.evolution import compare
from teamsight.analysis.evolution.cma import TEST, VALIDATE, Evolution, Generation, evolve, steps_a_trial
from teamsight.analysis.evolution.page import page, picture
from teamsight.analysis.runs import files
from teamsight.analysis.runs.simulate import IMPORTS
from teamsight.analysis.runs.workers import WorkerPool, cores
from teamsight.policies.evolved import Evolved
from teamsight.policies.evolved.layout import SILENCED, beginning, silenced
from teamsight.policies.evolved.policy import made, to_json

_KEPT_EACH = 100
_SCREEN_RUNS, _VALIDATE_RUNS = 10, 5
_ROAD = "road.json"


_Helpful = argparse.ArgumentDefaultsHelpFormatter


def main() -> None:
    """Read the command line and obey."""
    parser = argparse.ArgumentParser(description="Shape the learned rule, or measure the one shipped.")
    parser.add_argument("--workers", type=int, default=cores())
    jobs = parser.add_subparsers(dest="job", required=True)
    begin = jobs.add_parser("train", formatter_class=_Helpful, help="evolve the rule; run it again to go on")
    begin.add_argument("--out", default="evolution", help="folder of the log and of the rule found")
    begin.add_argument("--generations", type=int, default=400, help="in all")
    begin.add_argument("--population", type=int, default=Evolution.population, help="candidates of a generation")
    begin.add_argument("--seed", type=int, default=Evolution.seed, help="of the candidates")
    measure = jobs.add_parser("test", formatter_class=_Helpful, help="measure the rule on other noise")
    measure.add_argument("--constants", help="a rule that train found; by default the one shipped")
    measure.add_argument("--trained", help="folder of train: shows the road there too")
    measure.add_argument("--out", default="docs", help="folder of the page, its table and its picture")
    measure.add_argument("--runs", type=int, default=30, help="of each cell")
    given = parser.parse_args()
    if given.job == "train" and importlib.util.find_spec("cma") is None:
        parser.exit(2, "evolution needs the package cma: pip install 'teamsight[evolve]', or -e '.[evolve]'\n")
    folder = files.prepare_folder(given.out)
    with Progress() as bar, WorkerPool(given.workers, IMPORTS, bar.console.print) as pool:
        if given.job == "train":
            _train(Evolution(given.population, seed=given.seed), given.generations, folder, pool, bar)
        else:
            trained = Path(given.trained) if given.trained else None
            _test(Path(given.constants) if given.constants else None, trained, folder, given.runs, pool, bar)


def _train(evolution: Evolution, generations: int, folder: Path, pool: WorkerPool, bar: Progress) -> None:
    task = bar.add_task("evolving", total=generations)
    kept = {0: beginning(evolution.seed)}
    for generation in evolve(evolution, generations, folder, pool):
        bar.update(task, completed=generation.number)
        if generation.number % _KEPT_EACH == 0 or generation.number == generations:
            kept[generation.number] = generation.mean
            _save(folder, evolution, generation)
            if not bar.console.is_terminal:
                bar.console.print(f"{generation.number} of {generations} generations, worth {generation.worth:.4f}")
    task = bar.add_task("validating")
    rules = {str(number): Evolved(tuple(mean)) for number, mean in kept.items()}
    strongest = _strongest(compare.screen(pool, _SCREEN_RUNS))
    runs = compare.compare(pool, rules, strongest, root=VALIDATE, runs=_VALIDATE_RUNS, watch=_watch(bar, task))
    road = [
        {"generation": int(name), "robot_steps": int(name) * evolution.population * steps_a_trial()}
        | compare.overall(found)._asdict()
        for name, found in runs.items()
    ]
    files.write_json(folder / _ROAD, road, force=True)


def _save(folder: Path, evolution: Evolution, generation: Generation) -> None:
    trials = evolution.population * generation.number
    about = {
        "command": f"python -m teamsight.analysis.evolution.evolve train --generations {generation.number} "
        f"--population {evolution.population} --seed {evolution.seed}",
        "trials": trials,
        "robot_steps": trials * steps_a_trial(),
        "version": __version__,
    }
    files.write_json(folder / "constants.json", to_json(generation.mean, about), force=True)


def _test(
    constants: Path | None, trained: Path | None, folder: Path, runs: int, pool: WorkerPool, bar: Progress
) -> None:
    learned = Evolved.load(constants) if constants else Evolved()
    task = bar.add_task("screening A-CMOMMT")
    screened = compare.screen(pool, _SCREEN_RUNS, _watch(bar, task))
    strongest = _strongest(screened)
    task = bar.add_task("comparing")
    (found,) = compare.compare(
        pool, {"evolved": learned}, strongest, root=TEST, runs=runs, watch=_watch(bar, task)
    ).values()
    task = bar.add_task("silencing")
    parts = {name: Evolved(tuple(silenced(np.array(learned.constants), name))) for name in SILENCED}
    silent = compare.compare(
        pool, {"all": learned, **parts}, strongest, root=VALIDATE, runs=_VALIDATE_RUNS, watch=_watch(bar, task)
    )
    road = json.loads((trained / _ROAD).read_text(encoding="utf-8")) if trained else []
    table = pd.concat(
        [
            screened.assign(part="screen"),
            compare.by_cell(found).assign(part="cell"),
            pd.DataFrame([compare.overall(found)._asdict()]).assign(part="overall"),
            _gains(silent).assign(part="silenced"),
            pd.DataFrame(road).assign(part="road"),
        ],
        ignore_index=True,
    )
    about = {"version": __version__, "runs": runs, "made": made(constants) if constants else made()}
    files.write_table(folder / "learned.parquet", table, about, force=True)
    files.write_text(folder / "learned.md", page(table, about), force=True)
    files.write_bytes(files.prepare_folder(folder / "images") / "learned.png", picture(table, about), force=True)


def _gains(found: dict[str, pd.DataFrame]) -> pd.DataFrame:
    return pd.DataFrame([{"name": name, **compare.overall(rows)._asdict()} for name, rows in found.items()])


def _strongest(screened: pd.DataFrame) -> dict[str, Any]:
    return {str(name): screened[name].iloc[0] for name in compare.RULES_OF_A_CMOMMT}


def _watch(bar: Progress, task: TaskID) -> compare.Watch:
    return lambda done, total: bar.update(task, completed=done, total=total)


if __name__ == "__main__":
    main()
