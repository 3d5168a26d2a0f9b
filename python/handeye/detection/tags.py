"""Corners of markers: of a grid of AprilTags or ArUco markers, or of a single one."""

from functools import lru_cache

import cv2
import numpy as np

from handeye import _core
from handeye.detection.base import Detection, Image, NotFound, Reason, inside
from handeye.detection.code_corners import code_corners
from handeye.detection.corner_fit import (
    ASTRAY_PX,
    BAND_SHARE,
    FEW,
    WIDE_PX,
    CornerFits,
    CornerKind,
    astray,
    clear_bands,
    corner_fits,
    curvatures,
    nearer,
    spread,
)
from handeye.detection.diagnosis import diagnose
from handeye.detection.edge_shift import FEWEST, Corners, sharpened, without_edge_shift
from handeye.detection.marker_lattice import contradiction
from handeye.detection.marker_sides import side_meetings
from handeye.detection.markers import (
    LEAST_SHARE,
    NO_IDS,
    Bits,
    Seen,
    disagreement,
    find_markers,
    from_neighbours,
)
from handeye.detection.quality import stated
from handeye.detection.registration import Aligned, drawn
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.target import MarkerCorners
from handeye.types.target.artwork import Squares
from handeye.types.target.dictionaries import marker_bits

# How far the window of a corner stays from the next edge, which is blurred, too: so many pixels, but at least
# and at most these shares of the space between markers. Along the sides it takes a share of those, unless
# squares touch the corners: edges that moved do so on both sides then, and a window as wide on both leaves
# the corner where it is.
AWAY_PX, LEAST_AWAY, MOST_AWAY = 4.5, 0.2, 0.4
ALONG_SHARE = 0.5
# Tags read where they are expected.
FEWEST_TAGS = 2
# So many markers do not tell which of their corners is none, but their sides do; fitted corners are no
# further from where sides meet than this many of the latter's deviations.
FEW_MARKERS, MEETING_SIGMAS = 3, 3.0
# Where edges meet at a sharp angle, corners go further than edges: of few markers they are not known to this.
LARGEST_OPEN_PX = 0.5
# Numbers of the map from a board to a picture, and the least deviation of the directions that it tells.
OF_MAP, LEAST_TURN = 22, 1e-3
# Cells of the code along a side that show at its corner where they are blurred.
CELLS_BESIDE = 4
# Tried until all tags are found, the last only if some are; one leaves the ink as it is.
THINNING_PX = (3, 1, 5)


@lru_cache(maxsize=16)
def _bits(target: MarkerCorners) -> Bits:
    return Bits.of(target)


