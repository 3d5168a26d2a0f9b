"""Grey values of pictures in messages (`image_encodings.hpp` of sensor_msgs, compressed_image_transport)."""

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.datasets.bags.messages import Compressed, Raw
from handeye.datasets.images import decoded, eight_bits
from handeye.errors import InputError
from handeye.types.camera import MAX_PIXELS

Grey = NDArray[np.uint8]
_COLOURS = {
    "rgb8": (3, cv2.COLOR_RGB2GRAY), "bgr8": (3, cv2.COLOR_BGR2GRAY), "8uc3": (3, cv2.COLOR_BGR2GRAY),
    "rgba8": (4, cv2.COLOR_RGBA2GRAY), "bgra8": (4, cv2.COLOR_BGRA2GRAY), "8uc4": (4, cv2.COLOR_BGRA2GRAY),
    # The first letters name the colours of the first two pixels; OpenCV names those of the second row.
    "bayer_rggb8": (1, cv2.COLOR_BayerBG2GRAY), "bayer_bggr8": (1, cv2.COLOR_BayerRG2GRAY),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGR2GRAY), "bayer_grbg8": (1, cv2.COLOR_BayerGB2GRAY),
    "yuv422": (2, cv2.COLOR_YUV2GRAY_UYVY), "uyvy": (2, cv2.COLOR_YUV2GRAY_UYVY),
    "yuv422_yuy2": (2, cv2.COLOR_YUV2GRAY_YUY2), "yuyv": (2, cv2.COLOR_YUV2GRAY_YUY2),
}  # fmt: skip
_GREY, _DEEP = frozenset({"mono8", "8uc1"}), frozenset({"mono16", "16uc1"})
_FILES = {b"\x89PNG": ".png", b"\xff\xd8\xff": ".jpg", b"RIFF": ".webp", b"BM": ".bmp"}


def grey_of(picture: Raw | Compressed, where: str) -> Grey:
    """Return the grey values (H, W) of a picture.

    Raises
    ------
    InputError
        An encoding that no camera picture has, or bytes that are not such a picture.
    """
    if isinstance(picture, Compressed):
        content = bytes(picture.data)
        suffix = next((s for head, s in _FILES.items() if content.startswith(head)), None)
        if suffix is None:
            raise InputError(
                f"{where}: a compressed picture ({picture.format[:40]}) of no known kind",
                code=Code.NOT_AN_IMAGE,
            )
        return decoded(content, suffix, where)
    return _plain(picture, where)


def _plain(picture: Raw, where: str) -> Grey:
    encoding = picture.encoding.strip().lower()
    channels, code = _COLOURS.get(encoding, (1, None))
    if code is None and encoding not in _GREY | _DEEP:
        known = ", ".join(sorted(_GREY | _DEEP | set(_COLOURS)))
        raise InputError(
            f"{where}: pictures in {picture.encoding[:40]!r}, expected {known}",
            code=Code.NOT_AN_IMAGE,
            hint="name the topic of the camera with --image-topic",
        )
    deep = encoding in _DEEP
    row = picture.width * channels * (2 if deep else 1)
    if (
        not 0 < picture.width * picture.height <= MAX_PIXELS
        or picture.step_bytes < row
        or picture.step_bytes * picture.height > len(picture.data)
    ):
        raise InputError(
            f"{where}: {picture.width} x {picture.height} pixels of {encoding} in {len(picture.data)} bytes",
            code=Code.DAMAGED_IMAGE,
        )
    flat = np.frombuffer(picture.data, np.uint8, picture.step_bytes * picture.height)
    rows = flat.reshape(picture.height, picture.step_bytes)[:, :row]
    if deep:
        values = np.ascontiguousarray(rows).view(">u2" if picture.is_big_endian else "<u2")
        return eight_bits(values.astype(np.uint16), where)
    if code is None:
        return np.ascontiguousarray(rows)
    shape = (picture.height, picture.width) if channels == 1 else (picture.height, picture.width, channels)
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(rows).reshape(shape), code), dtype=np.uint8)
