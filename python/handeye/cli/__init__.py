"""The command line: one file per command, one boundary for errors, no rule that the library lacks."""

import os
import sys


def main() -> None:
    """Run the command that the arguments name and leave with its exit code."""
    # Matrices are small: threads of the linear algebra would wait for each other longer than they work, and
    # what they round would depend on their number.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from handeye.cli.boundary import INTERRUPTED, run  # noqa: PLC0415 - importing this package costs nothing

    code = run(sys.argv[1:])
    if code == INTERRUPTED:
        # Taking the interpreter apart would wait for threads, and free what the system frees at once.
        os._exit(code)
    sys.exit(code)
