"""The closed loop with several cameras: one station at a time until all that is asked for is reached.

What happens next is a function of the stations on disk and the seed alone. A station is on disk before the
arm moves again: its corner files first, then `recording.toml` in one step. A run that was killed goes on
where it was.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import numpy as np

from handeye.datasets import holds_several, read_rig, write_rig
from handeye.datasets.recording_header import FILE_NAME
from handeye.datasets.rig_format import append_station
from handeye.errors import DegenerateError, HandeyeError, InputError
from handeye.estimation import RigEstimate, RigMeasurements, estimate_rig
from handeye.estimation.rig_checks import check_tied
from handeye.estimation.rig_labels import agree_on_labels
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.collisions import Body as ArmBody
from handeye.planning.prediction import Sight
from handeye.planning.rig import RigRequest, rig_gains
from handeye.robots import Arm, ArmKinematics
from handeye.robots.protocol import Goal, Reading, Robot
from handeye.types import CameraView, Pose, RigRecording, Station, View
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.kinematics import Kinematics

# What every camera sees when the arm stands still: camera, target, point ids (N,), pixels (N, 2).
Seen = tuple[str, str, IndexArray, FloatArray]
START_SPREAD_RAD, START_SHRINK = 0.2, 0.85
SPREAD_RAD = 0.25
# Candidates whose straight path is looked at.
MOST_PATHS = 24


class RigEndReason(StrEnum):
    """How a run ended."""

    ACCURACY_REACHED = "accuracy_reached"
    STATIONS_TAKEN = "stations_taken"
    TOO_MANY_FAILURES = "too_many_failures"


@dataclass(frozen=True)
class RigWish:
    """What a run is asked for.

    Parameters
    ----------
    request
        How accurate all cameras must be; None to take all stations.
    most_stations, fewest_stations
        Stop at so many in any case, and not before so many.
    candidates
        Postures drawn at every step.
    failures_in_a_row
        Stop after so many attempts that brought nothing.
    seed
        Of every choice by chance.
    """

    request: RigRequest | None = field(default_factory=RigRequest)
    most_stations: int = 30
    fewest_stations: int = 6
    candidates: int = 600
    failures_in_a_row: int = 20
    seed: int = 0


@dataclass(frozen=True, eq=False)
class RigWorld:
    """What a run drives: the arm, and a look through all cameras at rest.

    Parameters
    ----------
    robot, arm
        The driver, and the description of the arm.
    look
        Takes what every camera sees under a label; raises `DeviceError` where a camera fails.
    start_rad
        Where the arm stands first, seen by the cameras.
    body
        Judges postures: limits, the box of work, the arm itself.
    described
        Whether the estimate knows the arm.
    """

    robot: Robot
    arm: Arm
    look: Callable[[str], Sequence[Seen]]
    start_rad: FloatArray
    body: ArmBody
    described: bool = True

    @property
    def kinematics(self) -> Kinematics | None:
        """The arm as the estimate knows it."""
        return ArmKinematics(self.arm) if self.described else None


@dataclass(frozen=True, eq=False)
class RigEnd:
    """How a run ended, and what is believed."""

    reason: RigEndReason
    estimate: RigEstimate | None
    recording: RigRecording
    attempts: int


def open_or_create(folder: Path, empty: RigRecording) -> RigRecording:
    """Return the recording in a folder, which is created with no stations where there is none.

    Raises
    ------
    InputError
        The folder holds the recording of other cameras or targets.
    OutputError
        The system refuses to write.
    """
    if not (folder / FILE_NAME).is_file():
        write_rig(empty, folder)
        return empty
    if not holds_several(folder):
        raise InputError(f"{folder}: a recording of one camera", code="invalid_field")
    found = read_rig(folder).recording
    if (dict(found.cameras), dict(found.targets)) != (dict(empty.cameras), dict(empty.targets)):
        raise InputError(
            f"{folder}: a recording of other cameras or targets",
            code="other_cell",
            hint="go on with the same options, or give a new folder",
        )
    return found


def run_rig(
    world: RigWorld,
    wish: RigWish,
    recording: RigRecording,
    folder: Path | None = None,
    *,
    taken: Callable[[Station, RigEstimate | None], None] | None = None,
) -> RigEnd:
    """Take stations until the end.

    Parameters
    ----------
    world, wish
        What is driven, and what is asked for.
    recording
        The stations so far.
    folder
        Where every station is written before the arm moves again; None to keep nothing.
    taken
        Told of every station, with the estimate that it was chosen by.

    Raises
    ------
    OutputError
        The disk does not take a station.
    """
    attempts = failures = 0
    while True:
        count = len(recording)
        estimate = _estimate(recording, world)
        reason = _ended(wish, count, failures, estimate)
        if reason is not None:
            return RigEnd(reason, estimate, recording, attempts)
        label = f"station_{count + 1:02d}" + (f".{failures + 1}" if failures else "")
        goal = _goal(world, wish, recording, estimate, failures, label)
        attempts += 1
        try:
            world.robot.move_to(goal)
            reading = world.robot.read_pose()
            station = _station(f"station_{count + 1:02d}", reading, world.look(label))
        except HandeyeError:
            station = None
        except (OSError, RuntimeError):  # drivers raise what they like
            station = None
        except BaseException:
            world.robot.stop()
            raise
        if station is None:
            failures += 1
            continue
        recording = recording.with_stations([*recording.stations, station])
        if folder is not None:
            append_station(recording, folder)
        failures = 0
        if taken is not None:
            taken(station, estimate)


def _ended(wish: RigWish, count: int, failures: int, estimate: RigEstimate | None) -> RigEndReason | None:
    if (
        wish.request is not None
        and estimate is not None
        and estimate.determined
        and count >= wish.fewest_stations
        and not wish.request.missing(estimate)
    ):
        return RigEndReason.ACCURACY_REACHED
    if count >= wish.most_stations:
        return RigEndReason.STATIONS_TAKEN
    return RigEndReason.TOO_MANY_FAILURES if failures >= wish.failures_in_a_row else None


def _estimate(recording: RigRecording, world: RigWorld) -> RigEstimate | None:
    """Return what is believed; None while the stations do not say enough of every camera."""
    if not recording.stations:
        return None
    measurements = agree_on_labels(RigMeasurements.of(recording))
    try:
        check_tied(measurements)
        return estimate_rig(measurements, world.kinematics)
    except (InputError, DegenerateError):
        return None


def _goal(
    world: RigWorld,
    wish: RigWish,
    recording: RigRecording,
    estimate: RigEstimate | None,
    failures: int,
    label: str,
) -> Goal:
    """Turn a little about the start at first, then go where most is learnt of what is still missing."""
    random = np.random.default_rng([wish.seed, len(recording), failures])
    if estimate is None or not estimate.determined:
        # Nearer to the start after each turn that lost the boards.
        spread = START_SPREAD_RAD * START_SHRINK**failures if len(recording) or failures else 0.0
        drawn = _free(world, world.start_rad + spread * random.standard_normal((40, len(world.start_rad))))
        return _goal_of(world, drawn[0] if len(drawn) else world.start_rad, label)
    known = np.array([station.joints_rad for station in recording.stations])
    around = known[random.integers(0, len(known), wish.candidates)]
    joints = _free(world, around + SPREAD_RAD * random.standard_normal(around.shape))
    poses = world.arm.forward(joints)
    pool = Pool(
        tuple(
            Candidate(f"candidate_{k}", Pose(pose), tuple(q))
            for k, (pose, q) in enumerate(zip(poses, joints.tolist(), strict=True))
        )
    )
    missing = {} if wish.request is None else wish.request.missing(estimate)
    found = rig_gains(estimate, pool, missing, Sight(margin_px=25.0))
    ranked = np.argsort(-np.nan_to_num(found.gains, nan=-1.0), kind="stable")[:MOST_PATHS]
    standing = known[-1]
    reached = [int(i) for i in ranked if world.body.obstacle_on_path(standing, joints[i]) is None]
    if not reached:
        return _goal_of(world, standing, label)
    # After a failure the next best: the same place would most likely fail alike.
    return _goal_of(world, joints[reached[min(failures, len(reached) - 1)]], label)


def _free(world: RigWorld, joints: FloatArray) -> FloatArray:
    """Return the postures (M, n) of these (N, n) that the arm may take."""
    inside = joints[[world.arm.within_limits(q) for q in joints]]
    free = [why is None for why in world.body.obstacles(inside)] if len(inside) else []
    return inside[np.array(free, dtype=bool)]


def _goal_of(world: RigWorld, joints: FloatArray, label: str) -> Goal:
    return Goal(label, Pose(world.arm.forward(joints)), tuple(joints.tolist()))


def _station(name: str, reading: Reading, seen: Sequence[Seen]) -> Station | None:
    """Return the station of what was seen, None if that is nothing."""
    views = tuple(
        CameraView(
            camera,
            target,
            View(name, reading.T_base_flange, ids, pixels, joints_rad=reading.joints_rad),
        )
        for camera, target, ids, pixels in seen
    )
    return Station(views) if views else None
