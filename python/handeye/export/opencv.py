"""YAML for OpenCV's `cv::FileStorage`: both transforms as 4 x 4 matrices in metres, and the camera."""

from collections.abc import Sequence

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.export.base import Exporter, hash_comments, number, quoted
from handeye.export.mount import Mount
from handeye.types import Camera, Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.camera import OPENCV_LENSES

_PER_LINE = 4


def text(mount: Mount) -> str:
    """Return the header that OpenCV insists on, comments and the nodes."""
    result = mount.result
    camera_side, target_side = (
        ("flange", "base") if result.mounting is Mounting.EYE_IN_HAND else ("base", "flange")
    )
    child = "camera" if mount.frames.link is None else "camera_link"
    parts = [
        f"mounting: {quoted(result.mounting.value)}\nunit: {quoted('m')}\n",
        f"parent_frame: {quoted(mount.parent)}\nchild_frame: {quoted(mount.child)}\n",
        _transform(f"T_{camera_side}_{child}", mount.T_parent_child),
        f"target_parent_frame: {quoted(mount.target_parent)}\ntarget_frame: {quoted(mount.frames.target)}\n",
        _transform(f"T_{target_side}_target", result.T_fixed_target),
    ]
    if result.camera is not None:
        parts.append(_camera(result.camera))
    return "%YAML:1.0\n---\n" + hash_comments(mount) + "".join(parts)


def _transform(name: str, pose: Pose) -> str:
    return _matrix(name, pose.matrix)


def _camera(camera: Camera) -> str:
    if camera.lens not in OPENCV_LENSES:
        raise InputError(
            f"a camera of lens {camera.lens}: OpenCV has no form for it",
            code=Code.UNKNOWN_LENS,
            hint=f"export to another format, or calibrate with one of {', '.join(sorted(OPENCV_LENSES))}",
        )
    fisheye = int(camera.lens == "kannala_brandt")
    coefficients = camera.distortion if len(camera.distortion) else np.zeros(4)
    return (
        f"image_width: {camera.width_px}\nimage_height: {camera.height_px}\nfisheye: {fisheye}\n"
        + _matrix("camera_matrix", camera.matrix)
        + _matrix("distortion_coefficients", coefficients[np.newaxis])
    )


def _matrix(name: str, values: FloatArray) -> str:
    rows, columns = values.shape
    return (
        f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n"
        f"   data: [ {_wrapped(values.ravel().tolist())} ]\n"
    )


def _wrapped(values: Sequence[float]) -> str:
    lines = [
        ", ".join(number(value) for value in values[i : i + _PER_LINE])
        for i in range(0, len(values), _PER_LINE)
    ]
    return ",\n       ".join(lines)


EXPORTER = Exporter("opencv", "OpenCV FileStorage YAML", ".yaml", text)
