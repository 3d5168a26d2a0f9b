"""Everything that was asked for, as it is written into a session."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from enum import StrEnum
from typing import Any, cast

import msgspec
import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.height import Height
from handeye.estimation.work import Work
from handeye.planning.collisions import Workspace
from handeye.planning.constraints import ViewLimits
from handeye.planning.policies import make_policy
from handeye.robots import Arm
from handeye.robots.simulated import ArmErrors
from handeye.session.attempt import Timeouts
from handeye.session.drivers import MANUAL, REPLAY
from handeye.session.faults import FaultRates
from handeye.session.simulated import ORDINARY, usual_errors
from handeye.session.starting import Start
from handeye.session.wish import Wish
from handeye.types import Mounting, Pose, View
from handeye.types.calibration import ModelName
from handeye.types.plain import read_document

SIMULATED = "simulated"


class Collisions(StrEnum):
    """By what it is judged whether the links of an arm touch one another."""

    AUTO = "auto"
    """Their shapes where the description and the extra `meshes` have them, capsules otherwise."""
    MESHES = "meshes"
    CAPSULES = "capsules"


@dataclass(frozen=True)
class Simulation:
    """What is wrong in a simulated cell, in the units of `ArmErrors` and `Appearance`."""

    errors: ArmErrors = field(default_factory=usual_errors)
    faults: FaultRates | None = None
    blur_px: float = 0.6
    pixel_noise: float = 2.0
    occluded_share: float = 0.0
    points_only: float | None = None
    camera_error: float = 1.0
    lens: str = ORDINARY
    focal_px: float | None = None


@dataclass(frozen=True)
class RigSettings:
    """A run with several cameras.

    Parameters
    ----------
    cameras
        Those that take part; None for all.
    camera_to_camera
        Radii (mm, deg) for cameras of one body in each other; None if they are not asked for.
    candidates
        Postures drawn at every step.
    images
        Where the pictures of each camera come from, by its name; None for a simulated rig.
    """

    cameras: tuple[str, ...] | None = None
    camera_to_camera: tuple[float, float] | None = None
    candidates: int = 600
    images: dict[str, str] | None = None


@dataclass(frozen=True)
class Configuration:
    """A run, in plain values.

    Parameters
    ----------
    robot
        Name of a shipped arm, or a URDF file; None for a replay of an arm that is not known.
    driver, images
        Specifications of the drivers, see `handeye.session.drivers`.
    workspace_m
        Corners of the box that no motion may leave; None only for a simulated cell.
    collisions
        What links are judged by; once a session has begun it is no longer `auto`.
    camera_known
        Whether the camera is calibrated; if not, the views teach it too.
    lens
        Of a camera that is not; None to have the views choose.
    accuracy_px
        How well such a camera is to be known, see `Wish`.
    touch_mm, work
        Touch error to reach in place of the accuracy, and what is seen and touched.
    height
        Of the target, as measured, for an arm that turns about one axis only.
    rig
        What there is to say of several cameras; None for one.
    anyway
        Go on although the accuracy is out of reach, see `Wish`.
    """

    robot: str | None
    _: KW_ONLY
    driver: str = SIMULATED
    images: str = SIMULATED
    mounting: Mounting = Mounting.EYE_IN_HAND
    accuracy_mm: float | None = 0.5
    accuracy_deg: float | None = 0.05
    most_views: int = 20
    seed: int = 0
    model: ModelName = ModelName.AUTO
    policy: str = "next_best_view"
    speed_rad_s: float = 0.5
    failures_in_a_row: int = 10
    joints_err: bool = True
    refine: bool = True
    workspace_m: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    floor_m: float = 0.0
    collisions: Collisions = Collisions.AUTO
    limits: ViewLimits = field(default_factory=ViewLimits)
    timeouts: Timeouts = field(default_factory=Timeouts)
    camera_known: bool = True
    lens: str | None = None
    accuracy_px: float = 1.0
    simulation: Simulation = field(default_factory=Simulation)
    touch_mm: float | None = None
    work: Work = field(default_factory=Work)
    rig: RigSettings | None = None
    anyway: bool = False
    height: Height | None = None

    @property
    def is_simulated(self) -> bool:
        """Whether nothing moves."""
        return self.driver == SIMULATED

    @property
    def by_hand(self) -> bool:
        """Whether a person moves the arm."""
        return self.driver.partition(":")[0] == MANUAL

    @property
    def is_replay(self) -> bool:
        """Whether a recording is gone through again."""
        return self.driver.partition(":")[0] == REPLAY

    def wish(self) -> Wish:
        """Return what is asked for."""
        return Wish(
            self.accuracy_mm,
            self.accuracy_deg,
            self.most_views,
            self.seed,
            ModelName(self.model),
            self.failures_in_a_row,
            speed_rad_s=self.speed_rad_s,
            joints_err=self.joints_err,
            refine=self.refine,
            policy=make_policy(self.policy),
            accuracy_px=None if self.camera_known else self.accuracy_px,
            touch_mm=self.touch_mm,
            work=self.work,
            camera_to_camera=None if self.rig is None else self.rig.camera_to_camera,
            anyway=self.anyway,
            height=self.height,
        )

    def workspace(self) -> Workspace:
        """Return the stated workspace.

        Raises
        ------
        InputError
            None is stated.
        """
        if self.workspace_m is None:
            raise InputError(
                "no workspace is stated, and without one nothing moves",
                code=Code.NO_WORKSPACE,
                hint="state the box that the flange may move in, in the frame of the robot's base",
            )
        lower, upper = self.workspace_m
        return Workspace(np.array(lower), np.array(upper), self.floor_m)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON; `from_dict` reads them back."""
        return msgspec.to_builtins(self, enc_hook=_number)

    @classmethod
    def from_dict(cls, data: object) -> "Configuration":
        """Read what `to_dict` wrote.

        Raises
        ------
        InputError
            A missing or unusable field.
        """
        values = data
        if isinstance(values, dict) and "patience" in values:
            # As sessions of earlier versions call it.
            document = dict(cast("dict[str, Any]", values))
            document["timeouts"] = document.pop("patience")
            return read_document(document, cls, "settings")
        return read_document(data, cls, "settings")


