"""Made-up cells: consistent with their truth, the same for the same seed, wrong in the way they claim."""

from dataclasses import replace

import numpy as np
import pytest

from handeye import _core
from handeye.detection import Detection, calibrate_camera
from handeye.errors import SolveError
from handeye.simulation.cells import (
    CellOptions,
    ErrorKind,
    camera_information,
    simulate,
    simulate_cell,
    simulated_arm,
)
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording

NO_PIXELS = CellOptions(pixel_sigma_px=(1e-9, 1e-9), views=(8, 8))


def discrepancies(recording: Recording) -> np.ndarray:
    """(K, 6) twist, in the camera frame, between the chain with reported poses and the pose in the image."""
    assert recording.truth is not None
    X, Y = recording.truth.X, recording.truth.Y
    assert X is not None
    assert Y is not None
    twists: list[np.ndarray] = []
    for view in recording.views:
        chain = X @ recording.mounting.chain(view.T_base_flange) @ Y
        args = (recording.camera.lens, recording.camera.parameters, recording.target.points[view.point_ids])
        found = _core.refine_pose(*args, np.zeros(len(view)), view.pixels, chain.matrix)[0]
        twists.append((chain @ Pose(found).inverse()).log())
    return np.array(twists)


@pytest.mark.parametrize("mounting", Mounting)
def test_without_errors_the_chain_closes(mounting: Mounting) -> None:
    recording = simulate(ErrorKind.PIXEL_ONLY, 1, replace(NO_PIXELS, mounting=mounting))
    assert len(recording) == 8
    assert recording.mounting is mounting
    assert np.abs(discrepancies(recording)).max() < 1e-8


EXACT_ROBOT = {
    ErrorKind.PIXEL_ONLY,
    ErrorKind.WRONG_INTRINSICS,
    ErrorKind.SAME_PICTURES,
    ErrorKind.BOARD_SCALE,
    ErrorKind.FOCAL,
    ErrorKind.PIXEL_FIELD,
}


@pytest.mark.parametrize("kind", [kind for kind in ErrorKind if kind not in EXACT_ROBOT])
def test_every_kind_of_robot_error_opens_the_chain(kind: ErrorKind) -> None:
    twists = discrepancies(simulate(kind, 1, NO_PIXELS))
    most = 0.05 if kind is ErrorKind.ROBOT_NOISE_1_DEG else 5e-3
    assert 1e-5 < np.linalg.norm(twists[:, :3], axis=1).mean() < most
    assert 1e-5 < np.linalg.norm(twists[:, 3:], axis=1).mean() < most


def test_the_camera_of_the_same_pictures_says_so() -> None:
    recording = simulate(ErrorKind.SAME_PICTURES, 1)
    assert recording.camera.from_views
    assert recording.camera.covariance is not None
    assert not simulate(ErrorKind.PIXEL_ONLY, 1).camera.from_views


def test_numbers_seeds_and_kinds_make_different_cells() -> None:
    first = simulate(ErrorKind.WHITE_BASE, 1)
    assert first == simulate(ErrorKind.WHITE_BASE, 1)
    for other in (
        simulate(ErrorKind.WHITE_BASE, 2),
        simulate(ErrorKind.WHITE_BASE, 1, seed=1),
        simulate(ErrorKind.WHITE_FLANGE, 1),
    ):
        assert first.truth != other.truth


def test_views_are_in_the_image_and_differ() -> None:
    for number in range(5):
        recording = simulate(ErrorKind.PIXEL_ONLY, number)
        assert 8 <= len(recording) <= 12
        for view in recording.views:
            assert view.pixels.min() > 15
            assert (view.pixels.max(axis=0) < np.array([1265, 1009])).all()
        poses = np.array([view.T_base_flange.matrix for view in recording.views])
        assert np.ptp(poses[:, :3, 3], axis=0).max() > 0.1


def test_the_camera_is_off_by_what_its_covariance_says() -> None:
    options = replace(NO_PIXELS, pixel_sigma_px=(0.1, 0.1))
    ratios: list[float] = []
    for number in range(24):
        recording = simulate(ErrorKind.PIXEL_ONLY, number, options)
        covariance = recording.camera.covariance
        assert covariance is not None
        # The true camera is not in the recording; one calibrated from the views is close to it.
        found = {view.name: Detection(view.point_ids, view.pixels) for view in recording.views}
        fitted = calibrate_camera(recording.target, found, recording.camera.size_px).camera
        assert fitted.covariance is not None
        shift = fitted.parameters[0] - recording.camera.parameters[0]
        ratios.append(shift**2 / (covariance[0, 0] + fitted.covariance[0, 0]))
    assert 0.4 < np.mean(ratios) < 2.0


def test_impossible_cells_are_refused() -> None:
    with pytest.raises(SolveError, match="attempts"):
        simulate(ErrorKind.PIXEL_ONLY, 0, CellOptions(distance_m=(3.0, 4.0)))


@pytest.mark.parametrize("kind", [ErrorKind.ENCODER, ErrorKind.JOINT_OFFSETS])
def test_the_robot_reports_the_pose_of_the_joints_it_reads(kind: ErrorKind) -> None:
    recording = simulate(kind, 2, NO_PIXELS)
    joints = np.array([view.joints_rad for view in recording.views])
    reported = np.array([view.T_base_flange.matrix for view in recording.views])
    np.testing.assert_allclose(simulated_arm().forward(joints), reported, atol=1e-12)


def test_camera_information_is_that_of_numerical_derivatives() -> None:
    camera = Camera("brown_conrady_4", [800, 810, 320, 240, -0.1, 0.05, 0.001, 0.002], 640, 480)
    target = Chessboard(4, 5, 0.03)
    pose = Pose.exp([-0.05, -0.04, 0.5, 0.2, -0.3, 0.1])

    def pixels(values: np.ndarray) -> np.ndarray:
        moved = Camera(camera.lens, camera.parameters + values[:8], *camera.size_px)
        return moved.project((Pose.exp(values[8:]) @ pose).act(target.points))[0].ravel()

    step = np.array([1e-3] * 4 + [1e-5] * 4 + [1e-6] * 6)
    columns = [(pixels(s * e) - pixels(-s * e)) / (2 * s) for s, e in zip(step, np.eye(14), strict=True)]
    jacobian = np.array(columns).T
    full = jacobian.T @ jacobian
    expected = full[:8, :8] - full[:8, 8:] @ np.linalg.solve(full[8:, 8:], full[8:, :8])
    scale = np.sqrt(np.diag(expected))
    found = camera_information(camera, target, pose.matrix)
    np.testing.assert_allclose(found / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-6)


def test_a_camera_of_the_same_pictures_is_that_on_an_arm_that_errs_too() -> None:
    cell = simulate_cell(ErrorKind.SAME_PICTURES_MIXTURE, 0)
    assert cell.arm is not None
    assert cell.recording.camera.from_views
    assert not simulate_cell(ErrorKind.MIXTURE_CELL, 0).recording.camera.from_views
