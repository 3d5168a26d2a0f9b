"""The command line: one file per command, one boundary for errors, no rule that the library lacks."""

import sys


def main() -> None:
    """Run the command that the arguments name and leave with its exit code."""
    from handeye.cli.boundary import run  # noqa: PLC0415 - importing this package costs nothing

    sys.exit(run(sys.argv[1:]))
