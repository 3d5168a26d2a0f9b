"""What of a bag is the camera, and what says where the flange was."""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from handeye.codes import Code
from handeye.datasets import DataWarning
from handeye.datasets.bags import Contents, TimesOf, Track, chain, parents, rising, way
from handeye.datasets.bags.contents import Joints, Stamps, matrices
from handeye.datasets.bags.messages import (
    CAMERA_INFO,
    COMPRESSED,
    IMAGE,
    JOINTS,
    POSE,
    POSE_WITH_COVARIANCE,
    CameraInfo,
)
from handeye.datasets.camera_files import camera_info
from handeye.datasets.plausibility import accuracy_warnings
from handeye.errors import HandeyeError, InputError
from handeye.robots import Arm, parse_urdf
from handeye.types import Camera

# Frames at the end of an arm beside those of `handeye.robots.urdf`, and at its base, the likeliest first.
TIP_NAMES = (
    "tool0", "flange", "ee_link", "tool", "link_ee", "tcp", "panda_link8", "fr3_link8", "lbr_link_ee",
    "tool0_controller", "wrist_3_link", "link_7", "link7", "link_6", "link6",
)  # fmt: skip
BASE_NAMES = ("base_link", "base", "panda_link0", "fr3_link0", "link_0", "link0", "lbr_link_0", "world")
_NO_CAMERA = ("depth", "infra", "_ir", "/ir/", "costmap", "mask", "debug", "theora")
# Clocks that differ by more were never set to one another: then the times of reception count.
CLOCKS_APART_S = 0.5


@dataclass(frozen=True)
class BagOptions:
    """What a bag may leave open.

    Parameters
    ----------
    image_topic
        Topic of the pictures.
    pose_topic
        Topic of the flange's poses or of the joints, in place of tf.
    base_frame, flange_frame
        Frames of the robot's base and flange in tf.
    """

    image_topic: str | None = None
    pose_topic: str | None = None
    base_frame: str | None = None
    flange_frame: str | None = None


NOTHING_CHOSEN = BagOptions()


@dataclass(frozen=True, eq=False)
class Chosen:
    """What counts in a bag.

    Attributes
    ----------
    image_topic
        Topic of the pictures.
    times_s
        (N,) when each of them was taken, seconds since the bag began.
    track
        Where the flange was.
    camera
        What the bag says of the camera; None if nothing.
    warnings
        What was assumed.
    """

    image_topic: str
    times_s: np.ndarray[tuple[int], np.dtype[np.float64]]
    track: Track
    camera: Camera | None
    warnings: tuple[DataWarning, ...]


def choose(contents: Contents, options: BagOptions, arm: Arm | None) -> Chosen:
    """Choose pictures, poses and camera.

    Raises
    ------
    InputError
        Nothing that serves, or several things between which only the owner can choose.
    """
    topic = _image_topic(contents, options)
    pictures = contents.pictures[topic]
    poses = _source(contents, options, arm)
    streams = [stream for stream in poses.streams if stream.made_ns]
    offsets = [stream.offset_s for stream in (pictures, *streams)]
    known = [offset for offset in offsets if offset is not None]
    received = len(known) < len(offsets) or (bool(known) and max(known) - min(known) > CLOCKS_APART_S)
    origin = min(stream.received_ns[0] for stream in (pictures, *streams) if stream.received_ns)
    times_of = TimesOf(origin, received=received)
    warnings: list[DataWarning] = []
    if received:
        why = "have no time" if len(known) < len(offsets) else "are of clocks that differ"
        message = (
            f"pictures or poses {why}: the times of reception count, the lag contains the way to the recorder"
        )
        warnings.append(DataWarning("received_times", message))
    if contents.is_cut:
        message = (
            f"{contents.path.name} breaks off: it was not closed, or not copied whole; what is there is used"
        )
        warnings.append(DataWarning("bag_cut", message))
    track = poses.track(times_of)
    warnings += [
        *poses.warnings,
        DataWarning("poses_assumed", f"the flange's poses are {track.words}{poses.how}"),
    ]
    camera, notes = _camera(contents, topic)
    return Chosen(topic, times_of(pictures), track, camera, (*warnings, *notes))


