"""A simulated cell with a realistic arm in which views are measured one at a time, with paired noise."""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.estimation import Measurements
from handeye.planning import Candidate
from handeye.robots import ArmKinematics
from handeye.robots.protocol import Goal
from handeye.robots.simulated import ArmErrors, SimulatedArm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate, simulated_arm
from handeye.types import Camera, Mounting, Pose, Recording, View
from handeye.types.arrays import FloatArray

PIXEL_SIGMA_PX = 0.1
# Border that no point of the target may touch.
MARGIN_PX = 20.0


@dataclass(frozen=True, eq=False)
class MeasuredCell:
    """A cell, its truth, and views that are taken when they are asked for.

    Parameters
    ----------
    recording
        Views without noise at random postures that show the whole target, and the camera as it is known.
    X, Y
        The truth of the chain.
    true_camera
        The camera, which is known only as well as its calibration says.
    errors
        Of the arm.
    seed
        Of the arm's errors and of all noise.
    """

    recording: Recording
    X: Pose
    Y: Pose
    true_camera: Camera
    errors: ArmErrors
    seed: int

    @property
    def kinematics(self) -> ArmKinematics:
        """The arm as it is described: without its errors."""
        return ArmKinematics(simulated_arm())

    def empty(self) -> Measurements:
        """Return measurements of no view."""
        return Measurements.of(self.recording.mounting, self.recording.camera, self.recording.target)

    def measure(self, joints_rad: tuple[float, ...], step: int, name: str, draw: int = 0) -> View:
        """Take the view of a posture as the `step`-th: noise depends on step and draw, not on the posture.

        So all policies meet the same noise. Another draw is the same cell with another arm of the same kind:
        its constant errors are noise too, to the planner.
        """
        home = self.recording.views[0].joints_rad or ()
        arm = SimulatedArm(simulated_arm(), self.errors, self.seed + draw, home)
        arm.move_to(Goal(f"step_{step}", Pose.identity(), joints_rad))
        chain = (self.X @ self.recording.mounting.chain(arm.hidden_pose) @ self.Y).matrix
        target = self.recording.target
        pixels, _ = _core.project_features(
            self.true_camera.lens, self.true_camera.parameters, chain, target.points, target.radii_m
        )
        random = np.random.default_rng([self.seed, 5, step, draw])
        noisy = pixels + PIXEL_SIGMA_PX * random.standard_normal(pixels.shape)
        reported = arm.read_pose()
        ids = np.arange(target.point_count)
        return View(name, reported.T_base_flange, ids, noisy, joints_rad=joints_rad)

    def reachable(self, seen: FloatArray, near: tuple[float, ...]) -> list[Candidate]:
        """Return those of `T_camera_target` (N, 4, 4) that the arm reaches and that show the whole target."""
        chain = self.X.inverse().matrix @ seen @ self.Y.inverse().matrix
        in_hand = self.recording.mounting is Mounting.EYE_IN_HAND
        flange = np.linalg.inv(chain) if in_hand else chain
        joints, reached = simulated_arm().inverse_all(flange, np.array(near), attempts=4)
        return [
            Candidate(f"lattice_{k:02d}", Pose(flange[k]), tuple(joints[k].tolist()))
            for k in range(len(seen))
            if reached[k] and self.shows(seen[k])
        ]

    def shows(self, T_camera_target: FloatArray) -> bool:
        """Tell whether the whole target is in the image at `T_camera_target` (4, 4)."""
        points = self.recording.target.points @ T_camera_target[:3, :3].T + T_camera_target[:3, 3]
        camera = self.true_camera
        pixels, seen = _core.project(camera.lens, camera.parameters, points)
        size = np.array(camera.size_px)
        inside = (pixels >= MARGIN_PX) & (pixels <= size - 1 - MARGIN_PX)
        return bool(seen.all() and inside.all())


def measured_cell(
    number: int, mounting: Mounting, errors: ArmErrors, *, pool_size: int = 120, seed: int = 0
) -> MeasuredCell:
    """Draw a cell; the same for the same number and seed.

    Raises
    ------
    SolveError
        No views could be drawn.
    """
    noise = (PIXEL_SIGMA_PX, PIXEL_SIGMA_PX)
    options = CellOptions(mounting=mounting, views=(pool_size, pool_size), pixel_sigma_px=noise)
    recording = simulate(ErrorKind.PIXEL_ONLY, number, options, seed=seed)
    camera, truth = recording.camera, recording.truth
    if camera.covariance is None or truth is None or truth.X is None or truth.Y is None:
        raise AssertionError("a simulated cell has its truth, and a camera with a covariance")
    random = np.random.default_rng([seed, 4, number])
    off = random.multivariate_normal(np.zeros(len(camera.parameters)), camera.covariance, method="cholesky")
    true_camera = Camera(camera.lens, camera.parameters + off, *camera.size_px)
    return MeasuredCell(recording, truth.X, truth.Y, true_camera, errors, int(random.integers(2**31)))
