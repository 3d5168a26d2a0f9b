"""Run a study on a local Dask cluster, kill a worker and the client, resume it, and compare with one process.

.venv/bin/python tools/kill_studies.py --trials 1000
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from clusters import local_cluster
from handeye.evaluation.checkpoint import FILE
from handeye.evaluation.studies.coverage import CASES

BYTES_PER_TRIAL = 100
COMMAND = "import sys; from handeye.cli import main; sys.exit(main())"


def study(folder: Path, options: argparse.Namespace, *more: str) -> list[str]:
    """The command of the study, its answer in a folder."""
    command = [sys.executable, "-c", COMMAND, "study", "coverage", "--model", options.model]
    return [*command, "--trials", str(options.trials), "--output", str(folder), *more]


def seconds(command: list[str]) -> float:
    """Run a command to its end."""
    began = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.monotonic() - began


def main() -> int:
    """Return 1 if the results differ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=1000, help="of each of the ten kinds of errors")
    parser.add_argument("--model", default="paper", choices=["paper", "auto"])
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kept = folder / "kept"
        on_cluster = ("--checkpoint", str(kept), "--scheduler")
        with local_cluster(folder) as cluster:
            command = study(folder / "cluster", options, *on_cluster, cluster.address)
            began = time.monotonic()
            client = subprocess.Popen(command, stdout=subprocess.DEVNULL)
            total = options.trials * len(CASES)
            # A fifth of the way a worker dies, half of the way the client.
            wait_for(kept / FILE, 0.2 * total)
            cluster.workers[0].kill()
            wait_for(kept / FILE, 0.5 * total)
            client.send_signal(signal.SIGKILL)
            client.wait()
            until_kill = time.monotonic() - began
            done = (kept / FILE).stat().st_size
            print(f"{total} trials; a worker killed, and the client after {until_kill:.0f} s", flush=True)
            rest = seconds(command)
            print(f"resumed with one worker: {rest:.0f} s more", flush=True)
            share = done / (kept / FILE).stat().st_size
            print(
                f"kept over the kill: {share:.0%} of {(kept / FILE).stat().st_size / 1e6:.2f} MB", flush=True
            )
        again = seconds(study(folder / "again", options, "--checkpoint", str(kept)))
        print(f"once more from what is kept: {again:.1f} s", flush=True)
        alone = seconds(study(folder / "alone", options, "--workers", "1"))
        print(f"one process: {alone:.0f} s", flush=True)
        places = ("cluster", "again", "alone")
        found = [json.loads((folder / place / "coverage.json").read_text()) for place in places]
    same = found[0] == found[1] == found[2]
    print("the same to the bit" if same else "DIFFERENT")
    return 0 if same else 1


def wait_for(file: Path, trials: float) -> None:
    """Wait until about so many trials are kept."""
    while not file.exists() or file.stat().st_size < trials * BYTES_PER_TRIAL:
        time.sleep(0.1)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    raise SystemExit(main())
