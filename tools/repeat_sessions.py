"""Run the same simulated sessions several times and compare them bit for bit.

.venv/bin/python tools/repeat_sessions.py --seeds 6 --times 3 --load 8
.venv/bin/python tools/repeat_sessions.py --commands --times 3 --load 8

Of every seed: points, faults of every kind, rendered pictures, the other mounting, a lens that nobody knows,
and several cameras. Timings apart, journal, recording and pictures have to be the same, also on a busy
machine: with `--load` every run but the first goes beside so many processes that do nothing but count. Of
`--commands`, which are demonstrations and the twin of the paper's cell, everything printed and every file has
to be the same, but for seconds. Checksums compare runs of this tool.
"""

import argparse
import hashlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye.session.faults import FaultRates
from handeye.session.settings import Configuration
from handeye.types import Mounting
from sessions import RIG, Outcome, configured, run, run_rig

HANDEYE = (sys.executable, "-c", "from handeye.cli import main; main()")
COMMANDS = {
    "demo": ("demo", "--picture", "demo.png"),
    "make demo": ("demo", "--cell", "cells", "--picture", "cells.png"),
    "demo of a rig": ("demo", "--rig", "rig", "--picture", "rig.png"),
    "demo of a folder": ("demo", "--folder", "folder"),
    "study twin": ("study", "twin", "--output", "twin"),
    "study twin, rendered": ("study", "twin", "--render", "--sets", "1", "--trials", "2", "--output", "twin"),
}
# What says when something was made or how long it took: in journals, and in what is written for people.
TIMINGS = re.compile(
    rb'"timings_s":\{[^}]*\}|"chain":"[0-9a-f]+"|\b[0-9.]+ s(econds)?\b|[0-9]{4}-[0-9-]{5} [0-9:]{5} UTC'
)


def configurations(seed: int) -> dict[str, Configuration]:
    """Return runs of one seed."""
    everything = FaultRates(**dict.fromkeys(vars(FaultRates()), 0.05))
    return {
        "points": configured(seed),
        "faults": configured(seed, faults=everything, most_views=6),
        "pictures": configured(seed, points_only=None, most_views=4, camera_error=1.0),
        "pictures with faults": configured(seed, points_only=None, most_views=4, faults=everything),
        "beside": configured(seed, robot="ur5e", mounting=Mounting.EYE_TO_HAND, most_views=8),
        "lens": configured(seed, camera_known=False, most_views=12),
        "rig": replace(RIG, seed=seed),
    }


@contextmanager
def busy(processes: int) -> Generator[None]:
    """Keep processors busy in the meantime."""
    children: list[int] = []
    try:
        for _ in range(processes):
            child = os.fork()
            if child == 0:
                os.nice(5)
                while True:
                    pass
            children.append(child)
        yield
    finally:
        for child in children:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def printed(line: tuple[str, ...], folder: Path) -> dict[str, bytes]:
    """Run a command in an empty folder; return what it printed and every file, without seconds."""
    folder.mkdir()
    done = subprocess.run([*HANDEYE, *line], cwd=folder, capture_output=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.decode()[-2000:])
    files = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    return {name: TIMINGS.sub(b"", content) for name, content in {"printed": done.stdout, **files}.items()}


def session(configuration: Configuration, folder: Path) -> Outcome:
    """Run a session and return everything that must not depend on the machine."""
    (run if configuration.rig is None else run_rig)(configuration, folder)
    return Outcome.of(folder)


def unlike(found: list[Any]) -> str:
    """Return in what the results differ from the first of them, nothing if in nothing."""
    if all(one == found[0] for one in found):
        return ""
    if not isinstance(found[0], dict):
        return "not the same"
    names = {name for one in found for name in one if one[name] != found[0].get(name)}
    return f"not the same: {', '.join(sorted(names))}"


def main() -> int:
    """Run everything; return 1 if two runs differ."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--load", type=int, default=0, help="busy processes beside all runs but the first")
    parser.add_argument("--commands", action="store_true", help="commands instead of sessions")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    works: dict[str, Callable[[Path], Any]] = {
        f"seed {seed}, {name}": partial(session, configuration)
        for seed in seeds
        for name, configuration in configurations(seed).items()
    }
    if options.commands:
        works = {name: partial(printed, line) for name, line in COMMANDS.items()}
    different = 0
    digest = hashlib.blake2b(digest_size=8)
    began = time.monotonic()
    for number, (name, work) in enumerate(works.items(), start=1):
        with tempfile.TemporaryDirectory() as folder:
            found = list[Any]()
            for once in range(options.times):
                with busy(options.load if once else 0):
                    found.append(work(Path(folder) / str(once)))
        digest.update(repr(found[0]).encode())
        how = unlike(found)
        different += how != ""
        print(
            f"{number} of {len(works)}, {name}: {how or 'the same'}; checksum {digest.hexdigest()}, "
            f"{time.monotonic() - began:.0f} s",
            flush=True,
        )
    print(f"{len(works)} works, {different} not the same")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
