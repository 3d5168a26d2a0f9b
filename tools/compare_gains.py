"""Compare the gains that two builds of the core print: the same to 1e-10, whatever the machine.

The example `counted` prints them. A build for 64-bit ARM runs under qemu:

cargo build --release --example counted
cargo build --release --example counted --target aarch64-unknown-linux-gnu
python tools/compare_gains.py target/release/examples/counted \
    target/aarch64-unknown-linux-gnu/release/examples/counted \
    --runner "qemu-aarch64 -L /"
"""

import argparse
import shlex
import subprocess

import numpy as np

TOLERANCE = 1e-10
UNITS = ("portable", "avx2", "avx512")


def printed(command: str) -> np.ndarray:
    """Return the numbers that a command prints, one a line."""
    answer = subprocess.run(shlex.split(command), check=True, capture_output=True, text=True)
    return np.array([float(line) for line in answer.stdout.split()])


def main() -> None:
    """Print the largest difference for each vector unit here; exit 1 beyond the tolerance."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("here", help="counted, built for this machine")
    parser.add_argument("other", help="counted, built for another")
    parser.add_argument("--runner", default="", help="what runs the other")
    arguments = parser.parse_args()
    other = printed(f"{arguments.runner} {arguments.other} gains portable")
    worst = 0.0
    for unit in UNITS:
        here = printed(f"{arguments.here} gains {unit}")
        alike = here.shape == other.shape and np.array_equal(np.isnan(here), np.isnan(other))
        seen = ~np.isnan(here)
        off = (
            float(np.max(np.abs(here - other)[seen] / np.abs(here[seen]))) if alike and seen.any() else np.inf
        )
        print(f"{unit}: {here.size} gains, {int(seen.sum())} in sight, relative difference at most {off:.1e}")
        worst = max(worst, off)
    raise SystemExit(worst > TOLERANCE)


if __name__ == "__main__":
    main()
