"""A camera in ROS 2: the first picture exposed after it is asked for. Not tried on a real camera."""

from typing import Any

import cv2
import numpy as np

from handeye.cameras.protocol import Frame, Grey
from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.ros.link import RosLink, look_around, options_of, ros_library, seconds
from handeye.ros.stamps import BAD_STAMP, Stream

IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
STARTS_S, GRAB_S, INFO_S = 10.0, 5.0, 1.0
USUAL = {"image": "/camera/image_raw", "info": "", "clock": "system"}
# Encodings of sensor_msgs/Image: bytes a pixel, and how they become grey.
PLAIN = {"mono8": 1, "8UC1": 1, "mono16": 2, "16UC1": 2}
COLOURS = {
    "rgb8": (3, cv2.COLOR_RGB2GRAY),
    "bgr8": (3, cv2.COLOR_BGR2GRAY),
    "8UC3": (3, cv2.COLOR_BGR2GRAY),
    "rgba8": (4, cv2.COLOR_RGBA2GRAY),
    "bgra8": (4, cv2.COLOR_BGRA2GRAY),
    "bayer_rggb8": (1, cv2.COLOR_BayerRGGB2GRAY),
    "bayer_grbg8": (1, cv2.COLOR_BayerGRBG2GRAY),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGBRG2GRAY),
    "bayer_bggr8": (1, cv2.COLOR_BayerBGGR2GRAY),
}
LARGEST_PX = 20_000


class Ros2Camera:
    """A topic of pictures, with the camera_info of each.

    Parameters
    ----------
    address
        Topic of the pictures (sensor_msgs/Image); after a comma `info=TOPIC`, where camera_info is not beside
        it, and `clock=sim` for the time of a simulation.

    Raises
    ------
    InputError
        An address of another form.
    DeviceError
        ROS 2 is not there.
    """

    def __init__(self, address: str) -> None:
        options = options_of(address, "image", USUAL)
        topic = options["image"]
        info = options["info"] or f"{topic.rpartition('/')[0]}/camera_info"
        messages = ros_library("sensor_msgs.msg")
        self._link = RosLink("handeye_camera", options["clock"])
        self._pictures: Stream[Any] = Stream(topic, self._link.now_s, keep=4, code=Code.NO_IMAGE)
        self._infos: Stream[Any] = Stream(info, self._link.now_s, keep=40, code=Code.NO_CAMERA_INFO)
        self._known: tuple[Any, ...] | None = None
        try:
            self._listen(messages, topic, info)
        except DeviceError:
            self.close()
            raise

    def _listen(self, messages: Any, topic: str, info: str) -> None:  # noqa: ANN401 - a module of ROS
        """Subscribe, and wait for the first of each: finding one another takes a moment."""
        self._link.subscribe(messages.CameraInfo, info, lambda m: self._infos.put(seconds(m.header.stamp), m))
        self._link.subscribe(messages.Image, topic, lambda m: self._pictures.put(seconds(m.header.stamp), m))
        for stream, name, kind in ((self._pictures, topic, IMAGE), (self._infos, info, INFO)):
            try:
                stream.after(0.0, STARTS_S)
            except DeviceError as error:
                if error.code == BAD_STAMP:
                    raise
                listed = ", ".join(self._link.topics(kind)[:20]) or "none"
                raise DeviceError(
                    f"{name}: nothing comes; topics of {kind} are: {listed}",
                    code=Code.NO_CAMERA,
                    hint="name the topic of the pictures: ros2:/wrist/image_raw,info=/wrist/camera_info",
                ) from error

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return the topics of pictures.

        Raises
        ------
        DeviceError
            ROS 2 is not there.
        """
        return look_around(lambda link: [(topic, IMAGE) for topic in link.topics(IMAGE)])

    def grab(self, label: str) -> Frame:
        """Return the first picture that was exposed after now, as 8 bits of grey.

        Raises
        ------
        DeviceError
            `no_image`; `bad_stamp` where stamps cannot be true; `no_camera_info` without one of the same
            stamp; `camera_changed` where it differs from that of the first picture.
        """
        found = self._pictures.after(self._link.now_s(), GRAB_S)
        info = self._infos.at(found.stamp_s, INFO_S).value
        if (info.width, info.height) != (found.value.width, found.value.height):
            raise DeviceError(
                f"{label}: camera_info is of {info.width} x {info.height} pixels, the picture of "
                f"{found.value.width} x {found.value.height}",
                code=Code.CAMERA_CHANGED,
                hint="calibrate the camera at the size that is published",
            )
        known = (info.distortion_model, *np.asarray(info.k).tolist(), *np.asarray(info.d).tolist())
        if self._known is not None and known != self._known:
            raise DeviceError(
                f"{label}: camera_info is another than that of the first picture",
                code=Code.CAMERA_CHANGED,
                hint="switch autofocus off, and begin a new session",
            )
        self._known = known
        return Frame(grey_of(label, found.value), timestamp_s=found.stamp_s)

    def close(self) -> None:
        """Leave ROS 2."""
        self._link.close()


def grey_of(label: str, message: Any) -> Grey:  # noqa: ANN401 - sensor_msgs/Image
    """Return a picture as 8 bits of grey (H, W).

    Raises
    ------
    DeviceError
        An encoding that is not known, or fewer bytes than its size asks for.
    """
    width, height, step, form = message.width, message.height, message.step, message.encoding
    depth = PLAIN.get(form) or COLOURS.get(form, (0, 0))[0]
    if not depth:
        raise DeviceError(
            f"{label}: encoding {form[:40]!r}, expected one of {', '.join([*PLAIN, *COLOURS])}",
            code=Code.BAD_IMAGE,
        )
    data = np.frombuffer(message.data, np.uint8)
    sizes = 0 < width <= LARGEST_PX and 0 < height <= LARGEST_PX
    if not sizes or step < width * depth or len(data) < step * height:
        raise DeviceError(
            f"{label}: {len(data)} bytes for {width} x {height} pixels of {form}, {step} bytes a row",
            code=Code.BAD_IMAGE,
        )
    rows = data[: step * height].reshape(height, step)[:, : width * depth]
    if form in COLOURS:
        channels, conversion = COLOURS[form]
        shape = (height, width) if channels == 1 else (height, width, channels)
        return np.array(cv2.cvtColor(np.ascontiguousarray(rows).reshape(shape), conversion), dtype=np.uint8)
    if depth == 2:
        return np.array(rows[:, 0 if message.is_bigendian else 1 :: 2], dtype=np.uint8)
    return np.array(rows, dtype=np.uint8)
