"""The JSON of a solve as a report needs it, from the library or from a file."""

from typing import Any

import msgspec


class _Rejected(msgspec.Struct):
    name: str
    reason: str = ""


class _Views(msgspec.Struct):
    used: list[str] = []
    rejected: list[_Rejected] = []
    rmse_px: dict[str, float] = {}


class _Noise(msgspec.Struct):
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
    """What `handeye solve` writes and a report repeats; it has more."""

    rmse_px: float
    noise: _Noise
    model: str
    start: str = ""
    ending: str = ""
    degrees_of_freedom: float | None = None
    views: _Views = msgspec.field(default_factory=_Views)
    diagnosis: list[_Finding] = []
    unobservable: list[_Open] = []
    camera: dict[str, Any] | None = None
    camera_origin: str | None = None
    source: str = ""
