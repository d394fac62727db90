"""The golden file: fingerprints of all results, one line each. ``python tests/golden/compare.py`` compares, ``--write`` writes.

Every world is run, stepped, both in turn, reset and run again, recorded, run in a reused world, and restored in another
process; all ways must give one fingerprint. The tables are those of ``teamsight reproduce --quick``, of studies, of an
exploration, of `run_many` and of rollouts of the environments.
"""

from __future__ import annotations

import argparse
import difflib
import hashlib
import os
import pickle
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
GOLDEN = HERE / "golden.txt"
STEPS, SAVED = 40, 15
SEED = 20


def digest(parts: Iterable[Any]) -> str:
    """Return a digest of arrays, texts and numbers, all to the last bit."""
    found = hashlib.blake2b(digest_size=8)
    for part in parts:
        if isinstance(part, str | bytes):
            content = part.encode() if isinstance(part, str) else part
            form = "text"
        else:
            import numpy as np

            array = np.asarray(part)
            if array.dtype.kind not in "biuf":
                raise TypeError(f"{array.dtype}: has no bits to compare")
            # Whole numbers and truths may be held in other widths later.
            array = array.astype(np.float64 if array.dtype.kind == "f" else np.int64)
            form, content = f"{array.dtype} {array.shape}", np.ascontiguousarray(array).tobytes()
        found.update(f"{form} {len(content)} ".encode())
        found.update(content)
    return found.hexdigest()


def of_world(world: Any) -> str:
    """Return the fingerprint of a world: all that a user can see of what has happened."""
    return digest(_seen(world))


def _seen(world: Any) -> Iterator[Any]:
    yield from (world.tick, world.steps, float(world.clock.now), world.observed_fraction, world.max_neighbours)
    yield from (world.mean_neighbours, world.mean_degree, world.observed)
    for group in world.groups:
        yield from (group.position, group.heading, group.identity, group.speed, group.active)
        yield from group.columns.arrays().values()
        state = group.policy_state
        yield from () if state is None else [state] if hasattr(state, "dtype") else state
        for channel in group.channels:
            yield from group.neighbours(channel)
        if len(group):
            group[0].percept  # noqa: B018  (brings the group's up to date)
            yield from (*group.percept.targets, *group.percept.teammates, *group.percept.relayed, group.percept.situation)
            yield from () if group.lidar is None else [group.percept.lidar]
    for table in (world.recording.history, world.recording.trajectory):
        yield from (table[name].to_numpy() for name in table if table[name].dtype.kind in "biuf")
    yield world.events.to_csv()


def ways(name: str) -> tuple[dict[str, str], str, bytes]:
    """Return the fingerprints of a world by way, that of its frames, and a saved state."""
    import worlds

    from teamsight.agents.reused_worlds import ReusedWorlds

    reused = name in worlds.RUNS
    if reused:
        model, parameters = worlds.RUNS[name][0], worlds.RUNS[name][1]()
        make: Callable[..., Any] = partial(model, **parameters)
    else:
        make = worlds.WORLDS[name]
    found, saved, frames = {}, b"", ""
    for way, deed in _WAYS.items():
        world = make(rng=SEED)
        deed(world)
        found[way] = of_world(world)
        world.close()
    world = make(rng=SEED)
    world.run(SAVED)
    saved = pickle.dumps(world.state())
    world.close()
    world = make(rng=SEED)
    replay = world.record(steps=STEPS)
    found["recorded"] = of_world(world)
    frames = digest(_frames(replay.frames))
    world.close()
    if reused:
        several = ReusedWorlds()
        several.expect([(parameters, SEED + 1), (parameters, SEED)])
        several.begin(model, parameters, SEED + 1).run(7)
        world = several.begin(model, parameters, SEED)
        world.run(STEPS)
        found["reused"] = of_world(world)
        several.close()
    return found, frames, saved


def _frames(frames: Iterable[Any]) -> Iterator[Any]:
    for frame in frames:
        yield from (frame.time, frame.series, frame.x, frame.y, frame.heading, frame.flags)


