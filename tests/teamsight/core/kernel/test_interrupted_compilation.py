"""Ctrl-C and kills while kernels are compiled, saved or loaded: nothing is swallowed, and the cache stays usable."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]


def python(folder: Path, script: str) -> subprocess.CompletedProcess[str]:
    (folder / "script.py").write_text(script)
    environment = dict(os.environ, PYTHONPATH=str(ROOT), TEAMSIGHT_CACHE_DIR=str(folder / "cache"))
    return subprocess.run(
        [sys.executable, "script.py", str(folder / "cache")],
        cwd=folder, env=environment, capture_output=True, text=True,
    )  # fmt: skip


CALLBACKS = """
import signal, sys
from numba.core.codegen import CPUCodeLibrary

signal.signal(signal.SIGINT, signal.default_int_handler)
armed, compiled, interrupts = "never", [], []

def interrupting(name):
    hook = getattr(CPUCodeLibrary, name)
    def interrupted(*given):
        if armed in name:
            signal.raise_signal(signal.SIGINT)
        return hook(*given)
    setattr(CPUCodeLibrary, name, staticmethod(interrupted))

interrupting("_object_compiled_hook")

# After the hooks: importing kernels makes the code generator, which keeps them.
import teamsight.core.kernel
from teamsight.core.kernel import Entry

teamsight.core.kernel.entry.announce = compiled.append

def entry():
    return Entry(lambda given: given + 5)

one, armed = entry(), "compiled"
try:
    one(1)
except KeyboardInterrupt:
    interrupts.append(armed)
armed = "never"
assert one(1) == entry()(1) == 6
print(interrupts, len(compiled))
"""


@pytest.mark.short
def test_an_interrupt_in_a_callback_of_llvm_is_raised_when_the_entry_is_ready(tmp_path: Path) -> None:
    done = python(tmp_path, CALLBACKS)
    # What was under way is completed, here and in the cache.
    assert (done.stdout, done.stderr) == ("['compiled'] 1\n", "")


KILLS = '''
"""Compile entries in child processes and kill them at random calls; print what went wrong."""
import itertools, os, random, signal, sys
import numpy as np
import teamsight.core.kernel
from teamsight.core.kernel import Entry, array_at

ENTRIES = 8
teamsight.core.kernel.entry.announce = lambda name: None

def make(number):
    def fill(address):
        row = array_at(address, 16, np.float64)
        for i in range(16):
            row[i] = number * i + np.sqrt(row[i])
        return number
    return fill

def work():
    for number in range(ENTRIES):
        row = np.ones(16)
        assert Entry(make(number))(row.ctypes.data) == number
        assert np.array_equal(row, number * np.arange(16.0) + 1), row

def child(stop=None, call=0):
    """Do the work in a child, which stops itself at a call; leave as a command does: 0 when it is done, 130 after Ctrl-C."""
    pid = os.fork()
    if pid:
        return pid
    status, calls = 1, itertools.count()

    def count(frame, event, argument):
        if event == "c_call" and next(calls) == call:
            os.kill(os.getpid(), stop)

    try:
        sys.setprofile(count if stop else None)
        work()
        status = 0
    except KeyboardInterrupt:
        status = 130
    finally:
        os._exit(status)

def status_of(pid):
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

Entry(lambda given: given)(1)  # what is slow the first time
for seed in range(30):
    noise = random.Random(seed)
    os.environ["TEAMSIGHT_CACHE_DIR"] = os.path.join(sys.argv[1], str(seed // 3))
    sent = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)[seed % 3]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    left = status_of(child(sent, int(noise.random() ** 2 * 400_000)))
    if left not in (0, 130 if sent == signal.SIGINT else -sent):
        print(f"seed {seed}: killed by {sent.name}, left with {left}")
    left = status_of(child())
    if left:
        print(f"seed {seed}: after {sent.name} the next run left with {left}")
'''


@pytest.mark.rare
def test_30_kills_at_random_calls_of_compiling_and_caching_do_no_harm(tmp_path: Path) -> None:
    done = python(tmp_path, KILLS)
    assert (done.stdout, done.stderr, done.returncode) == ("", "", 0)


TURNS = '''
"""Several processes need the same entries at once; the first is killed while it compiles."""
import os, signal, sys, time
import teamsight.core.kernel
from teamsight.core.kernel import Entry

def make(number):
    return lambda given: given * number + number

def work(is_killed):
    for number in range(2, 6):
        if is_killed and number == 4:
            teamsight.core.kernel.entry.announce = hang
        assert Entry(make(number))(3) == 4 * number

def announced(name):
    os.write(1, b"c")

def hang(name):
    os.write(hanging, b"h")
    time.sleep(600)

def child(is_killed):
    if pid := os.fork():
        return pid
    try:
        work(is_killed)
        os._exit(0)
    finally:
        os._exit(1)

teamsight.core.kernel.entry.announce = announced
import teamsight.core.kernel.compiler
seen, hanging = os.pipe()
pids = [child(True)]
os.read(seen, 1)
pids += [child(False) for _ in range(3)]
time.sleep(0.5)  # they come to the entry that the first one holds
os.kill(pids[0], signal.SIGKILL)
print([os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) for pid in pids])
print(sorted(os.path.splitext(name)[1] for name in os.listdir(sys.argv[1])))
'''


def test_nobody_compiles_what_another_process_compiles_or_waits_for_a_dead_one(tmp_path: Path) -> None:
    done = python(tmp_path, TURNS)
    compiled, codes, kept = done.stdout.replace("[", "\n[").split("\n", 1)[0], *done.stdout.split("\n")[-3:-1]
    # The dead one never said that it compiled.
    assert compiled == "cccc", (done.stdout, done.stderr)
    assert codes.endswith("[-9, 0, 0, 0]")
    assert kept == str([".kernel"] * 4)
