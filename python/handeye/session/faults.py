"""Drivers that fail on purpose, to see what becomes of a session."""

import zlib
from dataclasses import dataclass

import cv2
import numpy as np

from handeye.cameras.protocol import Frame, ImageSource, Points
from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.robots.protocol import Goal, Reading, Robot


@dataclass(frozen=True)
class FaultRates:
    """Share of the attempts that each fault befalls, 0 to 1.

    Parameters
    ----------
    refused
        The robot will not go there.
    robot_dies
        The driver raises something of its own.
    off_target
        The motion ends a few centimetres from the goal, and the robot says so.
    not_found, blurred, overexposed
        Of the picture.
    camera_hangs, camera_fails, garbage, stale
        The camera does not answer in time (said at once: simulated cells have no clock), raises, returns
        noise, or returns the last picture again.

    Raises
    ------
    InputError
        A rate outside 0 to 1.
    """

    refused: float = 0.0
    robot_dies: float = 0.0
    off_target: float = 0.0
    not_found: float = 0.0
    blurred: float = 0.0
    overexposed: float = 0.0
    camera_hangs: float = 0.0
    camera_fails: float = 0.0
    garbage: float = 0.0
    stale: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 <= value <= 1:
                raise InputError(f"{name} {value}, expected 0 to 1", code=Code.OUT_OF_RANGE)


class FaultyRobot:
    """A robot that fails at random, always alike for the same seed and label."""

    def __init__(self, robot: Robot, rates: FaultRates, seed: int) -> None:
        self._robot = robot
        self._rates = rates
        self._seed = seed

    def move_to(self, goal: Goal) -> None:
        """Go there, or not."""
        random = _chance(self._seed, 5, goal.label)
        if random.uniform() < self._rates.refused:
            raise DeviceError(f"{goal.label}: protective stop", code=Code.MOTION_REFUSED)
        if random.uniform() < self._rates.robot_dies:
            raise ConnectionResetError("connection reset by peer")
        if random.uniform() < self._rates.off_target and goal.joints_rad is not None:
            off = np.array(goal.joints_rad) + 0.02 * random.uniform(-1, 1, len(goal.joints_rad))
            goal = Goal(goal.label, goal.T_base_flange, tuple(off.tolist()), goal.speed_rad_s)
        self._robot.move_to(goal)

    def read_pose(self) -> Reading:
        """Say where it is."""
        return self._robot.read_pose()

    def stop(self) -> None:
        """Stop."""
        self._robot.stop()


class FaultyCamera:
    """A camera that fails at random, always alike for the same seed and label."""

    def __init__(self, source: ImageSource, rates: FaultRates, seed: int) -> None:
        self._source = source
        self._rates = rates
        self._seed = seed
        self._last: Frame | None = None

    def grab(self, label: str) -> Frame:
        """Take a picture, or something like it."""
        rates, random = self._rates, _chance(self._seed, 6, label)
        if random.uniform() < rates.camera_hangs:
            raise DeviceError(f"{label}: no answer in time", code=Code.TIMEOUT)
        if random.uniform() < rates.camera_fails:
            raise RuntimeError("grab failed (-1)")
        if random.uniform() < rates.stale and self._last is not None:
            return self._last
        frame = self._source.grab(label)
        self._last = frame
        if frame.image is None:
            return _spoilt_points(frame, rates, random)
        image = frame.image
        if random.uniform() < rates.garbage:
            image = random.integers(0, 256, image.shape, dtype=np.uint8)
        elif random.uniform() < rates.not_found:
            image = np.full_like(image, 120)
            image[::7, ::5] = 90
        elif random.uniform() < rates.blurred:
            image = np.asarray(cv2.GaussianBlur(image, (0, 0), 25.0), dtype=np.uint8)
        elif random.uniform() < rates.overexposed:
            image = np.clip(image.astype(np.float64) * 6, 0, 255).astype(np.uint8)
        return Frame(image, None, frame.timestamp_s)


def _spoilt_points(frame: Frame, rates: FaultRates, random: np.random.Generator) -> Frame:
    points = frame.points
    if points is None:
        return frame
    if random.uniform() < rates.garbage:
        pixels = points.pixels[random.permutation(len(points.pixels))]
        return Frame(None, Points(points.point_ids, pixels), frame.timestamp_s)
    if random.uniform() < max(rates.not_found, rates.blurred, rates.overexposed):
        return Frame(None, Points(points.point_ids[:0], points.pixels[:0]), frame.timestamp_s)
    return frame


def _chance(seed: int, stream: int, label: str) -> np.random.Generator:
    return np.random.default_rng([seed, stream, zlib.crc32(label.encode())])
