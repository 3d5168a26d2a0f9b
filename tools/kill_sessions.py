"""Kill simulated sessions at random instants, go on with them, and compare the end with an undisturbed run.

.venv/bin/python tools/kill_sessions.py --kills 500
"""

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye.session.faults import FaultRates
from sessions import Outcome, configured, run, run_killed


def main() -> int:
    """Run until enough kills are done; return 1 if any session ended otherwise than undisturbed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=500)
    parser.add_argument("--mean-s", type=float, default=0.2, help="mean life of a process")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    kills = runs = different = 0
    began = time.monotonic()
    while kills < options.kills:
        seed = options.seed + runs
        faults = FaultRates(refused=0.1, not_found=0.1, camera_fails=0.05) if runs % 2 else None
        configuration = configured(seed, faults=faults)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            run(configuration, folder / "undisturbed")
            kills += run_killed(configuration, folder / "killed", np.random.default_rng(seed), options.mean_s)
            same = Outcome.of(folder / "undisturbed") == Outcome.of(folder / "killed")
            if not same:
                different += 1
                shutil.copytree(folder, Path("out") / f"killed_{seed}", dirs_exist_ok=True)
        runs += 1
        seconds = time.monotonic() - began
        print(f"{runs} runs, {kills} kills, {different} ended otherwise, {seconds:.0f} s", flush=True)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
