"""The one family of errors, each with its exit code for the command line.

A failure is never answered with a plausible value: it raises one of these, with a message that names what was
found and what was expected, a `code` that a script can compare, and a `hint` that says what to do.
"""

from enum import IntEnum
from typing import ClassVar

from handeye.codes import Code

__all__ = [
    "DegenerateError",
    "DetectionError",
    "DeviceError",
    "ExitCode",
    "HandeyeError",
    "InputError",
    "OutputError",
    "SolveError",
    "UnstatedError",
]


def printable(text: object, limit: int) -> str:
    """Return a text of others, shortened, without what cannot be shown or would steer a terminal."""
    try:
        shown = str(text)
    except Exception:  # noqa: BLE001 - whatever a driver's object does
        shown = "(cannot be shown)"
    cut = shown[:limit] + ("..." if len(shown) > limit else "")
    return "".join(c if c.isprintable() else " " if c.isspace() else "?" for c in cut)


class ExitCode(IntEnum):
    """Exit codes of the command line.

    Examples
    --------
    >>> int(ExitCode.DEGENERATE)
    4
    """

    SUCCESS = 0
    UNEXPECTED = 1
    USAGE = 2
    UNUSABLE_INPUT = 3
    DEGENERATE = 4
    DETECTION = 5
    SOLVE = 6
    OUTPUT = 7
    DEVICE = 8
    MOVED = 9
    INTERRUPTED = 130


class HandeyeError(Exception):
    """Base of all errors that `handeye` raises on purpose.

    Parameters
    ----------
    message
        What was found and what was expected, for a person.
    code
        A stable lower-case word for scripts, such as `not_rigid`: one of `handeye.codes.Code`, or a driver's
        own; by default the `default_code` of the class.
    hint
        What to do about it, or None.

    Examples
    --------
    >>> import handeye
    >>> try:
    ...     handeye.open_folder("no such folder")
    ... except handeye.HandeyeError as error:
    ...     print(error.code, int(error.exit_code))
    missing_file 3
    """

    exit_code: ClassVar[ExitCode] = ExitCode.SOLVE
    default_code: ClassVar[str] = Code.ERROR

    def __init__(self, message: str, *, code: str | None = None, hint: str | None = None) -> None:
        super().__init__(message)
        self.code: Code | str = self.default_code if code is None else code
        self.hint = hint

    @property
    def message(self) -> str:
        """What was found and what was expected."""
        return str(self.args[0])


class InputError(HandeyeError):
    """The input cannot be used: a wrong shape, a file that is not what it claims, a value out of range.

    Examples
    --------
    >>> InputError("3 rows: expected 4", code="wrong_shape").exit_code.name
    'UNUSABLE_INPUT'
    """

    exit_code = ExitCode.UNUSABLE_INPUT
    default_code = Code.INVALID_INPUT


class UnstatedError(InputError):
    """The files leave open what the robot's poses mean, or what is stated of them is not so.

    Attributes
    ----------
    options
        Options of the command line that say what the pictures agree with; empty where they do not tell.

    Examples
    --------
    >>> UnstatedError("whose poses?", hint="say --notation", options=("--notation", "ur")).options
    ('--notation', 'ur')
    """

    default_code = Code.NOTATION_UNSTATED

    def __init__(
        self, message: str, *, hint: str, options: tuple[str, ...] = (), code: str | None = None
    ) -> None:
        super().__init__(message, hint=hint, code=code)
        self.options = options


class DegenerateError(HandeyeError):
    """The views leave directions of the answer undetermined.

    Examples
    --------
    >>> print(DegenerateError("the views turn about one axis").code)
    degenerate
    """

    exit_code = ExitCode.DEGENERATE
    default_code = Code.DEGENERATE


class DetectionError(HandeyeError):
    """The target was not found in an image.

    Examples
    --------
    >>> DetectionError("no pattern", hint="describe the board").hint
    'describe the board'
    """

    exit_code = ExitCode.DETECTION
    default_code = Code.NOT_DETECTED


class SolveError(HandeyeError):
    """A numerical step failed or did not converge.

    Examples
    --------
    >>> SolveError("no minimum").message
    'no minimum'
    """

    exit_code = ExitCode.SOLVE
    default_code = Code.NOT_SOLVED


class OutputError(HandeyeError):
    """A result cannot be written.

    Examples
    --------
    >>> print(OutputError("the disk is full").code)
    not_written
    """

    exit_code = ExitCode.OUTPUT
    default_code = Code.NOT_WRITTEN


class DeviceError(HandeyeError):
    """A robot or a camera did not do what it was asked.

    Examples
    --------
    >>> int(DeviceError("no answer within 5 s", code="timeout").exit_code)
    8
    """

    exit_code = ExitCode.DEVICE
    default_code = Code.DEVICE_FAILED
