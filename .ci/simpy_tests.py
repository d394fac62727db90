"""Run SimPy's own tests on the clock of a world; they are downloaded, and all but `APART` must pass.

Usage: .ci/simpy_tests.py [FOLDER]    the folder of an unpacked sdist of SimPy; by default it is downloaded with pip
"""

import importlib.metadata
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

#: What cannot mean the same here, and why.
APART = {
    "test_environment.py::test_run_until_value": "a world stands still at whole ticks, not at 3.141592",
    "test_exceptions.py::test_exception_chaining": "the traceback names the frames of simpy.Environment.run",
}

# Makes a world in place of the environment, which advances as `simpy.Environment.run` does.
CONFTEST = '''
import math
import pytest
import simpy
from teamsight import Box, World


class Stop(Exception):
    pass


def stop(event):
    if event.ok:
        raise Stop
    event.defused = True
    raise event.value


def run(world, until=None):
    clock = world.clock
    if until is not None and not isinstance(until, simpy.Event):
        if float(until) <= clock.now:
            raise ValueError(f"until ({until}) must be greater than the current simulation time")
        # As in SimPy, the events of that time are left to the next run.
        return world.run(math.ceil(float(until)) - world.tick)
    if until is not None:
        if until.callbacks is None:
            return until.value
        until.callbacks.append(stop)
    try:
        while clock.peek() < math.inf:
            world.run(int(clock.ticks_until_event(world.tick)))
            clock.advance(world.tick)
    except Stop:
        return until.value
    if until is not None:
        raise RuntimeError(f'No scheduled events left but "until" event was not triggered: {until}')


@pytest.fixture
def log():
    return []


@pytest.fixture
def env():
    world = World(Box(4, 4), rng=1)
    world.clock.run = lambda until=None: run(world, until)
    world.clock.step = world.step
    return world.clock
'''


def main(folder: Path) -> int:
    """Return 0 if what fails is `APART`."""
    if len(sys.argv) > 1:
        source = Path(sys.argv[1])
    else:
        release = f"simpy=={importlib.metadata.version('simpy')}"
        download = ["download", "-q", "--no-binary", ":all:", "--no-deps", "-d", str(folder), release]
        subprocess.run([sys.executable, "-m", "pip", *download], check=True)
        with tarfile.open(next(folder.glob("*.tar.gz"))) as archive:
            archive.extractall(folder, filter="data")
        source = next(path for path in folder.iterdir() if path.is_dir())
    tests = folder / "tests"
    shutil.copytree(source / "tests", tests)
    (tests / "conftest.py").write_text(CONFTEST)
    # Benchmarks need a plug-in and test nothing else.
    options = ["-q", "--tb=line", "-rf", "-p", "no:cacheprovider", "-c", "/dev/null", "--ignore=test_benchmark.py"]
    found = subprocess.run([sys.executable, "-m", "pytest", *options, "."], capture_output=True, text=True, cwd=tests)
    failed = {line.split()[1] for line in found.stdout.splitlines() if line.startswith(("FAILED ", "ERROR "))}
    print(found.stdout.splitlines()[-1] if found.stdout else found.stderr)
    for name in sorted(failed | APART.keys()):
        print(f"{name}: {APART.get(name, 'must pass')}" + ("" if name in failed else ", but passes"))
    return int(failed != APART.keys())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        sys.exit(main(Path(scratch)))
