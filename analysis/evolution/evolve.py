"""The two commands of evolution: train the constants of the evolved policy, and evaluate them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from teamsight import __version__
from teamsight.analysis.evolution import cma, compare
from teamsight.analysis.evolution.cma import Evolution, Generation
from teamsight.analysis.evolution.compare import options_of
from teamsight.analysis.evolution.generalise import generalise
from teamsight.analysis.evolution.page import page, picture
from teamsight.analysis.runs import files
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Progress, Watch
from teamsight.policies.evolved import SILENCED, Evolved, made, silenced, to_json

CONSTANTS, TRAINING = "constants.json", "training.json"
# Columns of a validated generation.
_POINT = ("generation", "robot_steps", *compare.Gain._fields)
# Constants are saved and validated every so many generations.
_SAVE_EVERY = 100
_SCREEN_RUNS, _VALIDATE_RUNS = 10, 5


def train(
    evolution: Evolution,
    generations: int,
    folder: Path,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    *,
    force: bool = False,
) -> None:
    """Evolve constants, validate them on other worlds, and write both to a folder.

    The folder receives ``constants.json``, ``training.json`` and ``evolution.checkpoint``. The latter stays: from it an
    interrupted call resumes, and one with more generations continues.

    Parameters
    ----------
    evolution : Evolution
        Its parameters.
    generations : int
        Number of generations in all.
    folder : Path
        An existing folder.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    watch : callable
        Called with the phase, the work done and the work in all.
    force : bool
        Replace files that teamsight did not write, and those of other evolutions.

    Raises
    ------
    ModuleNotFoundError
        If the package cma is not installed.
    ValueError
        If a file in `folder` belongs to another evolution, or must not be replaced.
    """
    cma.check_installed()
    for name in (CONSTANTS, TRAINING):
        files.check_replaceable(folder / name, asdict(evolution), force=force)
    checkpoint = cma.checkpoint_in(folder)
    checkpoint.check()
    means = {0: evolution.begin()}
    for generation in cma.evolve(evolution, generations, checkpoint, pool):
        watch("evolving", generation.number, generations)
        if generation.number % _SAVE_EVERY == 0 or generation.number == generations:
            means[generation.number] = generation.mean
            _save(folder / CONSTANTS, evolution, generation, force)
    policies = {str(number): Evolved(tuple(mean)) for number, mean in means.items()}
    options = options_of(compare.screen(_SCREEN_RUNS, pool, _phase(watch, "screening")))[0]
    differences = compare.compare(
        policies, options, pool, root=cma.VALIDATE, runs=_VALIDATE_RUNS, progress=_phase(watch, "validating")
    )
    points = [
        {"generation": int(name), "robot_steps": int(name) * evolution.population * cma.robot_steps()}
        | compare.overall(found)._asdict()
        for name, found in differences.items()
    ]
    files.write_json(folder / TRAINING, _marked(evolution) | {"options": options, "points": points}, force=force)


def evaluate(
    folder: Path,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    *,
    constants: Path | None = None,
    training: Path | None = None,
    further: Path | None = None,
    runs: int = 30,
    force: bool = False,
) -> None:
    """Compare constants with the strongest A-CMOMMT on worlds that shaped neither, and write page, table and picture.

    The folder receives ``evolved.md``, ``evolved.parquet`` and ``images/evolved.png``.

    Parameters
    ----------
    folder : Path
        An existing folder.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    watch : callable
        Called with the phase, the work done and the work in all.
    constants : Path, optional
        A file that `train` wrote; by default the constants that ship with the package.
    training : Path, optional
        The folder of `train`, whose validated generations the page shows.
    further : Path, optional
        The folder of an evolution that began with the constants, for the same purpose.
    runs : int
        Runs of each cell.
    force : bool
        Replace files that teamsight did not write.

    Raises
    ------
    ValueError
        If a file holds no constants or no validated generations, or a file in `folder` must not be replaced.
    """
    table_file, page_file = folder / "evolved.parquet", folder / "evolved.md"
    for file in (table_file, page_file, folder / "images" / "evolved.png"):
        files.check_replaceable(file, force=force)
    policy = Evolved.load(constants) if constants else Evolved()
    points, trained = _progress(training / TRAINING) if training else ([], {})
    more, continued = _progress(further / TRAINING) if further else ([], {})
    about = {
        "version": __version__, "runs": runs, "made": made(constants) if constants else made(),
        "trained": trained, "continued": continued, "further": made(further / CONSTANTS) if further else None,
    }  # fmt: skip
    table = pd.concat(
        [
            *_compared(policy, runs, pool, watch),
            pd.DataFrame(points).assign(part="training"),
            pd.DataFrame(more).assign(part="further"),
        ],
        ignore_index=True,
    )
    files.write_table(table_file, table, about, force=force)
    files.write_page(page_file, page(table, about), force=force)
    images = files.prepare_folder(folder / "images")
    files.write_bytes(images / "evolved.png", picture(table, about), force=force)


def _compared(policy: Evolved, runs: int, pool: WorkerPool | None, watch: Watch) -> list[pd.DataFrame]:
    """Screen A-CMOMMT, and return all comparisons of the policy with the best of it."""
    screened = compare.screen(_SCREEN_RUNS, pool, _phase(watch, "screening"))
    options = options_of(screened)[0]
    (found,) = compare.compare(
        {"evolved": policy}, options, pool, root=cma.TEST, runs=runs, progress=_phase(watch, "comparing")
    ).values()
    ablated = {name: Evolved(tuple(silenced(np.array(policy.constants), name))) for name in SILENCED}
    ablations = compare.compare(
        {"none": policy, **ablated}, options, pool,
        root=cma.VALIDATE, runs=_VALIDATE_RUNS, progress=_phase(watch, "ablating"),
    )  # fmt: skip
    elsewhere = generalise(policy, options, pool, runs=runs, progress=_phase(watch, "generalising"))
    return [
        screened.assign(part="screen"),
        compare.by_cell(found).assign(part="cell"),
        _gains({"evolved": found}).drop(columns="name").assign(part="overall"),
        _gains(ablations).assign(part="ablation"),
        elsewhere.assign(part="generalisation"),
    ]


def _save(file: Path, evolution: Evolution, generation: Generation, force: bool) -> None:
    trials = evolution.population * generation.number
    further = f" --start {CONSTANTS} --spread {evolution.spread:g}" if evolution.start else ""
    about = {
        "command": f"teamsight evolve train --generations {generation.number} --population {evolution.population} "
        f"--seed {evolution.seed}{further}",
        "trials": trials,
        "robot_steps": trials * cma.robot_steps(),
        "version": __version__,
    }
    files.write_json(file, _marked(evolution) | to_json(generation.mean, about), force=force)


def _progress(file: Path) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Return the validated generations of a training, and the options of A-CMOMMT with which they were compared."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        found = [{name: point[name] for name in _POINT} for point in content["points"]]
        options = {name: content["options"][name] for name in compare.OPTIONS}
    except (ValueError, TypeError, KeyError):
        found, options = [{"generation": None}], {}
    if not all(isinstance(value, int | float) for point in found for value in point.values()):
        raise ValueError(f"{file}: holds no validated generations; make it again with `teamsight evolve train`")
    return found, options


def _marked(evolution: Evolution) -> dict[str, Any]:
    return {"software": "teamsight", "settings": asdict(evolution)}


def _gains(found: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    return pd.DataFrame([{"name": name, **compare.overall(rows)._asdict()} for name, rows in found.items()])


def _phase(watch: Watch, phase: str) -> Progress:
    return lambda done, total: watch(phase, done, total)
