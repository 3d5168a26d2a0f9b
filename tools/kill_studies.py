"""Run a study on a local Dask cluster, kill a worker and the client, resume it, and compare with one process.

.venv/bin/python tools/kill_studies.py --trials 1000

The study is that of coverage with the paper's model, in cells with four views of a small board: a trial takes
some milliseconds.
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
from handeye.compute.checkpoint import FILE, Checkpoint
from handeye.compute.cluster import Cluster
from handeye.compute.parallel import Workers
from handeye.simulation.cells import CellOptions
from handeye.studies.coverage import CASES, study_coverage
from handeye.types import Chessboard
from handeye.types.calibration import ModelName

BYTES_PER_TRIAL = 100
CELL = CellOptions(views=(4, 4), calibration_views=4, target=Chessboard(4, 5, 0.03))


def study(answer: Path, trials: int, kept: Path | None, scheduler: str | None) -> None:
    """Do the study in this process and write its answer."""
    workers: Workers = 1 if scheduler is None else Cluster(scheduler)
    if kept is not None:
        workers = Checkpoint(kept, workers)
    found = study_coverage(model=ModelName.PAPER, cell=CELL, trials=trials, workers=workers)
    answer.write_text(json.dumps({case.name: repr(runs) for case, runs in found.kinds.items()}))


def command(answer: Path, trials: int, *more: str) -> list[str]:
    """The same in a process of its own."""
    return [sys.executable, __file__, "--trials", str(trials), "--answer", str(answer), *more]


def seconds(words: list[str]) -> float:
    """Run a command to its end."""
    began = time.monotonic()
    subprocess.run(words, check=True)
    return time.monotonic() - began


def wait_for(file: Path, trials: float) -> None:
    """Wait until about so many trials are kept."""
    while not file.exists() or file.stat().st_size < trials * BYTES_PER_TRIAL:
        time.sleep(0.1)


def experiment(trials: int, folder: Path) -> bool:
    """Kill and resume; whether the answers are the same."""
    total = trials * len(CASES)
    answers = [folder / name for name in ("cluster", "again", "alone")]
    file = folder / "kept" / FILE
    keep = ("--checkpoint", str(file.parent))
    with local_cluster(folder) as cluster:
        words = command(answers[0], trials, *keep, "--scheduler", cluster.address)
        began = time.monotonic()
        client = subprocess.Popen(words)
        # A fifth of the way a worker dies, half of the way the client.
        wait_for(file, 0.2 * total)
        cluster.workers[0].kill()
        wait_for(file, 0.5 * total)
        client.send_signal(signal.SIGKILL)
        client.wait()
        until = time.monotonic() - began
        size = file.stat().st_size
        print(f"{total} trials; one of two workers killed, and the client after {until:.0f} s", flush=True)
        rest = seconds(words)
        share = size / file.stat().st_size
        print(f"kept over the kill: {share:.0%}; resumed with one worker: {rest:.0f} s more", flush=True)
    again = seconds(command(answers[1], trials, *keep))
    print(f"once more from what is kept, {file.stat().st_size / 1e6:.2f} MB: {again:.1f} s", flush=True)
    alone = seconds(command(answers[2], trials))
    print(f"one process: {alone:.0f} s", flush=True)
    return len({answer.read_text() for answer in answers}) == 1


def main() -> int:
    """Return 1 if the results differ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=1000, help="of each of the ten kinds of errors")
    parser.add_argument("--answer", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--checkpoint", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--scheduler", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.answer is not None:
        study(options.answer, options.trials, options.checkpoint, options.scheduler)
        return 0
    with tempfile.TemporaryDirectory() as name:
        same = experiment(options.trials, Path(name))
    print("the same to the bit" if same else "DIFFERENT")
    return 0 if same else 1


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    raise SystemExit(main())
