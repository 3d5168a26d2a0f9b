"""Stations of an arm with several cameras and targets: what the calibration of a whole cell is made from.

A recording of one camera and one target is the simple case: `RigRecording.of` and `RigRecording.single` lead
from one to the other.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import combinations, groupby, product

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.camera import Camera
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose
from handeye.types.recording import Recording, Truth
from handeye.types.target import Target
from handeye.types.view import View

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}", re.ASCII)
# Names in the simple case.
CAMERA, TARGET = "camera", "target"


class Body(StrEnum):
    """What a camera or a target is fixed to.

    Examples
    --------
    >>> Body("flange").value
    'flange'
    """

    FLANGE = "flange"
    BASE = "base"
    """The base of the arm, or anything that does not move against it."""


@dataclass(frozen=True)
class MountedCamera:
    """A camera and what it is fixed to.

    Examples
    --------
    >>> MountedCamera(Camera("pinhole", [800, 800, 320, 240], 640, 480), Body.FLANGE).mounting.value
    'eye_in_hand'
    """

    camera: Camera
    body: Body

    @property
    def mounting(self) -> Mounting:
        """The mounting that gives the camera's pose its name."""
        return Mounting.EYE_IN_HAND if self.body is Body.FLANGE else Mounting.EYE_TO_HAND


@dataclass(frozen=True)
class MountedTarget:
    """A target and what it is fixed to.

    Examples
    --------
    >>> MountedTarget(Chessboard(6, 9, 0.025), Body.BASE).pose_name
    'T_base_target'
    """

    target: Target
    body: Body

    @property
    def pose_name(self) -> str:
        """Name of its pose: `T_flange_target` or `T_base_target`."""
        return f"T_{self.body.value}_target"


@dataclass(frozen=True)
class CameraView:
    """What one camera saw of one target at a station; the view bears the station's name.

    Examples
    --------
    >>> corners = np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0], [9.0, 9.0]])  # pixels
    >>> CameraView("left", "table", View("stop_1", Pose.identity(), np.arange(4), corners)).camera
    'left'
    """

    camera: str
    target: str
    view: View


@dataclass(frozen=True)
class Station:
    """One stop of the arm, and what every camera saw there.

    Raises
    ------
    InputError
        No view, a camera that saw a target twice, or views that differ in name, robot pose, joints or time.

    Examples
    --------
    >>> corners = np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0], [9.0, 9.0]])  # pixels
    >>> view = View("stop_1", Pose.identity(), np.arange(4), corners)
    >>> Station((CameraView("left", "table", view), CameraView("right", "table", view))).name
    'stop_1'
    """

    views: tuple[CameraView, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "views", tuple(self.views))
        if not self.views:
            raise InputError("a station without views", code=Code.NO_POINTS)
        seen: set[tuple[str, str]] = set()
        for one in self.views:
            if (one.camera, one.target) in seen:
                raise InputError(
                    f"station {self.name}: camera {one.camera} saw target {one.target} twice",
                    code=Code.DUPLICATE_VIEW,
                )
            seen.add((one.camera, one.target))
            for what in ("name", "T_base_flange", "joints_rad", "timestamp_s"):
                if getattr(one.view, what) != getattr(self.views[0].view, what):
                    raise InputError(
                        f"station {self.name}: camera {one.camera} has another {what} than "
                        f"{self.views[0].camera}",
                        code=Code.INVALID_FIELD,
                        hint="the views of a station are taken at one stop of the arm",
                    )

    @property
    def name(self) -> str:
        """Name of the station."""
        return self.views[0].view.name

    @property
    def T_base_flange(self) -> Pose:
        """Pose of the flange in the base, as the robot reports it."""
        return self.views[0].view.T_base_flange

    @property
    def joints_rad(self) -> tuple[float, ...] | None:
        """Joint positions (radians; metres for sliding joints); None if unknown."""
        return self.views[0].view.joints_rad


@dataclass(frozen=True)
class RigTruth:
    """What is known to be true, by name: `T_camera_flange` or `T_camera_base`, and Y of targets.

    Examples
    --------
    >>> list(RigTruth(cameras={"left": Pose.identity()}).cameras)
    ['left']
    """

    cameras: Mapping[str, Pose] = field(default_factory=dict[str, Pose])
    targets: Mapping[str, Pose] = field(default_factory=dict[str, Pose])


