"""What several cameras saw of several targets: one `Measurements` per pair, and the stations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from handeye.estimation.measurements import Measurements
from handeye.types.camera import Camera
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose
from handeye.types.rig import CAMERA, TARGET, Body, MountedCamera, MountedTarget, RigRecording
from handeye.types.view import View

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class RigMeasurements:
    """Measurements of every pair of camera and target, by the names of their stations.

    Parameters
    ----------
    cameras, targets
        By name, in the order of the parameters.
    pairs
        What each camera saw of each target. Where the arm does not move the two against each other, motions
        are the identity.
    views
        One view of every station by its name, with the robot's pose as reported, in order.

    Examples
    --------
    >>> measured = RigMeasurements.of(rig)
    >>> measured.moves("left", "table"), measured.moves("front", "table")
    (True, False)
    """

    cameras: Mapping[str, MountedCamera]
    targets: Mapping[str, MountedTarget]
    pairs: Mapping[Pair, Measurements]
    views: Mapping[str, View]

    @classmethod
    def of(cls, recording: RigRecording, known: "RigMeasurements | None" = None) -> "RigMeasurements":
        """Measure the pose of the target in every view; those of `known` are not measured again."""
        pairs: dict[Pair, Measurements] = {}
        for pair in recording.pairs:
            one = recording.pair(*pair)
            before = None if known is None else known.pairs.get(pair)
            names = set[str]() if before is None else {v.name for v in before.views} | set(before.rejected)
            if before is None or not names <= {view.name for view in one.views}:  # one was taken back
                before, names = Measurements.of(one.mounting, one.camera, one.target), set[str]()
            new = [view for view in one.views if view.name not in names]
            if not recording.moves(*pair):
                new = [replace_pose(view, Pose.identity()) for view in new]
            pairs[pair] = before.with_views(new)
        views = {station.name: station.views[0].view for station in recording.stations}
        return cls(recording.cameras, recording.targets, pairs, views)

    @classmethod
    def of_one(cls, measurements: Measurements) -> "RigMeasurements":
        """Return the measurements of one camera and one target as the simple case."""
        in_hand = measurements.mounting is Mounting.EYE_IN_HAND
        camera = MountedCamera(measurements.camera, Body.FLANGE if in_hand else Body.BASE)
        target = MountedTarget(measurements.target, Body.BASE if in_hand else Body.FLANGE)
        return cls(
            {CAMERA: camera},
            {TARGET: target},
            {(CAMERA, TARGET): measurements},
            {view.name: view for view in measurements.views},
        )

    def moves(self, camera: str, target: str) -> bool:
        """Tell whether the arm moves a camera and a target against each other."""
        return self.cameras[camera].body is not self.targets[target].body

    def through(self, cameras: Mapping[str, Camera]) -> "RigMeasurements":
        """Return the measurements as made through other cameras: their poses found again."""
        return self._with_cameras(cameras, Measurements.through)

    def near(self, cameras: Mapping[str, Camera]) -> "RigMeasurements":
        """Return the measurements as made through cameras close to these: their poses refined."""
        return self._with_cameras(cameras, Measurements.near)

    def _with_cameras(
        self, cameras: Mapping[str, Camera], measured_through: Callable[[Measurements, Camera], Measurements]
    ) -> "RigMeasurements":
        return replace(
            self,
            cameras={
                name: replace(one, camera=cameras.get(name, one.camera)) for name, one in self.cameras.items()
            },
            pairs={
                (camera, target): measured_through(measured, cameras[camera])
                if camera in cameras
                else measured
                for (camera, target), measured in self.pairs.items()
            },
        )

    def with_pairs(self, pairs: Mapping[Pair, Measurements]) -> "RigMeasurements":
        """Return the measurements with other views of some pairs."""
        return replace(self, pairs={**self.pairs, **pairs})

    @cached_property
    def stations(self) -> tuple[View, ...]:
        """One view of every station at which something was measured."""
        seen = {view.name for measured in self.pairs.values() for view in measured.views}
        return tuple(view for name, view in self.views.items() if name in seen)

    @cached_property
    def whole(self) -> Measurements:
        """The stations as the measurements of one camera: what the arm did, poses of targets left out."""
        first = next(iter(self.pairs.values()))
        return replace(first, views=self.stations, poses=())

    def of_camera(self, camera: str) -> dict[str, Measurements]:
        """Return what a camera saw, by target."""
        return {target: measured for (name, target), measured in self.pairs.items() if name == camera}


def replace_pose(view: View, pose: Pose) -> View:
    """Return a view with another pose of the robot."""
    return replace(view, T_base_flange=pose)
