"""Writing so that a reader finds either all or nothing, whatever happens in between.

A new folder is filled beside its place under another name and then renamed; a file is replaced the same way.
Every file is on the disk before it gets its name. Whatever the system refuses becomes an `OutputError`.
"""

import errno
import os
import re
import secrets
import shutil
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from handeye.codes import Code
from handeye.datasets.reading import reason
from handeye.errors import OutputError

_COPY_CHUNK = 1 << 20
_PARTIAL = re.compile(r"\..{1,100}\.[0-9a-f]{12}\.partial", re.DOTALL)


@contextmanager
def new_folder(folder: Path) -> Generator[Path]:
    """Give a hidden folder to fill; on leaving it becomes `folder`, on an error it is removed.

    Raises
    ------
    OutputError
        `folder` exists and is not empty, its parent does not exist, or the system refuses to write.
    """
    with _system_errors_at(folder):
        if not folder.parent.is_dir():
            raise OutputError(f"{folder}: the folder {folder.parent} does not exist", hint="create it first")
        if is_occupied(folder):
            raise OutputError(
                f"{folder}: exists already and is not empty", code=Code.EXISTS, hint="choose another name"
            )
        partial = _beside(folder)
        partial.mkdir()
        try:
            yield partial
            _sync_tree(partial)
            if folder.is_dir():
                folder.rmdir()  # empty, as checked above; a rename onto it is not possible on every system
            partial.rename(folder)
        except BaseException:
            shutil.rmtree(partial, ignore_errors=True)
            raise
        _hasten(folder.parent)


def is_occupied(folder: Path) -> bool:
    """Tell whether a path is taken: a file, a link to nowhere, or a folder with something in it."""
    if folder.is_dir():
        with os.scandir(folder) as entries:
            return next(entries, None) is not None
    return folder.exists() or folder.is_symlink()


def replace_file(path: Path, content: bytes) -> None:
    """Write a file under another name, bring it to the disk, and give it its name.

    Raises
    ------
    OutputError
        The system refuses to write; the old file is as it was.
    """
    with _system_errors_at(path):
        partial = _beside(path)
        try:
            _write(partial, content)
            partial.replace(path)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
        _hasten(path.parent)


def write_file(path: Path, content: bytes) -> None:
    """Write a new file and bring it to the disk.

    Raises
    ------
    OutputError
        The file exists or the system refuses to write; nothing is left behind.
    """
    with _system_errors_at(path):
        try:
            _write(path, content)
        except FileExistsError:
            raise
        except BaseException:
            path.unlink(missing_ok=True)
            raise


def copy_file(source: Path, path: Path) -> None:
    """Copy a regular file to a new one and bring it to the disk.

    Raises
    ------
    OutputError
        The source cannot be read, the file exists, or the system refuses to write; nothing is left behind.
    """
    with _system_errors_at(path):
        if not source.is_file():
            raise OutputError(f"{source}: not a regular file")
        with source.open("rb") as reader, path.open("xb") as writer:
            try:
                shutil.copyfileobj(reader, writer, _COPY_CHUNK)
                writer.flush()
                os.fsync(writer.fileno())
            except BaseException:
                path.unlink(missing_ok=True)
                raise


def remove_partials(folder: Path) -> None:
    """Remove files that were not written to their end, as a process that is gone left them."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if _PARTIAL.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                Path(entry.path).unlink(missing_ok=True)


def _write(path: Path, content: bytes) -> None:
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _beside(path: Path) -> Path:
    """Return a hidden name in the same folder that nobody else uses."""
    return path.with_name(f".{path.name[:100]}.{secrets.token_hex(6)}.partial")


def _sync_tree(folder: Path) -> None:
    for root, _, _ in os.walk(folder):
        _sync_folder(Path(root))


def _sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where the system can."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in {errno.EINVAL, errno.ENOTSUP}:  # some file systems know no such thing
            raise
    finally:
        os.close(descriptor)


def _hasten(folder: Path) -> None:
    """Bring a new name to the disk soon; whole it is already, so a refusal is no failure."""
    with suppress(OSError):
        _sync_folder(folder)


@contextmanager
def _system_errors_at(path: Path) -> Generator[None]:
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        raise OutputError(
            f"{path}: cannot be written: {reason(error)}",
            hint="check the free space and the permissions; nothing was changed",
        ) from error
