"""Cut and change the journals of simulated sessions at very many places, and see what becomes of them.

.venv/bin/python tools/cut_journals.py --sessions 3 --cuts 0 --changes 2000

Every cut journal is read: it must give the attempts whose lines are whole, no more, no fewer, no others. What
an opening makes of that depends on how many those are and how the last line ends: of each such case, and of
`--opened` further places a session, one is opened. It is either mended, and goes on to the same end as
undisturbed, or refused, and no file of the session is changed but by the cut. A changed byte is refused when
the journal is read, or when the session is opened. `--cuts 0` tries every position.
"""

import argparse
import os
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye.errors import InputError
from handeye.session.faults import FaultRates
from handeye.session.journal import JOURNAL_FILE, Journal, read_journal
from handeye.session.settings import Configuration
from handeye.session.store import open_session
from sessions import Outcome, configured, run


def tree(folder: Path) -> dict[str, bytes]:
    """Return all files of a session but its journal."""
    found = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    found.pop(JOURNAL_FILE, None)
    return found


def read(folder: Path) -> Journal | None:
    """Return the journal of a session, None if it is refused."""
    try:
        return read_journal(folder)
    except InputError:
        return None


@dataclass
class Trial:
    """A session that has ended, a copy of it whose journal is spoiled, and what came of that."""

    configuration: Configuration
    whole: Path
    work: Path
    refused: int = 0
    mended: int = 0
    accepted: int = 0
    wrong: int = 0
    content: bytes = field(init=False)
    before: dict[str, bytes] = field(init=False)
    end: Outcome = field(init=False)

    def __post_init__(self) -> None:
        run(self.configuration, self.whole)
        self.content = (self.whole / JOURNAL_FILE).read_bytes()
        self.before, self.end = tree(self.whole), Outcome.of(self.whole)
        shutil.copytree(self.whole, self.work)

    def opens(self, content: bytes) -> bool:
        """Open the copy with a spoiled journal; if that is refused, nothing else may have changed."""
        (self.work / JOURNAL_FILE).write_bytes(content)
        try:
            open_session(self.work).close()
        except InputError:
            self.wrong += tree(self.work) != self.before
            return False
        return True

    def cut(self, cuts: range | list[int], opened: set[int]) -> None:
        """Cut the journal at all places, from its end to its beginning."""
        entries = read_journal(self.whole).entries
        tried = dict[tuple[int, bool, bool], bool]()
        for cut in sorted(cuts, reverse=True):
            os.truncate(self.whole / JOURNAL_FILE, cut)
            found = read(self.whole)
            lines = self.content[:cut].count(b"\n")
            # A line is whole also where only its line feed is missing.
            lines += self.content[cut : cut + 1] == b"\n"
            if found is None or found.entries != entries[:lines]:
                self.wrong += 1
                continue
            case = (lines, found.torn > 0, self.content[:cut].endswith(b"\n"))
            if case not in tried or cut in opened:
                tried[case] = self.opens(self.content[:cut])
                if tried[case]:
                    run(self.configuration, self.work)
                    self.wrong += Outcome.of(self.work) != self.end
                    shutil.rmtree(self.work)
                    shutil.copytree(self.whole, self.work)
            self.mended += tried[case]
            self.refused += not tried[case]
        (self.whole / JOURNAL_FILE).write_bytes(self.content)

    def change(self, number: int, random: np.random.Generator) -> None:
        """Change one byte of the journal, so many times."""
        for _ in range(number):
            changed = bytearray(self.content)
            changed[random.integers(len(self.content) - 1)] ^= int(random.integers(1, 256))
            (self.whole / JOURNAL_FILE).write_bytes(changed)
            if read(self.whole) is not None and self.opens(bytes(changed)):
                self.accepted += 1
        (self.whole / JOURNAL_FILE).write_bytes(self.content)


def main() -> int:
    """Try all places; return 1 if anything was lost, doubled or invented."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sessions", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, help="seed of the first of them")
    parser.add_argument("--cuts", type=int, default=0, help="positions a session, 0 for every one")
    parser.add_argument("--opened", type=int, default=100, help="further cuts a session that are opened")
    parser.add_argument("--changes", type=int, default=2000, help="changed bytes of all sessions together")
    options = parser.parse_args()
    refused = mended = accepted = wrong = 0
    began = time.monotonic()
    for seed in range(options.first, options.first + options.sessions):
        random = np.random.default_rng([23, seed])
        with tempfile.TemporaryDirectory() as name:
            rates = FaultRates(not_found=0.2, refused=0.2)
            trial = Trial(configured(seed, most_views=6, faults=rates), Path(name) / "s", Path(name) / "work")
            length = len(trial.content)
            cuts = range(length)
            if options.cuts:
                cuts = sorted({0, *random.integers(0, length, options.cuts).tolist()})
            trial.cut(cuts, set(random.choice(cuts, min(options.opened, len(cuts))).tolist()))
            trial.change(options.changes // options.sessions, random)
        refused, mended = refused + trial.refused, mended + trial.mended
        accepted, wrong = accepted + trial.accepted, wrong + trial.wrong
        print(
            f"seed {seed}, {length} bytes: {refused} cuts refused, {mended} mended, {accepted} changed "
            f"bytes accepted, {wrong} wrong, {time.monotonic() - began:.0f} s",
            flush=True,
        )
    return 1 if wrong or accepted else 0


if __name__ == "__main__":
    sys.exit(main())
