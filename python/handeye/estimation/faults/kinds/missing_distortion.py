"""A camera stated without any distortion whose pictures show some."""

from handeye.estimation.faults.kinds.base import Handling, Kind
from handeye.types.calibration import Finding

KIND = Kind(
    "missing_distortion",
    "a camera stated without distortion",
    "A driver states zeros where nobody has calibrated, or the coefficients were left out.",
    "Through a camera without distortion the board's points fit no pose as well as with one found from the "
    "same pictures.",
    Handling.USED,
    "Calibrate the camera; until then its distortion is found from the same views.",
    "writes a camera calibrated from the same pictures",
)


def finding(before_px: float, after_px: float) -> Finding:
    """Return the finding, with the residuals without and with distortion."""
    return Finding(
        KIND.code,
        "the camera is stated without distortion, and its pictures show some: the points of a view fit "
        f"within {before_px:.2g} px, with a distortion found from the views within {after_px:.2g} px; that "
        "is used",
        {"views": [], "without_px": before_px, "with_px": after_px},
    )
