"""Kill processes that write results, at chosen calls, and print what is wrong with what they leave; a script.

It imports once and forks a process for each kill, in which alone libraries start threads. The moment is counted in calls
of functions written in C, such as those that write, and so depends on no clock.
"""

from __future__ import annotations

import itertools
import os
import random
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from teamsight.analysis.runs import checkpoint, files
from teamsight.policies.memory import LazyMemory

NAMES = ("table.parquet", "picture.png", "page.md", "ledger.json", "memory.safetensors", "runs.jsonl")
PICTURE = b"\x89PNG\r\n\x1a\n....tEXtSoftware\0teamsight"
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


def write_all(folder: Path, version: int) -> None:
    """Write one version of each kind of result; each is large enough to be cut off."""
    numbers = np.random.default_rng(version).random(60_000)
    files.write_table(folder / NAMES[0], pd.DataFrame({"x": numbers}), {"version": version})
    files.write_bytes(folder / NAMES[1], PICTURE + numbers.tobytes())
    files.write_page(folder / NAMES[2], f"{version} line\n" * 50_000)
    files.write_json(folder / NAMES[3], {"software": "teamsight", "numbers": numbers[:20_000].tolist()})
    situations = numbers[:40_000].reshape(-1, 2)
    LazyMemory.of(situations, situations, situations, {}, own=1, settings={"version": version}).save(folder / NAMES[4])
    checkpoint.Checkpoint(folder / NAMES[5]).add({(str(n),): (0.5, n) for n in range(500)})


def in_a_process(work: Callable[[], object]) -> None:
    """Do some work in a process of its own, and wait for its end, whatever that is."""
    process = os.fork()
    if process == 0:
        try:
            work()
        finally:
            os._exit(0)
    os.waitpid(process, 0)


def write_until(folder: Path, call: int, stop: signal.Signals) -> None:
    """Write again and again, and send this process a signal at the call of a function in C with a given number."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    calls = itertools.count()

    def count(frame: object, event: str, argument: object) -> None:
        if event == "c_call":
            number = next(calls)
            if number == call:
                os.kill(os.getpid(), stop)
            elif number == 2 * call + 1000:
                # A library has swallowed the exception that Ctrl-C is.
                os.kill(os.getpid(), signal.SIGKILL)

    sys.setprofile(count)
    for version in itertools.cycle((1, 2)):
        write_all(folder, version)


def calls_of_writing(folder: Path) -> int:
    """Return how many functions in C are called while everything is written once."""
    read, write = os.pipe()

    def work() -> None:
        calls = [0]

        def count(frame: object, event: str, argument: object) -> None:
            calls[0] += event == "c_call"

        sys.setprofile(count)
        write_all(folder, 1)
        sys.setprofile(None)
        os.write(write, str(calls[0]).encode())

    in_a_process(work)
    return int(os.read(read, 100))


def wrong_with(folder: Path, whole: list[dict[str, bytes]]) -> list[str]:
    """Return what is wrong with the files that a killed process has left."""
    wrong = []
    for name in NAMES[:-1]:
        path = folder / name
        if path.exists() and path.read_bytes() not in [versions[name] for versions in whole]:
            wrong.append(f"{name} is neither version")
    kept = checkpoint.Checkpoint(folder / NAMES[-1]).results([(str(n),) for n in range(500)])
    wrong += [f"run {key} has another result" for key, found in kept.items() if found != [0.5, int(key[0])]]
    return wrong + (["notes changed"] if (folder / "notes.md").read_text() != "thesis" else [])


def main(folder: Path, kills: int) -> None:
    whole = []
    for version in (1, 2):
        place = folder / str(version)
        place.mkdir(parents=True)
        in_a_process(lambda place=place, version=version: write_all(place, version))
        whole.append({name: (place / name).read_bytes() for name in NAMES})
    work = folder / "work"
    work.mkdir()
    (work / "notes.md").write_text("thesis")
    calls = calls_of_writing(folder / "1")
    for seed in range(kills):
        noise = random.Random(seed)
        # Also while the second version takes the place of the first.
        call, stop = noise.randrange(2 * calls), noise.choice(SIGNALS)
        in_a_process(lambda call=call, stop=stop: write_until(work, call, stop))
        for what in wrong_with(work, whole):
            print(f"seed {seed}, {stop.name} at call {call}: {what}")
    in_a_process(lambda: write_all(work, 1))
    if {name: (work / name).read_bytes() for name in NAMES[:-1]} != {name: whole[0][name] for name in NAMES[:-1]}:
        print("the next write failed")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
