"""Count the instructions of solver and scorer with callgrind, and compare with the counts that are committed.

Seconds are noisy, instructions are not: the same program takes the same number of them on every machine with
the same vector unit. Valgrind knows AVX2 and no AVX-512, so the solver is counted on AVX2.

.venv/bin/python tools/count_instructions.py            # compare
.venv/bin/python tools/count_instructions.py --update   # write benchmarks/instructions.json
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COUNTS = ROOT / "benchmarks" / "instructions.json"
PROGRAM = ROOT / "target" / "release" / "examples" / "counted"
FEW, MANY = 2, 12
# Candidates of a call in examples/counted.rs.
CANDIDATES = 1000
TOLERANCE = 0.03


def instructions(case: str, repeats: int) -> int:
    """Instructions of a whole run."""
    command = [
        "valgrind",
        "--tool=callgrind",
        "--callgrind-out-file=/dev/null",
        str(PROGRAM),
        case,
        str(repeats),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    assert found, done.stderr
    return int(found[1])


def count(case: str) -> int:
    """Instructions of one call, or of one candidate; what the program does besides falls out."""
    calls = (instructions(case, MANY) - instructions(case, FEW)) / (MANY - FEW)
    return round(calls / CANDIDATES) if case.startswith("score") else round(calls)


def main() -> int:
    """Return 1 if a count has grown by more than the tolerance."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="write the counts instead of comparing them")
    options = parser.parse_args()
    if shutil.which("valgrind") is None:
        sys.exit("valgrind is not installed")
    build = [
        "cargo",
        "build",
        "--release",
        "--locked",
        "--quiet",
        "--package",
        "handeye-core",
        "--example",
        "counted",
    ]
    subprocess.run(build, cwd=ROOT, check=True)
    cases = subprocess.run([str(PROGRAM)], capture_output=True, text=True, check=True).stdout.split()
    known = json.loads(COUNTS.read_text()) if COUNTS.exists() else {}
    counts: dict[str, int] = {}
    grown = 0
    for case in cases:
        counts[case] = count(case)
        change = counts[case] / known[case] - 1 if case in known else float("nan")
        grown += change > TOLERANCE
        print(f"{case:26} {counts[case]:10,d}  {change:+.1%}", flush=True)
    if options.update:
        COUNTS.write_text(json.dumps(counts, indent=2) + "\n")
        return 0
    return 1 if grown else 0


if __name__ == "__main__":
    raise SystemExit(main())
