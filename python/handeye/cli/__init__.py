"""The command line: one file per command, one boundary for errors, no rule that the library lacks."""

import os
import sys

from handeye.errors import ExitCode

INTERRUPTED = int(ExitCode.INTERRUPTED)


def main() -> None:
    """Run the command that the arguments name and leave with its exit code."""
    # Matrices are small: threads of the linear algebra would wait for each other longer than they work, and
    # what they round would depend on their number.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from handeye.cli.boundary import run  # noqa: PLC0415 - it loads much

        code = run(sys.argv[1:])
    except KeyboardInterrupt:
        # Before the boundary was there, or once more while it said so.
        code = INTERRUPTED
    if code == INTERRUPTED:
        # Taking the interpreter apart would wait for threads, and free what the system frees at once.
        os._exit(code)
    sys.exit(code)
