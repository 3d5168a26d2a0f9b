"""Cut and change the journals of simulated sessions at very many places, and see what becomes of them.

.venv/bin/python tools/cut_journals.py --sessions 3 --cuts 0 --changes 2000

A cut journal is either mended, and goes on to the same end as undisturbed, or refused, and no file of the
session is changed but by the cut. A changed byte is refused. `--cuts 0` tries every position.
"""

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye.errors import InputError
from handeye.session.faults import FaultRates
from handeye.session.journal import JOURNAL_FILE
from handeye.session.store import open_session
from sessions import Outcome, configured, run


def tree(folder: Path) -> dict[str, bytes]:
    """Return all files of a session but its journal."""
    found = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    found.pop(JOURNAL_FILE, None)
    return found


def main() -> int:
    """Try all places; return 1 if anything was lost, doubled or invented."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sessions", type=int, default=3)
    parser.add_argument("--cuts", type=int, default=0, help="positions a session, 0 for every one")
    parser.add_argument("--changes", type=int, default=2000, help="changed bytes of all sessions together")
    options = parser.parse_args()
    wrong = refused = mended = accepted = 0
    began = time.monotonic()
    for seed in range(options.sessions):
        random = np.random.default_rng([23, seed])
        with tempfile.TemporaryDirectory() as name:
            folder, work = Path(name) / "s", Path(name) / "work"
            rates = FaultRates(not_found=0.2, refused=0.2)
            configuration = configured(seed, most_views=6, faults=rates)
            run(configuration, folder)
            whole, before = Outcome.of(folder), tree(folder)
            content = (folder / JOURNAL_FILE).read_bytes()
            cuts = range(len(content))
            if options.cuts:
                cuts = sorted({0, *random.integers(0, len(content), options.cuts).tolist()})
            again: dict[int, bool] = {}
            shutil.copytree(folder, work)
            for cut in cuts:
                (work / JOURNAL_FILE).write_bytes(content[:cut])
                try:
                    open_session(work).close()
                except InputError:
                    refused += 1
                    wrong += tree(work) != before
                    continue
                mended += 1
                # Cuts that leave the same lines go on alike: one of each is run to its end.
                left = len((work / JOURNAL_FILE).read_bytes())
                if left not in again:
                    run(configuration, work)
                    again[left] = Outcome.of(work) == whole
                    wrong += not again[left]
                    shutil.rmtree(work)
                    shutil.copytree(folder, work)
            for _ in range(options.changes // options.sessions):
                changed = bytearray(content)
                changed[random.integers(len(content) - 1)] ^= int(random.integers(1, 256))
                (work / JOURNAL_FILE).write_bytes(changed)
                try:
                    open_session(work).close()
                except InputError:
                    wrong += tree(work) != before
                    continue
                accepted += 1
        print(
            f"{seed + 1} sessions: {refused} cuts refused, {mended} mended, {accepted} changed bytes "
            f"accepted, {wrong} wrong, {time.monotonic() - began:.0f} s",
            flush=True,
        )
    return 1 if wrong or accepted else 0


if __name__ == "__main__":
    sys.exit(main())
