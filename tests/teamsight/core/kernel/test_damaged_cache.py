"""A damaged cache of kernels costs a compilation, and never a result, an error or a crash."""

from __future__ import annotations

import ctypes
import os
import random
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numba
import pytest

from teamsight.core.kernel import entry as kernel_entry
from teamsight.core.kernel.cache import Code

ROOT = Path(__file__).parents[4]


def entry(number: int) -> kernel_entry.Entry:
    """Return an entry that has not been compiled in this process; it adds `number` to what it is given."""

    def add(given: int) -> int:
        return given + number

    return kernel_entry.Entry(add)


def truncated(data: bytes, noise: random.Random) -> bytes:
    return data[: noise.randrange(len(data))]


def one_bit_flipped(data: bytes, noise: random.Random) -> bytes:
    place = noise.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << noise.randrange(8)]) + data[place + 1 :]


def empty(data: bytes, noise: random.Random) -> bytes:
    return b""


def garbage(data: bytes, noise: random.Random) -> bytes:
    return noise.randbytes(noise.randrange(1, 2 * len(data)))


def other_beginning(data: bytes, noise: random.Random) -> bytes:
    length = noise.randrange(1, 64)
    return noise.randbytes(length) + data[length:]


def prolonged(data: bytes, noise: random.Random) -> bytes:
    return data + noise.randbytes(noise.randrange(1, 100))


def a_hole(data: bytes, noise: random.Random) -> bytes:
    first = noise.randrange(len(data))
    length = min(noise.randrange(1, 4096), len(data) - first)
    return data[:first] + bytes(length) + data[first + length :]


DAMAGE: list[Callable[[bytes, random.Random], bytes]] = [
    truncated, one_bit_flipped, empty, garbage, other_beginning, prolonged, a_hole
]  # fmt: skip


class Lab:
    """A cache folder of its own, and the names of what is compiled."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.compiled: list[str] = []
        monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(folder))
        monkeypatch.setattr(kernel_entry, "announce", self.compiled.append)

    def check(self, number: int, compilations: int, what: str) -> None:
        """Assert that the entry gives the right result, and how often it is compiled for that."""
        self.compiled.clear()
        assert entry(number)(1) == 1 + number, what
        assert len(self.compiled) == compilations, what

    def files(self) -> list[Path]:
        return sorted(self.folder.iterdir())


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    return Lab(tmp_path / "cache", monkeypatch)


# One of each kind, and then many.
@pytest.mark.parametrize("files", [len(DAMAGE), pytest.param(300, marks=pytest.mark.rare)])
def test_damaged_files_are_compiled_again_and_replaced(files: int, lab: Lab) -> None:
    lab.check(7, 1, "first")
    lab.check(7, 0, "second")
    original = {file: file.read_bytes() for file in lab.files()}
    for seed in range(files):
        noise = random.Random(seed)
        damage = DAMAGE[seed % len(DAMAGE)]
        file = noise.choice(sorted(original))
        damaged = damage(original[file], noise)
        if damaged == original[file]:
            continue
        file.write_bytes(damaged)
        what = f"{damage.__name__}, seed {seed}"
        lab.check(7, 1, what)
        lab.check(7, 0, f"afterwards, {what}")
        for path, content in original.items():
            path.write_bytes(content)


def test_the_file_of_another_entry_is_noticed(lab: Lab) -> None:
    lab.check(7, 1, "first")
    mine = lab.files()
    lab.check(8, 1, "another")
    others = [file for file in lab.files() if file not in mine]
    for file, other in zip(mine, others, strict=True):
        shutil.copy(other, file)
    lab.check(7, 1, "swapped")
    lab.check(8, 0, "the other is intact")


@pytest.mark.parametrize("obstacle", ["folder", "link", "dangling link", "pipe", "unreadable", "open to all"])
def test_what_stands_in_the_place_of_a_file_does_no_harm(lab: Lab, obstacle: str) -> None:
    lab.check(7, 1, "first")
    for file in lab.files():
        if obstacle in ("unreadable", "open to all"):
            file.chmod(0 if obstacle == "unreadable" else 0o666)
            continue
        elsewhere = file.with_name("elsewhere")
        file.rename(elsewhere)
        if obstacle == "folder":
            file.mkdir()
        elif obstacle == "pipe":
            os.mkfifo(file)
        else:
            file.symlink_to(elsewhere if obstacle == "link" else file.with_name("nothing"))
    # The superuser may read what is unreadable.
    compilations = 0 if obstacle == "unreadable" and os.geteuid() == 0 else 1
    lab.check(7, compilations, obstacle)
    # A folder is not removed; everything else is replaced.
    lab.check(7, 1 if obstacle == "folder" else 0, f"afterwards, {obstacle}")
    assert not list(lab.folder.glob("*.tmp"))


def test_a_folder_that_disappears_is_no_error(lab: Lab) -> None:
    lab.check(7, 1, "first")
    shutil.rmtree(lab.folder)
    lab.check(7, 1, "without the folder")


def test_an_intact_file_that_cannot_be_loaded_is_compiled_again(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    lab.check(7, 1, "first")
    load = Code.load
    for broken in (EOFError, ImportError, MemoryError):
        # Before and after it waits for its turn.
        errors = [broken("cannot load") for _ in range(2)]

        def fail_twice(code: Code, errors: list[Exception] = errors) -> tuple[object, int]:
            if errors:
                raise errors.pop()
            return load(code)

        monkeypatch.setattr(Code, "load", fail_twice)
        lab.check(7, 1, broken.__name__)


def test_machine_code_made_with_other_settings_of_numba_is_another_entry(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.check(7, 1, "first")
    with monkeypatch.context() as patch:
        patch.setattr(numba.config, "BOUNDSCHECK", 1)
        lab.check(7, 1, "with bounds checks")
    lab.check(7, 0, "without them again")


def test_code_with_an_address_of_this_process_is_not_kept(lab: Lab) -> None:
    of_python = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(lambda given: given + 7)
    for _ in range(2):
        assert kernel_entry.Entry(lambda given: of_python(given))(1) == 8
    assert len(lab.compiled) == 2
    assert lab.files() == []


COMMAND = ["run", "--robots", "2", "--targets", "2", "--radius", "2", "--steps", "3", "--policy", "stationary"]


# A whole command, which sends itself a signal while it compiles, as soon as it has stored another entry.
STOPPED = """
import os, runpy, signal, sys
stop, sys.argv = int(sys.argv[1]), ["teamsight", *sys.argv[2:]]

