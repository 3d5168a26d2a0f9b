"""ViSP's camera XML: camera {image_width, image_height, model {type, px, py, u0, v0, kud}}.

ViSP, `vpXmlParserCamera`; with distortion ``u = u0 + px x (1 + kud r^2)``, which is OpenCV's k1.
"""

from collections.abc import Mapping
from typing import cast

from handeye.codes import Code
from handeye.datasets.camera_files.base import (
    CameraFormat,
    Table,
    camera_of,
    number_at,
    pinhole_matrix,
    size_at,
)
from handeye.errors import InputError
from handeye.types import Camera


def _camera(document: Table) -> Table | None:
    camera = document.get("camera")
    return cast("Table", camera) if isinstance(camera, Mapping) and "model" in camera else None


def _recognises(document: Table) -> bool:
    return _camera(document) is not None


def _read(document: Table) -> Camera:
    camera = _camera(document) or {}
    # Of several models, with and without distortion, the last is the richest.
    models = camera.get("model")
    found = cast("list[object]", models) if isinstance(models, list) else [models]
    model = cast("Table", found[-1] if found and isinstance(found[-1], Mapping) else {})
    kind = str(model.get("type"))
    if not kind.startswith("perspectiveProjWith"):
        raise InputError(f"model type {kind[:60]!r}, expected perspectiveProjWith...", code=Code.UNKNOWN_LENS)
    matrix = pinhole_matrix(*(number_at(model, key) for key in ("px", "py", "u0", "v0")))
    k1 = number_at(model, "kud") if "WithDistortion" in kind else 0.0
    return camera_of(matrix, [k1, 0.0, 0.0, 0.0], size_at(camera, "image_width", "image_height"))


FORMAT = CameraFormat("a camera of ViSP", _recognises, _read)
