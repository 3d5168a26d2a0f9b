"""ROS's CameraInfo: the YAML of `camera_calibration_parsers`, and what a topic prints.

Parsers (`parse_yml.cpp`): image_width, image_height, camera_matrix {rows, cols, data}, distortion_model,
distortion_coefficients {rows, cols, data}; numbers as NumPy prints them, such as ``1200.``. Topics
(sensor_msgs/CameraInfo): width, height, distortion_model, and D, K in ROS 1, d, k in ROS 2.
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


def _is_file(document: Table) -> bool:
    return {"image_width", "camera_matrix"} <= set(document) and "distortion_model" in document


def _read_file(document: Table) -> Camera:
    size = size_at(document, "image_width", "image_height")
    matrix = square(numbers_at(document, "camera_matrix"), "camera_matrix")
    return camera_of(matrix, numbers_at(document, "distortion_coefficients"), size, _model(document))


def _is_message(document: Table) -> bool:
    return {"width", "height", "distortion_model"} <= set(document) and _case(document) is not None


def _case(document: Table) -> tuple[str, str] | None:
    return next((pair for pair in (("k", "d"), ("K", "D")) if set(pair) <= set(document)), None)


def _read_message(document: Table) -> Camera:
    k, d = _case(document) or ("k", "d")
    for key in ("binning_x", "binning_y"):
        if document.get(key) is not None and number_at(document, key) > 1:
            raise InputError(
                f"{key}: {number_at(document, key):g}: the matrix belongs to the picture before binning",
                code=Code.IMAGE_SIZE,
                hint="calibrate the camera at the size of the pictures",
            )
    matrix = square(numbers_at(document, k), k)
    return camera_of(matrix, numbers_at(document, d), size_at(document, "width", "height"), _model(document))


def _model(document: Table) -> str:
    model = document.get("distortion_model")
    return model if isinstance(model, str) and model else "plumb_bob"


FILE = CameraFormat("camera_info of ROS", _is_file, _read_file)
MESSAGE = CameraFormat("a CameraInfo message of ROS", _is_message, _read_message)
