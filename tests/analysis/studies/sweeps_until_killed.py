"""Kill processes that sweep a study, at chosen calls, and print what is wrong with what they leave; a script.

It imports once and forks a process for each kill, in which alone libraries start threads. The moment is counted in calls
of functions written in C, such as those that write, and so depends on no clock.
"""

from __future__ import annotations

import os
import pickle
import random
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pandas as pd
import pyarrow.parquet  # noqa: F401  before the forks

import teamsight.agents.reused_worlds  # noqa: F401  before the forks
from teamsight import CMOMMT
from teamsight.analysis.studies import sweep as sweeping
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.study import Record, Study, Until
from teamsight.analysis.studies.sweep import sweep

KINDS = ("runs", "failed", "steps", "trajectories")
STUDY = Study(
    model="odd_models:raising", path=Path(__file__).parent, axes={"robots": [2, 1], "bad": [1, 2]}, replicates=2,
    steps=6, record=Record(steps=True, trajectories=3), until=Until(0.3, limit=5),
)  # fmt: skip
#: Runs of a shard, so that most calls are those that write.
RUNS = 3


def in_a_process(work: Callable[[], object]) -> int:
    """Do some work in a process of its own, and return how it ended."""
    process = os.fork()
    if process == 0:
        status = 1
        try:
            work()
            status = 0
        finally:
            os._exit(status)
    return os.waitpid(process, 0)[1]


def counted(folder: Path, last: int) -> tuple[int, list[int]]:
    """Sweep; kill this process at the C call with this number.

    Return how many calls there were, and the numbers of those that wrote parts.
    """
    calls, writing = 0, []
    is_writing = False
    code = StudyFolder.write.__code__

    def count(frame: FrameType, event: str, argument: object) -> None:
        nonlocal calls, is_writing
        if event == "c_call":
            calls += 1
            if is_writing:
                writing.append(calls)
            if calls == last:
                os.kill(os.getpid(), signal.SIGKILL)
        elif frame.f_code is code:
            is_writing = event == "call"

    sys.setprofile(count)
    sweep(STUDY, folder)
    sys.setprofile(None)
    return calls, writing


def tables(folder: Path) -> dict[str, pd.DataFrame]:
    """Return the rows of each kind, in one order; none if there is no folder yet."""
    place = StudyFolder(folder)
    found = {}
    for kind in KINDS:
        table = place.read(kind).to_pandas() if place.is_prepared else pd.DataFrame()
        keys = [name for name in ("setting", "replicate", "step", "time", "identity") if name in table]
        found[kind] = table.sort_values(keys, ignore_index=True, kind="stable") if len(table) else table
    return found


def wrong_with(folder: Path, whole: dict[str, pd.DataFrame], *, is_complete: bool) -> list[str]:
    """Return what is wrong with the rows that a sweep has left."""
    wrong = []
    for kind, table in tables(folder).items():
        expected = whole[kind]
        if is_complete:
            if not table.equals(expected):
                wrong.append(f"{kind}: {len(table)} rows are not the {len(expected)} rows of the whole sweep")
        elif len(table) and len(table.merge(expected, how="left", indicator=True).query("_merge != 'both'")):
            wrong.append(f"{kind}: has rows that the whole sweep does not have")
    return wrong


def continue_and_check(what: str, place: Path, whole: dict[str, pd.DataFrame]) -> None:
    """Look at what a killed sweep has left, continue it, and look again."""
    wrong = wrong_with(place, whole, is_complete=False)
    sweep(STUDY, place)
    wrong += wrong_with(place, whole, is_complete=True)
    for each in wrong:
        print(f"{what}: {each}", flush=True)


def main(folder: Path, kills: int) -> None:
    sweeping._MOST_RUNS = RUNS
    # Compiled kernels are loaded once, before the forks.
    CMOMMT(robots=2, targets=2, policy="a-cmommt", rng=1).run(1)
    kept = folder / "whole.pickle"

    def sweep_whole() -> None:
        calls, writing = counted(folder / "whole", 0)
        kept.write_bytes(pickle.dumps((calls, writing, tables(folder / "whole"))))

    in_a_process(sweep_whole)
    calls, writing, whole = pickle.loads(kept.read_bytes())
    noise = random.Random(1)
    for number in range(kills):
        # Spread over the whole sweep, at a random call within each part of it; most of them while parts are written.
        moments = writing if number % 4 else range(1, calls + 1)
        call = moments[int((number + noise.random()) / kills * len(moments))]
        place = folder / str(number)
        what = f"killed at call {call} of {calls}"
        if os.waitstatus_to_exitcode(in_a_process(lambda place=place, call=call: counted(place, call))) != -signal.SIGKILL:
            print(f"{what}: was not killed", flush=True)
        # Some are killed again while they resume.
        if number % 5 == 1:
            in_a_process(lambda place=place, call=call: counted(place, call // 2))
        if in_a_process(lambda place=place, what=what: continue_and_check(what, place, whole)):
            print(f"{what}: cannot be continued", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