def _steps(world: Any) -> None:
    for _ in range(STEPS):
        world.step()


def _mixed(world: Any) -> None:
    for number in (1, 2, 0, 3, 5, 7, 11):
        world.run(number)
        world.step()
    world.run(STEPS - world.tick)


def _reset(world: Any) -> None:
    world.run(9)
    world.reset(SEED)
    world.run(STEPS)


_WAYS: dict[str, Callable[[Any], None]] = {
    "run": lambda world: world.run(STEPS), "steps": _steps, "mixed": _mixed, "reset": _reset
}  # fmt: skip


def restored(name: str, saved: bytes) -> str:
    """Return the fingerprint of a world that goes on from a saved state of another process."""
    import worlds

    make = partial(worlds.RUNS[name][0], **worlds.RUNS[name][1]()) if name in worlds.RUNS else worlds.WORLDS[name]
    world = make(rng=SEED + 2)
    world.restore(pickle.loads(saved))
    world.run(STEPS - SAVED)
    return of_world(world)


def of_table(table: Any) -> str:
    """Return the fingerprint of a table: the names of its columns, and their values."""
    columns = (table[name] for name in table)
    return digest(
        part
        for column in columns
        for part in (str(column.name), column.to_numpy() if column.dtype.kind in "biuf" else repr(column.tolist()))
    )


