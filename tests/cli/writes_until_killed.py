"""Kill processes that write results, at random moments, and print what is wrong with what they leave; a script.

It imports once and forks a process for each kill, in which alone libraries start threads.
"""

from __future__ import annotations

import itertools
import os
import random
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

from teamsight.analysis.runs import checkpoint, files
from teamsight.policies.memory import LazyMemory

NAMES = ("table.parquet", "picture.png", "page.md", "ledger.json", "memory.safetensors", "runs.jsonl")
PICTURE = b"\x89PNG\r\n\x1a\n....tEXtSoftware\0teamsight"


def write_all(folder: Path, version: int) -> None:
    """Write one version of each kind of result; each is large enough to be cut off."""
    numbers = np.random.default_rng(version).random(60_000)
    files.write_table(folder / NAMES[0], pd.DataFrame({"x": numbers}), {"version": version})
    files.write_bytes(folder / NAMES[1], PICTURE + numbers.tobytes())
    files.write_page(folder / NAMES[2], f"{version} line\n" * 50_000)
    files.write_json(folder / NAMES[3], {"software": "teamsight", "numbers": numbers[:20_000].tolist()})
    pairs = numbers[:40_000].reshape(-1, 2)
    LazyMemory.of(pairs, pairs, pairs, {}, own=1, settings={"version": version}).save(folder / NAMES[4])
    checkpoint.Checkpoint(folder / NAMES[5]).add({(str(n),): (0.5, n) for n in range(500)})


def fork(job: object, *given: object) -> int:
    """Return the process that does a job."""
    process = os.fork()
    if process == 0:
        try:
            job(*given)  # type: ignore[operator]
        finally:
            os._exit(0)
    return process


def write_for_ever(folder: Path) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for version in itertools.cycle((1, 2)):
        write_all(folder, version)


def kill_one(folder: Path, whole: list[dict[str, bytes]], noise: random.Random) -> list[str]:
    """Kill a process at some moment and return what is wrong."""
    process = fork(write_for_ever, folder)
    time.sleep(noise.uniform(0.0, 0.25))
    os.kill(process, noise.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT)))
    # A library may swallow the exception that Ctrl-C is.
    for _ in range(100):
        if os.waitpid(process, os.WNOHANG)[0]:
            break
        time.sleep(0.01)
    else:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
    wrong = []
    for name in NAMES[:-1]:
        path = folder / name
        if path.exists() and path.read_bytes() not in [versions[name] for versions in whole]:
            wrong.append(f"{name} is neither version")
    kept = checkpoint.Checkpoint(folder / NAMES[-1]).outcomes([(str(n),) for n in range(500)])
    wrong += [f"run {key} has another outcome" for key, found in kept.items() if found != (0.5, int(key[0]))]
    return wrong + (["notes changed"] if (folder / "notes.md").read_text() != "thesis" else [])


def main(folder: Path, kills: int) -> None:
    whole = []
    for version in (1, 2):
        (folder / str(version)).mkdir(parents=True)
        os.waitpid(fork(write_all, folder / str(version), version), 0)
        whole.append({name: (folder / str(version) / name).read_bytes() for name in NAMES})
    work = folder / "work"
    work.mkdir()
    (work / "notes.md").write_text("thesis")
    for seed in range(kills):
        for what in kill_one(work, whole, random.Random(seed)):
            print(f"seed {seed}: {what}")
    os.waitpid(fork(write_all, work, 1), 0)
    if {name: (work / name).read_bytes() for name in NAMES[:-1]} != {name: whole[0][name] for name in NAMES[:-1]}:
        print("the next write failed")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
