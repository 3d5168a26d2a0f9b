"""One attempt at a view or station: go there, see where the arm is, take the pictures, find the targets."""

import hashlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from handeye.cameras.protocol import BAD_FRAME, Frame, Grey, ImageSource, checked_frame
from handeye.codes import Code
from handeye.detection import Detection, NotFound, Prediction, Reason, detect
from handeye.errors import DeviceError, HandeyeError, InputError
from handeye.estimation.measurements import MIN_POINTS
from handeye.planning.collisions import Workspace
from handeye.planning.solids import SolidLinks
from handeye.robots import Arm
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.robots.reading import BAD_READING, checked_reading, typed_reading
from handeye.robots.replay import is_near
from handeye.session.calls import Calls
from handeye.session.entry import Failure
from handeye.session.observer import Observer
from handeye.session.safety import Believed, body_of, objection_to_motion
from handeye.types import Camera, Pose, Target
from handeye.types.rig import CAMERA, TARGET

# Reasons that the picture itself gives: light and focus, not the place.
_POOR = frozenset(
    {Reason.UNDEREXPOSED, Reason.OVEREXPOSED, Reason.LOW_CONTRAST, Reason.BLURRED, Reason.IMAGE_TOO_SMALL}
)

# A goal this near is where the arm stands already; a pose this near to the one before is the same.
MOVED_M, MOVED_RAD = 1e-3, 5e-3
STILL_M, STILL_RAD = 1e-5, 1e-4


@dataclass(frozen=True)
class Timeouts:
    """How long drivers may take, in seconds, and how far off a motion may end to count as reached.

    Examples
    --------
    >>> Timeouts(move_s=120.0).reached_m  # metres
    0.002
    """

    move_s: float = 60.0
    read_s: float = 5.0
    grab_s: float = 10.0
    reached_m: float = 0.002
    reached_rad: float = 0.01

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InputError(f"{name} {value}, expected above zero", code=Code.OUT_OF_RANGE)

    def without_clock(self) -> "Timeouts":
        """Return the same without limits of time: simulated drivers answer, and no clock is looked at."""
        return replace(self, move_s=math.inf, read_s=math.inf, grab_s=math.inf)


@dataclass(frozen=True, eq=False)
class Arrived:
    """Where a motion ended, as the robot says, and what is to be noted of it."""

    reading: Reading
    note: str = ""


@dataclass(frozen=True, eq=False)
class Seen:
    """What a camera saw: the points, whether their labels are sure, the image."""

    detection: Detection
    image: Grey | None
    digest: str
    timestamp_s: float | None
    labels_known: bool = False


@dataclass(frozen=True, eq=False)
class Missed:
    """Why an attempt brought nothing, whether the arm moved, and where it said that it stood afterwards."""

    failure: Failure
    detail: str
    moved: bool
    digest: str | None = None
    standing: Reading | None = None