def _image_topic(contents: Contents, options: BagOptions) -> str:
    known = contents.pictures
    if options.image_topic is not None:
        if options.image_topic not in known:
            raise _no_topic(contents, options.image_topic, (IMAGE, COMPRESSED))
        return options.image_topic
    usual = [name for name in known if not any(part in name.lower() for part in _NO_CAMERA)]
    # The same pictures, compressed beside them, are no second camera.
    plain = [
        name
        for name in usual
        if not (name.endswith("/compressed") and name.removesuffix("/compressed") in usual)
    ]
    if len(plain) > 1:
        raw = [name for name in plain if "rect" not in name]
        plain = raw if len(raw) == 1 and raw[0].rsplit("/", 1)[0] == plain[0].rsplit("/", 1)[0] else plain
    if not plain:
        raise _no_topic(contents, "pictures", (IMAGE, COMPRESSED))
    if len(plain) > 1:
        raise InputError(
            f"{contents.path}: pictures on {', '.join(sorted(plain)[:10])}",
            code=Code.AMBIGUOUS_FORMAT,
            hint="name the camera with --image-topic",
        )
    return plain[0]


class _Source:
    """Where the poses come from; the track is made once it is known which clock counts."""

    def __init__(self, streams: Sequence[Stamps], how: str = "") -> None:
        self.streams, self.how = streams, how
        self.warnings: list[DataWarning] = []

    def track(self, times_of: TimesOf) -> Track:
        raise NotImplementedError


class _OfTopic(_Source):
    def __init__(self, contents: Contents, topic: str) -> None:
        self._poses, self._topic = contents.poses[topic], topic
        super().__init__([self._poses])
        if contents.topics[topic].kind == POSE_WITH_COVARIANCE:
            self.warnings = accuracy_warnings(["covariance"], topic)

    def track(self, times_of: TimesOf) -> Track:
        return rising(times_of(self._poses), matrices(self._poses.values), f"those on {self._topic}")


class _OfFrames(_Source):
    def __init__(self, contents: Contents, base: str, flange: str, how: str) -> None:
        self._contents, self._base, self._flange = contents, base, flange
        up, down = way(contents.transforms, contents.static, base, flange)
        between = [contents.transforms[edge] for edge in (*up, *down) if edge in contents.transforms]
        super().__init__(between, how)

    def track(self, times_of: TimesOf) -> Track:
        contents = self._contents
        return chain(contents.transforms, contents.static, self._base, self._flange, times_of)


class _OfJoints(_Source):
    def __init__(self, joints: Joints, arm: Arm, topic: str) -> None:
        self._joints, self._arm, self._topic = joints, arm, topic
        super().__init__([joints])

    def track(self, times_of: TimesOf) -> Track:
        arm = self._arm
        named = [set(arm.joint_names) <= set(one) for one in self._joints.positions]
        if not any(named):
            told = ", ".join(sorted({name for one in self._joints.positions[:100] for name in one})[:20])
            raise InputError(
                f"{self._topic}: joints {told}, expected {', '.join(arm.joint_names)} of arm {arm.name}",
                code=Code.WRONG_ARM,
                hint="give the description of this robot with --robot",
            )
        rows = np.array(
            [
                [one[name] for name in arm.joint_names]
                for one in self._joints.positions
                if set(arm.joint_names) <= set(one)
            ]
        )
        usable = np.isfinite(rows).all(axis=1)
        times = times_of(self._joints)[np.array(named)][usable]
        words = f"those of {arm.name} ({arm.flange} in {arm.base}) at the joints on {self._topic}"
        return rising(times, arm.forward(rows[usable]), words, rows[usable])


def _source(contents: Contents, options: BagOptions, arm: Arm | None) -> _Source:
    topic = options.pose_topic
    if topic is not None:
        if topic in contents.poses:
            return _OfTopic(contents, topic)
        if topic not in contents.joints:
            raise _no_topic(contents, topic, (POSE, JOINTS))
        return _OfJoints(contents.joints[topic], _needed_arm(contents, options, arm), topic)
    frames = options.base_frame is not None or options.flange_frame is not None
    if arm is not None and not frames and contents.joints:
        return _OfJoints(*_joints(contents, arm))
    if contents.transforms:
        return _of_frames(contents, options)
    if len(contents.poses) == 1:
        return _OfTopic(contents, next(iter(contents.poses)))
    if contents.joints:
        arm = _needed_arm(contents, options, arm)
        return _OfJoints(*_joints(contents, arm))
    raise _no_topic(
        contents,
        "poses of the robot: tf, joint states with --robot, or poses with --pose-topic",
        (POSE, JOINTS),
    )


