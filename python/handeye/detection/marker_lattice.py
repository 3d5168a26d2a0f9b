"""Markers on a lattice, and which boards have them so."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.detection.base import NotFound, Reason, affine
from handeye.detection.marker_reading import Reading
from handeye.detection.markers import NO_IDS, Seen
from handeye.detection.part import mapped
from handeye.errors import InputError
from handeye.types import AprilGrid, ArucoGrid, ArucoMarker, Charuco, Target
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.target import Coded, Numbered
from handeye.types.target.dictionaries import DICTIONARIES

# How far from a place of the lattice a marker may lie, in places, and how far away a neighbour may be.
TOLERANCE, REACH = 0.3, 2.2
# Share of the markers that a board must have where they are, and of its own that must be seen.
AGREEING, COMPLETE = 0.9, 0.6
# A board of other columns is looked for with so many more than are seen.
MORE_COLUMNS = 3
# Markers that show a chequered lattice, and places around one that should be in the picture, too.
FEWEST_OF_CHARUCO, ROOM = 3, 0.6
# Markers that speak against a board; one may have been misread.
FEWEST_AGAINST = 2
# What the mean axes of two markers span, at least, as a share of what the sides of one of them make.
LEAST_ALIKE = 1e-3


@dataclass(frozen=True, eq=False)
class MarkerLattice:
    """Markers of one board in whole steps, seen upright as OpenCV draws them.

    Attributes
    ----------
    reading
        The markers.
    places
        (M, 2) column and row of each, from 0.
    step
        Distance of neighbouring places, in sides of a marker.
    """

    reading: Reading
    places: IndexArray
    step: float

    @property
    def ids(self) -> IndexArray:
        """(M,) numbers of the markers."""
        return self.reading.ids

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns that are seen."""
        columns, rows = (self.places.max(axis=0) + 1).tolist()
        return rows, columns

    def singles(self) -> "Iterator[MarkerLattice]":
        """Yield each marker for itself."""
        for k in range(len(self.ids)):
            one = replace(self.reading, ids=self.ids[[k]], corners=self.reading.corners[[k]])
            yield MarkerLattice(one, np.zeros((1, 2), dtype=np.int64), self.step)


def lattices_of(reading: Reading, step: float | None = None) -> list[MarkerLattice]:
    """Return the markers that lie on one lattice each, the most of them first: several boards may be seen.

    The step is the distance of neighbouring places in sides of a marker; None for what the markers tell.
    """
    centres = reading.corners.mean(axis=1)
    right = (
        reading.corners[:, 1] - reading.corners[:, 0] + reading.corners[:, 2] - reading.corners[:, 3]
    ) / 2
    down = (reading.corners[:, 3] - reading.corners[:, 0] + reading.corners[:, 2] - reading.corners[:, 1]) / 2
    axes = np.stack([right, down], axis=1)  # pixels for a step of one side
    # From marker i to j in sides of a marker, as the mean of what both say.
    both = (axes[:, np.newaxis] + axes) / 2
    flat = (centres - centres[:, np.newaxis])[:, :, np.newaxis]
    # Markers that are turned against each other have no axes in common, and are not beside each other.
    alike = np.abs(np.linalg.det(both)) > LEAST_ALIKE * np.prod(np.linalg.norm(axes, axis=2), axis=1)
    both[~alike] = np.eye(2)
    steps = np.asarray(np.linalg.solve(both.swapaxes(2, 3), flat.swapaxes(2, 3)), dtype=np.float64)[..., 0]
    away = np.where(alike, np.abs(steps).max(axis=2), np.inf)
    np.fill_diagonal(away, np.inf)
    unit = step or (float(np.median(away.min(axis=1))) if len(centres) > 1 else 1.0)
    lattices: list[MarkerLattice] = []
    rest = set(range(len(centres)))
    while rest:
        part = _grown(min(rest), steps / unit, away / unit)
        rest -= part.keys()
        chosen, places = np.array(list(part)), np.array(list(part.values()))
        taken = replace(reading, ids=reading.ids[chosen], corners=reading.corners[chosen])
        lattices.append(MarkerLattice(taken, places - places.min(axis=0), unit))
    return sorted(lattices, key=lambda lattice: -len(lattice.ids))


