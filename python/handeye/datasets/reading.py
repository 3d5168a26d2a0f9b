"""Reading files that a stranger wrote: bounded, inside their folder, and never a surprise to the caller.

Whatever is wrong becomes an `InputError` that names the file.
"""

import errno
import itertools
import os
import re
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from handeye.codes import Code
from handeye.errors import HandeyeError, InputError
from handeye.types.view import check_relative_path

MIB = 1 << 20
MAX_FOLDER_ENTRIES = 100_000
MAX_DIGITS = 400

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Opening a pipe must not wait for a writer, and text must come as it is.
_OPEN_FLAGS = (
    os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
)


@contextmanager
def located(where: str) -> Generator[None]:
    """Put the place in front of the message of every error of ours raised inside."""
    try:
        yield
    except HandeyeError as error:
        raise type(error)(f"{where}: {error.message}", code=error.code, hint=error.hint) from error


def existing_folder(path: str | os.PathLike[str]) -> Path:
    """Return the path of a folder that exists.

    Raises
    ------
    InputError
        No such folder, or not a folder.
    """
    try:
        folder = Path(path)
        if not folder.is_dir():
            found = "is not a folder" if folder.exists() else "no such folder"
            raise InputError(f"{folder}: {found}", code=Code.MISSING_FILE)
    except (OSError, ValueError) as error:
        raise InputError(f"{str(path)[:200]!r}: cannot be read ({error})", code=Code.UNREADABLE) from error
    return folder


def is_file(path: Path) -> bool:
    """Tell whether a file is there and can be looked at."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def file_names(folder: Path) -> list[str]:
    """Return the names of the files in a folder, without hidden ones, in the order people count: 2 before 10.

    Raises
    ------
    InputError
        The folder cannot be read or has too many entries.
    """
    names: list[str] = []
    try:
        with os.scandir(folder) as entries:
            for number, entry in enumerate(entries):
                if number >= MAX_FOLDER_ENTRIES:
                    raise InputError(f"{folder}: more than {MAX_FOLDER_ENTRIES} entries", code=Code.TOO_LARGE)
                if not entry.name.startswith(".") and entry.is_file():
                    names.append(entry.name)
    except OSError as error:
        raise InputError(f"{folder}: {reason(error)}", code=Code.UNREADABLE) from error
    return sorted(names, key=_counting_order)


def folder_names(folder: Path) -> list[str]:
    """Return the names of the folders in a folder, without hidden ones, in the order people count.

    Raises
    ------
    InputError
        The folder cannot be read.
    """
    try:
        with os.scandir(folder) as entries:
            listed = itertools.islice(entries, MAX_FOLDER_ENTRIES)
            names = [entry.name for entry in listed if not entry.name.startswith(".") and entry.is_dir()]
    except OSError as error:
        raise InputError(f"{folder}: {reason(error)}", code=Code.UNREADABLE) from error
    return sorted(names, key=_counting_order)


def inside(folder: Path, relative: str, what: str) -> Path:
    """Return the path of a file inside a folder.

    Raises
    ------
    InputError
        The path leaves the folder, by its text or through a symbolic link, or no such file.
    """
    check_relative_path(relative, what)
    try:
        root = folder.resolve(strict=True)
        path = (folder / relative).resolve(strict=True)
    except FileNotFoundError as error:
        raise InputError(
            f"{what}: {relative} is missing in {folder}", code=Code.MISSING_FILE, hint="put the file back"
        ) from error
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: links in a circle
        raise InputError(f"{what}: {relative} cannot be read ({error})", code=Code.UNREADABLE) from error
    if not path.is_relative_to(root):
        raise InputError(
            f"{what}: {relative} is a link out of {folder}",
            code=Code.PATH_OUTSIDE,
            hint="replace the link by the file itself",
        )
    return path


def read_bytes(path: Path, limit: int) -> bytes:
    """Return the content of a regular file of at most `limit` bytes.

    Raises
    ------
    InputError
        No such file, not a regular file, too large, or it cannot be read.
    """
    try:
        descriptor = os.open(path, _OPEN_FLAGS)
    except (OSError, ValueError) as error:
        code = Code.MISSING_FILE if isinstance(error, FileNotFoundError) else Code.UNREADABLE
        raise InputError(f"{path}: {reason(error)}", code=code) from error
    try:
        with os.fdopen(descriptor, "rb") as file:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode):
                raise InputError(f"{path}: not a regular file", code=Code.UNREADABLE)
            # Reading reserves as much memory as is asked for: the size of the file, and one byte more, as
            # it may grow while it is read.
            content = file.read(status.st_size + 1) if status.st_size <= limit else b""
            if len(content) > status.st_size:
                content += file.read(limit + 1 - len(content))
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}", code=Code.UNREADABLE) from error
    if status.st_size > limit or len(content) > limit:
        raise InputError(
            f"{path}: {status.st_size} bytes, expected at most {limit}",
            code=Code.TOO_LARGE,
            hint="wrong file?",
        )
    return content


def read_text(path: Path, limit: int) -> str:
    """Return the content of a UTF-8 text file of at most `limit` bytes.

    Raises
    ------
    InputError
        As `read_bytes`, or not UTF-8 text.
    """
    try:
        return read_bytes(path, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start})", code=Code.NOT_TEXT) from error


def number(text: str, where: str) -> float:
    """Return the number that a text spells.

    Raises
    ------
    InputError
        Not a number, NaN or infinite.
    """
    text = text.strip()
    value = float(text) if len(text) <= MAX_DIGITS and _NUMBER.fullmatch(text) else None
    if value is None or value in {float("inf"), float("-inf")}:
        raise InputError(
            f"{where}: {text[:40]!r}, expected a finite number",
            code=Code.NOT_FINITE
            if text.lower().strip("+-") in {"nan", "inf", "infinity"}
            else Code.NOT_NUMBERS,
            hint="remove the line or repair it",
        )
    return value


def reason(error: Exception) -> str:
    """Return what the system says, without number and path."""
    if isinstance(error, OSError) and error.strerror:
        return "no such file" if error.errno == errno.ENOENT else error.strerror.lower()
    return str(error)


def _counting_order(name: str) -> tuple[list[tuple[int, str]], str]:
    """Return a key that compares runs of digits as numbers, by length first."""
    parts = re.findall(r"\d+|\D+", name)
    key = [(len(p.lstrip("0")), p.lstrip("0")) if p.isdecimal() else (-1, p.lower()) for p in parts]
    return key, name
