"""Pan-tilt units: two axes and no translation leave several readings alike; the usual mistake is named first."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.estimation.faults import diagnose
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, View

CAMERA = Camera("brown_conrady_5", [1200, 1200, 639.5, 511.5, 0, 0, 0, 0, 0], 1280, 1024)


def pan_tilt(seed: int) -> Recording:
    """A camera on a unit that turns about z, then y; its z axis is the unit's x axis. Noise on all sides."""
    random = np.random.default_rng(seed)
    target = Chessboard(*((6, 9), (7, 10), (5, 8))[seed % 3], 0.025)
    looking = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    T_flange_camera = np.eye(4)
    T_flange_camera[:3, :3] = looking
    T_flange_camera[:3, 3] = random.uniform(-0.05, 0.05, 3)
    middle = np.append(-target.points.mean(axis=0), 1.0)[:3]
    T_base_target = np.eye(4)
    T_base_target[:3, :3] = looking @ Pose.exp([0, 0, 0, *random.uniform(-0.3, 0.3, 3)]).rotation
    T_base_target[:3, 3] = [random.uniform(0.6, 1.0), 0, 0] + T_base_target[:3, :3] @ middle
    views: list[View] = []
    for k in range(int(random.integers(10, 16))):
        pan, tilt = random.uniform(-0.25, 0.25, 2)
        pose = Pose.exp([0, 0, 0, 0, 0, pan]) @ Pose.exp([0, 0, 0, 0, tilt, 0])
        seen = np.linalg.inv(pose.matrix @ T_flange_camera) @ T_base_target
        points = target.points @ seen[:3, :3].T + seen[:3, 3]
        pixels = CAMERA.project(points)[0] + random.normal(0, 0.1, (len(points), 2))
        off = Pose.exp(random.normal(0, [5e-5] * 3 + [2e-4] * 3))
        views.append(View(f"v{k:02d}", pose @ off, np.arange(len(points)), pixels))
    return Recording("pan_tilt", Mounting.EYE_IN_HAND, CAMERA, target, tuple(views))


# Of 25 the inverted poses agree within 0.3 mm and 0.2 degrees.
@pytest.mark.parametrize("seed", [1, 2, 25])
def test_inverted_poses_are_named(seed: int) -> None:
    clean = pan_tilt(seed)
    assert diagnose(clean).findings == ()
    inverted = clean.with_views(
        replace(view, T_base_flange=view.T_base_flange.inverse()) for view in clean.views
    )
    diagnosis = diagnose(inverted)
    assert diagnosis.findings[0].code == "wrong_direction"
    assert diagnosis.refused is not None
