"""Where a target is expected in an image, and the part of the image to look at first."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye.detection.base import Detection, Image, affine, relabeled
from handeye.detection.part import Part, jacobians, mapped, reduced
from handeye.errors import InputError
from handeye.types import AprilGrid, Charuco, Chessboard, CircleGrid, Target
from handeye.types.arrays import FloatArray

# Beyond the margin, in pitches, what is printed around the outermost points; of a chessboard so much that a
# larger one is told from it.
BORDER, CHESSBOARD_BORDER = 1.5, 2.1
# A part this large is no part: then the whole image is looked at at once.
LARGEST_SHARE = 0.7
# Points of a board that tell how it is foreshortened.
SAMPLES = 60
# A part is searched no finer than so many pixels for the side of a square, the radius of a circle or the bit
# of a marker; finer details only take time until the points are measured, which is done in the image itself.
SQUARE_PX, RADIUS_PX, BIT_PX, TAG_BIT_PX = 20.0, 7.0, 4.0, 6.0
# Below this the image is reduced before it is turned, or pixels between would not count.
LARGEST_REDUCTION = 0.6
# Points nearer to a side of the part than this, in pitches, and there may be more beyond.
SIDE = 0.9
# Grey of what is outside the image.
OUTSIDE = 128
# A board of which fewer of the points expected are found is looked for in the whole image, too.
LEAST_SHARE = 0.5


@dataclass(frozen=True, eq=False, init=False)
class Prediction:
    """Where the points of a target are expected.

    Parameters
    ----------
    pixels
        (P, 2) one for each point of the target; NaN for points that the lens does not see. Places outside
        the image are fine.
    margin_px
        How far off the prediction may be: from the accuracy of whatever predicts. Too small a margin costs
        time, not views.

    Raises
    ------
    InputError
        Wrong shapes, or a margin below zero.
    """

    pixels: FloatArray
    margin_px: float

    def __init__(self, pixels: ArrayLike, margin_px: float) -> None:
        places = np.array(pixels, dtype=np.float64)
        if places.ndim != 2 or places.shape[1] != 2 or not margin_px >= 0:
            raise InputError(
                f"prediction: pixels of shape {places.shape} and a margin of {margin_px} px, expected (P, 2) "
                "and at least zero",
                code="wrong_shape",
            )
        places[~np.isfinite(places).all(axis=1)] = np.nan
        places.flags.writeable = False
        object.__setattr__(self, "pixels", places)
        object.__setattr__(self, "margin_px", float(margin_px))


def expected_part(image: Image, target: Target, prediction: Prediction, smallest_px: int) -> Part | None:
    """Return the part of an image to look at first, seen squarely; None where there is none worth the while.

    Raises
    ------
    InputError
        As many places are needed as the target has points.
    """
    if len(prediction.pixels) != target.point_count:
        raise InputError(
            f"prediction: {len(prediction.pixels)} pixels for {target.point_count} points of the target",
            code="wrong_shape",
        )
    seen = np.flatnonzero(np.isfinite(prediction.pixels[:, 0]))
    if len(seen) < 4:
        return None
    plane, pixels = target.points[seen, :2], prediction.pixels[seen]
    homography = _homography(plane, pixels)
    if homography is None or not _in_front(homography, target.points[:, :2]):
        return None
    scales = _local_scales(homography, plane)
    pitch, detail, wanted_px = _measures(target)
    # Pixels of the part per metre; no finer than the image is anywhere.
    scale = min(wanted_px / detail, float(scales.max()))
    border = CHESSBOARD_BORDER if isinstance(target, Chessboard) else BORDER
    aside = border * pitch + prediction.margin_px / max(float(scales.min()), 1e-9)
    low, high = plane.min(axis=0) - aside, plane.max(axis=0) + aside
    if not _in_front(homography, np.array([low, high])):
        return None
    width, height = np.ceil((high - low) * scale).astype(int).tolist()
    if min(width, height) < smallest_px or width * height > LARGEST_SHARE * image.size:
        return None
    to_plane = np.array([[1 / scale, 0, low[0]], [0, 1 / scale, low[1]], [0, 0, 1]])
    to_image = homography @ to_plane
    picture = _squarely(image, to_image, (width, height), scale / float(scales.mean()))
    return Part(picture, to_image, SIDE * pitch * scale)


def _squarely(image: Image, to_image: FloatArray, size: tuple[int, int], reduction: float) -> Image:
    """Return the part of a size; where it is much smaller than the image, what lies between is averaged."""
    width, height = size
    if reduction < LARGEST_REDUCTION:
        outline = mapped(to_image, np.array([[0, 0], [width, 0], [width, height], [0, height]], dtype=float))
        low = np.clip(np.floor(outline.min(axis=0)) - 2, 0, image.shape[::-1]).astype(int)
        high = np.clip(np.ceil(outline.max(axis=0)) + 3, 0, image.shape[::-1]).astype(int)
        cut = image[low[1] : high[1], low[0] : high[0]]
        if min(cut.shape) * reduction >= 2:
            image, factors = reduced(cut, reduction)
            # From the image to its reduced part.
            shift = (0.5 - low) / factors - 0.5
            to_image = (
                np.array([[1 / factors[0], 0, shift[0]], [0, 1 / factors[1], shift[1]], [0, 0, 1]]) @ to_image
            )
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(
        cv2.warpPerspective(image, to_image, (width, height), flags=flags, borderValue=OUTSIDE),
        dtype=np.uint8,
    )


def is_whole(image: Image, part: Part, target: Target, prediction: Prediction, found: Detection) -> bool:
    """Tell whether the whole image would show no more of the target than its part did."""
    height, width = image.shape
    last = np.array([width, height]) - 1.0
    size = np.array(part.picture.shape[::-1], dtype=np.float64)
    there = part.inverse(found.pixels)
    # Points at a side of the part: is there more image beyond?
    beyond = np.where(there < part.side_px, -1.0, np.where(there > size - 1 - part.side_px, size, there))
    touching = (beyond != there).any(axis=1)
    if touching.any() and _inside(part.places(beyond[touching]), last).any():
        return False
    expected = prediction.pixels
    if len(found) < LEAST_SHARE * _inside(expected, last).sum():
        return False
    # Where the points that were not found really are: the prediction, moved as those found are.
    best: tuple[float, FloatArray] = (np.inf, np.zeros((0, 2)))
    for permutation in target.symmetries:
        named = relabeled(found, permutation)
        known = np.isfinite(expected[named.point_ids, 0])
        if known.sum() < 4:
            continue
        source, destination = expected[named.point_ids[known]], named.pixels[known]
        A, b = affine(source, destination)
        miss = float(np.linalg.norm(source - destination, axis=1).mean())
        if miss < best[0]:
            missing = np.setdiff1d(np.flatnonzero(np.isfinite(expected[:, 0])), named.point_ids)
            best = miss, expected[missing] @ A + b
    missed = best[1]
    missed = missed[_inside(missed, last)]
    places = part.inverse(missed)
    return bool(((places >= part.side_px) & (places <= size - 1 - part.side_px)).all())


def _inside(pixels: FloatArray, last: FloatArray) -> NDArray[np.bool_]:
    """Tell which places (N, 2) are in an image; not those that are not finite."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((pixels >= 0) & (pixels <= last)).all(axis=1), dtype=np.bool_)


