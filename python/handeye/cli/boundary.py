"""The one place where errors become words and exit codes, and answers become output."""

import contextlib
import difflib
import io
import os
import shlex
import sys
import traceback
from collections.abc import Sequence
from typing import Any

from cyclopts import CycloptsError

from handeye.cli import INTERRUPTED
from handeye.cli.answer import Answer, json_text
from handeye.cli.app import COMMANDS, make_app
from handeye.cli.failures import UnexpectedError, UsageError, WarnedError
from handeye.codes import advice
from handeye.errors import ExitCode, HandeyeError, InputError, OutputError, UnstatedError

REPORT = (
    "This is a mistake in handeye. Please report it with the command, what --debug prints, and the version."
)


def run(arguments: Sequence[str]) -> int:
    """Run a command and return its exit code; nothing is raised."""
    # Looked for by hand: they must hold even where the rest of the line cannot be understood.
    options = list(arguments)[: list(arguments).index("--")] if "--" in arguments else list(arguments)
    as_json, debug = "--json" in options, "--debug" in options
    _show_what_can_be_shown()
    try:
        arguments = _asked_for_help(arguments)
        if sys.stdout is None:  # pyright: ignore[reportUnnecessaryComparison] - closed by the caller
            raise OutputError("the standard output is closed", hint="give the command one")
        app = make_app(next(iter(arguments), ""))
        answer: Any = app(list(arguments), exit_on_error=False, print_error=False)
        if isinstance(answer, Answer):
            _give(answer, as_json=as_json)
        sys.stdout.flush()
        return answer.exit_code if isinstance(answer, Answer) else ExitCode.SUCCESS
    except CycloptsError as error:
        return _fail(_usage(error, options), as_json=as_json, debug=debug)
    except UnstatedError as error:
        return _fail(_with_command(error, options), as_json=as_json, debug=debug)
    except HandeyeError as error:
        return _fail(error, as_json=as_json, debug=debug)
    except WarnedError as warned:
        return _fail(warned.error, warned.warnings, as_json=as_json, debug=debug)
    except KeyboardInterrupt:
        _silence_stdout()
        _complain("interrupted")
        return INTERRUPTED
    except (BrokenPipeError, SystemExit):  # rich makes the second of the first
        _silence_stdout()  # the reader has seen enough
        return ExitCode.OUTPUT
    except OSError as error:
        if _is_about_stdout(error):
            _silence_stdout()
            _complain(f"error: the output cannot be written: {(error.strerror or str(error)).lower()}")
            return ExitCode.OUTPUT
        return _fail(_unexpected(error), as_json=as_json, debug=debug)
    except BaseException as error:  # noqa: BLE001 - the boundary; a panic of the core is no Exception
        return _fail(_unexpected(error), as_json=as_json, debug=debug)


def _show_what_can_be_shown() -> None:
    """Escape on output what its encoding lacks, such as names of files that are no UTF-8."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _asked_for_help(arguments: Sequence[str]) -> Sequence[str]:
    """Return what is meant by `help` and `help COMMAND`; other arguments as they are."""
    asked = next(iter(arguments), "") == "help"
    return [*arguments[1:2], "--help"] if asked else arguments


def _usage(error: CycloptsError, arguments: Sequence[str]) -> HandeyeError:
    named = next((argument for argument in arguments if not argument.startswith("-")), None)
    names = [name for name, _, _ in COMMANDS]
    if named not in names:
        # Said here: the library would load every command to say it.
        message = "the command is missing" if named is None else f"no command {named!r}"
        near = difflib.get_close_matches(named or "", names, 1)
        meant = f"did you mean {near[0]}? " if near else ""
        return UsageError(message, hint=f"{meant}There are {', '.join(names)}; handeye --help says more")
    chain = " ".join(["handeye", *(error.command_chain or ())])
    message = " ".join(str(error).split())
    return UsageError(message, hint=f"{chain} --help says what can be asked").with_traceback(
        error.__traceback__
    )


def _with_command(error: UnstatedError, arguments: Sequence[str]) -> HandeyeError:
    """Return the error with the command line to run, where the pictures tell what to state."""
    if not error.options:
        return error
    told = {option for option in error.options if option.startswith("--")}
    kept, skip = list[str](), False
    for argument in arguments:
        if not skip and argument.partition("=")[0] not in told:
            kept.append(argument)
        skip = argument in told
    command = shlex.join(["handeye", *kept, *error.options])
    hint = f"run: {command}" + (f"\n      {error.hint}" if error.hint else "")
    return InputError(error.message, code=error.code, hint=hint).with_traceback(error.__traceback__)


def _unexpected(error: BaseException) -> HandeyeError:
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return UnexpectedError(f"unexpected {text}", hint=REPORT).with_traceback(error.__traceback__)


def _give(answer: Answer, *, as_json: bool) -> None:
    _print(answer, as_json=as_json)
    sys.stdout.flush()
    if answer.after is not None:
        answer.after()


def _print(answer: Answer, *, as_json: bool) -> None:
    if as_json:
        sys.stdout.write(json_text(answer.data))
        return
    from rich.console import Console  # noqa: PLC0415 - a program reading JSON need not wait for it

    answer.show(Console(highlight=False, markup=False))


def _fail(error: HandeyeError, warnings: tuple[str, ...] = (), *, as_json: bool, debug: bool) -> int:
    hint = advice(error.code) if error.hint is None else error.hint
    if as_json and sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison]
        described = {
            "code": error.code,
            "message": error.message,
            "hint": hint,
            "exit_code": int(error.exit_code),
        }
        try:
            sys.stdout.write(json_text({"error": described, "warnings": warnings}))
            sys.stdout.flush()
        except OSError:
            _silence_stdout()
    if debug:
        _complain("".join(traceback.format_exception(error.__cause__ or error)).rstrip())
    for warning in warnings:
        _complain(f"warning: {warning}")
    _complain(f"error: {error.message}")
    if hint is not None:
        _complain(f"hint: {hint}")
    return int(error.exit_code)


def _complain(text: str) -> None:
    if sys.stderr is None:  # pyright: ignore[reportUnnecessaryComparison]
        return  # print would take it to stdout
    with contextlib.suppress(OSError, ValueError):
        print(text, file=sys.stderr, flush=True)


def _is_about_stdout(error: OSError) -> bool:
    """Tell whether the system refused to take what was printed: a full disk behind stdout, or none at all.

    Errors of files that a command reads or writes name the file, and are `HandeyeError` anyway.
    """
    return error.filename is None


def _silence_stdout() -> None:
    """Keep the interpreter from complaining again when it flushes stdout at its end."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
