"""Kernels that several entries, threads and processes share: each gets the code of its own constants, and keeps it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from teamsight.core.kernel import Entry, cache, kernel, scratch

ROOT = Path(__file__).parents[4]


@kernel
def pick(values, at):
    return values[at]


@kernel
def room(count):
    return scratch(count, np.float64).size


def of_constants(number):
    # A tuple of several types, and the room on the stack, need constants.
    return int(pick((1, 2.5, number), 2)) + room(5)


SHARED = 5


@kernel
def shared(number):
    return number + SHARED


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(tmp_path / "cache"))


def test_constants_reach_a_kernel_through_its_parameters() -> None:
    assert Entry(of_constants)(7) == 12


def test_a_kernel_is_compiled_again_for_a_global_that_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    def first(number):
        return shared(number)

    def second(number):
        return 1000 + shared(number)

    assert Entry(first)(0) == 5
    monkeypatch.setitem(globals(), "SHARED", 7)
    assert [Entry(second)(0), Entry(second)(0), Entry(first)(0)] == [1007, 1007, 7]


NESTED = """
import enum
class Kinds(enum.IntEnum):
    ONE = {number}
TABLES = (1.0, ({number}.000000000001,))
"""


def test_the_digest_covers_modules_in_modules_tuples_and_enumerations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    found = set()
    for number in (1, 2):
        package = tmp_path / f"package_{number}"
        package.mkdir()
        (package / "__init__.py").write_text("from . import inner")
        (package / "inner.py").write_text(NESTED.format(number=number))
        names: dict[str, object] = {}
        exec(f"import package_{number} as package", names)
        for body in ("package.inner.Kinds.ONE", "package.inner.TABLES"):
            exec(f"def run(number):\n    return {body}", names)
            found.add(cache.digest(names["run"]))
    assert len(found) == 4


def test_threads_load_an_entry_once() -> None:
    Entry(of_constants)(1)
    entry, addresses, ready = Entry(of_constants), list[int](), threading.Barrier(8)

    def use() -> None:
        ready.wait()
        for _ in range(200):
            addresses.append(entry.address)

    threads = [threading.Thread(target=use) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({*addresses}) == 1


HOLDING = """
import sys, time
from teamsight.core.kernel import Entry, entry

def run(number):
    return number + 1

def announce(name):
    print(name, flush=True)
    time.sleep(float(sys.argv[1]))

entry.announce = announce
if sys.argv[2:]:  # within a block that defers Ctrl-C, as worlds load their kernels
    from teamsight.core.interrupts import deferred
    with deferred():
        print(Entry(run)(1))
else:
    print(Entry(run)(1))
"""


def test_who_waits_can_be_interrupted_and_takes_no_lock_away(tmp_path: Path) -> None:
    (tmp_path / "holding.py").write_text(HOLDING)
    environment = dict(os.environ, PYTHONPATH=str(ROOT))

    def start(*arguments: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "holding.py", *arguments], cwd=tmp_path, env=environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip

    holder = start("600")
    assert holder.stdout is not None
    assert holder.stdout.readline() == "run\n"
    waiting = start("0", "deferred")
    assert waiting.stderr is not None
    assert "waiting for another process" in waiting.stderr.readline()
    waiting.send_signal(signal.SIGINT)
    out, err = waiting.communicate()
    assert (out, "KeyboardInterrupt" in err) == ("", True)
    assert [file.suffix for file in (tmp_path / "cache").iterdir()] == [".lock"]
    holder.kill()
    holder.communicate()
    out, err = start("0").communicate()
    assert (out, err) == ("run\n2\n", "")
