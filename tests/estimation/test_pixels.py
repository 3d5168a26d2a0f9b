"""What pixels say by themselves, and measurements that follow a camera."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.estimation import Measurements
from handeye.estimation.camera_prior import camera_prior
from handeye.estimation.cell_fit import fit_cell
from handeye.estimation.pixels import camera_of_pixels, moved_cameras, pixels_of
from handeye.estimation.rig_measurements import RigMeasurements
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Camera
from handeye.types.rig import CAMERA, TARGET

MEASURED = Measurements.of_recording(simulate(ErrorKind.FOCAL, 0, CellOptions(views=(12, 12)), seed=3))


def longer(camera: Camera, share: float, covariance: np.ndarray | None = None) -> Camera:
    """The same camera with focal lengths that are longer by a share."""
    parameters = np.array(camera.parameters)
    parameters[:2] *= 1 + share
    return Camera(camera.lens, parameters, *camera.size_px, covariance=covariance)


def test_poses_refined_near_a_camera_are_those_found_from_nothing() -> None:
    camera = longer(MEASURED.camera, 0.002)
    again, near = MEASURED.through(camera), MEASURED.near(camera)
    assert len(near) == len(again) == len(MEASURED)
    assert np.allclose(near.camera_poses, again.camera_poses, atol=1e-7)
    assert np.abs(near.camera_poses - MEASURED.camera_poses).max() > 1e-4
    for one, other in zip(near.poses, again.poses, strict=True):
        assert one.rmse_px == pytest.approx(other.rmse_px, rel=1e-6)
        assert np.allclose(one.information, other.information, rtol=1e-5)
        assert (one.mirrored is None) == (other.mirrored is None)
        if one.mirrored is not None and other.mirrored is not None:
            assert one.mirrored[1] == pytest.approx(other.mirrored[1], rel=1e-6)


def test_a_view_that_cannot_be_refined_is_measured_again() -> None:
    away = replace(MEASURED.poses[0], T_camera_target=MEASURED.poses[0].T_camera_target.inverse())
    lost = replace(MEASURED, poses=(away, *MEASURED.poses[1:]))
    near = lost.near(MEASURED.camera)
    assert [view.name for view in near.views] == [view.name for view in MEASURED.views]
    assert np.allclose(near.camera_poses, MEASURED.camera_poses, atol=1e-7)


def test_pixels_find_the_camera_that_was_stated_wrongly() -> None:
    rig = RigMeasurements.of_one(MEASURED)
    prior = camera_prior(MEASURED.camera)
    pixels = pixels_of(rig, {CAMERA: prior})
    found = camera_of_pixels(pixels, CAMERA, prior)
    answer = fit_cell(rig).cameras[CAMERA]
    stated, seen = MEASURED.camera.parameters[0], answer.parameters[0]
    assert abs(seen - stated) > 1.0
    assert abs(found.parameters[0] - seen) < 0.5 * abs(seen - stated)
    assert list(pixels) == [(CAMERA, TARGET)]


def test_pixels_that_the_camera_comes_from_do_not_move_it() -> None:
    rig = RigMeasurements.of_one(MEASURED)
    prior = replace(camera_prior(MEASURED.camera), from_these_pixels=True)
    assert camera_of_pixels(pixels_of(rig, {CAMERA: prior}), CAMERA, prior) is prior.camera
    held = camera_prior(MEASURED.camera, fixed=True)
    assert camera_of_pixels(pixels_of(rig, {CAMERA: held}), CAMERA, held) is held.camera


def test_cameras_that_moved_by_pixels_are_told_from_those_that_did_not() -> None:
    priors = {CAMERA: camera_prior(MEASURED.camera)}
    for share, moves in ((1e-5, False), (0.01, True)):
        camera = longer(MEASURED.camera, share)
        assert moved_cameras(priors, {CAMERA: camera}) == ({CAMERA: camera} if moves else {})
