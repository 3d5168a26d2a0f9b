"""`handeye detect`: what is seen in each picture, and why the target is not found in some."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.source import Board
from handeye.codes import Code
from handeye.datasets import ImageSet, LoadedRecording, UnreadPoses, load
from handeye.datasets.image_header import IMAGE_SUFFIXES
from handeye.datasets.images import read_image
from handeye.datasets.reading import existing_folder, file_names
from handeye.datasets.writing import replace_file
from handeye.detection import (
    Detection,
    Image,
    NotFound,
    Reason,
    detect,
    detect_all,
    drawn_over,
    shown_board,
    without_lengths,
)
from handeye.detection.batch import processors
from handeye.errors import DetectionError, HandeyeError, InputError
from handeye.types import Chessboard, Target
from handeye.types.arrays import FloatArray

if TYPE_CHECKING:
    from rich.console import Console

# Lengths do not matter here.
ANY_PITCH_M = 0.02


@dataclass(frozen=True, eq=False)
class _Seen:
    """What became of one picture."""

    path: Path
    target: Target | None
    outcome: Detection | HandeyeError

    @property
    def why(self) -> str:
        """What there is to say about it."""
        if isinstance(self.outcome, Detection):
            return self.outcome.note
        return self.outcome.message.removeprefix(f"{self.path.name}: ")


def detect_in(
    path: Path,
    /,
    *,
    show: Path | None = None,
    board: Board = Board(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Say what is seen in each picture: how many points of the target, or why it is not found.

    Where another board than the one described is seen, it is named, with the option that describes it. Where
    none is described, neither by an option nor by the files, each picture is searched for any board.

    Parameters
    ----------
    path
        A picture, or a folder with pictures; a recording or a folder with poses says its target too.
    show
        Folder for the pictures with what was found drawn over them: points, their ids, and the axes of the
        target, x red and y green.
    """
    check_folder(show)
    pictures = _pictures(path)
    target = _target(path, board)
    seen = _searched(pictures) if target is None else _looked_for(pictures, target)
    drawings = {} if show is None else {one.path: _draw(one, show) for one in seen}
    data = _data(target, seen, drawings)
    return Answer(data, lambda console: _show(console, target, seen, show))


def _pictures(path: Path) -> list[Path]:
    """Return the pictures that are meant by a path, those of a recording in its folder `images`.

    Raises
    ------
    InputError
        There are none.
    """
    if path.is_file() and path.suffix.lower() in IMAGE_SUFFIXES:
        return [path]
    folder = existing_folder(path)
    for place in (folder, folder / "images"):
        names = file_names(place) if place.is_dir() else []
        pictures = [place / name for name in names if Path(name).suffix.lower() in IMAGE_SUFFIXES]
        if pictures:
            return pictures
    raise InputError(
        f"{folder}: no picture, expected files such as {', '.join(sorted(IMAGE_SUFFIXES))}",
        code=Code.NO_IMAGES,
    )


def _target(path: Path, board: Board) -> Target | None:
    """Return the target as described by options, or else by the files; None if by neither.

    Raises
    ------
    UsageError, InputError
        Options that cannot be understood.
    """
    described, pattern = board.described()
    if described is not None:
        return described
    try:
        loaded = load(path if path.is_dir() else path.parent, pattern=pattern)
    except HandeyeError:
        return None if pattern is None else Chessboard(*pattern, ANY_PITCH_M)
    if isinstance(loaded, LoadedRecording):
        return loaded.recording.target
    if isinstance(loaded, UnreadPoses):
        return loaded.images.target
    return loaded.target if isinstance(loaded, ImageSet) else None


def _looked_for(pictures: list[Path], target: Target) -> list[_Seen]:
    with progress("Looking for the target in the pictures") as advance:
        outcomes: dict[str, Detection | HandeyeError] = {}

        def note(name: str, outcome: Detection | HandeyeError) -> None:
            outcomes[name] = outcome
            advance(len(outcomes), len(pictures))

        advance(0, len(pictures))
        detect_all([(path.name, partial(read_image, path)) for path in pictures], target, progress=note)
    return [_Seen(path, target, outcomes[path.name]) for path in pictures]


