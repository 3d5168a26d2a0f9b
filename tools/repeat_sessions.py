"""Run the same simulated sessions several times and compare them bit for bit.

.venv/bin/python tools/repeat_sessions.py --seeds 6 --times 3 --load 8

Of every seed: points, faults of every kind, rendered pictures, and the other mounting. Timings apart,
journal, recording and pictures have to be the same, also on a busy machine: with `--load` every run but the
first goes beside so many processes that do nothing but count. Checksums compare runs of this tool.
"""

import argparse
import hashlib
import os
import signal
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye.session.faults import FaultRates
from handeye.session.settings import Configuration
from handeye.types import Mounting
from sessions import Outcome, configured, run


def configurations(seed: int) -> dict[str, Configuration]:
    """Return runs of one seed."""
    everything = FaultRates(**dict.fromkeys(vars(FaultRates()), 0.05))
    return {
        "points": configured(seed),
        "faults": configured(seed, faults=everything, most_views=6),
        "pictures": configured(seed, points_only=None, most_views=4, camera_error=1.0),
        "pictures with faults": configured(seed, points_only=None, most_views=4, faults=everything),
        "beside": configured(seed, robot="ur5e", mounting=Mounting.EYE_TO_HAND, most_views=8),
    }


@contextmanager
def busy(processes: int) -> Generator[None]:
    """Keep processors busy in the meantime."""
    children: list[int] = []
    try:
        for _ in range(processes):
            child = os.fork()
            if child == 0:
                while True:
                    pass
            children.append(child)
        yield
    finally:
        for child in children:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def main() -> int:
    """Run everything; return 1 if two runs differ."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--load", type=int, default=0, help="busy processes beside all runs but the first")
    options = parser.parse_args()
    runs = different = 0
    digest = hashlib.blake2b(digest_size=8)
    began = time.monotonic()
    for seed in range(options.first, options.first + options.seeds):
        for name, configuration in configurations(seed).items():
            with tempfile.TemporaryDirectory() as folder:
                found: list[Outcome] = []
                for number in range(options.times):
                    with busy(options.load if number else 0):
                        run(configuration, Path(folder) / str(number))
                    found.append(Outcome.of(Path(folder) / str(number)))
            runs += 1
            digest.update(repr(found[0]).encode())
            if any(one != found[0] for one in found):
                different += 1
                print(f"seed {seed}, {name}: not the same twice")
        seconds = time.monotonic() - began
        print(
            f"{runs} sessions, {different} not the same, checksum {digest.hexdigest()}, {seconds:.0f} s",
            flush=True,
        )
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
