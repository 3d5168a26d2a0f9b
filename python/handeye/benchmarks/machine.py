"""What the figures were measured on, and how a process keeps to one core."""

import os
import platform
import sys
from collections.abc import Generator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from handeye.codes import Code
from handeye.errors import HandeyeError

PACKAGES = (
    "handeye", "numpy", "scipy", "opencv-contrib-python-headless", "jax", "jaxlib", "pyceres", "gtsam",
    "cmeel-eigen",
)  # fmt: skip
# Widest last.
VECTOR_FLAGS = (("avx2", "AVX2"), ("avx512f", "AVX-512"))
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def describe_machine() -> dict[str, Any]:
    """Return processor, cores, vector units, memory, load and system, as far as the system tells."""
    processor, flags = _processor()
    return {
        "processor": processor,
        "cores": os.cpu_count(),
        "vector_units": [name for flag, name in VECTOR_FLAGS if flag in flags],
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
    }


def describe_versions() -> dict[str, str]:
    """Return the version of the interpreter and of every package that was measured and is there."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def _processor() -> tuple[str, frozenset[str]]:
    """Model and flags of the processor; on systems without /proc what the interpreter knows."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine(), frozenset()
    fields = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    place = [fields.get(key, "") for key in ("cpu family", "model", "stepping")]
    name = fields.get("model name", platform.machine())
    return f"{name} (family {place[0]}, model {place[1]}, stepping {place[2]})", frozenset(
        fields.get("flags", "").split()
    )


@contextmanager
def one_core() -> Generator[None]:
    """Keep this process and the threads it starts to one core, where the system can.

    Libraries that count the cores when they are loaded then see one: load them inside.
    """
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextmanager
def all_cores() -> Generator[int]:
    """Give this process all cores of the machine, and say how many they are."""
    if not hasattr(os, "sched_setaffinity"):
        yield os.cpu_count() or 1
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    try:
        yield len(os.sched_getaffinity(0))
    finally:
        os.sched_setaffinity(0, before)


def peak_memory_mb() -> float:
    """Return the most memory that this process has held, in megabytes.

    Raises
    ------
    HandeyeError
        The system does not tell.
    """
    # The usual way, getrusage, counts what the parent held when this process was started.
    try:
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    for line in lines:
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 2**10
    try:
        import resource  # noqa: PLC0415 - not on every system
    except ImportError:
        raise HandeyeError("this system does not tell the peak memory", code=Code.UNSUPPORTED) from None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 2**20 if sys.platform == "darwin" else peak / 2**10
