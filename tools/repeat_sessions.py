"""Run the same simulated sessions several times and compare them bit for bit.

.venv/bin/python tools/repeat_sessions.py --seeds 6 --times 3

Of every seed: points, faults of every kind, rendered pictures, and the other mounting. Timings apart,
journal, recording and pictures have to be the same, on a busy machine too.
"""

import argparse
import sys
import tempfile
import time
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


def main() -> int:
    """Run everything; return 1 if two runs differ."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--times", type=int, default=3)
    options = parser.parse_args()
    runs = different = 0
    began = time.monotonic()
    for seed in range(options.seeds):
        for name, configuration in configurations(seed).items():
            with tempfile.TemporaryDirectory() as folder:
                found: list[Outcome] = []
                for number in range(options.times):
                    run(configuration, Path(folder) / str(number))
                    found.append(Outcome.of(Path(folder) / str(number)))
            runs += 1
            if any(one != found[0] for one in found):
                different += 1
                print(f"seed {seed}, {name}: not the same twice")
        print(f"{runs} sessions, {different} not the same, {time.monotonic() - began:.0f} s", flush=True)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