@dataclass(frozen=True, eq=False)
class Eye:
    """One camera and one target that it may see: their names, the driver, as calibrated and as printed.

    `moves` says whether the arm moves the two against each other.
    """

    name: tuple[str, str]
    source: ImageSource
    camera: Camera
    target: Target
    moves: bool = True


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
        As calibrated and as printed; where there are several, of the leading eye.
    confirm
        Asked before every motion; False to leave it.
    solids
        Shapes of the arm's links, where they are known.
    speed_rad_s
        No goal is sent that is faster.
    by_hand
        Whether a person moves the arm, who sees the way and may not know the joints.
    observer
        Told of what happens.
    several
        All cameras and the targets that they may see, where there is more than one of either.

    Examples
    --------
    >>> from handeye.robots import open_arm
    >>> cell = simulated_cell(open_arm("ur5e")).cell
    >>> len(cell.read().joints_rad)  # radians
    6
    """

    robot: Robot
    source: ImageSource
    arm: Arm | None
    workspace: Workspace | None
    camera: Camera
    target: Target
    timeouts: Timeouts = field(default_factory=Timeouts)
    confirm: Callable[[Goal], bool] | None = None
    solids: SolidLinks | None = None
    speed_rad_s: float = math.inf
    by_hand: bool = False
    observer: Observer = field(default_factory=Observer)
    several: tuple[Eye, ...] = ()
    robot_calls: Calls = field(default_factory=lambda: Calls("robot"))
    camera_calls: Calls = field(default_factory=lambda: Calls("camera"))

    @property
    def eyes(self) -> tuple[Eye, ...]:
        """Every camera with every target that it may see."""
        return self.several or (Eye((CAMERA, TARGET), self.source, self.camera, self.target),)

    def stop(self) -> str | None:
        """Stop the arm, also while a call runs; say why that is not confirmed, None if it is."""
        try:
            self.robot_calls.beside(self.timeouts.read_s, self.robot.stop)
        except DeviceError as error:
            return error.message
        return None

    def read(self, expected: Pose | None = None) -> Reading:
        """Return where the robot says it is; where something moves, only what may be true.

        Raises
        ------
        DeviceError
            It does not say, or what it says cannot be true. `expected` helps to name what is wrong.
        """
        answer = self.robot_calls.run(self.timeouts.read_s, self.robot.read_pose)
        if self.arm is None or self.workspace is None:
            reading = typed_reading(answer)
        else:
            reading = checked_reading(answer, self.arm, joints_needed=not self.by_hand, expected=expected)
        self.observer.stands(reading)
        return reading

    def objection(self, goal: Goal, standing: Reading, believed: Believed | None) -> str | None:
        """Say why a goal must not be sent from where the arm stands, None if it may be."""
        if self.workspace is None:
            return None  # nothing moves
        if self.arm is None:
            return "the arm is not known, and no way can be checked"
        body = body_of(self.arm, self.workspace, self.solids, believed)
        return objection_to_motion(body, goal, standing.joints_rad, self.speed_rad_s)


def arrive(cell: Cell, goal: Goal, believed: Believed | None, timings: dict[str, float]) -> Arrived | Missed:
    """Try to bring the arm to a goal.

    Parameters
    ----------
    cell
        Where.
    goal
        Where to go; checked here from where the arm really stands, however it was chosen.
    believed
        What is believed: what is mounted on the arm takes part in the check.
    timings
        Filled with the seconds that it took.
    """
    started = time.monotonic()
    reading = _go(cell, goal, believed)
    if isinstance(reading, Missed):
        return reading
    timings["move"] = time.monotonic() - started
    if is_near(goal.T_base_flange, reading.T_base_flange, cell.timeouts.reached_m, cell.timeouts.reached_rad):
        return Arrived(reading)
    off = f"ended {_off(goal, reading)} from the goal"
    why = _not_there(cell, reading, believed)
    if why is not None:
        cell.stop()
        return Missed(Failure.ELSEWHERE, f"{off}: {why}", moved=True, standing=reading)
    return Arrived(reading, f"{off}; the pose read back is used")


def look(
    cell: Cell,
    eye: Eye,
    label: str,
    digests: frozenset[str],
    timings: dict[str, float],
    predicted: Prediction | None,
) -> Seen | Missed:
    """Try to see a target through a camera, the arm being at rest.

    Parameters
    ----------
    cell, eye
        Where, and which camera and target.
    label
        Of the attempt.
    digests
        Of the images so far: a picture that comes again is no new picture.
    timings
        The seconds that each part took are added to it.
    predicted
        Where in the image the target should be.
    """
    started = time.monotonic()
    try:
        frame = checked_frame(cell.camera_calls.run(cell.timeouts.grab_s, eye.source.grab, label))
    except DeviceError as error:
        known = {"timeout": Failure.CAMERA_TIMEOUT, "busy": Failure.CAMERA_TIMEOUT}
        known |= {BAD_FRAME: Failure.BAD_IMAGE}
        return Missed(known.get(error.code, Failure.CAMERA_FAILED), error.message, moved=True)
    timings["grab"] = timings.get("grab", 0.0) + time.monotonic() - started
    started = time.monotonic()
    if frame.image is not None and frame.image.shape == eye.camera.size_px[::-1]:
        # A driver may write its next picture into the same buffer.
        frame = replace(frame, image=frame.image.copy())
    found = _look(eye, frame, digests, predicted)
    seen = None if isinstance(found, Missed) else found[0]
    cell.observer.looked(label, frame.image, seen, eye.name)
    timings["detect"] = timings.get("detect", 0.0) + time.monotonic() - started
    if isinstance(found, Missed):
        return found
    detection, digest = found
    sure = frame.points is not None and frame.points.labels_known
    return Seen(detection, frame.image, digest, frame.timestamp_s, sure)


def _go(cell: Cell, goal: Goal, believed: Believed | None) -> Reading | Missed:
    """See where the arm stands, check the way, go, and see where it stands then."""
    try:
        # A camera that still hangs would not see what comes; a robot that does must not be told anything new.
        cell.camera_calls.wait(cell.timeouts.grab_s)
    except DeviceError as error:
        return Missed(Failure.CAMERA_TIMEOUT, error.message, moved=False)
    try:
        before = cell.read()
    except DeviceError as error:
        return Missed(_robot_failure(error), error.message, moved=False)
    why = cell.objection(goal, before, believed)
    if why is not None:
        return Missed(Failure.MOTION_REFUSED, why, moved=False, standing=before)
    if cell.confirm is not None and not cell.confirm(goal):
        return Missed(Failure.NOT_CONFIRMED, "not confirmed", moved=False, standing=before)
    cell.observer.goes(goal)
    try:
        cell.robot_calls.run(cell.timeouts.move_s, cell.robot.move_to, goal)
    except DeviceError as error:
        return _after_failed_motion(cell, before, error)
    try:
        after = cell.read(goal.T_base_flange)
    except DeviceError as error:
        cell.stop()
        return Missed(_robot_failure(error), error.message, moved=True)
    if not is_near(before.T_base_flange, goal.T_base_flange, MOVED_M, MOVED_RAD) and is_near(
        before.T_base_flange, after.T_base_flange, STILL_M, STILL_RAD
    ):
        return Missed(
            Failure.NOT_MOVED,
            f"the robot reports success, but its pose is the one before, {_off(goal, after)} from the goal",
            moved=False,
            standing=after,
        )
    return after


def _after_failed_motion(cell: Cell, before: Reading, error: DeviceError) -> Missed:
    """Stop the arm, unless it only would not go, and see where it stands."""
    detail, refused = error.message, error.code == Code.MOTION_REFUSED
    if not refused:
        stopped = cell.stop()
        if stopped is not None:
            detail = f"{detail}; stop: {stopped}"
    try:
        # The call may come back only now, and is waited for: one command at a time.
        cell.robot_calls.wait(cell.timeouts.move_s)
        after = cell.read()
    except DeviceError as second:
        return Missed(Failure.ROBOT_FAILED, f"{detail}; then {second.message}", moved=True)
    moved = not is_near(before.T_base_flange, after.T_base_flange, STILL_M, STILL_RAD)
    failure = Failure.MOTION_REFUSED if refused else Failure.ROBOT_FAILED
    return Missed(failure, detail, moved=moved, standing=after)


def _robot_failure(error: DeviceError) -> Failure:
    return Failure.BAD_READING if error.code in {BAD_READING, Code.NO_JOINTS} else Failure.ROBOT_FAILED


def _not_there(cell: Cell, reading: Reading, believed: Believed | None) -> str | None:
    """Say what is wrong with where a motion ended, None for nothing."""
    if cell.workspace is None or cell.arm is None:
        return None
    if not cell.workspace.contains(reading.T_base_flange.translation):
        return "outside the workspace"
    if reading.joints_rad is None:
        return None
    body = body_of(cell.arm, cell.workspace, cell.solids, believed)
    return body.obstacles(np.array(reading.joints_rad)[np.newaxis])[0]


def _off(goal: Goal, reading: Reading) -> str:
    difference = goal.T_base_flange.inverse() @ reading.T_base_flange
    millimetres = 1e3 * float(np.linalg.norm(difference.translation))
    return f"{millimetres:.1f} mm and {np.rad2deg(difference.rotation_angle_rad):.2f} deg"


def _look(
    eye: Eye, frame: Frame, digests: frozenset[str], predicted: Prediction | None
) -> tuple[Detection, str] | Missed:
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
    width, height = eye.camera.size_px
    if image is None or image.shape != (height, width):
        shape = "none" if image is None else f"{image.shape[1]} x {image.shape[0]}"
        return Missed(
            Failure.BAD_IMAGE, f"an image of {shape} pixels, the camera has {width} x {height}", moved=True
        )
    digest = _digest(image.tobytes())
    if digest in digests:
        return Missed(Failure.STALE_IMAGE, "the same picture as before, bit for bit", moved=True)
    found = detect(image, eye.target, predicted=predicted)
    if isinstance(found, NotFound):
        failure = Failure.POOR_IMAGE if found.reason in _POOR else Failure.NOT_FOUND
        return Missed(failure, f"{found.evidence} ({found.reason})", moved=True, digest=digest)
    if len(found) < MIN_POINTS:
        return Missed(Failure.NOT_FOUND, f"only {len(found)} points of the target", moved=True, digest=digest)
    return found, digest


def _digest(content: bytes) -> str:
    return hashlib.blake2b(content, digest_size=16).hexdigest()
