"""Views as the core takes them: flat arrays, the robot's motions, and the pose of the target in each view."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import HandeyeError, InputError
from handeye.types.arrays import FloatArray
from handeye.types.camera import Camera
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose, inverses
from handeye.types.recording import Recording, check_points
from handeye.types.target import Target
from handeye.types.view import View

MIN_POINTS = 4
_OF_VIEWS = {"flange_poses", "motions", "joints", "point_counts"}
_NO_IDS, _NO_PIXELS = np.zeros(0, dtype=np.int64), np.zeros((0, 2))


@dataclass(frozen=True)
class ViewPose:
    """The pose of the target in one view, from that view's image alone.

    Parameters
    ----------
    T_camera_target
        The pose that fits best.
    rmse_px
        Root mean square over the points of the residual's norm.
    information
        (6, 6) information of the pose's left perturbation at a pixel noise of 1 px.
    mirrored
        The second minimum of a planar target, and its `rmse_px`; None if there is only one.

    Examples
    --------
    >>> measurements.poses[0].information.shape
    (6, 6)
    """

    T_camera_target: Pose
    rmse_px: float
    information: FloatArray
    mirrored: tuple[Pose, float] | None

    @property
    def ambiguity_ratio(self) -> float:
        """Error of the mirrored pose over the error of the best; infinite if there is only one."""
        return float("inf") if self.mirrored is None else self.mirrored[1] / max(self.rmse_px, 1e-12)


def view_pose(camera: Camera, target: Target, view: View) -> ViewPose:
    """Find the pose of the target in one view.

    Parameters
    ----------
    camera
        The camera.
    target
        The target.
    view
        At least four of its points.

    Raises
    ------
    InputError, DegenerateError, SolveError
        Fewer than four points, points on a line, or no pose that fits; the message names the view.

    Examples
    --------
    >>> view_pose(camera, board, recording.views[0]).rmse_px < 1.0
    True
    """
    return _view_poses([_found(camera, target, view)])[0]


# Pose, root mean square and information.
_Fit = tuple[FloatArray, float, FloatArray]
# The better of two minima, and the other if there is one.
_Found = tuple[_Fit, _Fit | None]


def _found(camera: Camera, target: Target, view: View) -> _Found:
    if len(view) < MIN_POINTS:
        raise InputError(
            f"view {view.name}: {len(view)} points, at least {MIN_POINTS} are needed",
            code=Code.TOO_FEW_POINTS,
        )
    check_points(view, target)
    points = target.points[view.point_ids]
    radii = target.radii_m[view.point_ids]
    try:
        return _core.planar_pose(camera.lens, camera.parameters, points, radii, view.pixels)
    except HandeyeError as error:
        raise type(error)(f"view {view.name}: {error}", code=error.code, hint=error.hint) from error


def _view_poses(found: Sequence[_Found]) -> list[ViewPose]:
    matrices = [fit[0] for fits in found for fit in fits if fit is not None]
    poses = iter(Pose.of_matrices(np.array(matrices).reshape(-1, 4, 4)))
    return [
        ViewPose(next(poses), best[1], best[2], None if other is None else (next(poses), other[1]))
        for best, other in found
    ]


@dataclass(frozen=True, eq=False)
class Measurements:
    """Views of one target through one camera, ready to be solved.

    Views whose pose cannot be found alone do not belong here: `Measurements.of` leaves them out and says so
    in `rejected`.

    Examples
    --------
    >>> measured = Measurements.of_recording(recording)
    >>> len(measured), measured.motions.shape
    (9, (9, 4, 4))
    """

    mounting: Mounting
    camera: Camera
    target: Target
    views: tuple[View, ...]
    poses: tuple[ViewPose, ...]
    rejected: dict[str, str] = field(default_factory=dict[str, str])

    @classmethod
    def of(
        cls, mounting: Mounting, camera: Camera, target: Target, views: Iterable[View] = ()
    ) -> "Measurements":
        """Measure the pose of the target in every view."""
        return cls(mounting, camera, target, (), ()).with_views(views)

    @classmethod
    def of_recording(cls, recording: Recording) -> "Measurements":
        """Take the views of a recording."""
        return cls.of(recording.mounting, recording.camera, recording.target, recording.views)

    def with_views(self, views: Iterable[View]) -> "Measurements":
        """Return the measurements with more views."""
        kept, rejected = list(self.views), dict(self.rejected)
        found: list[_Found] = []
        for view in views:
            try:
                pose = _found(self.camera, self.target, view)
            except HandeyeError as error:
                rejected[view.name] = error.message.removeprefix(f"view {view.name}: ")
            else:
                kept.append(view)
                found.append(pose)
        return replace(self, views=tuple(kept), poses=(*self.poses, *_view_poses(found)), rejected=rejected)

    def select(self, indices: Sequence[int]) -> "Measurements":
        """Return the measurements of these views, in this order."""
        return replace(
            self, views=tuple(self.views[i] for i in indices), poses=tuple(self.poses[i] for i in indices)
        )

    def without(self, names: Collection[str], why: str) -> "Measurements":
        """Return the measurements without some views, and why they are rejected."""
        kept = self.select([k for k, view in enumerate(self.views) if view.name not in names])
        gone = {view.name: why for view in self.views if view.name in names}
        return replace(kept, rejected={**self.rejected, **gone})

    def with_camera(self, camera: Camera) -> "Measurements":
        """Return the measurements as seen through a camera close to this one; poses stay as they are."""
        return replace(self, camera=camera)

    def through(self, camera: Camera) -> "Measurements":
        """Return the measurements as made through another camera: every pose found again."""
        again = Measurements(self.mounting, camera, self.target, (), (), dict(self.rejected))
        return again.with_views(self.views)

    def near(self, camera: Camera) -> "Measurements":
        """Return the measurements as made through a camera close to this one.

        Every pose is refined from the one it had; where that fails all are found from nothing.
        """
        mirrored = [(k, pose.mirrored[0].matrix) for k, pose in enumerate(self.poses) if pose.mirrored]
        problem = self.problem.through(camera.lens, camera.parameters)
        views = [*range(len(self)), *(k for k, _ in mirrored)]
        starts = np.concatenate([self.camera_poses, *(start[np.newaxis] for _, start in mirrored)])
        try:
            fits = problem.refined(views, starts)
        except HandeyeError:
            return self.through(camera)
        found = [
            ViewPose(pose, rmse_px, information, None)
            for pose, rmse_px, information in zip(Pose.of_matrices(fits[0]), *fits[1:], strict=True)
        ]
        poses = found[: len(self)]
        for (k, _), other in zip(mirrored, found[len(self) :], strict=True):
            best, worse = sorted((poses[k], other), key=lambda pose: pose.rmse_px)
            poses[k] = replace(best, mirrored=(worse.T_camera_target, worse.rmse_px))
        near = replace(self, camera=camera, poses=tuple(poses))
        # Arrays of the views are made once, whatever camera they are seen through.
        vars(near).update({name: vars(self)[name] for name in _OF_VIEWS & vars(self).keys()}, problem=problem)
        return near

    def __len__(self) -> int:
        return len(self.views)

    @cached_property
    def motions(self) -> FloatArray:
        """(K, 4, 4) A of the chain of each view."""
        return self.flange_poses if self.mounting is Mounting.EYE_TO_HAND else inverses(self.flange_poses)

    @cached_property
    def flange_poses(self) -> FloatArray:
        """(K, 4, 4) `T_base_flange` of each view, as reported."""
        return np.array([view.T_base_flange.matrix for view in self.views]).reshape(-1, 4, 4)

    @cached_property
    def joints(self) -> FloatArray:
        """(K, n) joint positions of each view, radians (metres for sliding joints).

        Raises
        ------
        InputError
            A view has none, or another number of them than the first.
        """
        for view in self.views:
            if view.joints_rad is None or len(view.joints_rad) != len(self.views[0].joints_rad or ()):
                raise InputError(
                    f"view {view.name}: {len(view.joints_rad or ())} joint positions, "
                    f"the first view has {len(self.views[0].joints_rad or ())}",
                    code=Code.NO_JOINTS,
                    hint="the arm's kinematics need the joint positions of every view: record them, or solve "
                    "without the arm",
                )
        return np.array([view.joints_rad for view in self.views], dtype=float)

    @cached_property
    def camera_poses(self) -> FloatArray:
        """(K, 4, 4) `T_camera_target` of each view, from its image alone."""
        return np.array([pose.T_camera_target.matrix for pose in self.poses]).reshape(-1, 4, 4)

    @cached_property
    def pose_information(self) -> FloatArray:
        """(K, 6, 6) information of each of these poses at a pixel noise of 1 px."""
        return np.array([pose.information for pose in self.poses]).reshape(-1, 6, 6)

    @cached_property
    def point_counts(self) -> FloatArray:
        """(K,) number of points of each view."""
        return np.array([len(view) for view in self.views], dtype=float)

    @cached_property
    def problem(self) -> _core.Problem:
        """The measurements inside the core."""
        ids = np.concatenate([_NO_IDS, *(view.point_ids for view in self.views)])
        return _core.Problem(
            self.camera.lens,
            self.camera.parameters,
            self.target.points[ids],
            self.target.radii_m[ids],
            np.concatenate([_NO_PIXELS, *(view.pixels for view in self.views)]),
            np.cumsum([0, *map(len, self.views)]),
            self.motions,
        )
