"""What is printed is what is rendered, what OpenCV draws and what detectors find."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings

from handeye.detection import Detection, detect
from handeye.errors import InputError
from handeye.pattern import Pattern
from handeye.printing import Paper, lay_out
from handeye.printing.ink import ink_of
from handeye.types import AprilGrid, Charuco, Chessboard, CircleGrid, Target
from ink import is_black, picture
from strategies import targets

BORDER_MM = 0.01


@settings(max_examples=40)
@given(targets())
def test_ink_is_what_is_rendered(target: Target) -> None:
    pattern = Pattern(target)
    if isinstance(target, CircleGrid) and target.marked is not None and target.marked_diameter_m is None:
        with pytest.raises(InputError, match="marked_diameter_m"):
            ink_of(target)
        return
    if target.point_count > 400:
        return  # the same, for longer
    ink = ink_of(target)
    # Light on dark, the dark margin is printed too.
    margin = ink.quiet_mm if getattr(target, "inverted", False) else 0.0
    np.testing.assert_allclose(ink.low + margin, pattern.low * 1000, atol=1e-9)
    np.testing.assert_allclose(ink.high - margin, pattern.high * 1000, atol=1e-9)
    random = np.random.default_rng(1)
    span = ink.high - ink.low
    outside = 0.0 if margin else 0.05
    places = ink.low - outside * span + random.uniform(size=(3000, 2)) * span * (1 + 2 * outside)
    np.testing.assert_array_equal(is_black(ink.shapes, places), pattern.is_dark(places / 1000))
    assert ink.quiet_mm > 0


@pytest.mark.parametrize("family", Target.members)
def test_usual_targets_are_read_one_way_round(family: str) -> None:
    asked = {"marked": 0} if family == "circle_grid" else {}
    target = Target.member(family).usual(0.02, asked)
    assert len(target.symmetries) == 1
    assert target.caption
    assert ink_of(target).shapes


@pytest.mark.parametrize("family", sorted(set(Target.members) - {"aruco_marker"}))
def test_measures_asked_for_are_used(family: str) -> None:
    member = Target.member(family)
    target = member.usual(0.02, {"rows": 4, "columns": 5}).to_dict()
    assert (target["rows"], target["columns"]) == (4, 5)
    with pytest.raises(InputError, match="rows"):
        member.usual(0.02, {"rows": 0})


@pytest.mark.parametrize("rows", [6, 7])
@pytest.mark.parametrize("legacy", [False, True])
def test_charuco_is_opencvs(rows: int, legacy: bool) -> None:
    target = Charuco(rows, 5, 0.03, 0.0225, "DICT_5X5_100", legacy)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    board = cv2.aruco.CharucoBoard((5, rows), 0.03, 0.0225, dictionary)
    board.setLegacyPattern(legacy)
    side = 280  # pixels a square: whole pixels a bit of a marker
    drawn = board.generateImage((5 * side, rows * side)) < 128
    random = np.random.default_rng(2)
    pixels = random.integers(0, [5 * side, rows * side], size=(4000, 2))
    inside = (pixels % 30 > 3).all(axis=1) & (pixels % 30 < 27).all(axis=1)
    places = (pixels[inside] + 0.5) / side * 30 - 30
    here = is_black(ink_of(target).shapes, places)
    there = drawn[pixels[inside, 1], pixels[inside, 0]]
    assert (here == there).mean() > 0.999  # OpenCV rounds the markers to whole pixels


def seen(target: Target, pixels_per_mm: int) -> tuple[np.ndarray, np.ndarray]:
    """A picture of the sheet, and where the points of the target are in it, in pixels with centres at integers."""
    sheet = lay_out(target, Paper.of("a4"))
    places = target.points[:, :2] * 1000 + sheet.origin_mm
    return picture(sheet.drawing, pixels_per_mm), (places + 10) * pixels_per_mm - 0.5


def test_charuco_is_found_at_its_measures() -> None:
    target = Charuco(7, 10, 0.024, 0.018, "DICT_4X4_50")
    image, expected = seen(target, 5)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    board = cv2.aruco.CharucoBoard((10, 7), 0.024, 0.018, dictionary)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
    assert ids is not None
    assert len(ids) == target.point_count
    np.testing.assert_allclose(corners.reshape(-1, 2), expected[ids.ravel()], atol=0.5)


@pytest.mark.parametrize("border_bits", [1, 2])
def test_april_grid_is_found_at_its_measures(border_bits: int) -> None:
    target = AprilGrid(4, 6, 0.028, 0.3, border_bits=border_bits)
    image, expected = seen(target, 5)
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border_bits
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(image)
    assert ids is not None
    assert sorted(ids.ravel().tolist()) == list(range(24))
    for tag, found in zip(ids.ravel(), corners, strict=True):
        # As the target's description says: for OpenCV these tags stand on their head.
        ours = found.reshape(4, 2)[[1, 0, 3, 2]]
        np.testing.assert_allclose(
            ours, expected[4 * tag : 4 * tag + 4], atol=3
        )  # corners as they come, not refined


def test_chessboard_is_found_at_its_measures() -> None:
    target = Chessboard(7, 10, 0.022)
    image, expected = seen(target, 5)
    found = detect(image, target)
    assert isinstance(found, Detection), found
    np.testing.assert_array_equal(found.point_ids, np.arange(target.point_count))
    np.testing.assert_allclose(found.pixels, expected, atol=0.25)  # the picture's edges are that coarse
    spans = found.pixels - found.pixels.mean(axis=0)
    np.testing.assert_allclose(spans, expected - expected.mean(axis=0), atol=0.05)


@pytest.mark.parametrize("asymmetric", [False, True])
def test_circles_are_found_at_their_measures(asymmetric: bool) -> None:
    target = CircleGrid(7, 6, 0.02, 0.01, asymmetric)
    image, expected = seen(target, 4)
    flags = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    found, centres = cv2.findCirclesGrid(image, (6, 7), flags=flags | cv2.CALIB_CB_CLUSTERING)
    assert found
    centres = centres.reshape(-1, 2)
    nearest = np.linalg.norm(centres[:, None] - expected[None], axis=2).argmin(axis=1)
    assert len(set(nearest.tolist())) == target.point_count
    np.testing.assert_allclose(centres, expected[nearest], atol=0.2)
