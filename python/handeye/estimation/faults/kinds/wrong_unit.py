"""Lengths or angles in another unit than they were taken for."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from handeye.estimation.faults.kinds.base import Handling, Hypothesis, Kind, SharedFaultError, of_poses
from handeye.estimation.faults.kinds.numbers import DEGREES, TURNS, Numbers, angles_between, in_degrees
from handeye.estimation.faults.kinds.wrong_rotation import forms, words_of
from handeye.estimation.faults.scale import pitch_of, reach_of, scale_of
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.recording import Recording
from handeye.types.target import Target

KIND = Kind(
    "wrong_unit",
    "lengths or angles in another unit",
    "Positions of the robot in millimetres, centimetres or inches, the board's measures in millimetres, or "
    "angles in radians read as degrees or the other way round.",
    "Rotations agree, and robot and pictures differ by the factor of a unit; whichever then has an unusual "
    "size is blamed. Where both are in one wrong unit only their size shows it.",
    Handling.REFUSED,
    "Name the unit: `--unit`, or write metres.",
    "writes lengths in metres and angles as they were meant",
)
# Lengths that are taken for metres by mistake.
UNITS_M = {
    "millimetres": 1e-3,
    "centimetres": 1e-2,
    "decimetres": 1e-1,
    "inches": 0.0254,
    "feet": 0.3048,
    "kilometres": 1e3,
}
# A factor this near to that of a unit may be that unit.
UNIT_RANGE = 1.6
# Usual sizes: median distance of the flange from the base, and between neighbouring points of a target.
USUAL_REACH_M = (0.05, 10.0)
USUAL_PITCH_M = (1e-3, 0.6)
# No arm reaches so far and no board has such squares, at once.
ENORMOUS_REACH_M = 20.0
ENORMOUS_PITCH_M = 1.0
DEGREES_PER_RADIAN = 180 / math.pi


def check(measurements: Measurements) -> None:
    """Raise where robot and target are both so large that all lengths must be in another unit.

    They agree with each other then, so nothing else would show.
    """
    reach, pitch = reach_of(measurements), pitch_of(measurements.target)
    if reach > ENORMOUS_REACH_M and pitch > ENORMOUS_PITCH_M:
        raise SharedFaultError(
            f"the flange is {reach:.4g} m from the base and the points of the target {pitch:.4g} m apart: "
            "robot poses and target are in millimetres and were taken for metres",
            Hypothesis(
                KIND,
                "all_millimetres",
                "robot poses and target are in millimetres",
                "divide the translations of the robot poses and the measures of the target by 1000",
                _all_smaller,
            ),
        )


def _all_smaller(recording: Recording) -> Recording:
    return _smaller_poses(_larger_target(recording, 1e-3), 1e-3)


def hypotheses(measurements: Measurements) -> Iterator[Hypothesis]:
    """Yield the units that rotations and translations together ask for, and radians for degrees."""
    factor = scale_of(measurements)
    if factor is not None:
        for unit, metres in UNITS_M.items():
            yield from _of_unit(measurements, factor, unit, metres)
    for given in forms():
        yield of_poses(
            KIND,
            f"radians_{given.name}",
            f"the robot's {words_of(given)} are in radians and were read as degrees",
            "convert the angles, or name their unit",
            partial(Numbers(given).read_as, meant=given, factors=(DEGREES_PER_RADIAN,) * 3),
        )
    robot = np.array([view.T_base_flange.matrix for view in measurements.views])
    cameras = measurements.camera_poses[:, :3, :3]
    yield of_poses(
        KIND,
        "degrees",
        "the robot's rotation vectors are in degrees and were read as radians",
        "convert the angles, or name their unit",
        in_degrees(DEGREES, robot, angles_between(cameras, cameras)),
        log_prior=-len(robot) * math.log(len(TURNS)),
    )


def _of_unit(measurements: Measurements, factor: float, unit: str, metres: float) -> Iterator[Hypothesis]:
    # Lengths of the robot in millimetres say 1000 for 1 m: the target would have to be as much larger.
    reach, pitch = reach_of(measurements), pitch_of(measurements.target)
    if _is_near(factor, 1 / metres) and USUAL_REACH_M[0] <= reach * metres <= USUAL_REACH_M[1]:
        yield of_poses(
            KIND,
            f"robot_{unit}",
            f"the translations of the robot poses are in {unit} and were taken for metres",
            "divide the translations of the robot poses, or name their unit (--unit)",
            partial(_scaled, factor=metres),
        )
    if _is_near(factor, metres) and USUAL_PITCH_M[0] <= pitch * metres <= USUAL_PITCH_M[1]:
        yield Hypothesis(
            KIND,
            f"target_{unit}",
            f"the measures of the target are in {unit} and were taken for metres",
            "give the measures of the target in metres, as printed",
            partial(_larger_target, factor=metres),
            log_unit=3 * math.log(metres),
        )


def _is_near(factor: float, expected: float) -> bool:
    return abs(math.log(factor / expected)) < math.log(UNIT_RANGE)


def _scaled(poses: FloatArray, factor: float) -> FloatArray:
    changed = poses.copy()
    changed[:, :3, 3] *= factor
    return changed


def _smaller_poses(recording: Recording, factor: float) -> Recording:
    return of_poses(KIND, "", "", "", partial(_scaled, factor=factor)).change(recording)


def _larger_target(recording: Recording, factor: float) -> Recording:
    return replace(recording, target=larger(recording.target, factor))


def larger(target: Target, factor: float) -> Target:
    """Return a board with all its lengths times a factor."""
    lengths = [name for name in target.fields() if name.endswith("_m") and getattr(target, name) is not None]
    return target.changed(**{name: getattr(target, name) * factor for name in lengths})
