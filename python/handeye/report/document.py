"""The numbers of a report: one JSON object whose schema is published.

Lengths in millimetres and angles in degrees, as people read them; the unit is in the key. Matrices named
`T_...` are in metres. What has no value is null.
"""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from handeye.export.solved import Touch

FORMAT = "handeye-report"
VERSION = 1

Rows4 = Annotated[list[list[float]], Meta(description="4 x 4 by rows, translation in metres")]
Vector = Annotated[list[float], Meta(min_length=3, max_length=3)]


class Part(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """Base of the parts of a report."""


class Within(Part):
    """Radii within which the error lies with 95 % probability."""

    translation_mm: float
    rotation_deg: float


class PositionAxis(Part):
    """One principal axis of the region that holds the camera's position with 95 % probability."""

    half_length_mm: float
    direction_in_parent: Vector
    direction_in_camera: Vector
    words: str


class RotationAxis(Part):
    """One principal axis of the region that holds the camera's rotation with 95 % probability."""

    half_angle_deg: float
    direction_in_parent: Vector
    direction_in_camera: Vector
    words: str


class AtPoint(Part):
    """What the uncertainty means for a point on the optical axis."""

    distance_mm: float
    within_95_mm: float
    words: str


class Answer(Part):
    """Where the camera is."""

    parent: Annotated[str, Meta(description="flange or base: the frame that the camera is fixed to")]
    T_parent_camera: Rows4
    position_mm: Vector
    sigma_along_parent_axes_mm: Vector
    quaternion_xyzw: Annotated[list[float], Meta(min_length=4, max_length=4)]
    roll_pitch_yaw_deg: Annotated[Vector, Meta(description="about fixed axes, as in URDF")]
    target_parent: str
    T_fixed_target: Rows4
    sigma_translation_mm: float
    sigma_rotation_deg: float
    within_95: Within
    position_axes: list[PositionAxis]
    rotation_axes: list[RotationAxis]
    points: list[AtPoint]
    covariance: Annotated[
        list[list[float]], Meta(description="6 x 6 of the twist in the camera frame, metres and radians")
    ]
    degrees_of_freedom: float | None = None


class Request(Part):
    """What was asked for, and whether it was met."""

    translation_mm: float
    rotation_deg: float
    met: bool


class NoiseLevels(Part):
    """Noise levels that the answer rests on."""

    pixel_sigma_px: float
    robot_side: str
    robot_translation_mm: float
    robot_rotation_deg: float
    how: str
    evidence: dict[str, float]


class Said(Part):
    """A finding in words, with the numbers behind it."""

    code: str
    sentence: str
    advice: str
    evidence: dict[str, Any]


class Open(Part):
    """A direction that the views leave open."""

    sentence: str
    cure: str


class ViewLine(Part):
    """One view; what only the images and poses can tell is null where the report was made from a result."""

    name: str
    used: bool
    reason: str
    points: int | None = None
    rmse_px: Annotated[
        float | None,
        Meta(description="with the robot's pose as reported, put right by what was found of a known arm"),
    ] = None
    own_rmse_px: Annotated[float | None, Meta(description="with the pose that fits this image best")] = None
    robot_off_mm: Annotated[
        float | None,
        Meta(description="most probable error of the robot's pose; null where its poses are taken as exact"),
    ] = None
    robot_off_deg: float | None = None
    distance_mm: float | None = None
    tilt_deg: Annotated[float | None, Meta(description="0 is seen straight on")] = None


class CurvePoint(Part):
    """What would have been known after so many views."""

    views: int
    within_95: Within


class Attempt(Part):
    """An attempt of a session that brought no view."""

    label: str
    failure: str
    detail: str


class Recipe(Part):
    """How to get the same again."""

    command: str
    handeye_version: str
    python: str
    packages: dict[str, str]
    recording_sha256: str | None = None
    made: Annotated[str | None, Meta(description="time, ISO 8601")] = None


class Report(Part):
    """All numbers of a report."""

    format: Annotated[str, Meta(pattern=f"^{FORMAT}$")]
    version: Annotated[int, Meta(ge=1)]
    recording: str
    source: str
    mounting: str
    model: str
    target: dict[str, Any] | None
    camera: dict[str, Any] | None
    camera_origin: str | None
    answer: Answer
    request: Request | None
    true_error: Annotated[
        Within | None, Meta(description="how far off the answer is, where a simulation knows the truth")
    ]
    touch: Annotated[Touch | None, Meta(description="how far off the tool lands; null where nobody can say")]
    noise: NoiseLevels
    start: str
    ending: str
    rmse_px: float
    diagnosis: list[Said]
    unobservable: list[Open]
    warnings: list[str]
    views: list[ViewLine]
    curve: list[CurvePoint]
    attempts: list[Attempt]
    exports: Annotated[dict[str, str], Meta(description="the transform in the formats of others, by name")]
    recipe: Recipe


def to_dict(report: Report) -> dict[str, Any]:
    """Return plain values for JSON."""
    return msgspec.to_builtins(report)


def from_dict(data: object) -> Report:
    """Read what `to_dict` wrote.

    Raises
    ------
    msgspec.ValidationError
        It does not fit the schema.
    """
    return msgspec.convert(data, Report)


def schema() -> dict[str, Any]:
    """Return the JSON schema of a report."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Report of a hand-eye calibration by handeye",
        **msgspec.json.schema(Report),
    }
