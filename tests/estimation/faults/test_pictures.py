"""A camera that is not that of the pictures is told from one that says itself how loosely it is known."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.estimation import Measurements
from handeye.estimation.faults import examine
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Camera


@pytest.mark.parametrize("number", [0, 2])
def test_residuals_that_the_calibration_announces_are_no_fault(number: int) -> None:
    cell = simulate(ErrorKind.PIXEL_ONLY, number, CellOptions(views=(10, 10)), seed=4)
    camera = cell.camera
    assert camera.covariance is not None
    off = np.zeros(len(camera.parameters))
    off[4] = 0.35
    loose = camera.covariance + np.diag(off**2)

    def seen_through(covariance: np.ndarray) -> Measurements:
        other = Camera(camera.lens, camera.parameters + off, *camera.size_px, covariance)
        return Measurements.of_recording(replace(cell, camera=other))

    codes = {finding.code for finding in examine(seen_through(loose)).findings}
    assert codes <= {"gross_pose"}
    with pytest.raises(InputError) as raised:
        examine(seen_through(camera.covariance))
    assert "camera" in raised.value.message
