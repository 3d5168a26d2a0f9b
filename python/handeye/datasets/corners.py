"""The corners of one view as a CSV file: `id,u_px,v_px`, one point a line.

A fourth column, `sigma_px`, holds the standard deviation of each point where that is known.
"""

import re
from functools import lru_cache
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.datasets.reading import MIB, number, read_text
from handeye.errors import InputError
from handeye.types import View
from handeye.types.target.base import MAX_POINTS

HEADER = "id,u_px,v_px"
SIGMA = "sigma_px"
MAX_BYTES = 8 * MIB
_ID = re.compile(r"\d{1,9}", re.ASCII)


# A session writes its recording again with every view, and most of its views are those of before.
@lru_cache(maxsize=128)
def corners_text(view: View) -> str:
    """Return the text of the file; numbers read back to the last bit."""
    columns = [view.pixels] if view.sigmas_px is None else [view.pixels, view.sigmas_px[:, np.newaxis]]
    header = HEADER if view.sigmas_px is None else f"{HEADER},{SIGMA}"
    rows = zip(view.point_ids.tolist(), np.hstack(columns).tolist(), strict=True)
    return "\n".join([header, *(",".join([str(point), *map(repr, values)]) for point, values in rows)]) + "\n"


def read_corners(path: Path) -> tuple[list[int], list[list[float]], list[float] | None]:
    """Return point ids (N,), pixels (N, 2) and, where the file has them, standard deviations (N,) in px.

    Raises
    ------
    InputError
        Not such a file; the message names the line.
    """
    lines = read_text(path, MAX_BYTES).splitlines()
    header = lines[0].replace(" ", "") if lines else ""
    if header not in {HEADER, f"{HEADER},{SIGMA}"}:
        found = lines[0][:60] if lines else ""
        raise InputError(f"{path}: line 1: {found!r}, expected {HEADER}", code=Code.INVALID_FIELD)
    if len(lines) > MAX_POINTS + 1:
        raise InputError(f"{path}: more than {MAX_POINTS} points", code=Code.TOO_LARGE)
    names = header.split(",")
    ids: list[int] = []
    rows: list[list[float]] = []
    for index, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        where = f"{path}: line {index}"
        fields = line.split(",")
        if len(fields) != len(names):
            raise InputError(f"{where}: {len(fields)} values, expected {header}", code=Code.WRONG_SHAPE)
        if not _ID.fullmatch(fields[0].strip()):
            raise InputError(
                f"{where}: id {fields[0][:40]!r}, expected a whole number", code=Code.NOT_NUMBERS
            )
        ids.append(int(fields[0]))
        rows.append(
            [number(field, f"{where}: {name}") for field, name in zip(fields[1:], names[1:], strict=True)]
        )
    pixels = [row[:2] for row in rows]
    return ids, pixels, [row[2] for row in rows] if len(names) == 4 else None
