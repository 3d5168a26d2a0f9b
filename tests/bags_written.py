"""Bags of a made-up cell that moves between stations, written by the library rosbags (Ternaris, Apache-2.0)."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np

from cells import Cell
from handeye.cameras.render import Appearance, BoardRenderer
from handeye.errors import SolveError
from handeye.robots import Arm
from handeye.types import Camera, Chessboard, Mounting, Pose, Target

START_NS = 1_700_000_000_000_000_000
KINDS = ("rosbag1", "rosbag1-bz2", "rosbag1-lz4", "sqlite3", "sqlite3-message", "mcap", "mcap-zstd")
CAMERA = Camera("brown_conrady_5", [560, 560, 319.5, 239.5, -0.08, 0.03, 2e-4, -1e-4, 0.0], 640, 480)


@dataclass
class Journey:
    """A cell whose arm goes from station to station, with a camera that runs on a clock of its own.

    The pictures are stamped `lag_s` later than they were taken.
    """

    seed: int = 0
    stations: int = 8
    lag_s: float = 0.030
    mounting: Mounting = Mounting.EYE_IN_HAND
    stand_s: float = 0.6
    move_s: float = 0.7
    picture_hz: float = 12.0
    pose_hz: float = 100.0
    target: Target = field(default_factory=lambda: Chessboard(6, 8, 0.03))
    camera: Camera = CAMERA
    noise_m: float = 2e-5
    arm: Arm | None = None

    def __post_init__(self) -> None:
        self.random = np.random.default_rng(self.seed)
        self.cell = Cell(self.random, mounting=self.mounting, target=self.target, camera=self.camera)
        self.stops, self.postures = self._stops()
        self.duration_s = self.stations * self.stand_s + (self.stations - 1) * self.move_s

    def _stops(self) -> tuple[list[Pose], list[np.ndarray]]:
        if self.arm is None:
            return [
                self.cell.robot_pose(self.cell.look(tilt_rad=0.5, roll_rad=1.0)) for _ in range(self.stations)
            ], []
        # Where the arm reaches: a posture of its own, and the board put in front of it.
        middle = np.array([0.0, -1.2, 1.4, -1.6, -1.5, 0.2])[: len(self.arm)]
        postures: list[np.ndarray] = []
        first = Pose(self.arm.forward(middle))
        A = first.inverse() if self.mounting is Mounting.EYE_IN_HAND else first
        self.cell.Y = A.inverse() @ self.cell.X.inverse() @ self.cell.look(0.1, 0.1)
        while len(postures) < self.stations:
            goal = self.cell.robot_pose(self.cell.look(tilt_rad=0.5, roll_rad=1.0))
            try:
                postures.append(self.arm.inverse(goal, middle))
            except SolveError:
                continue
        return [Pose(self.arm.forward(q)) for q in postures], postures

    def _place(self, time_s: float) -> tuple[int, float]:
        """The station that was left last, and the share of the way to the next."""
        period = self.stand_s + self.move_s
        index = min(int(max(time_s, 0) // period), self.stations - 1)
        share = np.clip((time_s - index * period - self.stand_s) / self.move_s, 0, 1)
        return index, float(share**3 * (10 - 15 * share + 6 * share**2)) if index < self.stations - 1 else 0.0

    def joints(self, time_s: float) -> np.ndarray:
        index, share = self._place(time_s)
        first, second = self.postures[index], self.postures[min(index + 1, self.stations - 1)]
        return first + share * (second - first)

    def pose(self, time_s: float) -> Pose:
        if self.arm is not None:
            return Pose(self.arm.forward(self.joints(time_s)))
        index, share = self._place(time_s)
        first, second = self.stops[index], self.stops[min(index + 1, self.stations - 1)]
        return first @ Pose.exp(share * (first.inverse() @ second).log())

    def reported(self, time_s: float) -> Pose:
        noise = self.random.normal(size=6) * ([self.noise_m] * 3 + [self.noise_m] * 3)
        return self.pose(time_s) @ Pose.exp(noise)

    @cached_property
    def pictures(self) -> list[tuple[float, np.ndarray]]:
        """When each picture says that it was taken, and what it shows."""
        renderer = BoardRenderer(self.camera, self.target, Appearance(noise=1.5, supersampling=4))
        out = []
        for taken in np.arange(0.05, self.duration_s, 1 / self.picture_hz):
            pose = self.pose(float(taken))
            A = pose.inverse() if self.mounting is Mounting.EYE_IN_HAND else pose
            out.append(
                (float(taken) + self.lag_s, renderer.image(self.cell.X @ A @ self.cell.Y, self.random))
            )
        return out

    @property
    def truth(self) -> Pose:
        name = self.mounting.result_names[0]
        return self.mounting.results(self.cell.X, self.cell.Y)[name]


def write(
    path: Path,
    kind: str,
    journey: Journey,
    *,
    poses: str = "tf",
    picture: str = "mono8",
    stamps: bool = True,
    description: str = "",
) -> Path:
    """Write a bag; `poses` is tf, pose or joints."""
    sink = Sink(path, kind)
    with sink:
        info = sink.camera_info(journey.camera)
        sink.say("/camera/camera_info", "sensor_msgs/msg/CameraInfo", 0.0, info)
        if description:
            sink.say(
                "/robot_description",
                "std_msgs/msg/String",
                0.0,
                sink.make("std_msgs/msg/String", data=description),
            )
        if poses == "tf":
            static = [sink.transform(0.0, "world", "base_link", Pose.exp([0.1, 0.2, 0.3, 0, 0, 0.4]))]
            sink.say(
                "/tf_static",
                "tf2_msgs/msg/TFMessage",
                0.0,
                sink.make("tf2_msgs/msg/TFMessage", transforms=static),
            )
        events: list[tuple[float, Callable[[], None]]] = []
        times = np.arange(-0.2, journey.duration_s + 0.2, 1 / journey.pose_hz).tolist()
        events += [(time, partial(_pose, sink, journey, time, poses)) for time in times]
        events += [
            (time + 0.004, partial(_picture, sink, time, grey, picture, stamps=stamps))
            for time, grey in journey.pictures
        ]
        for _, event in sorted(events, key=lambda e: e[0]):
            event()
    return sink.path


def _pose(sink: "Sink", journey: Journey, time: float, how: str) -> None:
    if how == "joints":
        names = journey.arm.joint_names
        q = journey.joints(time)
        order = np.argsort(names)
        message = sink.make(
            "sensor_msgs/msg/JointState",
            header=sink.header(time, ""),
            name=[names[i] for i in order],
            position=np.array([q[i] for i in order]),
            velocity=np.zeros(0),
            effort=np.zeros(0),
        )
        sink.say("/joint_states", "sensor_msgs/msg/JointState", time, message)
        return
    pose = journey.reported(time)
    if how == "tf":
        # Two moving transforms whose product is the flange in the base.
        half = Pose.exp([0.1, -0.2, 0.3, 0.1, 0.4, 0.2 * time])
        both = [
            sink.transform(time, "base_link", "wrist_3_link", half),
            sink.transform(time, "wrist_3_link", "tool0", half.inverse() @ pose),
        ]
        sink.say("/tf", "tf2_msgs/msg/TFMessage", time, sink.make("tf2_msgs/msg/TFMessage", transforms=both))
        return
    kind, told = "geometry_msgs/msg/PoseStamped", sink.pose(pose)
    if how == "pose_with_covariance":
        kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
        told = sink.make("geometry_msgs/msg/PoseWithCovariance", pose=told, covariance=np.full(36, 1e-6))
    sink.say("/tcp_pose", kind, time, sink.make(kind, header=sink.header(time, "base"), pose=told))


def _picture(sink: "Sink", time: float, grey: np.ndarray, how: str, *, stamps: bool) -> None:
    header = sink.header(time if stamps else None, "camera")
    if how in {"jpeg", "png"}:
        data = cv2.imencode(f".{how}", grey)[1].ravel()
        message = sink.make("sensor_msgs/msg/CompressedImage", header=header, format=how, data=data)
        sink.say("/camera/image_raw/compressed", "sensor_msgs/msg/CompressedImage", time + 0.004, message)
        return
    content, channels = encoded(grey, how)
    message = sink.make(
        "sensor_msgs/msg/Image",
        header=header,
        height=grey.shape[0],
        width=grey.shape[1],
        encoding=how,
        is_bigendian=0,
        step=channels * grey.shape[1],
        data=content,
    )
    sink.say("/camera/image_raw", "sensor_msgs/msg/Image", time + 0.004, message)


def encoded(grey: np.ndarray, how: str) -> tuple[np.ndarray, int]:
    """Bytes of a grey picture in an encoding of ROS, and how many there are for a pixel."""
    if how in {"bgr8", "rgb8"}:
        return np.repeat(grey[:, :, None], 3, axis=2).ravel(), 3
    if how == "mono16":
        return (grey.astype("<u2") * 256).view(np.uint8).ravel(), 2
    if how == "yuv422_yuy2":
        return np.dstack([grey, np.full_like(grey, 128)]).ravel(), 2
    return grey.ravel(), 1


class Sink:
    """A bag that is being written."""

    def __init__(self, path: Path, kind: str) -> None:
        from rosbags import rosbag1, rosbag2
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.is_ros1 = kind.startswith("rosbag1")
        self.path = path.with_suffix(".bag") if self.is_ros1 else path
        self.store = get_typestore(Stores.ROS1_NOETIC if self.is_ros1 else Stores.ROS2_HUMBLE)
        if self.is_ros1:
            self.store.register(
                get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
            )
            self.writer: Any = rosbag1.Writer(self.path)
            if "-" in kind:
                form = self.writer.CompressionFormat
                self.writer.set_compression(form.BZ2 if kind.endswith("bz2") else form.LZ4)
        else:
            plugin = (
                rosbag2.StoragePlugin.SQLITE3 if kind.startswith("sqlite3") else rosbag2.StoragePlugin.MCAP
            )
            self.writer = rosbag2.Writer(self.path, version=9, storage_plugin=plugin)
            if "-" in kind:
                mode = (
                    rosbag2.CompressionMode.MESSAGE
                    if kind.endswith("message")
                    else rosbag2.CompressionMode.STORAGE
                )
                self.writer.set_compression(mode, rosbag2.CompressionFormat.ZSTD)
        self.connections: dict[str, Any] = {}
        self.sequence = 0

    def __enter__(self) -> Self:
        self.writer.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.writer.close()

    def make(self, kind: str, **fields: Any) -> Any:
        return self.store.types[kind](**fields)

    def header(self, time: float | None, frame: str) -> Any:
        at = 0 if time is None else START_NS + round(time * 1e9)
        stamp = self.make("builtin_interfaces/msg/Time", sec=at // 10**9, nanosec=at % 10**9)
        self.sequence += 1
        extra = {"seq": self.sequence} if self.is_ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **extra)

    def pose(self, pose: Pose) -> Any:
        (x, y, z), (a, b, c, w) = pose.translation, pose.quaternion_xyzw
        return self.make(
            "geometry_msgs/msg/Pose",
            position=self.make("geometry_msgs/msg/Point", x=x, y=y, z=z),
            orientation=self.make("geometry_msgs/msg/Quaternion", x=a, y=b, z=c, w=w),
        )

    def transform(self, time: float, parent: str, child: str, pose: Pose) -> Any:
        (x, y, z), (a, b, c, w) = pose.translation, pose.quaternion_xyzw
        return self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(time, parent),
            child_frame_id=child,
            transform=self.make(
                "geometry_msgs/msg/Transform",
                translation=self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
                rotation=self.make("geometry_msgs/msg/Quaternion", x=a, y=b, z=c, w=w),
            ),
        )

    def camera_info(self, camera: Camera) -> Any:
        fx, fy, cx, cy, *distortion = camera.parameters
        k = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0])
        p = np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1.0, 0])
        names = "DKRP" if self.is_ros1 else "dkrp"
        values = dict(zip(names, (np.array(distortion), k, np.eye(3).ravel(), p), strict=True))
        roi = self.make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return self.make(
            "sensor_msgs/msg/CameraInfo",
            header=self.header(0.0, "camera"),
            height=camera.height_px,
            width=camera.width_px,
            distortion_model="plumb_bob",
            binning_x=0,
            binning_y=0,
            roi=roi,
            **values,
        )

    def say(self, topic: str, kind: str, time: float, message: Any) -> None:
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        serialize = self.store.serialize_ros1 if self.is_ros1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], START_NS + round(time * 1e9), serialize(message, kind))
