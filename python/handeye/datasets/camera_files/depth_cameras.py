"""Intrinsics of depth cameras as JSON.

RealSense (librealsense, `rs2_intrinsics`): width, height, ppx, ppy, fx, fy, model, coeffs. Open3D
(`PinholeCameraIntrinsic`): width, height, intrinsic_matrix with nine numbers by columns, no distortion.
"""

from handeye.datasets.camera_files.base import (
    CameraFormat,
    Table,
    camera_of,
    number_at,
    numbers_at,
    pinhole_matrix,
    size_at,
    square,
)
from handeye.types import Camera


def _is_realsense(document: Table) -> bool:
    return {"width", "height", "ppx", "ppy", "fx", "fy"} <= set(document)


def _read_realsense(document: Table) -> Camera:
    matrix = pinhole_matrix(*(number_at(document, key) for key in ("fx", "fy", "ppx", "ppy")))
    coefficients = numbers_at(document, "coeffs") if "coeffs" in document else []
    model = str(document.get("model", "brown_conrady")).rsplit(".", maxsplit=1)[-1].lower()
    model = "brown_conrady" if model == "none" else model
    return camera_of(matrix, coefficients, size_at(document, "width", "height"), model)


def _is_open3d(document: Table) -> bool:
    return {"width", "height", "intrinsic_matrix"} <= set(document)


def _read_open3d(document: Table) -> Camera:
    matrix = square(numbers_at(document, "intrinsic_matrix"), "intrinsic_matrix")
    # By columns as Open3D writes it; a matrix written by rows has the principal point on the right.
    by_rows = matrix[2, 0] == 0 and matrix[2, 1] == 0
    return camera_of(matrix if by_rows else matrix.T, [], size_at(document, "width", "height"))


REALSENSE = CameraFormat("intrinsics of RealSense", _is_realsense, _read_realsense)
OPEN3D = CameraFormat("intrinsics of Open3D", _is_open3d, _read_open3d)