def tables(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the fingerprints of the tables of a results folder."""
    import pandas as pd

    for path in sorted(folder.rglob("*.parquet")):
        yield f"reproduce: {path.relative_to(folder)}", of_table(pd.read_parquet(path))


def studies(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the fingerprints of the rows of two studies, one of a task."""
    from teamsight import Failures, Study
    from teamsight.analysis.studies.study import Record

    one = Study(
        fixed={"policy": "a-cmommt", "events": Failures(20.0, 5.0)},
        axes={"robots": [3, 5], "radius": [2.0, 3.5], "awareness": ["none", "ring"]}, replicates=3, steps=40,
        record=Record(steps=True, trajectories=5, events=True), seed=4,
    ).run(folder / "one")  # fmt: skip
    for kind in ("frame", "settings", "steps", "trajectories", "events"):
        yield f"study of CMOMMT: {kind}", of_table(getattr(one, kind).reset_index())
    other = Study(
        model="task:forage", fixed={"obstacles": 0.0}, axes={"treatment": ["explore", "skilled"], "robots": [2, 4]},
        replicates=2, steps=60, pairing="none",
    ).run(folder / "other")  # fmt: skip
    yield "study of a task: frame", of_table(other.frame.reset_index())


def analyses() -> Iterator[tuple[str, str]]:
    """Yield the fingerprints of an exploration, of tables of `run_many`, and of a choice of δ."""
    from teamsight import run_many
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.analysis.delta import choose_delta
    from teamsight.analysis.learning.explore import explore_worlds

    model = partial(CMOMMT, robots=5, targets=8, radius=2.5, policy="random-walk", awareness="ring")
    memory = explore_worlds(model, 60, 6, rng=1)
    yield "exploration", digest([memory.table, memory.sha256])
    grid = {"robots": [2, 5], "radius": [2.0, 4.0], "policy": ["a-cmommt", "random-walk"]}
    yield "run_many", of_table(run_many(grid, steps=60, replicates=3, rng=9, workers=2))
    table = run_many({"treatment": ["explore", "skilled"], "robots": [3]}, task="graze", steps=60, replicates=2, rng=9)
    yield "run_many of a task", of_table(table)
    report = choose_delta(CMOMMT, runs=20, steps=60, risk=0.2, rng=1)
    yield "choose_delta", digest([report.delta, of_table(report.maxima), of_table(report.ring)])


def rollouts() -> Iterator[tuple[str, str]]:
    """Yield the fingerprints of rollouts of the three environments, and of their defaults."""
    import numpy as np

    from teamsight import Lidar
    from teamsight.env import gymnasium_env, parallel_env, vector_env

    rng = np.random.default_rng(1)
    one = parallel_env(
        robots=4, targets=6, max_cycles=20, action="heading", reward="observed", observation="ring",
        encoding="distance", target_policy="evasive",
    )  # fmt: skip
    observations, _ = one.reset(seed=7)
    seen = list(observations.values())
    while one.agents:
        made = one.step({name: rng.uniform(-1, 1, 3) for name in one.agents})
        seen += [value for part in made[:4] for value in part.values()]
    yield "parallel_env", digest(seen)
    many = vector_env(
        6, robots=3, targets=5, max_cycles=15, action="continuous", reward="observed", encoding="distance"
    )
    first, _ = many.reset(seed=3)
    seen = [first]
    for _ in range(40):
        step = many.step(rng.uniform(-1, 1, (6, 3, 2)))
        seen += [step.observations, step.rewards, step.terminated, step.truncated]
    yield "vector_env", digest(seen)
    shared = gymnasium_env(
        4, model="pursuit", max_cycles=15, action="continuous", reward="observed", encoding="distance"
    )
    first, _ = shared.reset(seed=3)
    shared.action_space.seed(5)
    seen = [first]
    for _ in range(40):
        seen += shared.step(shared.action_space.sample())[:4]
    yield "gymnasium_env", digest(seen)
    seen = []
    for settings in ({}, {"layout": "nearest", "observation": "shared", "lidar": Lidar(8, 2.0), "robot_radius": 0.2}):
        default = vector_env(4, robots=3, targets=5, max_cycles=15, **settings)
        seen.append(default.reset(seed=3)[0])
        for _ in range(20):
            seen += default.step(rng.uniform(-1, 1, (4, 3, 2)))[:4]
    yield "the defaults of environments", digest(seen)


def fingerprints(results: Path | None) -> Iterator[tuple[str, str]]:
    """Yield all fingerprints in the order of the file.

    Parameters
    ----------
    results : path, optional
        The results of ``teamsight reproduce --quick``, if they are there already.
    """
    import worlds

    names = [*worlds.RUNS, *worlds.WORLDS]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if results is None:
            results = folder / "results"
            command = [sys.executable, "-m", "teamsight", "reproduce", "--quick", "--out", str(results)]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        with _processes() as pool:
            made = list(pool.map(ways, names))
        with _processes() as pool:
            again = list(pool.map(restored, names, [saved for _, _, saved in made]))
        for name, (by_way, frames, _), gone_on in zip(names, made, again, strict=True):
            by_way["restored"] = gone_on
            common = by_way["run"]
            others = "".join(f", {way} {found}" for way, found in by_way.items() if found != common)
            yield name, common + others
            yield f"{name}, frames", frames
        yield from studies(folder)
        yield from analyses()
        yield from rollouts()
        yield from tables(results)


def _processes() -> ProcessPoolExecutor:
    cores = min(os.cpu_count() or 1, 8)
    return ProcessPoolExecutor(cores, mp_context=get_context("spawn"), initializer=_begin)


def _begin() -> None:
    warnings.simplefilter("ignore")
    # As pytest has them: the folder of helpers, and this one.
    sys.path[:0] = [str(HERE), str(HERE.parent)]


def main() -> int:
    """Compare or write the file; return 1 if results differ."""
    parser = argparse.ArgumentParser(prog="python tests/golden/compare.py", description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write the file instead of comparing")
    parser.add_argument("--results", type=Path, help="results of `teamsight reproduce --quick` that are there already")
    given = parser.parse_args()
    began = time.monotonic()
    found = [f"{name}: {value}\n" for name, value in fingerprints(given.results)]
    taken = f"{len(found)} fingerprints in {time.monotonic() - began:.0f} s"
    if given.write:
        GOLDEN.write_text("".join(found), encoding="utf-8")
        print(taken)
        return 0
    before = GOLDEN.read_text(encoding="utf-8").splitlines(keepends=True)
    changes = [line for line in difflib.unified_diff(before, found, "golden.txt", "now", n=0) if line[:2] != "@@"]
    print("".join(changes) + (f"results differ, see above; {taken}" if changes else f"all as before; {taken}"))
    return bool(changes)


if __name__ == "__main__":
    _begin()
    sys.exit(main())
