"""A Dask cluster on this machine: a scheduler and two worker processes on loopback."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

START_S = 60.0
DASK = [sys.executable, "-m", "dask"]


@dataclass(frozen=True)
class LocalCluster:
    """Where the scheduler is, and its workers' processes."""

    address: str
    workers: list[subprocess.Popen[bytes]]


@contextmanager
def local_cluster(folder: Path, workers: int = 2) -> Iterator[LocalCluster]:
    """Start a scheduler and workers, and end them."""
    file, log = folder / "scheduler.json", folder / "cluster.log"
    quiet = os.environ | {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with log.open("wb") as out:

        def start(*arguments: str) -> subprocess.Popen[bytes]:
            return subprocess.Popen([*DASK, *arguments], cwd=folder, env=quiet, stdout=out, stderr=out)

        place = ("--host", "127.0.0.1", "--scheduler-file", str(file))
        started = [start("scheduler", *place, "--port", "0", "--no-dashboard")]
        try:
            until = time.monotonic() + START_S
            while not file.exists() or not file.read_text():
                assert started[0].poll() is None, log.read_text()
                assert time.monotonic() < until, log.read_text()
                time.sleep(0.05)
            address = json.loads(file.read_text())["address"]
            options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
            started += [start("worker", address, *options) for _ in range(workers)]
            yield LocalCluster(address, started[1:])
        finally:
            for process in reversed(started):
                process.kill()
                process.wait()