def _in_front(homography: FloatArray, plane: FloatArray) -> bool:
    """Tell whether the box around places (N, 2) of the plane is in front of the camera, and not far off."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    outline = np.array([[*low, 1], [high[0], low[1], 1], [*high, 1], [low[0], high[1], 1]])
    depth = outline @ homography[2]
    return bool((depth > 0.1 * depth.max()).all()) and depth.max() > 0


def _measures(target: Target) -> tuple[float, float, float]:
    """Return the pitch, the smallest detail, and the pixels that it needs in a search."""
    if isinstance(target, Chessboard):
        return target.pitch_m, target.pitch_m, SQUARE_PX
    if isinstance(target, CircleGrid):
        return target.pitch_m, target.radius_m, RADIUS_PX
    if isinstance(target, Charuco):
        return target.square_m, target.marker_m / (_bits(target.dictionary) + 2), BIT_PX
    if isinstance(target, AprilGrid):
        bits = _bits(target.dictionary) + 2 * target.border_bits
        return target.tag_m * (1 + target.spacing_ratio) / 2, target.tag_m / bits, TAG_BIT_PX
    size = float(np.ptp(target.points[:, :2], axis=0).max())
    return size, size, np.inf


def _bits(dictionary: str) -> int:
    """Return the bits along a side of a dictionary's markers."""
    name = dictionary.removeprefix("DICT_").removeprefix("APRILTAG_").removeprefix("ARUCO_")
    known = {"16h5": 4, "25h9": 5, "36h10": 6, "36h11": 6, "ORIGINAL": 5, "MIP_36h12": 6}
    return known.get(name) or int(name[0])


def _homography(plane: FloatArray, pixels: FloatArray) -> FloatArray | None:
    """Return H (3, 3) from the plane to pixels; a lens makes it approximate, which is good enough here."""
    chosen = np.unique(np.linspace(0, len(plane) - 1, SAMPLES).astype(int))
    size = float(np.ptp(plane, axis=0).max())
    H, _ = cv2.findHomography(plane[chosen] / size, pixels[chosen], 0)
    # OpenCV gives None where no homography fits, whatever its types say.
    if H is None or not np.isfinite(H).all():  # pyright: ignore[reportUnnecessaryComparison]
        return None
    return np.asarray(H, dtype=np.float64) @ np.diag([1 / size, 1 / size, 1.0])


def _local_scales(homography: FloatArray, plane: FloatArray) -> FloatArray:
    """Return the least and largest pixels per metre (M, 2) at the corners of the points."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    places = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    return np.asarray(np.linalg.svd(jacobians(homography, places), compute_uv=False), dtype=np.float64)
