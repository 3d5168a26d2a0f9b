"""How well a lens is known, in pixels, is what its parameters' covariance leaves open in the image."""

from dataclasses import replace

import numpy as np

from cells import Cell
from handeye.estimation import Measurements, make_estimator
from handeye.estimation.lens_confidence import lens_difference_px, lens_within_px
from handeye.types import Camera
from handeye.types.calibration import ModelName

LENS = (900.0, 905.0, 640.0, 500.0, -0.1, 0.03, 0.001, -0.001, 0.01)


def test_the_statement_holds_what_it_says() -> None:
    random = np.random.default_rng(3)
    cell = Cell(random)
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(8)], sigma_px=0.1)
    estimate = make_estimator(ModelName.AUTO)(Measurements.of(cell.mounting, cell.camera, cell.target, views))
    camera = Camera("brown_conrady_5", LENS, 1280, 1000)
    root = (
        0.1 * random.standard_normal((9, 9)) * np.array([9, 9, 9, 9, 0.02, 0.02, 2e-3, 2e-3, 0.02])[:, None]
    )
    covariance = np.eye(21)
    covariance[12:, 12:] = root @ root.T
    estimate = replace(
        estimate, camera=camera, covariance=covariance, free_camera=tuple(range(9)), degrees_of_freedom=np.inf
    )
    stated = lens_within_px(estimate)
    drawn = [
        lens_difference_px(
            camera, camera.with_parameters(camera.parameters + root @ random.standard_normal(9))
        )
        for _ in range(600)
    ]
    assert 0.92 < np.mean(np.array(drawn) < stated) < 0.98
    # Few degrees of freedom have longer tails, and a camera that is held is not in doubt.
    assert lens_within_px(replace(estimate, degrees_of_freedom=4.0)) > 1.2 * stated
    assert lens_within_px(replace(estimate, free_camera=())) == 0.0


def test_a_turn_of_the_camera_is_no_other_lens() -> None:
    camera = Camera("brown_conrady_5", LENS, 1280, 1000)
    assert lens_difference_px(camera, camera) == 0.0
    # A small shift of the centre is nearly a turn; another focal length is not.
    shifted = camera.with_parameters(camera.parameters + np.eye(9)[2])
    longer = camera.with_parameters(camera.parameters + 5 * np.eye(9)[0])
    assert lens_difference_px(camera, shifted) < 0.5
    assert lens_difference_px(camera, longer) > 1.0
