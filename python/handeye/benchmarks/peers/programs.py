"""Peers in C++: compiled when a benchmark runs, if a compiler and the libraries are found."""

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from handeye.benchmarks.peers.availability import MissingPeerError
from handeye.benchmarks.problems import SIGMA_PX, Cell
from handeye.types.arrays import FloatArray

# Beside the sources of an editable install, or where the command is run.
PLACES = (Path(__file__).resolve().parents[3] / "benchmarks" / "peers", Path("benchmarks") / "peers")
FLAGS = ("-std=c++17", "-O3", "-march=native", "-DNDEBUG", "-fPIC", "-shared")
INCLUDES = (
    Path(sys.prefix) / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}"
    / "site-packages" / "cmeel.prefix" / "include" / "eigen3",
    Path("/usr/include/eigen3"),
    Path("/usr/local/include/eigen3"),
)  # fmt: skip
COMPILE_S = 300
INSTALL_CERES = "apt-get install libceres-dev (Debian, Ubuntu) or brew install ceres-solver (macOS)"


def compiler() -> str:
    """Return the C++ compiler.

    Raises
    ------
    MissingPeerError
        There is none.
    """
    names = [os.environ.get("CXX", ""), "g++", "clang++", "c++"]
    for name in names:
        found = shutil.which(name) if name else None
        if found:
            return found
    raise MissingPeerError("no C++ compiler was found (g++ or clang++, or CXX)")


def compiler_version() -> str | None:
    """Return the first line of what the compiler says of itself; None without one."""
    try:
        command = [compiler(), "--version"]
    except MissingPeerError:
        return None
    said = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - a compiler
    return said.stdout.partition("\n")[0] or None


def built(name: str, libraries: Sequence[str]) -> ctypes.CDLL:
    """Return the compiled program of a source file, remembered in the cache folder.

    Raises
    ------
    MissingPeerError
        The source, a compiler, Eigen or a library is missing.
    """
    source = next((place / f"{name}.cpp" for place in PLACES if (place / f"{name}.cpp").is_file()), None)
    if source is None:
        raise MissingPeerError(f"benchmarks/peers/{name}.cpp was not found: run in a clone of handeye")
    eigen = next((folder for folder in INCLUDES if (folder / "Eigen" / "Core").is_file()), None)
    if eigen is None:
        raise MissingPeerError("the Eigen headers were not found (requirements/bench.txt brings them)")
    program = compiler()
    command = [program, *FLAGS, f"-I{eigen}", str(source)]
    mark = hashlib.sha256(" ".join([*command, *libraries]).encode() + source.read_bytes()).hexdigest()[:16]
    from handeye.studies.data import cache_folder  # noqa: PLC0415 - brings OpenCV, which takes memory

    library = cache_folder() / "benchmarks" / f"{name}_{mark}.so"
    if not library.is_file():
        library.parent.mkdir(parents=True, exist_ok=True)
        made = library.with_suffix(f".{os.getpid()}")
        command += ["-o", str(made), *(f"-l{which}" for which in libraries)]
        try:
            done = subprocess.run(  # noqa: S603 - a compiler
                command, capture_output=True, text=True, check=False, timeout=COMPILE_S
            )
        except subprocess.TimeoutExpired:
            raise MissingPeerError(f"{name}.cpp took more than {COMPILE_S} s to compile") from None
        if done.returncode != 0:
            lines = [line for line in done.stderr.splitlines() if "error" in line or "cannot find" in line]
            why = lines[0].strip() if lines else f"the compiler ended with {done.returncode}"
            raise MissingPeerError(f"{name}.cpp did not compile: {why}")
        made.replace(library)
    try:
        return ctypes.CDLL(str(library))
    except OSError as error:
        raise MissingPeerError(f"{name} does not load: {error}") from None


def _pointer(values: FloatArray) -> ctypes.c_void_p:
    return ctypes.c_void_p(values.ctypes.data)


@cache
def ceres_solve() -> Callable[[Cell, FloatArray, int], FloatArray]:
    """Return what solves a cell by Ceres from 12 numbers: analytic (mode 0), or per point (1, 2).

    Raises
    ------
    MissingPeerError
        Ceres is not there.
    """
    try:
        function = built("ceres_solve", ["ceres", "glog"]).solve
    except MissingPeerError as missing:
        if not re.search(r"ceres/|-lceres|-lglog|glog/", str(missing)):
            raise
        raise MissingPeerError(f"Ceres for C++ is not installed: {INSTALL_CERES}") from None
    function.restype = ctypes.c_int

    def solve(cell: Cell, start: FloatArray, mode: int) -> FloatArray:
        values = start.copy()
        arrays = [cell.parameters, cell.points, cell.motions, cell.pixels, values]
        function(
            ctypes.c_int(cell.views), ctypes.c_int(len(cell.points)), ctypes.c_int(mode),
            *(_pointer(array) for array in arrays),
        )  # fmt: skip
        return values

    return solve


@cache
def eigen_score() -> Callable[[Cell, FloatArray, FloatArray, int], FloatArray]:
    """Return what scores motions (N, 4, 4) by Eigen: rank update and LLT (mode 0), LDLT of J'J (mode 1).

    Raises
    ------
    MissingPeerError
        Eigen is not there.
    """
    function = built("eigen_score", []).score
    function.restype = None

    def score(cell: Cell, information: FloatArray, motions: FloatArray, mode: int) -> FloatArray:
        gains = np.empty(len(motions))
        arrays = [cell.parameters, cell.points, cell.X, cell.Y, information, motions, gains]
        function(
            ctypes.c_int(len(motions)), ctypes.c_int(len(cell.points)), ctypes.c_int(mode),
            ctypes.c_double(SIGMA_PX), *(_pointer(array) for array in arrays),
        )  # fmt: skip
        return gains

    return score
