"""Values that are possible but hardly meant: millimetres where metres are due, degrees where radians are.

These are warnings, not errors: the largest arms reach 4 m and gantries a little further, boards have squares
of 5 mm to 0.5 m, so nobody is bothered who has measured in metres; but nobody is refused either.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from handeye.types import Camera, Pose, Recording, Target, View

FARTHEST_FLANGE_M = 20.0
FARTHEST_TARGET_M = 20.0
LARGEST_PITCH_M = 1.0
SMALLEST_PITCH_M = 2e-4
LARGEST_JOINT_RAD = 4 * np.pi
# Focal length over image width: 0.2 is a fisheye of 180 degrees and more, 20 a field of view of 3 degrees.
FOCAL_SHARE = (0.2, 20.0)


@dataclass(frozen=True)
class DataWarning:
    """Something in the data that is probably not meant.

    Attributes
    ----------
    code
        A stable lower-case word for scripts.
    message
        What was found, what is usual, and what to do, for a person.

    Examples
    --------
    >>> print(DataWarning("few_views", "3 views: ten are a good start").message)
    3 views: ten are a good start
    """

    code: str
    message: str

    def __str__(self) -> str:
        return self.message


def recording_warnings(recording: Recording) -> tuple[DataWarning, ...]:
    """Return what looks wrong with a recording.

    Examples
    --------
    >>> recording_warnings(recording)
    ()
    """
    warnings = [
        *pose_warnings((view.name, view.T_base_flange) for view in recording.views),
        *target_warnings(recording.target),
        *camera_warnings(recording.camera),
        *_distance_warnings(recording),
        *_joint_warnings(recording.views),
    ]
    return tuple(warnings)


def pose_warnings(named_poses: Iterable[tuple[str, Pose]]) -> list[DataWarning]:
    """Return what looks wrong with robot poses `T_base_flange`."""
    reach = [(float(np.linalg.norm(pose.translation)), name) for name, pose in named_poses]
    far = [(distance, name) for distance, name in reach if distance > FARTHEST_FLANGE_M]
    if not far:
        return []
    distance, name = max(far)
    return [
        DataWarning(
            "poses_not_metres",
            f"{len(far)} of {len(reach)} robot poses lie more than {FARTHEST_FLANGE_M:g} m from the robot "
            f"base (view {name}: {distance:.6g} m): are these millimetres? Divide the translations by 1000.",
        )
    ]


def accuracy_warnings(names: Sequence[str], where: str) -> list[DataWarning]:
    """Return the word that accuracies of single poses, as a file calls them, are not used."""
    if not names:
        return []
    listed = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
    message = (
        f"{where}: how accurate each pose is ({listed}) is not used: how far the robot errs is found from "
        "the views themselves"
    )
    return [DataWarning("accuracies_unused", message)]


def target_warnings(target: Target) -> list[DataWarning]:
    """Return what looks wrong with the measures of a target."""
    pitch = float(np.linalg.norm(target.points[1] - target.points[0]))
    if SMALLEST_PITCH_M <= pitch <= LARGEST_PITCH_M:
        return []
    remedy = "are these millimetres? Divide by 1000." if pitch > LARGEST_PITCH_M else "is this in metres?"
    return [
        DataWarning(
            "target_not_metres",
            f"the first two points of the {target.family} are {pitch:.6g} m apart: {remedy}",
        )
    ]


def camera_warnings(camera: Camera) -> list[DataWarning]:
    """Return what looks wrong with a camera calibration."""
    fx, fy, cx, cy = (float(value) for value in camera.parameters[:4])
    warnings: list[DataWarning] = []
    low, high = (share * max(camera.size_px) for share in FOCAL_SHARE)
    if not (low <= fx <= high and low <= fy <= high):
        warnings.append(
            DataWarning(
                "camera_focal_length",
                f"focal lengths {fx:.6g} and {fy:.6g} px for an image of {camera.width_px} x "
                f"{camera.height_px} pixels, usually {low:.3g} to {high:.3g} px: "
                "are they in pixels of this image size?",
            )
        )
    if not (0 <= cx <= camera.width_px and 0 <= cy <= camera.height_px):
        warnings.append(
            DataWarning(
                "camera_centre",
                f"principal point ({cx:.6g}, {cy:.6g}) px outside the image of {camera.width_px} x "
                f"{camera.height_px} pixels: does the calibration belong to these images?",
            )
        )
    if max(fx, fy) > 1.2 * min(fx, fy):
        warnings.append(
            DataWarning(
                "camera_pixel_shape",
                f"focal lengths {fx:.6g} and {fy:.6g} px differ by more than 20 %: pixels are usually square",
            )
        )
    return warnings


def _distance_warnings(recording: Recording) -> list[DataWarning]:
    far = [
        (distance, view.name)
        for view in recording.views
        if (distance := _rough_distance(view, recording)) > FARTHEST_TARGET_M
    ]
    if not far:
        return []
    distance, name = max(far)
    return [
        DataWarning(
            "target_far",
            f"by its size in the image the target is about {distance:.3g} m away (view {name}; {len(far)} of "
            f"{len(recording.views)} views beyond {FARTHEST_TARGET_M:g} m): are its measures in metres?",
        )
    ]


def _rough_distance(view: View, recording: Recording) -> float:
    """Return the distance in metres at which a target seen squarely would have its size in the image."""
    points = recording.target.points[view.point_ids]
    size_m = float(np.linalg.norm(np.ptp(points, axis=0)))
    size_px = float(np.linalg.norm(np.ptp(view.pixels, axis=0)))
    return float(recording.camera.parameters[0]) * size_m / size_px if size_px > 0 else 0.0


def _joint_warnings(views: tuple[View, ...]) -> list[DataWarning]:
    turned = [
        (max(map(abs, view.joints_rad)), view.name)
        for view in views
        if view.joints_rad is not None and max(map(abs, view.joints_rad)) > LARGEST_JOINT_RAD
    ]
    if not turned:
        return []
    angle, name = max(turned)
    return [
        DataWarning(
            "joints_not_radians",
            f"joints of {len(turned)} views stand at more than two turns (view {name}: {angle:.6g} rad): "
            "are these degrees?",
        )
    ]
