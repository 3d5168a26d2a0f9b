"""The messages that a calibration needs, by the definitions of common_interfaces (ROS 1 and ROS 2)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from handeye.datasets.bags.base import Record
from handeye.datasets.bags.wire import Wire

IMAGE, COMPRESSED = "sensor_msgs/Image", "sensor_msgs/CompressedImage"
CAMERA_INFO, JOINTS = "sensor_msgs/CameraInfo", "sensor_msgs/JointState"
TRANSFORMS, OLD_TRANSFORMS = "tf2_msgs/TFMessage", "tf/tfMessage"
POSE, TRANSFORM, TEXT = "geometry_msgs/PoseStamped", "geometry_msgs/TransformStamped", "std_msgs/String"
POSE_WITH_COVARIANCE = "geometry_msgs/PoseWithCovarianceStamped"


@dataclass(frozen=True, eq=False)
class Stamped:
    """A transform at a time: position in metres and quaternion x, y, z, w of the child in the parent.

    The child of a pose has no name.
    """

    stamp_ns: int
    parent: str
    child: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class JointPositions:
    """Where joints stand at a time, by name."""

    stamp_ns: int
    positions: dict[str, float]


@dataclass(frozen=True)
class Raw:
    """A picture as bytes: rows of `step_bytes`, in an encoding of ROS."""

    stamp_ns: int
    height: int
    width: int
    encoding: str
    is_big_endian: bool
    step_bytes: int
    data: memoryview


@dataclass(frozen=True)
class Compressed:
    """A picture as a file."""

    stamp_ns: int
    format: str
    data: memoryview


@dataclass(frozen=True)
class CameraInfo:
    """What a camera says of itself, with the names of ROS 2."""

    fields: dict[str, Any]


def _transform(wire: Wire) -> Stamped:
    stamp, parent = wire.header()
    child = wire.text()
    return Stamped(stamp, _frame(parent), _frame(child), wire.numbers("d", 7))


def _pose(wire: Wire) -> list[Stamped]:
    # A covariance that follows is not read: how far the robot errs is found from the views.
    stamp, parent = wire.header()
    return [Stamped(stamp, _frame(parent), "", wire.numbers("d", 7))]


def _one_transform(wire: Wire) -> list[Stamped]:
    return [_transform(wire)]


def _transforms(wire: Wire) -> list[Stamped]:
    return [_transform(wire) for _ in range(wire.length(least_bytes=60))]


def _joints(wire: Wire) -> JointPositions:
    stamp, _ = wire.header()
    names = [wire.text() for _ in range(wire.length(least_bytes=4))]
    positions = wire.numbers("d", wire.length(least_bytes=8))
    # A gripper without encoders has names and no positions.
    return JointPositions(stamp, dict(zip(names, positions, strict=False)))


def _image(wire: Wire) -> Raw:
    stamp, _ = wire.header()
    height, width = wire.whole("I"), wire.whole("I")
    encoding = wire.text()
    big, step = wire.whole("B"), wire.whole("I")
    return Raw(stamp, height, width, encoding, bool(big), step, wire.block())


def _compressed(wire: Wire) -> Compressed:
    stamp, _ = wire.header()
    return Compressed(stamp, wire.text(), wire.block())


def _camera_info(wire: Wire) -> CameraInfo:
    wire.header()
    height, width, model = wire.whole("I"), wire.whole("I"), wire.text()
    d = wire.numbers("d", wire.length(least_bytes=8))
    k, _, p = (wire.numbers("d", count) for count in (9, 9, 12))
    binning = wire.whole("I"), wire.whole("I")
    return CameraInfo({
        "width": width, "height": height, "distortion_model": model, "d": list(d), "k": list(k), "p": list(p),
        "binning_x": binning[0], "binning_y": binning[1],
    })  # fmt: skip


def _text(wire: Wire) -> str:
    return wire.long_text()


READERS: dict[str, Callable[[Wire], object]] = {
    IMAGE: _image,
    COMPRESSED: _compressed,
    CAMERA_INFO: _camera_info,
    JOINTS: _joints,
    TRANSFORMS: _transforms,
    OLD_TRANSFORMS: _transforms,
    POSE: _pose,
    POSE_WITH_COVARIANCE: _pose,
    TRANSFORM: _one_transform,
    TEXT: _text,
}


def message_of(record: Record) -> object:
    """Return what a record says.

    Raises
    ------
    InputError
        It is not a message of its type.
    """
    where = f"a message on {record.topic.name[:100]}"
    return READERS[record.topic.kind](Wire(record.data, is_cdr=record.topic.is_cdr, where=where))


def _frame(name: str) -> str:
    """Return a name of a frame as tf2 has it; tf had a slash in front."""
    return name.removeprefix("/")