@lru_cache(maxsize=16)
def _lights(target: MarkerCorners) -> FloatArray:
    """Return how light (P, 2) the bits are beside both sides of a marker that begin at each corner."""
    along = _sides(target, np.arange(target.point_count // 4))
    cell = _side(target) / (marker_bits(target.dictionary) + 2 * target.border_bits)
    steps = cell * (np.arange(CELLS_BESIDE) + 0.5)[:, np.newaxis]
    inwards = cell * (target.border_bits + 0.5) * along[:, ::-1, np.newaxis]
    places = target.points[:, np.newaxis, np.newaxis, :2] + along[:, :, np.newaxis] * steps + inwards
    return drawn(target, places).mean(axis=-1)


def find(image: Image, target: MarkerCorners) -> Detection | NotFound:
    """Find the corners of the markers that are visible."""
    return measured(image, target, _markers(image, target))


def measured(image: Image, target: MarkerCorners, markers: Seen) -> Detection | NotFound:
    """Return the corners of those of some markers that are on the board."""
    found = markers.of_board(target)
    if isinstance(found, NotFound):
        return found
    tags, seen = found
    if not len(tags):
        return diagnose(image, NotFound(Reason.NO_PATTERN, f"no marker of the board, of {target.dictionary}"))
    seen = seen[:, target.corner_order]
    points = tags[:, np.newaxis] * 4 + np.arange(4)
    against = disagreement(target.points[points, :2], seen) or contradiction(target, markers)
    if against is not None:
        return against
    plane = target.points[points.ravel(), :2]
    # The outline of a tag may run astray where a square touches it; the tags around know better.
    expected = from_neighbours(plane, seen.reshape(-1, 2))
    astray = np.linalg.norm(expected - seen.reshape(-1, 2), axis=1) > ASTRAY_PX
    seen = np.where(astray[:, np.newaxis], expected, seen.reshape(-1, 2)).reshape(-1, 4, 2)
    side = _side(target)
    near = _measured(image, target, tags, seen, None, rough=True)
    blur = near.usual_blur_px
    is_few = len(tags) <= FEW_MARKERS
    rough = _by_sides(image, target, seen, near)[0] if is_few else near.places
    good = np.flatnonzero(np.isfinite(rough[:, 0]))
    lens = _core.PlaneMap.fitted(plane[good], rough[good]) if len(good) >= 4 else None
    if lens is None:
        return NotFound(Reason.INCOMPLETE, f"{len(tags)} tags, but their corners are cut or unclear")
    # Once more: all corners together tell the directions of edges better than a tag does.
    again = np.where(np.isfinite(rough), rough, seen.reshape(-1, 2)).reshape(-1, 4, 2)
    steps = lens.steps(plane, 0.1 * side)
    fits = _measured(image, target, tags, again, steps, lens, blur)
    places, sigmas = fits.places, fits.sigmas_px
    if is_few:
        places, sigmas = _by_sides(image, target, again, fits)
        good = np.flatnonzero(np.isfinite(rough[:, 0]) & np.isfinite(places[:, 0]))
    else:
        good = np.flatnonzero(np.isfinite(rough[:, 0]) & ~fits.spoilt())
    expected = from_neighbours(plane[good], places[good])
    good = good[np.linalg.norm(expected - places[good], axis=1) <= ASTRAY_PX]
    if len(good) < 4:
        return NotFound(Reason.INCOMPLETE, f"{len(tags)} tags, but their corners are cut or unclear")
    return _stated(image, target, tags, good, places, steps, sigmas, blur) or NotFound(
        Reason.INCOMPLETE, f"{len(tags)} tags, but seen so obliquely that their corners are unclear"
    )


def confirm(image: Image, target: MarkerCorners, board: Aligned) -> Detection | None:
    """Return the corners of a grid that was found where it was expected; None unless it is that one."""
    plane, side = target.points[:, :2], _side(target)
    places = board.places(plane.reshape(-1, 4, 2))
    expected = inside(image, places.reshape(-1, 2)).reshape(-1, 4).all(axis=1)
    read = expected & _bits(target).readable(board)
    if read.sum() < max(min(FEWEST_TAGS, len(places)), LEAST_SHARE * expected.sum()):
        return None
    ids = (4 * np.flatnonzero(read)[:, np.newaxis] + np.arange(4)).ravel()
    corners, plane = places[read].reshape(-1, 2), plane[ids]
    steps = board.steps(plane)
    band = BAND_SHARE * _border(target) * side * np.linalg.norm(steps, axis=2).min()
    tags = np.flatnonzero(read)
    few = spread(len(tags), FEW // 4 if band >= WIDE_PX else len(tags))
    some = (4 * few[:, np.newaxis] + np.arange(4)).ravel()
    begun = _measured(image, target, tags[few], places[read][few], steps[some], rough=True)
    near, blur = begun.places, begun.usual_blur_px
    # Then it is known well enough where all are, so that where they were put matters no more.
    again, steps = nearer(plane, corners, steps, some, near)
    lens = _core.PlaneMap.fitted(plane, again)
    fits = _measured(image, target, tags, again.reshape(-1, 4, 2), steps, lens, blur)
    places_px, sigmas = fits.places, fits.sigmas_px
    good = ~fits.spoilt()
    if len(tags) <= FEW_MARKERS:
        places_px, sigmas = _by_sides(image, target, again.reshape(-1, 4, 2), fits)
        good = np.isfinite(places_px[:, 0])
    good &= ~astray(places_px, corners, side * np.linalg.norm(steps, axis=2).min(axis=1))
    if good.sum() < max(4, LEAST_SHARE * 4 * expected.sum()):
        return None
    return _stated(image, target, tags, np.flatnonzero(good), places_px, steps, sigmas, blur)


def _stated(
    image: Image,
    target: MarkerCorners,
    tags: IndexArray,
    good: IndexArray,
    places: FloatArray,
    steps: FloatArray,
    sigmas: FloatArray,
    blur_px: float,
) -> Detection | None:
    """Return the detection of those corners that are good among those (4 M) of markers (M,), edges put right.

    None where it is not known where all of a few are. They were measured at places, with deviations; steps
    (4 M, 2, 2) are the pixels per metre along both axes.
    """
    ids = (4 * tags[:, np.newaxis] + np.arange(4)).ravel()[good]
    plane, pixels = target.points[ids, :2], places[good]
    sides = _unit(_sides(target, tags) @ steps)[good]
    size = image.shape[1], image.shape[0]
    if len(good) >= FEWEST:
        sharp = without_edge_shift(plane, pixels, size, sides, _lights(target)[ids])
        return stated(image, target, ids, sharp, sigmas[good])
    if _is_touched(target):
        return stated(image, target, ids, pixels, sigmas[good])
    own = Corners(plane, pixels, sides, np.ones(len(plane)), sigmas[good])
    lens = _core.PlaneMap.fitted(plane, pixels)
    bits = None if lens is None else code_corners(image, target, tags, lens, blur_px)
    sharp = sharpened(own, bits, size)
    if sharp.open_px.max() > LARGEST_OPEN_PX:
        return None
    return stated(image, target, ids, sharp.pixels, sharp.sigmas_px, sharp.shared_px)


def _markers(image: Image, target: MarkerCorners) -> Seen:
    """Return the markers of the target's dictionary.

    The squares that Kalibr prints between tags touch them at their corners, so that outlines may merge; in a
    picture with thinner ink they are apart.
    """
    if not _is_touched(target):
        return find_markers(image, target.dictionary, target.border_bits)
    ids, seen, repeated = NO_IDS, np.zeros((0, 4, 2)), NO_IDS
    for size in THINNING_PX:
        if size == THINNING_PX[-1] and not len(ids):
            break
        kernel = np.ones((size, size), dtype=np.uint8)
        thinned = image if size == 1 else np.asarray(cv2.dilate(image, kernel), dtype=np.uint8)
        more = find_markers(thinned, target.dictionary, target.border_bits)
        new = ~np.isin(more.ids, ids)
        # Its edges have moved inwards by half the size: the corners belong further out on the diagonals.
        outwards = more.corners - more.corners.mean(axis=1, keepdims=True)
        outwards /= np.linalg.norm(outwards, axis=2, keepdims=True)
        grown = more.corners + outwards * (size // 2) * np.sqrt(2.0)
        ids, seen = np.concatenate([ids, more.ids[new]]), np.concatenate([seen, grown[new]])
        repeated = np.union1d(repeated, more.repeated)
        if np.isin(target.marker_ids, ids).all():
            break
    once = ~np.isin(ids, repeated)
    return Seen(ids[once], seen[once], repeated)


def _by_sides(
    image: Image, target: MarkerCorners, corners: FloatArray, fits: CornerFits
) -> tuple[FloatArray, FloatArray]:
    """Return corners (4 M, 2) of few markers as fitted where their sides meet, and deviations (4 M,).

    Elsewhere the window shows something else, so that the sides count; NaN where those do not tell. Corners
    (M, 4, 2) are about where they are.
    """
    if not len(corners):
        return fits.places, fits.sigmas_px
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    meetings = side_meetings(image, corners, BAND_SHARE * _border(target) * float(lengths.min()))
    places, sigmas = meetings.places.reshape(-1, 2), meetings.sigmas_px.ravel()
    away = np.linalg.norm(fits.places - places, axis=1)
    agree = ~fits.spoilt() & (away <= np.maximum(ASTRAY_PX, MEETING_SIGMAS * sigmas))
    return np.where(agree[:, np.newaxis], fits.places, places), np.where(agree, fits.sigmas_px, sigmas)


def _is_touched(target: MarkerCorners) -> bool:
    """Tell whether squares touch the corners of the markers."""
    return any(isinstance(layer, Squares) for layer in target.artwork().layers)


def _side(target: MarkerCorners) -> float:
    """Return the side of a marker in metres."""
    return float(np.linalg.norm(target.points[1] - target.points[0]))


def _border(target: MarkerCorners) -> float:
    """Return what is free of other edges along a marker's, as a share of its side."""
    cells = marker_bits(target.dictionary) + 2 * target.border_bits
    return min(target.border_bits / cells, target.gap_m / _side(target))


def _sides(target: MarkerCorners, markers: IndexArray) -> FloatArray:
    """Return the directions (4 M, 2, 2) on the board of both sides at each corner of markers (M,)."""
    plane = target.points[:, :2].reshape(-1, 4, 2)[markers]
    sides = np.stack([np.roll(plane, -1, axis=1) - plane, np.roll(plane, 1, axis=1) - plane], axis=2)
    return sides.reshape(-1, 2, 2) / _side(target)


def _turns(outlined: FloatArray, told: FloatArray) -> FloatArray:
    """Return the deviations (N,) of the directions told of edges, as the markers' own outlines have them.

    Both are (N, 2, 2) unit vectors, four corners of each marker in turn.
    """
    free = len(told) - OF_MAP / 2
    if len(told) <= 4 * FEW_MARKERS or free <= 0:
        return np.full(len(told), np.inf)
    off = np.linalg.det(np.stack([outlined, told], axis=2)) ** 2 * len(told) / free
    own = off.reshape(-1, 8).mean(axis=1)
    return np.sqrt(np.repeat(np.maximum(own, off.mean()), 4)).clip(LEAST_TURN)


def _unit(directions: FloatArray) -> FloatArray:
    return directions / np.maximum(np.linalg.norm(directions, axis=2, keepdims=True), 1e-12)


def _measured(
    image: Image,
    target: MarkerCorners,
    markers: IndexArray,
    tags: FloatArray,
    steps: FloatArray | None,
    lens: _core.PlaneMap | None = None,
    blur_px: float = 0.0,
    rough: bool = False,
) -> CornerFits:
    """Return the corners (4 M) of markers (M,) with corners (M, 4, 2) as fitted.

    The directions of the edges are those of the outlines, or, if it is known, those that the pixels
    (4 M, 2, 2) per metre along both axes tell; how the lens bends them, its map of the plane.
    """
    after = np.roll(tags, -1, axis=1) - tags
    before = np.roll(tags, 1, axis=1) - tags
    lengths = np.minimum(np.linalg.norm(after, axis=2), np.linalg.norm(before, axis=2)).reshape(-1)
    outlined = np.stack([after, before], axis=2).reshape(-1, 2, 2)
    sides = _sides(target, markers)
    directions = _unit(outlined if steps is None else sides @ steps)
    plane = target.points[:, :2].reshape(-1, 4, 2)[markers].reshape(-1, 2)
    # Sides run along the axes of the board, or against them.
    bends = (sides @ curvatures(lens, plane, target.spacing_m)[:, :, np.newaxis])[..., 0]
    turns = None if steps is None else _turns(_unit(outlined), directions)
    height = lengths * np.abs(np.linalg.det(directions))
    free = target.gap_m / _side(target) * height
    beyond = free - np.clip(AWAY_PX, LEAST_AWAY * free, MOST_AWAY * free)
    radii = (
        np.maximum(beyond, ALONG_SHARE * height) if steps is not None and not _is_touched(target) else beyond
    )
    return corner_fits(
        image,
        tags.reshape(-1, 2),
        directions,
        radii,
        CornerKind.QUADRANTS,
        bends,
        beyonds=beyond,
        bands=clear_bands(_border(target) * height, blur_px),
        turns=turns,
        rough=rough,
    )