@dataclass(frozen=True)
class RigRecording:
    """Stations of an arm with named cameras and named targets, each on the flange or on the base.

    Parameters
    ----------
    name
        Name of the recording, one line.
    cameras, targets
        By name.
    stations
        In the order of recording.
    truth
        What is known to be true, None for most recordings.
    source
        Where the data came from, in words.

    Raises
    ------
    InputError
        Two stations of one name, a view of a camera or target that is not there, a point that the target does
        not have, a pixel far outside the image, or a name that is none.

    Examples
    --------
    >>> one = RigRecording.of(recording)
    >>> one.pair("camera", "target").views == recording.views
    True
    """

    name: str
    cameras: Mapping[str, MountedCamera]
    targets: Mapping[str, MountedTarget]
    stations: tuple[Station, ...]
    truth: RigTruth | None = None
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "stations", tuple(self.stations))
        if not self.cameras or not self.targets:
            raise InputError("a recording needs a camera and a target", code=Code.INVALID_FIELD)
        for what, names in (("camera", self.cameras), ("target", self.targets)):
            for name in names:
                if not _NAME.fullmatch(name):
                    raise InputError(
                        f"{what} {name[:60]!r}: expected a name of 1 to 40 letters, digits, '_' or '-'",
                        code=Code.INVALID_NAME,
                    )
        for station in self.stations:
            for one in station.views:
                for what, name, known in (
                    ("camera", one.camera, self.cameras),
                    ("target", one.target, self.targets),
                ):
                    if name not in known:
                        raise InputError(
                            f"station {station.name}: no {what} {name[:60]!r}, expected one of "
                            f"{', '.join(known)}",
                            code=Code.INVALID_FIELD,
                        )
        # The views of a pair are held to the rules of a recording: names, points and pixels.
        for camera, target in self.pairs:
            self.pair(camera, target)
        names = [station.name.lower() for station in self.stations]
        for name in names:
            if names.count(name) > 1:
                raise InputError(
                    f"station {name}: the name is there twice", code=Code.DUPLICATE_VIEW, hint="rename one"
                )

    def __len__(self) -> int:
        return len(self.stations)

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Camera and target of every pair of which there is a view, in the order of the names."""
        seen = {(one.camera, one.target) for station in self.stations for one in station.views}
        return tuple(pair for pair in product(self.cameras, self.targets) if pair in seen)

    def moves(self, camera: str, target: str) -> bool:
        """Tell whether the arm moves a camera and a target against each other."""
        return self.cameras[camera].body is not self.targets[target].body

    def pair(self, camera: str, target: str) -> Recording:
        """Return the views of one target through one camera, under the names of their stations.

        Where camera and target are fixed to the same body the mounting is that of the camera, and the robot's
        poses say nothing.
        """
        mounted = self.cameras[camera]
        truth = None
        if self.truth is not None and self.moves(camera, target):
            X, Y = self.truth.cameras.get(camera), self.truth.targets.get(target)
            if X is not None or Y is not None:
                truth = Truth(X, Y)
        return Recording(
            self.name,
            mounted.mounting,
            mounted.camera,
            self.targets[target].target,
            tuple(
                one.view
                for station in self.stations
                for one in station.views
                if (one.camera, one.target) == (camera, target)
            ),
            truth,
            self.source,
        )

    @property
    def single(self) -> Recording | None:
        """The recording of the one camera and one target, if there are no more and the arm moves them."""
        if len(self.cameras) > 1 or len(self.targets) > 1:
            return None
        (camera,), (target,) = self.cameras, self.targets
        return self.pair(camera, target) if self.moves(camera, target) else None

    @classmethod
    def of(cls, recording: Recording) -> "RigRecording":
        """Return a recording of one camera and one target as the simple case."""
        in_hand = recording.mounting is Mounting.EYE_IN_HAND
        truth = recording.truth
        return cls(
            recording.name,
            {CAMERA: MountedCamera(recording.camera, Body.FLANGE if in_hand else Body.BASE)},
            {TARGET: MountedTarget(recording.target, Body.BASE if in_hand else Body.FLANGE)},
            tuple(Station((CameraView(CAMERA, TARGET, view),)) for view in recording.views),
            None
            if truth is None
            else RigTruth(
                {} if truth.X is None else {CAMERA: truth.X},
                {} if truth.Y is None else {TARGET: truth.Y},
            ),
            recording.source,
        )

    @classmethod
    def of_views(
        cls,
        name: str,
        cameras: Mapping[str, MountedCamera],
        targets: Mapping[str, MountedTarget],
        views: Iterable[CameraView],
        truth: RigTruth | None = None,
        source: str = "",
    ) -> "RigRecording":
        """Return the recording of these views; those that follow each other under one name are a station."""
        stations = tuple(Station(tuple(group)) for _, group in groupby(views, lambda one: one.view.name))
        return cls(name, cameras, targets, stations, truth, source)

    def with_stations(self, stations: Iterable[Station]) -> "RigRecording":
        """Return the recording with other stations."""
        return replace(self, stations=tuple(stations))

    def rigid_pairs(self) -> tuple[tuple[str, str], ...]:
        """Pairs of cameras on one body, whose pose in each other's frame the arm does not move."""
        return tuple(
            (a, b) for a, b in combinations(self.cameras, 2) if self.cameras[a].body is self.cameras[b].body
        )