def contradiction(board: Coded, seen: Seen) -> NotFound | None:
    """Return word of markers that lie on the grid of a board, but not as they would on it; else None.

    They may be on the board in another place, so that its rows have another length, or not on it at all, so
    that it is larger or begins elsewhere. Markers elsewhere in the picture are those of another board.
    """
    own = board.marker_ids
    if len(own) < 2 or len(seen.ids) < 2:
        return None
    reading = Reading(board.dictionary, board.border_bits, False, seen.ids, seen.corners, NO_IDS)
    lattices = lattices_of(reading, board.spacing_m / _marker_m(board))
    lattice = max(lattices, key=lambda lattice: np.isin(lattice.ids, own).sum())
    others = int((~np.isin(lattice.ids, own)).sum())
    if others >= FEWEST_AGAINST:
        return NotFound(
            Reason.INCONSISTENT, f"{others} markers beside those of the board described continue its grid"
        )
    offsets = _offsets(board, lattice)
    off = (
        0 if not len(offsets) else len(offsets) - int(np.unique(offsets, axis=0, return_counts=True)[1].max())
    )
    if off >= FEWEST_AGAINST:
        return NotFound(
            Reason.INCONSISTENT, f"{off} of {len(offsets)} markers lie elsewhere than on the board described"
        )
    return None


def _offsets(board: Coded, lattice: MarkerLattice) -> IndexArray:
    """Return how far (K, 2) the markers that a board has are from where they are seen, in places."""
    index = {number: m for m, number in enumerate(board.marker_ids.tolist())}
    seen = [k for k, number in enumerate(lattice.ids.tolist()) if number in index]
    which = np.array([index[int(lattice.ids[k])] for k in seen], dtype=np.int64)
    return _places(board)[which] - lattice.places[seen]


def _grown(first: int, steps: FloatArray, away: FloatArray) -> dict[int, IndexArray]:
    """Return the place (2,) of each marker that is reached from the first, by neighbours."""
    found = {first: np.zeros(2, dtype=np.int64)}
    waiting = [first]
    while waiting:
        here = waiting.pop(0)
        for other in np.flatnonzero(away[here] < REACH).tolist():
            whole = np.rint(steps[here, other])
            if other not in found and whole.any() and np.abs(steps[here, other] - whole).max() < TOLERANCE:
                found[other] = found[here] + whole.astype(np.int64)
                waiting.append(other)
    return found


def boards_like(described: Target, lattice: MarkerLattice, image_size: tuple[int, int]) -> Iterator[Coded]:
    """Yield boards that have the markers of a lattice, those most like the one described first."""
    proposed = _proposed(described, lattice)
    if len(lattice.ids) == 2 and not _would_show_more(lattice, image_size):
        # At the picture's edge nothing tells whether two markers are a board, unless it is much as described.
        if isinstance(described, ArucoMarker):
            for single in lattice.singles():
                yield from boards_like(described, single, image_size)
            return
        proposed = _changed(described, lattice.reading) if isinstance(described, Coded) else ()
    for board in proposed:
        if board is not None and _has(board, lattice, image_size):
            yield board


def _has(board: Coded, lattice: MarkerLattice, image_size: tuple[int, int]) -> bool:
    """Tell whether a board has the markers where they are seen, and none that should be seen and are not.

    Parameters
    ----------
    image_size
        Width and height in pixels.
    """
    own = _places(board)
    offsets = _offsets(board, lattice)
    if len(offsets) < AGREEING * len(lattice.ids):
        return False
    values, counts = np.unique(offsets, axis=0, return_counts=True)
    if counts.max() < AGREEING * len(lattice.ids):
        return False
    places = own - values[np.argmax(counts)]
    within = ((places >= 0) & (places <= lattice.places.max(axis=0))).all(axis=1)
    if counts.max() < COMPLETE * within.sum():
        return False
    # A line of which nothing is seen though it should be in the picture is not there.
    return bool(within.all()) or not _in_picture(places[~within], lattice, image_size).any()


