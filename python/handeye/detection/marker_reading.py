"""Markers of any dictionary in an image: what is there, where the ones described are not."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import repeat

import cv2
import numpy as np
from cv2.typing import MatLike

from handeye.detection.base import Image
from handeye.detection.markers import SMALLEST_PERIMETER_SHARE, dictionary
from handeye.detection.noise import calmed
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.target.dictionaries import marker_bits, marker_count

# One of each kind; smaller dictionaries are beginnings of these.
LARGEST = (
    "DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL",
    "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h10", "DICT_APRILTAG_36h11",
    "DICT_ARUCO_MIP_36h12",
)  # fmt: skip
# Samples along a side of a bit, over this share of it: the rest may be blurred.
SAMPLES, SHARE = 3, 0.6
# Grey values between dark and light of a marker.
LEAST_CONTRAST = 12.0
# Bits of the border that may be misread, and of the number once it is known which dictionary it is.
BORDER_ERRORS, CORRECTION = 0.06, 0.6
# Fewer markers than these may be chance where a dictionary has so few bits.
FEWEST, FEWEST_OF_FOUR = 1, 3
# Unless one is as large as this, as a share of the image.
LARGE_SHARE = 0.08
# Of a reading that is no chance; four of the smallest markers of 4 x 4 bits have as much.
PLAIN_BITS = 16.0
# Corners of outlines are off by so many pixels, or this share of a side.
NEAR_PX, NEAR_SHARE = 5, 0.08
_ENOUGH = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 0.05)
# Windows of the thresholds, what is darker than its surroundings by so much, and how straight sides are, as a
# share of the length around.
WINDOWS_PX, THRESHOLD, STRAIGHT = (5, 13, 23), 7, 0.03
# Enough of them where ink is made thinner.
FEW_WINDOWS_PX = (13, 23)
# What is seen at several thresholds is one.
SAME_PX, SAME_SIZES, MOST_QUADS = 4.0, 8, 1500
# Thinner ink, dark or light, parts markers from squares that touch them, as Kalibr prints them.
THINNED = ((cv2.dilate, 1), (cv2.dilate, 3), (cv2.erode, 3))


@dataclass(frozen=True, eq=False)
class Reading:
    """Markers of one dictionary, all with one border and one polarity.

    Attributes
    ----------
    dictionary
        OpenCV's name; the largest of its kind.
    border_bits, inverted
        Width of the border, and whether they are light on dark.
    ids, corners
        (M,) and (M, 4, 2) numbers, none twice, and corners in OpenCV's order.
    repeated
        Numbers of markers that are in several places; one place of each is among the others.
    """

    dictionary: str
    border_bits: int
    inverted: bool
    ids: IndexArray
    corners: FloatArray
    repeated: IndexArray


def read_markers(image: Image, *, touched: bool = False) -> Reading | None:
    """Return the markers of the dictionary that most of them are of; None where there are none.

    Parameters
    ----------
    image
        The picture (H, W).
    touched
        Whether squares that touch the markers are to be reckoned with where none is read otherwise.
    """
    picture = calmed(image)
    readings = dict[tuple[str, int, bool], Reading]()
    best: Reading | None = None
    for change, size in THINNED:
        kernel = np.ones((size, size), dtype=np.uint8)
        changed = picture if size == 1 else np.asarray(change(picture, kernel), dtype=np.uint8)
        for reading in _readings(changed, WINDOWS_PX if size == 1 else FEW_WINDOWS_PX):
            kind = reading.dictionary, reading.border_bits, reading.inverted
            readings[kind] = _together(readings[kind], reading) if kind in readings else reading
        best = max(map(_outermost, readings.values(), repeat(readings)), key=_weight, default=None)
        if not (touched if best is None else best.border_bits == 2):
            break
    if best is None:
        return None
    return replace(best, corners=_sharpened(image, best.corners))


def _weight(reading: Reading) -> float:
    """Return how many bits speak against chance: more markers, and fewer of the codes with a number."""
    name = reading.dictionary
    return len(reading.ids) * (marker_bits(name) ** 2 - np.log2(4 * marker_count(name)))


def is_plain(reading: Reading, image_size: tuple[int, int]) -> bool:
    """Tell whether markers are no chance even where none are expected: large, and of many bits."""
    large = LARGE_SHARE * max(image_size)
    return _weight(reading) >= PLAIN_BITS and bool(_sides(reading.corners).max() >= large)


def _outermost(reading: Reading, others: dict[tuple[str, int, bool], Reading]) -> Reading:
    """Return a reading without markers that have a wider border.

    Thresholds draw a line inside of a wide border, too, and there the marker has a border of one bit.
    """
    wider = others.get((reading.dictionary, 2, reading.inverted))
    if reading.border_bits == 2 or wider is None:
        return reading
    size = dict(zip(wider.ids.tolist(), _sides(wider.corners).tolist(), strict=True))
    sides = zip(reading.ids.tolist(), _sides(reading.corners).tolist(), strict=True)
    kept = np.array([side > size.get(number, 0.0) for number, side in sides], dtype=np.bool_)
    return replace(reading, ids=reading.ids[kept], corners=reading.corners[kept])


def _sides(corners: FloatArray) -> FloatArray:
    """Return the length (M,) of the shortest side of markers (M, 4, 2)."""
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).min(axis=1))


def _together(first: Reading, second: Reading) -> Reading:
    """Return what was read twice, each marker where it was read first."""
    new = ~np.isin(second.ids, first.ids)
    return replace(
        first,
        ids=np.concatenate([first.ids, second.ids[new]]),
        corners=np.concatenate([first.corners, second.corners[new]]),
        repeated=np.union1d(first.repeated, second.repeated),
    )


def _sharpened(image: Image, corners: FloatArray) -> FloatArray:
    """Return corners (M, 4, 2) nearer to where edges meet: an outline is rounded, and inside of it."""
    sharp = np.empty_like(corners)
    for marker, side in enumerate(_sides(corners).tolist()):
        window = int(np.clip(NEAR_SHARE * side, 2, NEAR_PX))
        near = corners[marker].reshape(-1, 1, 2).astype(np.float32)
        found = cv2.cornerSubPix(image, near, (window, window), (-1, -1), _ENOUGH)
        sharp[marker] = np.asarray(found, dtype=np.float64).reshape(4, 2)
    return sharp


def _readings(image: Image, windows_px: tuple[int, ...]) -> Iterator[Reading]:
    quads = _quads(image, windows_px)
    large = LARGE_SHARE * max(image.shape)
    if not len(quads):
        return
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    maps = [cv2.getPerspectiveTransform(unit, quad) for quad in quads.astype(np.float32)]
    for border in (1, 2):
        for bits in (4, 5, 6, 7):
            cells = _cells(image, maps, bits + 2 * border)
            low, high = cells.min(axis=(1, 2)), cells.max(axis=(1, 2))
            light = cells > ((low + high) / 2)[:, np.newaxis, np.newaxis]
            framed = light.copy()
            framed[:, border:-border, border:-border] = False
            number = cells[0].size - bits * bits
            share = framed.sum(axis=(1, 2)) / number
            for inverted in (False, True):
                fits = (high - low >= LEAST_CONTRAST) & ((1 - share if inverted else share) <= BORDER_ERRORS)
                codes = light[fits, border:-border, border:-border] != inverted
                yield from _of_dictionaries(
                    codes.astype(np.uint8), quads[fits], bits, border, inverted, large
                )


def _of_dictionaries(
    codes: Image, quads: FloatArray, bits: int, border: int, inverted: bool, large: float
) -> Iterator[Reading]:
    for name in LARGEST:
        if marker_bits(name) != bits or not len(codes):
            continue
        exact = _identified(codes, quads, name, 0.0)
        if len(exact[0]) >= (FEWEST_OF_FOUR if bits == 4 else FEWEST) or (
            len(exact[0]) and _sides(exact[1]).max() >= large
        ):
            yield Reading(name, border, inverted, *_identified(codes, quads, name, CORRECTION))


def _identified(
    codes: Image, quads: FloatArray, name: str, correction: float
) -> tuple[IndexArray, FloatArray, IndexArray]:
    """Return ids (M,), corners (M, 4, 2) and repeated ids of codes (Q, B, B) that a dictionary has."""
    book, found, repeated = dictionary(name), dict[int, FloatArray](), set[int]()
    for code, quad in zip(codes, quads, strict=True):
        known, number, rotation = book.identify(code, correction)
        if not known:
            continue
        first = found.setdefault(int(number), np.roll(quad, int(rotation), axis=0))
        if np.linalg.norm(first.mean(axis=0) - quad.mean(axis=0)) > np.linalg.norm(first[1] - first[0]) / 2:
            repeated.add(int(number))
    corners = np.array(list(found.values())).reshape(-1, 4, 2)
    return np.array(list(found), dtype=np.int64), corners, np.array(sorted(repeated), dtype=np.int64)


def _quads(image: Image, windows_px: tuple[int, ...]) -> FloatArray:
    """Return the corners (Q, 4, 2), clockwise, of everything that has four.

    As OpenCV looks for candidates, but one that lies around another is kept: the outline of the paper must
    not hide a marker of a dictionary that is not known yet.
    """
    least = SMALLEST_PERIMETER_SHARE * max(image.shape)
    found: dict[tuple[int, ...], FloatArray] = {}
    for window in (*windows_px, max(image.shape) // 16 | 1):
        dark = cv2.adaptiveThreshold(
            image, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, window, THRESHOLD
        )
        contours, _ = cv2.findContours(dark, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        for contour in contours:
            if len(contour) < least:
                continue
            quad = cv2.approxPolyDP(contour, STRAIGHT * len(contour), closed=True)
            if len(quad) != 4 or not cv2.isContourConvex(quad):
                continue
            corners = quad.reshape(4, 2).astype(np.float64)
            if cv2.contourArea(quad, oriented=True) < 0:
                corners = corners[::-1]
            place = np.rint(corners.mean(axis=0) / SAME_PX).astype(int).tolist()
            found.setdefault((*place, round(SAME_SIZES * float(np.log(len(contour))))), corners)
    return np.array(list(found.values())[:MOST_QUADS]).reshape(-1, 4, 2)


def _cells(image: Image, homographies: list[MatLike], side: int) -> FloatArray:
    """Return the mean grey values (Q, side, side) of the cells of quads, which are images of unit squares."""
    fine = (np.arange(SAMPLES) - (SAMPLES - 1) / 2) / SAMPLES * SHARE
    steps = ((np.arange(side)[:, np.newaxis] + 0.5 + fine) / side).ravel()
    x, y = np.meshgrid(steps, steps)
    flat = np.stack([x, y], axis=-1).reshape(1, -1, 2).astype(np.float32)
    places = [cv2.perspectiveTransform(flat, homography) for homography in homographies]
    maps = np.array(places, dtype=np.float32).reshape(len(places), -1, 2)
    grey = cv2.remap(image, maps, np.empty(0), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    shape = (len(places), side, SAMPLES, side, SAMPLES)
    return np.asarray(grey, dtype=np.float64).reshape(shape).mean(axis=(2, 4))
