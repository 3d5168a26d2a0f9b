"""Kalibr's camchain: cam0: {camera_model, intrinsics, distortion_model, distortion_coeffs, resolution}.

Kalibr wiki, "YAML formats": pinhole has fu, fv, pu, pv; radtan has k1, k2, r1, r2, which are OpenCV's k1, k2,
p1, p2; equi is OpenCV's fisheye.
"""

from handeye.codes import Code
from handeye.datasets.camera_files.base import (
    CameraFormat,
    Table,
    camera_of,
    numbers_at,
    pinhole_matrix,
    size_at,
    table_at,
)
from handeye.errors import InputError
from handeye.types import Camera

_MODELS = {"radtan": "plumb_bob", "equidistant": "equidistant", "equi": "equidistant", "none": "plumb_bob"}


def _recognises(document: Table) -> bool:
    return "cam0" in document


def _read(document: Table) -> Camera:
    names = _names(document)
    if len(names) > 1:
        raise InputError(
            f"{len(names)} cameras ({', '.join(names)[:100]}), expected one",
            code=Code.SEVERAL_CAMERAS,
            hint="keep the camera that took the pictures, under the name cam0",
        )
    return _camera(document, "cam0")


def cameras_of(document: Table) -> dict[str, Camera]:
    """Return the cameras of a chain by their names; empty where the document is none.

    Raises
    ------
    InputError
        A camera that cannot be read.
    """
    return {name: _camera(document, name) for name in _names(document)} if _recognises(document) else {}


def _names(document: Table) -> list[str]:
    return [key for key in document if key.startswith("cam")]


def _camera(document: Table, name: str) -> Camera:
    camera = table_at(document, name)
    kind, lens = camera.get("camera_model"), camera.get("distortion_model")
    if kind != "pinhole" or not isinstance(lens, str) or lens not in _MODELS:
        raise InputError(
            f"{name}: {str(kind)[:40]}-{str(lens)[:40]}, expected pinhole-radtan, pinhole-equi or "
            "pinhole-none",
            code=Code.UNKNOWN_LENS,
        )
    intrinsics = numbers_at(camera, "intrinsics")
    if len(intrinsics) != 4:
        raise InputError(f"intrinsics: {len(intrinsics)} numbers, expected 4", code=Code.WRONG_SHAPE)
    fx, fy, cx, cy = intrinsics
    size = numbers_at(camera, "resolution")
    if len(size) != 2:
        raise InputError(f"resolution: {len(size)} numbers, expected 2", code=Code.WRONG_SHAPE)
    pair = size_at({"width": size[0], "height": size[1]}, "width", "height")
    coefficients = [] if lens == "none" else numbers_at(camera, "distortion_coeffs")
    return camera_of(pinhole_matrix(fx, fy, cx, cy), coefficients, pair, _MODELS[lens])


FORMAT = CameraFormat("a camchain of Kalibr", _recognises, _read)
