"""The answer of a calibration, and how it came about."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from handeye.types.arrays import FloatArray
from handeye.types.camera import Camera
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose
from handeye.types.touch import TouchMap
from handeye.types.units import MM_PER_M

# Order of the rows of every covariance of a twist.
TWIST_ORDER = ("tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")


class ModelName(StrEnum):
    """Which assumptions a solve makes."""

    AUTO = "auto"
    """Robot noise and camera parameters weighed by what the data say."""
    PAPER = "paper"
    """Robot poses and camera exact, as in Yang, Rebello and Waslander (2023)."""


class RobotSide(StrEnum):
    """Where the robot's error acts."""

    NONE = "none"
    FLANGE = "flange"
    BASE = "base"
    JOINTS = "joints"
    """In the positions of the joints; compared only where the arm's kinematics are known."""
    LINKS = "links"
    """In where the joints sit on the links; compared only where the arm's kinematics are known."""


@dataclass(frozen=True)
class Noise:
    """Noise levels that the answer rests on.

    Parameters
    ----------
    pixel_sigma_px
        Standard deviation of the pixels of each used view, in the order of the used views.
    robot_side
        Where the robot's error acts; `none` if its poses are taken as exact.
    robot_translation_m, robot_rotation_rad
        Standard deviation per axis of the robot's error; of the flange on average, if it acts in the joints
        or links.
    joint_rad
        Standard deviation of the position of each joint, if the error acts there.
    how
        How the levels were found, in one line.
    evidence
        Share of each side in the misfit that the robot explains; all of it at `none` where it is exact.
    pixel_shared
        Factor on the pixels' deviation as neighbouring points err alike; 1 if they do not.
    smooth_probability
        Share of what changes smoothly with the posture of an arm that is not described, not from view to
        view; the covariance counts it, and grows.
    """

    pixel_sigma_px: tuple[float, ...]
    robot_side: RobotSide = RobotSide.NONE
    robot_translation_m: float = 0.0
    robot_rotation_rad: float = 0.0
    how: str = ""
    evidence: dict[str, float] = field(default_factory=dict[str, float])
    joint_rad: float = 0.0
    smooth_probability: float = 0.0
    pixel_shared: float = 1.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, with units in the keys."""
        joints = {"joint_deg": float(np.rad2deg(self.joint_rad))} if self.joint_rad > 0 else {}
        return {
            **joints,
            "pixel_sigma_px": float(np.sqrt(np.mean(np.square(self.pixel_sigma_px)))),
            "pixel_sigma_per_view_px": list(self.pixel_sigma_px),
            "robot_side": self.robot_side.value,
            "robot_translation_mm": self.robot_translation_m * MM_PER_M,
            "robot_rotation_deg": float(np.rad2deg(self.robot_rotation_rad)),
            "how": self.how,
            "evidence": dict(self.evidence),
            "smooth_probability": self.smooth_probability,
            "pixel_shared": self.pixel_shared,
        }


@dataclass(frozen=True)
class JointOffset:
    """By how much a joint truly stands beyond where it is read, and how well that is known.

    Both in radians, in metres for a joint that slides.
    """

    joint: str
    offset: float
    sigma: float
    sliding: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, with units in the keys."""
        unit, factor = ("mm", MM_PER_M) if self.sliding else ("deg", float(np.rad2deg(1.0)))
        return {
            "joint": self.joint,
            f"offset_{unit}": self.offset * factor,
            f"sigma_{unit}": self.sigma * factor,
        }


