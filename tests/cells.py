"""A made-up cell: truth, a board, a camera, and views from robot poses that the test chooses."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye import _core
from handeye.types import Camera, Chessboard, Mounting, Pose, Target, View
from handeye.types.arrays import FloatArray


def random_pose(random: np.random.Generator, metres: float, radians: float) -> Pose:
    """Return a pose with a translation up to `metres` per axis, turned by up to `radians` about any axis."""
    axis = random.normal(size=3)
    turn = axis / np.linalg.norm(axis) * random.uniform(0, radians)
    return Pose.exp(np.concatenate([np.zeros(3), turn])) @ Pose.exp(
        np.concatenate([random.uniform(-metres, metres, 3), np.zeros(3)])
    )


@dataclass
class Cell:
    """Truth of a made-up calibration."""

    random: np.random.Generator
    mounting: Mounting = Mounting.EYE_IN_HAND
    target: Target = field(default_factory=lambda: Chessboard(7, 9, 0.03))
    camera: Camera = field(
        default_factory=lambda: Camera(
            "brown_conrady_5", [1400, 1395, 640, 512, -0.1, 0.05, 1e-3, -5e-4, 0.01], 1280, 1024
        )
    )

    def __post_init__(self) -> None:
        """Draw X and Y."""
        self.X = random_pose(self.random, 0.15, 3)
        self.Y = random_pose(self.random, 1.0, 3)

    def robot_pose(self, T_camera_target: Pose) -> Pose:
        """Return the robot pose that shows the target so."""
        A = self.X.inverse() @ T_camera_target @ self.Y.inverse()
        return A.inverse() if self.mounting is Mounting.EYE_IN_HAND else A

    def look(self, tilt_rad: float = 0.6, roll_rad: float = 1.5) -> Pose:
        """Return a random view of the target: `T_camera_target`, the target's middle near the axis."""
        turn = self.random.uniform(-1, 1, 3) * [tilt_rad, tilt_rad, roll_rad]
        return self.aimed(Pose.exp(np.concatenate([np.zeros(3), turn])).rotation)

    def aimed(self, rotation: FloatArray) -> Pose:
        """Return `T_camera_target` of a rotation (3, 3) with the target's middle near the optical axis."""
        middle = np.mean(self.target.points, axis=0)
        aim = np.append(self.random.uniform(-0.03, 0.03, 2), self.random.uniform(0.6, 0.9))
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = aim - rotation @ middle
        return Pose(matrix)

    def turned(self, first: Pose, turn: FloatArray) -> Pose:
        """Return the robot pose whose rotation is the first's times `exp(turn)`, and that sees the target."""
        relative = Pose.exp(np.concatenate([np.zeros(3), turn]))
        seen = self.X @ self.mounting.chain(first @ relative) @ self.Y
        return self.robot_pose(self.aimed(seen.rotation))

    def view(
        self, name: str, T_base_flange: Pose, *, sigma_px: float = 0.0, reported: Pose | None = None
    ) -> View:
        """Take a view where the robot truly is; it reports `reported` if given."""
        A = self.mounting.chain(T_base_flange)
        pixels, seen = _core.project_features(
            self.camera.lens,
            self.camera.parameters,
            (self.X @ A @ self.Y).matrix,
            self.target.points,
            self.target.radii_m,
        )
        assert seen.all()
        noise = self.random.normal(size=pixels.shape) * sigma_px
        return View(name, reported or T_base_flange, np.arange(len(pixels)), pixels + noise)

    def views(
        self, poses: Sequence[Pose], *, sigma_px: float = 0.0, robot_sigma: FloatArray | None = None
    ) -> list[View]:
        """Take views at robot poses; `robot_sigma` (6,) is the deviation of the pose on the flange side."""
        views: list[View] = []
        for i, pose in enumerate(poses):
            sigma = np.zeros(6) if robot_sigma is None else robot_sigma
            reported = pose @ Pose.exp(self.random.normal(size=6) * sigma)
            views.append(self.view(f"view_{i:02d}", pose, sigma_px=sigma_px, reported=reported))
        return views
