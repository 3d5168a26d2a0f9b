"""The corners of one view as a CSV file: `id,u_px,v_px`, one point a line."""

import re
from functools import lru_cache
from pathlib import Path

from handeye.datasets.reading import MIB, number, read_text
from handeye.errors import InputError
from handeye.types import View
from handeye.types.target.base import MAX_POINTS

HEADER = "id,u_px,v_px"
MAX_BYTES = 8 * MIB
_ID = re.compile(r"\d{1,9}", re.ASCII)


# A session writes its recording again with every view, and most of its views are those of before.
@lru_cache(maxsize=128)
def corners_text(view: View) -> str:
    """Return the text of the file; numbers read back to the last bit."""
    rows = zip(view.point_ids.tolist(), view.pixels.tolist(), strict=True)
    return "\n".join([HEADER, *(f"{point},{u!r},{v!r}" for point, (u, v) in rows)]) + "\n"


def read_corners(path: Path) -> tuple[list[int], list[list[float]]]:
    """Return point ids (N,) and pixels (N, 2) of a file.

    Raises
    ------
    InputError
        Not such a file; the message names the line.
    """
    lines = read_text(path, MAX_BYTES).splitlines()
    if not lines or lines[0].replace(" ", "") != HEADER:
        found = lines[0][:60] if lines else ""
        raise InputError(f"{path}: line 1: {found!r}, expected {HEADER}", code="invalid_field")
    if len(lines) > MAX_POINTS + 1:
        raise InputError(f"{path}: more than {MAX_POINTS} points", code="too_large")
    ids: list[int] = []
    pixels: list[list[float]] = []
    for index, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        where = f"{path}: line {index}"
        fields = line.split(",")
        if len(fields) != 3:
            raise InputError(f"{where}: {len(fields)} values, expected {HEADER}", code="wrong_shape")
        if not _ID.fullmatch(fields[0].strip()):
            raise InputError(f"{where}: id {fields[0][:40]!r}, expected a whole number", code="not_numbers")
        ids.append(int(fields[0]))
        pixels.append([number(fields[1], f"{where}: u_px"), number(fields[2], f"{where}: v_px")])
    return ids, pixels