def hook(event, arguments):
    global stop
    if stop and event == "os.rename" and str(arguments[1]).endswith(".kernel"):
        stop, sent, left = 0, stop, iter(range(2000))

        def count(frame, event, argument):
            if next(left, None) == 1999:
                os.kill(os.getpid(), sent)

        sys.setprofile(count)

sys.addaudithook(hook)
runpy.run_module("teamsight", run_name="__main__", alter_sys=True)
"""


def start(cache: Path, stop: int = 0) -> subprocess.Popen[str]:
    """Start a whole command, which may stop itself."""
    return subprocess.Popen(
        [sys.executable, "-c", STOPPED, str(int(stop)), *COMMAND],
        cwd=ROOT, env=dict(os.environ, TEAMSIGHT_CACHE_DIR=str(cache)), text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        # A shell lets jobs in the background ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


def run(cache: Path) -> str:
    """Run a whole command; return what it observed."""
    process = start(cache)
    out, err = process.communicate()
    assert (process.returncode, "Traceback" in err) == (0, False), err
    # The time, and with it the width of the table, differs.
    return "\n".join(line.strip() for line in out.splitlines() if not line.startswith("time"))


def kill(cache: Path, number: signal.Signals) -> None:
    """Run a whole command that stops itself while it compiles."""
    process = start(cache, number)
    out, err = process.communicate()
    assert (process.returncode, out) == (130 if number == signal.SIGINT else -number, ""), err
    if number == signal.SIGINT:
        announcement, farewell = err.split("\n", 1)
        assert "compiling" in announcement
        assert farewell.strip().startswith("teamsight: interrupted")
        assert farewell.strip().count("\n") == 0


@pytest.mark.rare
def test_a_whole_command_goes_on_after_kills_and_with_damaged_files(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    for number in (signal.SIGKILL, signal.SIGINT):
        kill(cache, number)
    right = run(cache)
    noise = random.Random(1)
    files = sorted(cache.glob("*.kernel"), key=lambda file: file.stat().st_size)
    assert len(files) > 4
    # The smallest, since compiling all of them again would take as long as the first run.
    for number, file in enumerate(files[:4]):
        file.write_bytes(DAMAGE[number % len(DAMAGE)](file.read_bytes(), noise))
    assert run(cache) == right
