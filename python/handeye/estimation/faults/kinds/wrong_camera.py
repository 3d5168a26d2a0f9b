"""A camera file that does not belong to the pictures: another size, cropped or stretched pictures."""

import numpy as np

from handeye.estimation.faults.kinds.base import Handling, Kind
from handeye.types.camera import Camera

OTHER_SIZE = Kind(
    "camera_other_size",
    "a camera calibrated for pictures of another size",
    "The calibration was made at another resolution or binning than the pictures were taken at.",
    "Focal lengths and centre that the pictures of the board ask for are those stated times one factor.",
    Handling.REFUSED,
    "Calibrate at the size of the pictures, or scale focal lengths and centre.",
    "writes a camera calibrated from the same pictures",
)
CROPPED = Kind(
    "pictures_cropped",
    "cropped pictures",
    "Pictures were cut, or a region of interest was set, after the camera was calibrated.",
    "The focal length fits and the centre that the pictures ask for lies elsewhere by many pixels.",
    Handling.REFUSED,
    "Subtract the corner of the region from the centre, or calibrate the camera with that region.",
    "writes a camera calibrated from the same pictures",
)
STRETCHED = Kind(
    "pictures_stretched",
    "pictures scaled unequally",
    "Pictures were resized to another shape, as to a square.",
    "The focal lengths along rows and columns that the pictures ask for differ from those stated by unequal "
    "factors.",
    Handling.REFUSED,
    "Resize both sides alike, or calibrate the camera with such pictures.",
    "writes a camera calibrated from the same pictures",
)
LENS = Kind(
    "wrong_distortion",
    "a wrong distortion of the lens",
    "Coefficients in another order or of another lens, pictures already undistorted, a calibration that went "
    "wrong.",
    "Through the camera as stated the board's points fit no pose; with a distortion found from the same "
    "pictures they do.",
    Handling.REFUSED,
    "Calibrate the camera, or leave it out: it is then calibrated from the pictures. For pictures that are "
    "undistorted give zero distortion.",
    "writes a camera calibrated from the same pictures",
)
ALL = (OTHER_SIZE, CROPPED, STRETCHED, LENS)
# What is known of focal lengths and centre beside the covariance of the new calibration, relative to the
# focal length; and what another free number must bring of the squared distance to be believed.
KNOWN_SHARE = 3e-3
PER_NUMBER = 10.0


def told(given: Camera, found: Camera) -> tuple[Kind, str]:
    """Return what is wrong with a camera, by the one that the pictures ask for.

    Of the ways to change focal lengths and centre (none, one factor, another centre, two factors) the one is
    taken whose nearest camera is nearest to that of the pictures, in standard deviations.
    """
    was, now = given.parameters[:4], found.parameters[:4]
    covariance = np.diag(np.full(4, (KNOWN_SHARE * now[0]) ** 2))
    if found.covariance is not None:
        covariance = covariance + found.covariance[:4, :4]
    fx, fy, cx, cy = was
    zero = np.zeros(4)
    ways = {
        LENS.code: (was, np.zeros((4, 0))),
        OTHER_SIZE.code: (zero, was[:, np.newaxis]),
        CROPPED.code: (was, np.eye(4)[:, 2:]),
        STRETCHED.code: (zero, np.array([[fx, 0], [0, fy], [cx, 0], [0, cy]])),
    }
    weight = np.linalg.inv(covariance)
    best, numbers = LENS.code, np.zeros(0)
    least = np.inf
    for code, (start, columns) in ways.items():
        values = np.linalg.solve(columns.T @ weight @ columns, columns.T @ weight @ (now - start))
        away = now - start - columns @ values
        distance = float(away @ weight @ away) + PER_NUMBER * columns.shape[1]
        if distance < least:
            best, numbers, least = code, values, distance
    return _words(best, given, numbers.tolist())


def _words(code: str, given: Camera, numbers: list[float]) -> tuple[Kind, str]:
    if code == STRETCHED.code:
        along = f"by {numbers[0]:.3f} along rows and {numbers[1]:.3f} along columns"
        return STRETCHED, f"the pictures are stretched: {along}"
    if code == OTHER_SIZE.code:
        width, height = (round(numbers[0] * side) for side in given.size_px)
        return OTHER_SIZE, (
            "the camera is calibrated for pictures of another size: focal length and centre that the "
            f"pictures ask for are {numbers[0]:.3f} times those stated (as if {given.width_px} x "
            f"{given.height_px} pixels had been {width} x {height})"
        )
    if code == CROPPED.code:
        return CROPPED, (
            f"the pictures are cropped: the centre that they ask for lies {numbers[0]:+.0f} px and "
            f"{numbers[1]:+.0f} px from that of the camera"
        )
    return LENS, "the distortion of the camera is not that of the pictures"
