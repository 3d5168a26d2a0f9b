"""Files that a command writes: refused before the work begins, written whole or not at all."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import json_text
from handeye.codes import Code
from handeye.datasets.writing import is_occupied, replace_file
from handeye.errors import OutputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def check_output(path: Path | None) -> None:
    """Refuse a place that cannot be written to, before the work rather than after it.

    Raises
    ------
    OutputError
        A folder, or a file whose folder does not exist.
    """
    if path is None:
        return
    if path.is_dir():
        raise OutputError(f"{path}: is a folder", hint="give the name of a file")
    if not path.parent.is_dir():
        raise OutputError(f"{path}: the folder {path.parent} does not exist", hint="create it first")


def check_picture(path: Path) -> None:
    """Refuse a picture that cannot be written, before the work rather than after it.

    Raises
    ------
    OutputError
        As `check_output`, or a format that is none of png, svg and pdf.
    """
    check_output(path)
    _picture_kind(path)


def _picture_kind(path: Path) -> str:
    kind = path.suffix.lower().removeprefix(".")
    if kind not in {"png", "svg", "pdf"}:
        raise OutputError(f"{path}: no picture format, expected .png, .svg or .pdf", code=Code.UNKNOWN_FORMAT)
    return kind


def check_new_folder(path: Path) -> None:
    """Refuse a folder that is there already or cannot be made, before the work rather than after it.

    Raises
    ------
    OutputError
        It exists and is not empty, or the folder it belongs in does not exist.
    """
    if is_occupied(path):
        raise OutputError(
            f"{path}: exists already and is not empty", code=Code.EXISTS, hint="choose another name"
        )
    if not path.parent.is_dir():
        raise OutputError(f"{path}: the folder {path.parent} does not exist", hint="create it first")


def check_folder(path: Path | None) -> None:
    """Make the folder that several files will be written into, before the work rather than after it.

    Raises
    ------
    OutputError
        It cannot be made.
    """
    if path is None:
        return
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be made a folder ({(error.strerror or str(error)).lower()})"
        ) from error


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write one JSON object.

    Raises
    ------
    OutputError
        The system refuses to write; an older file is as it was. Or what was written does not read back.
    """
    text = json_text(data)
    replace_file(path, text.encode())
    if path.is_file() and path.read_bytes() != text.encode():
        raise OutputError(f"{path}: does not read back as it was written", hint="check the disk")


def write_figure(path: Path, figure: "Figure") -> None:
    """Write a picture in the format of its suffix (png, svg, pdf).

    Raises
    ------
    OutputError
        An unknown format, or the system refuses to write; an older file is as it was.
    """
    from io import BytesIO  # noqa: PLC0415 - pictures are rare

    content = BytesIO()
    figure.savefig(content, format=_picture_kind(path))  # pyright: ignore[reportUnknownMemberType]
    replace_file(path, content.getvalue())
