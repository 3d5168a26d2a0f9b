"""How far the calibration of several cameras holds: halves of the stations compared, and with the truth.

Stations are split, not views: the robot's error is shared by the views of a station, so halves that shared
one would agree too well.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import DegenerateError, InputError, SolveError
from handeye.estimation import RigCalibration, solve_rig
from handeye.types import Pose, RigRecording
from handeye.types.arrays import FloatArray
from handeye.types.kinematics import Kinematics
from handeye.validation import metrics

# Fewer stations in a half determine nothing.
FEWEST_STATIONS = 6
Stated = tuple[Pose, FloatArray]


@dataclass(frozen=True)
class RigDifference:
    """How two answers for one transform differ, and their NEES by their covariances."""

    translation_mm: float
    rotation_deg: float
    nees_per_dof: float

    def to_dict(self) -> dict[str, float]:
        """Return plain values for JSON."""
        return dict(vars(self))


@dataclass(frozen=True, eq=False)
class RigValidation:
    """What halves of the stations say of every transform, by name: a camera, or `T_left_right`.

    Parameters
    ----------
    calibration
        From all stations.
    halves
        Differences of the halves that both determine the answer.
    truth
        Error against the truth, where the recording knows it.
    splits, undetermined
        Number of halvings, and of those of which a half did not determine the answer.
    """

    calibration: RigCalibration
    halves: Mapping[str, tuple[RigDifference, ...]]
    truth: Mapping[str, RigDifference]
    splits: int
    undetermined: int

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: the same keys for every camera, and for cameras in each other."""
        of_camera = self.calibration.estimate.of_camera
        between = self.calibration.camera_to_camera
        stated = {name: of_camera(name).within_95 for name in self.calibration.cameras}
        stated |= {f"T_{a}_{b}": one.within_95 for (a, b), one in between.items()}
        told = {
            name: {
                "within_95": radii.to_dict(),
                "halves": None if not self.halves[name] else _means(self.halves[name]).to_dict(),
                "truth": self.truth[name].to_dict() if name in self.truth else None,
            }
            for name, radii in stated.items()
        }
        return {
            "splits": self.splits,
            "undetermined": self.undetermined,
            "cameras": {name: told[name] for name in self.calibration.cameras},
            "camera_to_camera": {n: one for n, one in told.items() if n not in self.calibration.cameras},
        }


def _means(found: tuple[RigDifference, ...]) -> RigDifference:
    return RigDifference(
        *(
            float(np.mean([getattr(one, name) for one in found]))
            for name in ("translation_mm", "rotation_deg", "nees_per_dof")
        )
    )


def validate_rig(
    recording: RigRecording, *, splits: int = 20, seed: int = 0, kinematics: Kinematics | None = None
) -> RigValidation:
    """Calibrate random halves of the stations and compare them.

    Parameters
    ----------
    recording
        At least twelve stations.
    splits
        Number of random halvings.
    seed
        Of the halvings.
    kinematics
        As for `handeye.estimation.solve_rig`.

    Raises
    ------
    InputError
        Too few stations.
    DegenerateError, SolveError
        As for `handeye.estimation.solve_rig`.
    """
    count = len(recording)
    if count < 2 * FEWEST_STATIONS:
        raise InputError(
            f"{count} stations, at least {2 * FEWEST_STATIONS} are needed to compare halves",
            code=Code.TOO_FEW_VIEWS,
            hint="take more stations",
        )
    random = np.random.default_rng(seed)
    whole = solve_rig(recording, kinematics=kinematics)
    names = list(_answers(whole))
    differences: dict[str, list[RigDifference]] = {name: [] for name in names}
    undetermined = 0
    for _ in range(splits):
        order: list[int] = random.permutation(count).tolist()
        try:
            one, other = (
                _answers(solve_rig(_part(recording, half), kinematics=kinematics))
                for half in (order[: count // 2], order[count // 2 :])
            )
        except (InputError, DegenerateError, SolveError):
            undetermined += 1
            continue
        for name in names:
            (X, first), (again, second) = one[name], other[name]
            differences[name].append(_difference(X, first + second, again))
    return RigValidation(
        whole,
        {name: tuple(found) for name, found in differences.items()},
        _against_truth(recording, _answers(whole)),
        splits,
        undetermined,
    )


def _part(recording: RigRecording, numbers: list[int]) -> RigRecording:
    return recording.with_stations(recording.stations[i] for i in sorted(numbers))


def _answers(calibration: RigCalibration) -> dict[str, Stated]:
    """Return pose and covariance of every transform."""
    estimates = {name: calibration.estimate.of_camera(name) for name in calibration.cameras}
    cameras = {name: (one.X, one.hand_eye_covariance) for name, one in estimates.items()}
    between = {
        f"T_{a}_{b}": (one.pose, one.covariance) for (a, b), one in calibration.camera_to_camera.items()
    }
    return {**cameras, **between}


def _difference(found: Pose, covariance: FloatArray, other: Pose) -> RigDifference:
    error = metrics.absolute_error(found, other)
    return RigDifference(error.translation_mm, error.rotation_deg, metrics.nees(found, covariance, other) / 6)


def _against_truth(recording: RigRecording, answers: Mapping[str, Stated]) -> dict[str, RigDifference]:
    if recording.truth is None:
        return {}
    true = dict(recording.truth.cameras)
    true |= {
        f"T_{a}_{b}": true[a] @ true[b].inverse()
        for a, b in recording.rigid_pairs()
        if a in true and b in true
    }
    return {name: _difference(*answers[name], pose) for name, pose in true.items() if name in answers}