def _would_show_more(lattice: MarkerLattice, image_size: tuple[int, int]) -> bool:
    """Tell whether all places around those of a lattice are in the picture, as its markers have them."""
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / (2 * lattice.step)
    flat = (lattice.places[:, np.newaxis] + corner).reshape(-1, 2)
    low, high = -1 - ROOM, lattice.places.max(axis=0) + 1 + ROOM
    A, b = affine(flat, lattice.reading.corners.reshape(-1, 2))
    around = np.array([[low, low], [high[0], low], high, [low, high[1]]]) @ A + b
    return bool(((around >= 0) & (around <= image_size)).all())


def _in_picture(places: IndexArray, lattice: MarkerLattice, image_size: tuple[int, int]) -> NDArray[np.bool_]:
    """Tell which places (N, 2) of the lattice, and all around them, are in the picture."""
    if min(lattice.shape) < 2 or len(lattice.places) < 4:
        return np.zeros(len(places), dtype=np.bool_)
    centres = lattice.reading.corners.mean(axis=1)
    found, _ = cv2.findHomography(lattice.places.astype(np.float64), centres, cv2.LMEDS)
    homography = np.asarray(found, dtype=np.float64)
    if homography.shape != (3, 3):
        # None found: markers nearly on one line say nothing of what lies beside it.
        return np.zeros(len(places), dtype=np.bool_)
    around = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * ROOM
    where = mapped(homography, (places[:, np.newaxis] + around).astype(np.float64))
    return np.asarray(((where >= 0) & (where <= image_size)).all(axis=(1, 2)), dtype=np.bool_)


def _places(board: Coded) -> IndexArray:
    """Return column and row (M, 2) of the markers of a board, seen upright as OpenCV draws them."""
    outlines = board.outlines
    right, down = outlines[0, 1] - outlines[0, 0], outlines[0, 3] - outlines[0, 0]
    flat = outlines.mean(axis=1) @ (np.stack([right, down]) / np.linalg.norm(right)).T / board.spacing_m
    return np.rint(flat - flat.min(axis=0)).astype(np.int64)


def _proposed(described: Target, lattice: MarkerLattice) -> Iterator[Coded | None]:
    """Yield boards that might have the markers of a lattice."""
    if isinstance(described, Coded):
        yield from _changed(described, lattice.reading)
    if len(lattice.ids) == 1:
        yield _made(ArucoMarker, lattice, marker_m=_marker_m(described), id=int(lattice.ids[0]))
        return
    yield from _charucos(described, lattice)
    # The family described first.
    for family in sorted((AprilGrid, ArucoGrid), key=lambda family: not isinstance(described, family)):
        for columns in range(lattice.shape[1], lattice.shape[1] + MORE_COLUMNS):
            yield from _numbered(_grid(family, described, lattice, columns), described, lattice)
    for family in sorted((AprilGrid, ArucoGrid), key=lambda family: not isinstance(described, family)):
        yield _listed(_grid(family, described, lattice, lattice.shape[1]), lattice)


def _changed(described: Coded, reading: Reading) -> Iterator[Coded | None]:
    """Yield the board described with other markers, rows and columns exchanged, and the other layout."""
    name = _dictionary(reading, described.dictionary)
    same = _replaced(described, dictionary=name, border_bits=reading.border_bits, inverted=reading.inverted)
    if same is None:
        return
    yield same
    if isinstance(same, Charuco | AprilGrid | ArucoGrid):
        swapped = _replaced(same, rows=same.columns, columns=same.rows)
        for board in (same, swapped):
            if isinstance(board, Charuco):
                yield _replaced(board, legacy_pattern=not board.legacy_pattern)
            yield board


