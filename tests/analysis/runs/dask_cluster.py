"""A Dask cluster for tests: a scheduler and two workers, each a process of its own, with TLS where openssl is there."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

# Seconds, against a hang; a cluster without a client ends by itself after this time.
PATIENCE = 1800.0
# Dask gives up a connection after half a minute, which a busy machine may need to answer.
_SETTINGS = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1800s", "DASK_DISTRIBUTED__COMM__TIMEOUTS__TCP": "1800s"}


class Cluster(NamedTuple):
    """How to reach a cluster, and its processes."""

    scheduler: str
    tls: dict[str, str]
    processes: tuple[subprocess.Popen[bytes], ...]


def certificate(folder: Path) -> dict[str, str]:
    """Write a certificate that signs itself; empty without openssl."""
    if shutil.which("openssl") is None:
        return {}
    key, certificate = str(folder / "key.pem"), str(folder / "certificate.pem")
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"]
    subprocess.run([*command, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    return {"tls_ca": certificate, "tls_cert": certificate, "tls_key": key}


@contextmanager
def cluster(folder: Path, workers: int = 2, *, tls: bool = False) -> Iterator[Cluster]:
    """Start a scheduler and workers on 127.0.0.1, and end them."""
    files = certificate(folder) if tls else {}
    address = folder / "scheduler.json"
    secure = [f"--{name.replace('tls_', 'tls-').replace('-ca', '-ca-file')}={path}" for name, path in files.items()]
    host = "tls://127.0.0.1" if files else "127.0.0.1"
    common = ["--scheduler-file", str(address), "--host", host, "--dashboard-address=127.0.0.1:0", *secure]
    processes = [start("dask_scheduler", *common, "--port=0", f"--idle-timeout={PATIENCE}")]
    try:
        processes.append(
            start(
                "dask_worker", *common, f"--nworkers={workers}", "--nthreads=1",
                f"--local-directory={folder}", f"--death-timeout={PATIENCE}",
            )
        )  # fmt: skip
        yield Cluster(_written(address), files, tuple(processes))
    finally:
        for process in processes:
            # The workers are processes of the one that was started.
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _written(address: Path) -> str:
    """Wait for the scheduler's address: its file is there before its text is."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        with suppress(FileNotFoundError, json.JSONDecodeError):
            return str(json.loads(address.read_text())["address"])
        time.sleep(0.05)
    raise AssertionError("the scheduler did not start")


def start(tool: str, *options: str) -> subprocess.Popen[bytes]:
    paths = [str(Path(__file__).parents[3]), str(Path(__file__).parent)]
    return subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.{tool}", *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=dict(os.environ, **_SETTINGS, PYTHONPATH=os.pathsep.join(paths)),
        start_new_session=True,
    )