def _needed_arm(contents: Contents, options: BagOptions, arm: Arm | None) -> Arm:
    if arm is not None:
        return arm
    if contents.description:
        return parse_urdf(contents.description.encode(), base=options.base_frame, tip=options.flange_frame)
    raise InputError(
        f"{contents.path}: the bag has joint positions and no description of the robot",
        code=Code.UNKNOWN_ARM,
        hint="give its URDF with --robot",
    )


def _joints(contents: Contents, arm: Arm) -> tuple[Joints, Arm, str]:
    """Return the joint states that hold all joints of an arm, or else the only ones."""
    holding = [
        name for name, joints in contents.joints.items()
        if any(set(arm.joint_names) <= set(one) for one in joints.positions[:1000])
    ]  # fmt: skip
    name = holding[0] if holding else next(iter(contents.joints))
    return contents.joints[name], arm, name


def _of_frames(contents: Contents, options: BagOptions) -> _Source:
    moving = contents.transforms
    above = parents([*contents.static, *moving])
    known = [*dict.fromkeys(name for edge in (*moving, *contents.static) for name in edge)]
    below_moving = [name for name in known if _moves(name, above, moving)]
    flange = options.flange_frame or _named(below_moving, TIP_NAMES)
    base = options.base_frame
    if base is None and flange is not None:
        base = _named(
            [name for name in _ancestors(flange, above) if not _moves(name, above, moving)], BASE_NAMES
        )
    if flange is None or base is None:
        named = ", ".join(known[:30])
        raise InputError(
            f"{contents.path}: which frames of tf are the robot's base and flange? There are {named}",
            code=Code.UNKNOWN_FRAME,
            hint="name them with --base-frame and --flange-frame",
        )
    said = options.base_frame is not None and options.flange_frame is not None
    return _OfFrames(contents, base, flange, "" if said else " (--base-frame, --flange-frame)")


def _ancestors(frame: str, above: dict[str, str]) -> list[str]:
    way = [frame]
    while way[-1] in above and above[way[-1]] not in way:
        way.append(above[way[-1]])
    return way[1:]


def _moves(frame: str, above: dict[str, str], moving: Iterable[tuple[str, str]]) -> bool:
    """Tell whether something between a frame and the root moves."""
    way = [frame, *_ancestors(frame, above)]
    return any((parent, child) in moving for child, parent in itertools.pairwise(way))


def _named(frames: Sequence[str], wanted: Sequence[str]) -> str | None:
    """Return the only frame of a wanted name, also behind a prefix; None if there is none or several."""
    for name in wanted:
        fitting = [f for f in frames if f == name] or [
            f for f in frames if f.endswith((f"_{name}", f"/{name}"))
        ]
        if fitting:
            return fitting[0] if len(fitting) == 1 else None
    return None


def _camera(contents: Contents, topic: str) -> tuple[Camera | None, list[DataWarning]]:
    beside = topic.removesuffix("/compressed").rsplit("/", 1)[0]
    info = contents.cameras.get(f"{beside}/camera_info")
    if info is None and len(contents.cameras) == 1:
        info = next(iter(contents.cameras.values()))
    if info is None:
        return None, []
    try:
        return camera_info.MESSAGE.read(
            _rectified(info) if "rect" in topic.rsplit("/", 2)[-1] else info.fields
        ), []
    except HandeyeError as error:
        message = f"camera_info: {error.message}; the camera is not taken from it"
        return None, [DataWarning("camera_unread", message)]


def _rectified(info: CameraInfo) -> dict[str, object]:
    """Return the camera of rectified pictures: the projection matrix, and no distortion."""
    p = info.fields["p"]
    k = [p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]]
    return {**info.fields, "k": k, "d": [], "distortion_model": "plumb_bob"}


def _no_topic(contents: Contents, what: str, kinds: Sequence[str]) -> InputError:
    fitting = sorted(name for name, topic in contents.topics.items() if topic.kind in kinds)
    there = ", ".join(fitting[:20]) or ", ".join(sorted(contents.topics)[:20]) or "nothing"
    return InputError(
        f"{contents.path}: no {what}; the bag has {there}",
        code=Code.MISSING_TOPIC,
        hint=f"expected {' or '.join(kinds)}" + (f", camera {CAMERA_INFO}" if IMAGE in kinds else ""),
    )
