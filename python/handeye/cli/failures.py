"""Errors that only a command line has."""

from handeye.codes import Code
from handeye.errors import ExitCode, HandeyeError


class WarnedError(Exception):
    """An error after warnings about the data, which may well name its cause."""

    def __init__(self, error: HandeyeError, warnings: tuple[str, ...]) -> None:
        super().__init__(error.message)
        self.error = error
        self.warnings = warnings


class UsageError(HandeyeError):
    """The command line is not understood, or asks for what does not go together."""

    exit_code = ExitCode.USAGE
    default_code = Code.USAGE


class UnexpectedError(HandeyeError):
    """Something that should not have happened."""

    exit_code = ExitCode.UNEXPECTED
    default_code = Code.UNEXPECTED
