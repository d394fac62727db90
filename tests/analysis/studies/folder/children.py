"""What child processes of these tests do: ``python children.py NAME FOLDER …``."""

from __future__ import annotations

import itertools
import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from made_parts import fill, names, part, prepared, runs_of, study

from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.standing import status


def say(text: str) -> None:
    # In one call, so that lines of several processes do not mix.
    os.write(1, f"{text}\n".encode())


def hold(folder: str, shard: str = "") -> None:
    """Hold the lock until standard input ends."""
    chosen = tuple(map(int, shard.split("/"))) if shard else None
    with StudyFolder(folder).lock(chosen):  # type: ignore[arg-type]
        say("held")
        sys.stdin.read()


def wait(folder: str) -> None:
    """Wait for the lock, and say so."""
    with StudyFolder(folder).lock(wait=True, waiting=say):
        say("held")


def killed(folder: str, kills: str) -> None:
    """Write parts in a child of this process and kill it, again and again; say what is wrong with what it leaves."""
    place = StudyFolder(folder)
    plan = place.study.plan()
    made = [({"steps": part(plan, [run], 9000), "runs": part(plan, [run])}, names(plan, [run])) for run in runs_of(plan)]
    left = 0
    for kill in range(int(kills)):
        for path in (*place.path.glob("runs/*"), *place.path.glob("steps/*")):
            path.unlink()
        read, write = os.pipe()
        process = forked(lambda: write_for_ever(place, made, write))
        os.read(read, 5)
        time.sleep(random.Random(kill).uniform(0, 0.02))
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        left += check(place, kill)
    say(f"{left} drafts")


def write_for_ever(place: StudyFolder, made: list[tuple[dict[str, bytes], list[str]]], begun: int) -> None:
    """Write parts again and again."""
    with place.lock(), place.recorded(engine="test", workers=1, code="x") as heartbeat:
        os.write(begun, b"begun")
        for count, (parts, runs) in enumerate(itertools.cycle(made)):
            place.write(parts, runs)
            heartbeat.update(count, 12, made=count)


def check(place: StudyFolder, kill: int) -> int:
    """Say what is wrong with a folder; return how many drafts there were."""
    found, read = status(place.path), (place.read("runs").num_rows, place.read("steps").num_rows)
    if found.damaged or found.sweeps or found.running:
        say(f"kill {kill}: {found}")
    if read != (found.done, 9000 * found.done):
        say(f"kill {kill}: {found.done} runs are done, but {read} rows are there")
    left = len(list(place.path.rglob(".*.part")))
    with place.lock():
        if damaged := place.tidy():
            say(f"kill {kill}: {damaged}")
    if list(place.path.rglob(".*.part")):
        say(f"kill {kill}: drafts stay")
    return left


def limited(folder: str, *sizes: str) -> None:
    """Write parts where no file may be larger than some bytes, as on a full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    place = StudyFolder(folder)
    plan = place.study.plan()
    for size in sizes:
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(size), resource.RLIM_INFINITY))
        fill_and_report(place, plan)


def powerless(folder: str, user: str) -> None:
    """Write parts as another user, who may not write here."""
    place = StudyFolder(folder)
    plan = place.study.plan()
    # All modules are imported before: those of Python's own may not be readable either.
    with tempfile.TemporaryDirectory() as elsewhere:
        fill(prepared(Path(elsewhere, "a")), plan)
    os.setgroups([])
    os.setgid(int(user))
    os.setuid(int(user))
    fill_and_report(place, plan)


def fill_and_report(place: StudyFolder, plan: object) -> None:
    attempts = {
        "prepare": lambda: prepared(place.path),
        "lock": lambda: place.lock().__enter__(),
        "write": lambda: fill(place, plan, 12, steps=True),  # type: ignore[arg-type]
    }
    for name, attempt in attempts.items():
        try:
            attempt()
        except ValueError as error:
            say(f"{name}: {type(error).__name__}: {error}")
        else:
            say(f"{name}: no error")


def prepare_at_once(folder: str, processes: str) -> None:
    """Prepare folders, each by several processes at the same time: by half of them for one study, by half for another."""
    prepared(Path(folder, "before"))
    for number in range(5):
        go, path = Path(folder, f"go-{number}"), Path(folder, str(number))
        children = [forked(lambda: prepare_when(go, path, each % 2)) for each in range(int(processes))]
        go.touch()
        for child in children:
            os.waitpid(child, 0)
        say(f"{StudyFolder(path).study.seed} is kept")


def prepare_when(go: Path, path: Path, seed: int) -> None:
    """Prepare a folder for the study with a seed as soon as a file is there, and say what came of it."""
    while not go.exists():
        time.sleep(0.001)
    try:
        prepared(path, study(seed=seed))
    except ValueError:
        say(f"{seed} is refused")
    else:
        say(f"{seed} is accepted")


def forked(work: Callable[[], object]) -> int:
    """Do some work in a child of this process; return its number."""
    process = os.fork()
    if process == 0:
        try:
            work()
        except BaseException as error:
            say(repr(error))
        finally:
            os._exit(0)
    return process


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