def _searched(pictures: list[Path]) -> list[_Seen]:
    """Return which board is in each picture, looked at side by side."""
    seen: list[_Seen] = []
    pool = ThreadPoolExecutor(processors(), thread_name_prefix="detect")
    with progress("Looking for any board in the pictures") as advance:
        try:
            for one in pool.map(_any_board, pictures):
                seen.append(one)
                advance(len(seen), len(pictures))
        finally:
            pool.shutdown(cancel_futures=True)
    return seen


def _any_board(path: Path) -> _Seen:
    try:
        image = read_image(path)
    except InputError as error:
        return _Seen(path, None, error)
    target = shown_board(image)
    if target is None:
        missing = NotFound(Reason.NO_PATTERN, "no board that is known here")
        return _Seen(path, None, missing.error(path.name))
    outcome = detect(image, target)
    return _Seen(path, target, outcome if isinstance(outcome, Detection) else outcome.error(path.name))


def _draw(seen: _Seen, folder: Path) -> Path:
    """Write the picture with what was found in it, and return where.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    import cv2  # noqa: PLC0415 - only where something is drawn

    try:
        image: Image = read_image(seen.path)
    except InputError:
        image = np.full((240, 320), 128, dtype=np.uint8)
    outcome = seen.outcome
    shown = outcome if isinstance(outcome, Detection) else NotFound(Reason.NO_PATTERN, seen.why)
    drawing = folder / f"{seen.path.name}.png"
    replace_file(drawing, cv2.imencode(".png", drawn_over(image, seen.target, shown))[1].tobytes())
    return drawing


def _data(target: Target | None, seen: list[_Seen], drawings: Mapping[Path, Path]) -> dict[str, Any]:
    return {
        "target": None if target is None else target.to_dict(),
        "total": len(seen),
        "found": sum(isinstance(one.outcome, Detection) for one in seen),
        "images": [_image_data(one, drawings.get(one.path)) for one in seen],
    }


def _image_data(seen: _Seen, drawing: Path | None) -> dict[str, Any]:
    found = seen.outcome if isinstance(seen.outcome, Detection) else None
    error = seen.outcome if isinstance(seen.outcome, HandeyeError) else None
    return {
        "name": seen.path.name,
        "board": None if seen.target is None else seen.target.to_dict(),
        "points": 0 if found is None else len(found),
        "point_ids": [] if found is None else found.point_ids.tolist(),
        "pixels": [] if found is None else found.pixels.tolist(),
        "code": None if error is None else error.code,
        "note": seen.why or None,
        "hint": None if error is None else error.hint,
        "drawing": None if drawing is None else str(drawing),
    }


def _show(console: "Console", target: Target | None, seen: list[_Seen], show: Path | None) -> None:
    from rich.table import Table  # noqa: PLC0415 - a program reading JSON need not wait for it
    from rich.text import Text  # noqa: PLC0415

    from handeye.cli.wording import heading, notices  # noqa: PLC0415 - as in all commands

    number = sum(isinstance(one.outcome, Detection) for one in seen)
    named = "Any board" if target is None else target.caption
    heading(console, named, f"found in {number} of {len(seen)} pictures")
    table = Table("picture", "points", "size px", "what is seen", box=None, pad_edge=False)
    for one in seen:
        found = one.outcome if isinstance(one.outcome, Detection) else None
        points = "-" if found is None or one.target is None else f"{len(found)} of {one.target.point_count}"
        size = "-" if found is None else _size(found.pixels)
        board = without_lengths(one.target) if target is None and one.target is not None else "found"
        table.add_row(Text(one.path.name), points, size, Text(one.why or board))
    console.print(table)
    errors = [one.outcome for one in seen if isinstance(one.outcome, DetectionError)]
    notices(console, "What to do", dict.fromkeys(error.hint for error in errors if error.hint))
    if show is not None:
        console.print(f"drawn: {show}", markup=False, soft_wrap=True)


def _size(pixels: FloatArray) -> str:
    width, height = np.ptp(pixels, axis=0)
    return f"{width:.0f} x {height:.0f}"
