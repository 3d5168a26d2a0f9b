"""What programs write with `cv::FileStorage`: camera matrix, coefficients and size under many names.

The names are those of OpenCV's own calibration samples (`calibration.cpp`, `camera_calibration.cpp`,
`stereo_calib.cpp`) and of our export.
"""

from handeye.codes import Code
from handeye.datasets.camera_files.base import (
    CameraFormat,
    Table,
    camera_of,
    number_at,
    numbers_at,
    size_at,
    square,
)
from handeye.errors import InputError
from handeye.types import Camera

_MATRICES = (
    "camera_matrix",
    "cameraMatrix",
    "Camera_Matrix",
    "intrinsic_matrix",
    "camera_intrinsic",
    "K",
    "M",
    "mtx",
)
_DISTORTIONS = (
    "distortion_coefficients",
    "distCoeffs",
    "Distortion_Coefficients",
    "dist_coeffs",
    "distortion",
    "dist",
    "D",
)
_SIZES = (("image_width", "image_height"), ("image_Width", "image_Height"), ("width", "height"))


def _first(document: Table, names: tuple[str, ...]) -> str | None:
    return next((name for name in names if name in document), None)


def _recognises(document: Table) -> bool:
    return _first(document, _MATRICES) is not None


def _read(document: Table) -> Camera:
    matrix_name = _first(document, _MATRICES) or _MATRICES[0]
    matrix = square(numbers_at(document, matrix_name), matrix_name)
    name = _first(document, _DISTORTIONS)
    coefficients = [] if name is None else numbers_at(document, name)
    fisheye = any(key in document and number_at(document, key) != 0 for key in ("fisheye", "useFisheye"))
    model = document.get("distortion_model")
    model = model if isinstance(model, str) and model else "fisheye" if fisheye else "plumb_bob"
    return camera_of(matrix, coefficients, _size(document), model)


def _size(document: Table) -> tuple[int, int]:
    for width, height in _SIZES:
        if {width, height} <= set(document):
            return size_at(document, width, height)
    for key in ("image_size", "imageSize", "resolution", "img_size"):
        if key in document:
            values = numbers_at(document, key)
            if len(values) == 2:
                return size_at({"width": values[0], "height": values[1]}, "width", "height")
    raise InputError(
        "the size of the image is not in the file",
        code=Code.INVALID_FIELD,
        hint="add image_width and image_height, or write the camera as TOML",
    )


FORMAT = CameraFormat("a FileStorage of OpenCV", _recognises, _read)
