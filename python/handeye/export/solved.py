"""The JSON of a solve as others need it, from the library or from a file."""

from typing import Annotated, Any

import msgspec

from handeye.types import Mounting

Rows = list[list[float]]


class _Rejected(msgspec.Struct):
    name: str
    reason: str = ""


class _Views(msgspec.Struct):
    used: list[str] = []
    rejected: list[_Rejected] = []
    rmse_px: dict[str, float] = {}


class Noise(msgspec.Struct):
    """The noise behind the answer."""

    pixel_sigma_px: float
    robot_side: str = "none"
    robot_translation_mm: float = 0.0
    robot_rotation_deg: float = 0.0
    how: str = ""
    evidence: dict[str, float] = {}


class _Finding(msgspec.Struct):
    code: str
    sentence: str
    evidence: dict[str, Any] = {}


class _Open(msgspec.Struct):
    sentence: str
    cure: str = ""


class TouchPoint(msgspec.Struct, forbid_unknown_fields=True):
    """A point of the box of work in the frame of the base, and within how much a touch lands there."""

    point_mm: Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
    radius_mm: float


class Touch(msgspec.Struct, forbid_unknown_fields=True):
    """How far off the tool lands over a box of work: radii with 95 % probability."""

    mean_mm: float
    worst_mm: float
    worst_at_mm: Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
    as_reported_mm: float
    box_mm: Rows
    box_stated: bool
    tool_mm: Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
    depth: str
    limits: dict[str, float]
    advice: str
    out_of_reach: int
    out_of_sight: int
    map: Annotated[list[TouchPoint], msgspec.Meta(min_length=1, max_length=1000)]
    probability: float = 0.95


class Solved(msgspec.Struct):
    """What `handeye solve` writes about one camera, as far as others need it; it has more.

    What only a report repeats may be missing: a transform can be exported without it.
    """

    mounting: Mounting
    covariance: Rows
    T_flange_camera: Rows | None = None
    T_base_camera: Rows | None = None
    T_base_target: Rows | None = None
    T_flange_target: Rows | None = None
    recording: str = ""
    source: str = ""
    views: _Views = msgspec.field(default_factory=_Views)
    warnings: list[str] = []
    unobservable: list[_Open] = []
    camera: dict[str, Any] | None = None
    camera_origin: str | None = None
    degrees_of_freedom: Annotated[float, msgspec.Meta(gt=0)] | None = None
    rmse_px: float | None = None
    noise: Noise | None = None
    model: str = ""
    start: str = ""
    ending: str = ""
    diagnosis: list[_Finding] = []
    touch: Touch | None = None