def _charucos(described: Target, lattice: MarkerLattice) -> Iterator[Coded | None]:
    """Yield ChArUco boards: markers are in every second place."""
    odd = lattice.places.sum(axis=1) % 2
    if len(lattice.ids) < FEWEST_OF_CHARUCO or min(odd.mean(), 1 - odd.mean()) > 0:
        return
    light_first = not odd.any()
    rows, columns = lattice.shape
    side = _marker_m(described)
    for more in range(MORE_COLUMNS):
        board = _made(
            Charuco,
            lattice,
            described,
            rows=rows + (light_first and rows % 2),
            columns=columns + more,
            square_m=described.square_m if isinstance(described, Charuco) else round(side * lattice.step, 4),
            marker_m=side,
            legacy_pattern=light_first,
        )
        yield from _numbered(board, described, lattice)


def _grid(
    family: type[AprilGrid | ArucoGrid], described: Target, lattice: MarkerLattice, columns: int
) -> Coded | None:
    """Return a grid with as many rows as are seen; its lengths are those described where they can be."""
    rows, side = lattice.shape[0], _marker_m(described)
    gap = round(lattice.step - 1, 2)
    if isinstance(described, AprilGrid | ArucoGrid):
        gap = described.gap_m / side
    lengths = (
        {"tag_m": side, "spacing_ratio": gap}
        if family is AprilGrid
        else {"marker_m": side, "separation_m": round(gap * side, 9)}
    )
    return _made(family, lattice, described, rows=rows, columns=columns, **lengths)


def _numbered(board: Coded | None, described: Target, lattice: MarkerLattice) -> Iterator[Coded | None]:
    """Yield a board with the numbers described, the usual ones, and those if it begins here."""
    if board is None:
        return
    first = {described.first_id} if isinstance(described, Numbered) else set[int]()
    serial = {tuple(place): m for m, place in enumerate(_places(board).tolist())}
    begins = serial.get(tuple(lattice.places[0].tolist()))
    if begins is not None:
        first.add(int(lattice.ids[0]) - begins)
    for number in sorted({0, *first}):
        yield _replaced(board, first_id=number)


def _listed(board: Coded | None, lattice: MarkerLattice) -> Coded | None:
    """Return a grid with the numbers that are seen, if all are."""
    if board is None:
        return None
    rows, columns = lattice.shape
    seen = np.full((rows, columns), -1)
    seen[lattice.places[:, 1], lattice.places[:, 0]] = lattice.ids
    column, row = _places(board).T
    ids = seen[row, column].tolist()
    return _replaced(board, ids=tuple(ids), first_id=0) if min(ids) >= 0 else None


def _marker_m(described: Target) -> float:
    """Return the side of a marker in metres, or a length that may stand for it."""
    if isinstance(described, Coded):
        return float(np.linalg.norm(described.outlines[0, 1] - described.outlines[0, 0]))
    return described.spacing_m


def _dictionary(reading: Reading, described: str | None) -> str:
    """Return the dictionary described if it is of that kind, else the smallest that has all markers."""
    kind = reading.dictionary.rsplit("_", 1)[0] + "_"
    alike = [name for name in DICTIONARIES if name.startswith(kind)] if "X" in kind else [reading.dictionary]
    fitting = [name for name in alike if DICTIONARIES[name] > reading.ids.max()]
    return described if described in fitting else fitting[0]


def _made(
    family: type[Coded],
    lattice: MarkerLattice,
    described: Target | None = None,
    **fields: Any,  # noqa: ANN401 - fields of any family
) -> Coded | None:
    """Return a board with the markers of a lattice; None where that is none."""
    reading = lattice.reading
    name = _dictionary(reading, described.dictionary if isinstance(described, Coded) else None)
    fields |= {"dictionary": name, "border_bits": reading.border_bits, "inverted": reading.inverted}
    try:
        return family(**fields)
    except InputError:
        return None


def _replaced(board: Coded, **fields: Any) -> Coded | None:  # noqa: ANN401 - fields of any family
    """Return a board with other measures; None where that is none."""
    try:
        return board.changed(**fields)
    except InputError:
        return None
