"""What a camera may return: a frame of plain arrays, or an error of the device."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from handeye.cameras.protocol import BAD_FRAME, Frame, Points, checked_frame
from handeye.errors import DeviceError

IMAGE = np.zeros((4, 6), np.uint8)


def holding(image: Any) -> Frame:
    """A frame whose picture was changed past its checks."""
    frame = Frame(IMAGE)
    object.__setattr__(frame, "image", image)
    return frame


class Kept(np.ndarray):
    def tobytes(self, *_: object) -> bytes:
        raise RuntimeError("trap")


@pytest.mark.parametrize(
    "answer",
    [
        None,
        IMAGE,
        SimpleNamespace(image=IMAGE, points=None, timestamp_s=None),
        holding([[1, 2]]),
        holding(SimpleNamespace(ndim=2, dtype=np.dtype(np.uint8), shape=(4, 6))),
        holding(IMAGE.astype(np.uint16)),
        holding(IMAGE[:, :, np.newaxis]),
        Frame(IMAGE, timestamp_s=10**400),
        Frame(IMAGE, timestamp_s=float("nan")),
        Frame(IMAGE, timestamp_s="now"),  # type: ignore[arg-type]
        Frame(None, SimpleNamespace(point_ids=[0], pixels=[[1.0, 2.0]], labels_known=False)),  # type: ignore[arg-type]
        Frame(None, Points(np.array([-1]), np.array([[1.0, 2.0]]))),
        Frame(None, Points(np.array([0.5]), np.array([[1.0, 2.0]]))),
        Frame(None, Points(np.array([0]), np.array([[np.nan, 2.0]]))),
        Frame(None, Points(np.array([0]), np.array([1.0, 2.0]))),
        # More than there is memory for, in few bytes.
        Frame(np.broadcast_to(np.uint8(1), (10**6, 10**6))),
        Frame(np.broadcast_to(np.uint8(1), (10**6, 10**6)), Points(np.arange(9), np.eye(9, 2))),
        Frame(None, Points(np.broadcast_to(1, (10**12,)), np.broadcast_to(1.0, (10**12, 2)))),
        Frame(None, Points(np.arange(9), np.broadcast_to(1.0, (10**12, 2)))),
    ],
)
def test_what_is_no_frame_is_an_error_of_the_device(answer: object) -> None:
    with pytest.raises(DeviceError) as found:
        checked_frame(answer)
    assert found.value.code == BAD_FRAME


def test_subclasses_of_arrays_become_plain_ones() -> None:
    assert type(checked_frame(holding(IMAGE.view(Kept))).image) is np.ndarray


def test_what_only_looks_like_a_frame_is_none() -> None:
    alike = SimpleNamespace(image=IMAGE, points=None, timestamp_s=None)
    with pytest.raises(DeviceError, match="expected Frame"):
        checked_frame(alike)