@dataclass(frozen=True)
class LinkError:
    """How a joint truly sits on the link before it, relative to where the description has it.

    Parameters
    ----------
    joint
        Its name.
    twist
        Displacement (metres) and tilt (radians) in the frame of the joint.
    """

    joint: str
    twist: tuple[float, float, float, float, float, float]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, with units in the keys."""
        return {
            "joint": self.joint,
            "translation_mm": [MM_PER_M * value for value in self.twist[:3]],
            "rotation_deg": np.rad2deg(self.twist[3:]).tolist(),
        }


@dataclass(frozen=True, eq=False)
class ArmCorrection:
    """What puts the poses of a known arm right: see `Kinematics`.

    Parameters
    ----------
    joint_offsets
        (n,) by how much the joints stand beyond where they are read, radians and metres.
    displacements
        (m,) how the joints are displaced on their links, metres and radians.
    """

    joint_offsets: FloatArray
    displacements: FloatArray


@dataclass(frozen=True)
class Finding:
    """One thing that a diagnosis has to say: a stable code, a sentence, and the numbers behind it."""

    code: str
    sentence: str
    evidence: dict[str, Any] = field(default_factory=dict[str, Any])

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {"code": self.code, "sentence": self.sentence, "evidence": dict(self.evidence)}


@dataclass(frozen=True)
class Unobservable:
    """A direction that the views leave undetermined.

    `direction` is a unit vector over the twist of X and the twist of Y, metres and radians weighing alike.
    """

    sentence: str
    cure: str
    direction: tuple[float, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {"sentence": self.sentence, "cure": self.cure, "direction": list(self.direction)}


@dataclass(frozen=True)
class ViewResult:
    """One view at the answer."""

    name: str
    rmse_px: float
    used: bool = True
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Calibration:
    """X and Y of the chain with their uncertainty, and how they were found.

    Parameters
    ----------
    mounting
        Gives X and Y their names.
    X, Y
        Of the chain ``T_camera_target = X @ A @ Y``.
    camera
        The camera as used; updated where its parameters were free.
    covariance
        (6, 6) covariance of the hand-eye, in `TWIST_ORDER`: of the twist `xi` in ``X <- exp(xi) X``, which
        moves the camera by `-xi` in its own frame.
    information
        (n, n) information of all parameters, twist of X first, then of Y.
    rmse_px
        Root mean square over all points of all used views of the residual's norm.
    joint_offsets
        What was found of the offsets of the joints, where the arm's kinematics were given.
    link_errors
        How the joints most likely sit on their links, where the arm's kinematics were given and the views
        say so. The hand-eye is then that of the arm as it is, not of the poses as reported.
    arm_correction
        What puts the poses of a known arm right; None without one.
    degrees_of_freedom
        Degrees of freedom of the noise levels behind the covariance; infinite if they were given. Regions
        take quantiles of F(6, degrees of freedom) in place of chi-square.
    touch
        How far off the tool lands, where that was asked for.
    """

    mounting: Mounting
    X: Pose
    Y: Pose
    camera: Camera
    covariance: FloatArray
    information: FloatArray
    rmse_px: float
    ending: str
    iterations: int
    noise: Noise
    model: ModelName
    start: str
    views: tuple[ViewResult, ...]
    warnings: tuple[str, ...] = ()
    diagnosis: tuple[Finding, ...] = ()
    unobservable: tuple[Unobservable, ...] = ()
    degrees_of_freedom: float = float("inf")
    joint_offsets: tuple[JointOffset, ...] = ()
    link_errors: tuple[LinkError, ...] = ()
    arm_correction: ArmCorrection | None = None
    touch: TouchMap | None = None

    @property
    def results(self) -> dict[str, Pose]:
        """The pose of the camera (the inverse of X) and Y, under their names."""
        return self.mounting.results(self.X, self.Y)

    @property
    def sigma_translation_m(self) -> float:
        """Standard deviation of the camera's position: root of the sum of the three variances."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3])))

    @property
    def sigma_rotation_rad(self) -> float:
        """Standard deviation of the camera's rotation: root of the sum of the three variances."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))

    @property
    def used(self) -> tuple[str, ...]:
        """Names of the views that the answer rests on."""
        return tuple(view.name for view in self.views if view.used)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: stable keys, transforms row-major in metres, units in the keys."""
        deviations = np.sqrt(np.diag(self.covariance))
        offsets = [offset.to_dict() for offset in self.joint_offsets]
        links = [error.to_dict() for error in self.link_errors]
        return {
            **({"joint_offsets": offsets} if offsets else {}),
            **({"link_errors": links} if links else {}),
            **({} if self.touch is None else {"touch": self.touch.to_dict()}),
            "mounting": self.mounting.value,
            **{name: pose.to_list() for name, pose in self.results.items()},
            "rmse_px": self.rmse_px,
            "covariance": self.covariance.tolist(),
            "covariance_frame": "camera",
            "covariance_order": list(TWIST_ORDER),
            "sigma_translation_mm": self.sigma_translation_m * MM_PER_M,
            "sigma_rotation_deg": float(np.rad2deg(self.sigma_rotation_rad)),
            "sigma_translation_xyz_mm": (deviations[:3] * MM_PER_M).tolist(),
            "sigma_rotation_xyz_deg": np.rad2deg(deviations[3:]).tolist(),
            "degrees_of_freedom": None if np.isinf(self.degrees_of_freedom) else self.degrees_of_freedom,
            "views": {
                "used": [view.name for view in self.views if view.used],
                "rejected": [
                    {"name": view.name, "reason": view.reason} for view in self.views if not view.used
                ],
                "rmse_px": {view.name: view.rmse_px for view in self.views if np.isfinite(view.rmse_px)},
            },
            "ending": self.ending,
            "iterations": self.iterations,
            "model": self.model.value,
            "start": self.start,
            "noise": self.noise.to_dict(),
            "diagnosis": [finding.to_dict() for finding in self.diagnosis],
            "unobservable": [direction.to_dict() for direction in self.unobservable],
            "camera": self.camera.to_dict(),
            "warnings": list(self.warnings),
        }
