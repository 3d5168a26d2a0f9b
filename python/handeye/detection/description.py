"""Which board a picture shows, where the one described is not there."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from handeye.detection import chessboard, tags
from handeye.detection.base import Detection, Image, NotFound, Reason, upright
from handeye.detection.blobs import find_spots
from handeye.detection.lattice import grow
from handeye.detection.marker_lattice import boards_like, lattices_of
from handeye.detection.marker_reading import Reading, is_plain, read_markers
from handeye.detection.markers import Seen
from handeye.detection.part import Part
from handeye.types import Charuco, Chessboard, CircleGrid, Target
from handeye.types.arrays import IndexArray
from handeye.types.target import Coded, MarkerCorners

_Board = TypeVar("_Board", bound=Target)
# Boards are looked for in a picture no larger than this; circles, of which noise makes many, in a
# smaller one.
SEARCH_SIDE_PX, CIRCLES_SIDE_PX = 1400, 600
# Fewer markers are chance where none are expected.
FEWEST_MARKERS = 4
# Share of the circles of a grid that must be there, the fewest that are a grid, and the most.
FILLED, FEWEST_CIRCLES, MOST_CIRCLES = 0.9, 9, 10_000
# An outermost line of a grid has at least so many of the circles that others have.
FULL_LINE = 0.5
# What lengths are taken from where no board is described.
UNKNOWN = Chessboard(7, 10, 0.02)
# What a picture says for itself, whatever the board.
_OF_THE_PICTURE = (Reason.UNDEREXPOSED, Reason.OVEREXPOSED, Reason.LOW_CONTRAST, Reason.BLURRED)


def explained(image: Image, target: Target, missing: NotFound) -> Detection | NotFound:
    """Return which other board a picture shows, else what was said before.

    The markers are read once more, by other means. If they are those of the target after all, its points are
    returned.

    Parameters
    ----------
    image
        The picture (H, W) in which the target was not found.
    target
        The target as described.
    missing
        Why it was not found.
    """
    if missing.reason in _OF_THE_PICTURE or missing.reason is Reason.REPEATED:
        return missing
    # Where there are markers of the board, it is another with such markers, or none.
    only_markers = isinstance(target, Coded) and missing.reason is not Reason.NO_PATTERN
    shown, markers = next(_visible(image, target, only_markers=only_markers), (None, None))
    if shown is None:
        return missing
    if shown != target:
        reason = Reason.WRONG_SIZE if _is_size_only(target, shown) else Reason.OTHER_BOARD
        named = shown.caption if type(shown) is type(target) else without_lengths(shown)
        evidence = f"the picture shows another board: {named}{_difference(target, shown)}"
        return NotFound(reason, evidence, shown, _advice(target, shown))
    if isinstance(target, MarkerCorners) and markers is not None:
        return tags.measured(*upright(image, target), Seen(markers.ids, markers.corners, markers.repeated))
    return missing


def shown_board(image: Image) -> Target | None:
    """Return the board that an image shows, of lengths that are not known; None if it shows none.

    Examples
    --------
    >>> print(shown_board(np.full((480, 640), 255, np.uint8)))
    None
    """
    # Small markers only show in the whole picture.
    for side_px in (SEARCH_SIDE_PX, max(image.shape)):
        for board, _ in _visible(image, UNKNOWN, fewest_markers=1, side_px=side_px):
            return board
        if max(image.shape) <= SEARCH_SIDE_PX:
            break
    return None


def _visible(
    image: Image,
    target: Target,
    fewest_markers: int = FEWEST_MARKERS,
    *,
    only_markers: bool = False,
    side_px: float = SEARCH_SIDE_PX,
) -> Iterator[tuple[Target, Reading | None]]:
    """Yield boards that an image shows, those of the family described first, and their markers."""
    part = Part.halved(image, side_px)
    small = part.picture
    # Markers first: what lies between them looks like squares, too.
    touched = isinstance(target, Coded) and target.border_bits == 2
    reading = read_markers(small, touched=touched)
    if reading is not None:
        reading = replace(reading, corners=part.places(reading.corners))
        fewest = 1 if isinstance(target, Coded) else fewest_markers
        yield from ((board, reading) for board in _marked(image, target, reading, fewest))
        if len(reading.ids) >= FEWEST_MARKERS:
            return
    if only_markers:
        return
    without_markers = (_chessboard, _circle_grid)
    for look in without_markers[::-1] if isinstance(target, CircleGrid) else without_markers:
        for board in look(small, target):
            yield board, None
    # One marker may belong to something else in the picture; it is what is shown where there is nothing else.
    if reading is not None and not isinstance(target, Coded) and is_plain(reading, image.shape[::-1]):
        yield from ((board, reading) for board in _marked(image, target, reading, 1))


def _marked(image: Image, target: Target, reading: Reading, fewest: int) -> Iterator[Target]:
    """Yield boards with so many markers at least that have those that were read."""
    height, width = image.shape
    for lattice in lattices_of(reading):
        if len(lattice.ids) >= fewest:
            yield from boards_like(target, lattice, (width, height))


def _chessboard(picture: Image, target: Target) -> Iterator[Chessboard]:
    """Yield the chessboard of whatever size, turned as it is described."""
    pitch = target.spacing_m
    for rows, columns in chessboard.sizes(picture):
        yield _nearest(target, [Chessboard(rows, columns, pitch), Chessboard(columns, rows, pitch)])


def _circle_grid(picture: Image, target: Target) -> Iterator[Target]:
    """Yield the grid of circles of whatever size, turned as it is described."""
    small = Part.whole(picture, CIRCLES_SIDE_PX / max(picture.shape)).picture
    for spots in find_spots(small):
        lattice = grow(spots, MOST_CIRCLES)
        if len(lattice) >= FEWEST_CIRCLES:
            grids = [*_symmetric(lattice.places, target), *_asymmetric(lattice.places, target)]
            if grids:
                # The dark squares of a chessboard lie like the circles of such a grid.
                if all(grid.asymmetric for grid in grids):
                    yield from (b for b in _chessboard(picture, target) if b.point_count > len(lattice))
                yield _nearest(target, grids)
                return


def _trimmed(places: IndexArray) -> IndexArray:
    """Return places (N, 2) without outermost lines that hardly anything is on: spots beside the grid."""
    for _ in range(2):
        for axis in (0, 1):
            values, counts = np.unique(places[:, axis], return_counts=True)
            full = values[counts >= FULL_LINE * np.median(counts)]
            places = places[(places[:, axis] >= full.min()) & (places[:, axis] <= full.max())]
    return places - places.min(axis=0)


def _symmetric(places: IndexArray, target: Target) -> list[CircleGrid]:
    places = _trimmed(places)
    columns, rows = (np.ptp(places, axis=0) + 1).tolist()
    if len(places) < FILLED * rows * columns:
        return []
    return [_circles(target, *shape, asymmetric=False) for shape in ((rows, columns), (columns, rows))]


def _asymmetric(places: IndexArray, target: Target) -> list[CircleGrid]:
    """Return asymmetric grids whose rows run diagonally over a lattice of places (N, 2)."""
    x = places[:, 0] - places[:, 1]
    y = places[:, 0] + places[:, 1]
    grids: list[CircleGrid] = []
    turned = _trimmed(np.column_stack([x, y]))
    for _ in range(4):
        width, rows = (turned.max(axis=0) + 1).tolist()
        columns = width // 2
        # Unshifted rows begin at the left, shifted ones end at the right.
        right = (turned[:, 0] % 2 == turned[:, 1] % 2).all() and width == 2 * columns
        if right and min(rows, columns) >= 2 and len(turned) >= FILLED * rows * columns:
            grids.append(_circles(target, rows, columns, asymmetric=True))
        turned = np.column_stack([turned[:, 1].max() - turned[:, 1], turned[:, 0]])
    return grids


def _circles(target: Target, rows: int, columns: int, *, asymmetric: bool) -> CircleGrid:
    marked: dict[str, Any] = {}
    if isinstance(target, CircleGrid):
        same = (rows, columns, asymmetric) == (target.rows, target.columns, target.asymmetric)
        marked = {"marked": target.marked, "marked_diameter_m": target.marked_diameter_m} if same else {}
        diameter = target.diameter_m
    else:
        diameter = target.spacing_m / 2
    diameter = min(diameter, 0.9 * target.spacing_m)
    return CircleGrid(rows, columns, target.spacing_m, diameter, asymmetric, **marked)


def _nearest(target: Target, boards: Sequence[_Board]) -> _Board:
    """Return the board whose rows and columns are most like those described."""

    def off(board: Target) -> tuple[bool, int]:
        sizes = [abs(getattr(board, side) - getattr(target, side, 0)) for side in ("rows", "columns")]
        alike = getattr(board, "asymmetric", False) == getattr(target, "asymmetric", False)
        return not alike, sum(sizes)

    return min(boards, key=off)


def _is_size_only(target: Target, shown: Target) -> bool:
    differing = {name for name in target.to_dict() | shown.to_dict() if name not in {"rows", "columns"}}
    return all(target.to_dict().get(name) == shown.to_dict().get(name) for name in differing)


def _difference(target: Target, shown: Target) -> str:
    """Return in words how a description went wrong, where that is plain."""
    if type(target) is not type(shown):
        return ""
    rows, columns = getattr(shown, "rows", 0), getattr(shown, "columns", 0)
    described = getattr(target, "rows", 0), getattr(target, "columns", 0)
    if (rows, columns) == described:
        return ""
    if (columns, rows) == described:
        return "; rows and columns were exchanged"
    if isinstance(shown, Chessboard) and (rows + 1, columns + 1) in {described, described[::-1]}:
        return "; squares were counted instead of inner corners"
    if isinstance(shown, Charuco) and (rows - 1, columns - 1) in {described, described[::-1]}:
        return "; inner corners were counted instead of squares"
    return ""


def without_lengths(board: Target) -> str:
    """Return a board in words, without what a picture does not tell.

    Examples
    --------
    >>> from handeye.types import Chessboard
    >>> without_lengths(Chessboard(6, 9, 0.025))
    'chessboard, rows 6, columns 9'
    """
    fields = board.to_dict()
    family = fields.pop("family")
    told = [f"{name} {_toml(value)}" for name, value in fields.items() if not name.endswith("_m")]
    return f"{family}, {', '.join(told)}"


def _advice(target: Target, shown: Target) -> str:
    """Return what to write instead: options of the command line, or lines of a target file."""
    if isinstance(shown, Chessboard):
        return f"for this board: --rows {shown.rows} --columns {shown.columns}"
    here, there = shown.to_dict(), target.to_dict()
    same_family = here["family"] == there["family"]
    lines = [
        f"{name} = {_toml(value)}"
        for name, value in {**here, **_usual(target, here)}.items()
        if not name.endswith("_m") and not (same_family and there.get(name) == value)
    ]
    lengths = "" if same_family else "; lengths as measured"
    return f"give --target a file with {', '.join(lines)}{lengths}"


def _usual(target: Target, here: dict[str, Any]) -> dict[str, Any]:
    """Return fields of a target that a file of the board shown would leave out, as they are there."""
    gone = set(target.to_dict()) - set(here)
    usual: dict[str, Any] = {"inverted": False, "first_id": 0, "border_bits": 1}
    if "ids" in gone and "first_id" not in here:
        gone.add("first_id")
    return {name: value for name, value in usual.items() if name in gone}


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else str(value)
