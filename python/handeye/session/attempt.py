"""One attempt at one view: go there, see where the arm is, take the picture, find the target, judge it."""

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np

from handeye.cameras.protocol import Frame, Grey, ImageSource
from handeye.detection import Detection, NotFound, Prediction, Reason, detect
from handeye.errors import DeviceError, HandeyeError
from handeye.planning.collisions import Workspace
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.robots.replay import is_near
from handeye.session.entry import Failure
from handeye.session.patience import within
from handeye.solving.measurements import MIN_POINTS
from handeye.types import Camera, Pose, Target

# Reasons that the picture itself gives: light and focus, not the place.
_POOR = frozenset(
    {Reason.UNDEREXPOSED, Reason.OVEREXPOSED, Reason.LOW_CONTRAST, Reason.BLURRED, Reason.IMAGE_TOO_SMALL}
)


@dataclass(frozen=True)
class Patience:
    """How long drivers may take, in seconds, and how far off a motion may end to count as reached."""

    move_s: float = 60.0
    read_s: float = 5.0
    grab_s: float = 10.0
    reached_m: float = 0.002
    reached_rad: float = 0.01


@dataclass(frozen=True, eq=False)
class Seen:
    """What an attempt brought: the pose read back, the points, whether their labels are sure, the image."""

    reading: Reading
    detection: Detection
    image: Grey | None
    digest: str | None
    timestamp_s: float | None
    note: str
    labels_known: bool = False


@dataclass(frozen=True, eq=False)
class Missed:
    """Why an attempt brought nothing, and whether the arm moved."""

    failure: Failure
    detail: str
    moved: bool
    digest: str | None = None


@dataclass(frozen=True, eq=False)
class Cell:
    """Everything outside: the arm and what is known of it, the camera, the target.

    Parameters
    ----------
    robot, source
        The drivers.
    arm
        Description of the arm; None if it is not known and nothing really moves.
    workspace
        What no motion may leave; None where nothing really moves.
    camera, target
        As calibrated and as printed.
    confirm
        Asked before every motion; False to leave it.
    solids
        Shapes of the arm's links, where they are known.
    """

    robot: Robot
    source: ImageSource
    arm: Arm | None
    workspace: Workspace | None
    camera: Camera
    target: Target
    patience: Patience = field(default_factory=Patience)
    confirm: Callable[[Goal], bool] | None = None
    solids: SolidLinks | None = None

    def stop(self) -> None:
        """Stop the arm through its driver; a driver that fails even then stops nothing else."""
        try:
            within(self.patience.read_s, "robot", self.robot.stop)
        except DeviceError:
            return

    def read(self) -> Reading:
        """Return where the robot says it is.

        Raises
        ------
        DeviceError
            It does not say.
        """
        return within(self.patience.read_s, "robot", self.robot.read_pose)


def attempt(
    cell: Cell,
    goal: Goal,
    digests: frozenset[str],
    timings: dict[str, float],
    foresee: Callable[[Pose], Prediction | None] | None = None,
) -> Seen | Missed:
    """Try to take one view.

    Parameters
    ----------
    cell
        Where.
    goal
        Where to go; it has been checked where it was chosen, and the workspace is checked here again.
    digests
        Of the images so far: a picture that comes again is no new picture.
    timings
        Filled with the seconds that each part took.
    foresee
        Tells from the pose read back where in the image the target should be.
    """
    if cell.workspace is not None and not cell.workspace.contains(goal.T_base_flange.translation):
        return Missed(Failure.MOTION_REFUSED, "the goal is outside the stated workspace", moved=False)
    if cell.confirm is not None and not cell.confirm(goal):
        return Missed(Failure.NOT_CONFIRMED, "not confirmed", moved=False)
    started = time.monotonic()
    try:
        within(cell.patience.move_s, "robot", cell.robot.move_to, goal)
        reading = cell.read()
    except DeviceError as error:
        if error.code == "motion_refused":
            return Missed(Failure.MOTION_REFUSED, error.message, moved=False)
        cell.stop()
        return Missed(Failure.ROBOT_FAILED, error.message, moved=False)
    timings["move"] = time.monotonic() - started
    note = ""
    if not is_near(
        goal.T_base_flange, reading.T_base_flange, cell.patience.reached_m, cell.patience.reached_rad
    ):
        difference = goal.T_base_flange.inverse() @ reading.T_base_flange
        off = 1e3 * float(np.linalg.norm(difference.translation))
        turn = float(np.rad2deg(difference.rotation_angle_rad))
        note = f"ended {off:.1f} mm and {turn:.2f} deg from the goal; the pose read back is used"
        if cell.workspace is not None and not cell.workspace.contains(reading.T_base_flange.translation):
            cell.stop()
            return Missed(Failure.ELSEWHERE, f"{note.split(';')[0]}, outside the workspace", moved=True)
    started = time.monotonic()
    try:
        frame = within(cell.patience.grab_s, "camera", cell.source.grab, goal.label)
    except DeviceError as error:
        failure = Failure.CAMERA_TIMEOUT if error.code == "timeout" else Failure.CAMERA_FAILED
        return Missed(failure, error.message, moved=True)
    timings["grab"] = time.monotonic() - started
    started = time.monotonic()
    predicted = None if foresee is None else foresee(reading.T_base_flange)
    found = _look(cell, frame, digests, predicted)
    timings["detect"] = time.monotonic() - started
    if isinstance(found, Missed):
        return found
    detection, digest = found
    sure = frame.points is not None and frame.points.labels_known
    return Seen(reading, detection, frame.image, digest, frame.timestamp_s, note, sure)


def _look(
    cell: Cell, frame: Frame, digests: frozenset[str], predicted: Prediction | None
) -> tuple[Detection, str | None] | Missed:
    """Find the target in a frame, and tell frames that are no pictures of now."""
    if frame.points is not None:
        if len(frame.points.point_ids) < MIN_POINTS:
            return Missed(Failure.NOT_FOUND, "the camera found no target", moved=True)
        digest = _digest(frame.points.pixels.tobytes())
        if digest in digests:
            return Missed(Failure.STALE_IMAGE, "the same points as before, bit for bit", moved=True)
        try:
            return Detection(frame.points.point_ids, frame.points.pixels), digest
        except HandeyeError as error:
            return Missed(Failure.BAD_IMAGE, error.message, moved=True)
    image = frame.image
    width, height = cell.camera.size_px
    if image is None or image.shape != (height, width):
        shape = "none" if image is None else f"{image.shape[1]} x {image.shape[0]}"
        return Missed(
            Failure.BAD_IMAGE, f"an image of {shape} pixels, the camera has {width} x {height}", moved=True
        )
    digest = _digest(image.tobytes())
    if digest in digests:
        return Missed(Failure.STALE_IMAGE, "the same picture as before, bit for bit", moved=True)
    found = detect(image, cell.target, predicted=predicted)
    if isinstance(found, NotFound):
        failure = Failure.POOR_IMAGE if found.reason in _POOR else Failure.NOT_FOUND
        return Missed(failure, f"{found.evidence} ({found.reason})", moved=True, digest=digest)
    if len(found) < MIN_POINTS:
        return Missed(Failure.NOT_FOUND, f"only {len(found)} points of the target", moved=True, digest=digest)
    return found, digest


def _digest(content: bytes) -> str:
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def encoded(image: Grey) -> bytes:
    """Return an image as PNG."""
    _, data = cv2.imencode(".png", image)
    return data.tobytes()
