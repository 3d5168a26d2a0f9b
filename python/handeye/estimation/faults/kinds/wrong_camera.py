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
    "Through the camera as stated the board's points do not fit any pose; with a distortion found from the "
    "same pictures they do.",
    Handling.REFUSED,
    "Calibrate the camera, or leave it out: it is then calibrated from the pictures. For pictures that are "
    "undistorted give zero distortion.",
    "writes a camera calibrated from the same pictures",
)
ALL = (OTHER_SIZE, CROPPED, STRETCHED, LENS)
# Focal lengths and centre that differ by less do not count.
SHARE = 0.04
CENTRE_SHARE = 0.02


def told(given: Camera, found: Camera) -> tuple[Kind, str]:
    """Return what is wrong with a camera, by the one that the pictures ask for."""
    fx, fy, cx, cy = found.parameters[:4] / given.parameters[:4]
    shift = (found.parameters[2:4] - given.parameters[2:4]) / given.size_px[0]
    focal = float(np.sqrt(fx * fy))
    if abs(np.log(fx / fy)) > SHARE:
        return STRETCHED, f"the pictures are stretched: by {fx:.3f} along rows and {fy:.3f} along columns"
    alike = max(abs(np.log(cx / focal)), abs(np.log(cy / focal))) < max(2 * SHARE, 0.5 * abs(np.log(focal)))
    if abs(np.log(focal)) > SHARE and alike:
        width, height = (round(focal * side) for side in given.size_px)
        return OTHER_SIZE, (
            "the camera is calibrated for pictures of another size: focal length and centre that the "
            f"pictures ask for are {focal:.3f} times those stated (as if {given.width_px} x "
            f"{given.height_px} pixels had been {width} x {height})"
        )
    if np.abs(shift).max() > CENTRE_SHARE and abs(np.log(focal)) < 2 * SHARE:
        u, v = (given.parameters[2:4] - found.parameters[2:4]).tolist()
        return CROPPED, (
            f"the pictures are cropped: the centre that they ask for lies {u:+.0f} px and {v:+.0f} px from "
            "that of the camera"
        )
    return LENS, "the distortion of the camera is not that of the pictures"