def _number(value: object) -> object:
    """Return a number of numpy as one of Python."""
    if isinstance(value, np.generic):
        return cast("float | int", value.item())
    raise NotImplementedError(type(value).__name__)


def settings_of(configuration: Configuration, start: Start | None) -> dict[str, Any]:
    """Return plain values of what was asked for and of where the arm stands, see `read_start`."""
    settings: dict[str, Any] = {"configuration": configuration.to_dict()}
    if start is not None:
        settings["start"] = {
            "T_base_flange": start.T_base_flange.to_list(),
            "joints_rad": list(start.joints_rad),
            "posture_known": start.posture_known,
        }
    return settings


def read_start(settings: Mapping[str, Any]) -> Start:
    """Return where the arm stood when a session began.

    Raises
    ------
    InputError
        The settings do not say.
    """
    document = read_document(settings.get("start"), _StartDocument, "settings: start")
    return Start(Pose(document.T_base_flange), tuple(document.joints_rad), document.posture_known)


@dataclass(frozen=True)
class _StartDocument:
    T_base_flange: list[list[float]]
    joints_rad: list[float]
    posture_known: bool = True


def fingerprints(arm: Arm | None, recorded: Sequence[View] | None) -> dict[str, str]:
    """Return checksums of what the settings only name: the arm's description, the recording of a replay."""
    found: dict[str, str] = {}
    if arm is not None:
        found["arm"] = arm.fingerprint
    if recorded is not None:
        content = msgspec.json.encode([view.to_dict() for view in recorded])
        found["recorded"] = hashlib.blake2b(content, digest_size=16).hexdigest()
    return found


def check_fingerprints(settings: Mapping[str, Any], found: Mapping[str, str]) -> None:
    """Refuse to go on with another arm or recording than the session began with.

    Raises
    ------
    InputError
        It is another.
    """
    words = {"arm": "the description of the arm", "recorded": "the recording that is replayed"}
    for name, fingerprint in found.items():
        # Sessions of version 1 do not say.
        if settings.get(name, fingerprint) != fingerprint:
            raise InputError(
                f"{words[name]} is not what it was when the session began",
                code=Code.SETTINGS_CHANGED,
                hint="undo the change, or begin a new session",
            )
