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
