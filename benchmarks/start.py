"""How long the command line takes to answer: the first time on a machine, later, and for its help."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time

from measure import Row, interleave, median, ratio
from websockets.sync.client import connect

RUN = [sys.executable, "-m", "teamsight", "run"]


def measure_start(rounds: int) -> list[Row]:
    """Measure ``teamsight run`` with an empty cache and with a full one, beside the import of mesa, and the help."""
    with tempfile.TemporaryDirectory() as kept:
        cpu_of(RUN, kept)
        taken = interleave(
            {
                "mesa": lambda: cpu_of([sys.executable, "-c", "import mesa"], kept),
                "first": _first,
                "later": lambda: cpu_of(RUN, kept),
                "picture": _picture,
                "help": _help,
            },
            rounds,
        )
    return [
        median("import mesa", "CPU s", taken["mesa"]),
        median("teamsight run, empty cache", "CPU s", taken["first"]),
        ratio("the same / import mesa", taken["first"], taken["mesa"], most=8),
        median("teamsight run, full cache", "CPU s", taken["later"]),
        ratio("the same / import mesa", taken["later"], taken["mesa"], most=1.2),
        median("teamsight watch, empty cache, first picture", "CPU s", taken["picture"]),
        ratio("the same / teamsight run, empty cache", taken["picture"], taken["first"], most=0.5),
        median("teamsight --help, wall time", "s", taken["help"], most=0.5),
    ]


def _first() -> float:
    with tempfile.TemporaryDirectory() as empty:
        return cpu_of(RUN, empty)


def cpu_of(command: list[str], cache: str = "") -> float:
    """Return the CPU time of a command in a process of its own [s], with a folder for kernels if one is given."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    where = {"TEAMSIGHT_CACHE_DIR": cache} if cache else {}
    subprocess.run(command, check=True, capture_output=True, env=os.environ | where)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _picture() -> float:
    """Return the CPU time of ``teamsight watch`` until a page has a picture, with an empty cache [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "teamsight", "watch", "--no-browser", "--port", "0"]
    with tempfile.TemporaryDirectory() as empty:
        environment = dict(os.environ, TEAMSIGHT_CACHE_DIR=empty)
        quiet = subprocess.DEVNULL
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=quiet, env=environment, text=True) as process:
            assert process.stdout is not None
            address = process.stdout.readline().strip()
            with connect(address.replace("http", "ws") + "socket", origin=address.rstrip("/"), proxy=None) as page:
                while not isinstance(page.recv(), bytes):
                    pass
            process.kill()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _help() -> float:
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-m", "teamsight", "--help"], check=True, capture_output=True)
    return time.perf_counter() - begin
