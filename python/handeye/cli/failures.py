"""Errors that only a command line has."""

from handeye.errors import ExitCode, HandeyeError


class UsageError(HandeyeError):
    """The command line is not understood, or asks for what does not go together."""

    exit_code = ExitCode.USAGE
    default_code = "usage"


class UnexpectedError(HandeyeError):
    """Something that should not have happened."""

    exit_code = ExitCode.UNEXPECTED
    default_code = "unexpected"
