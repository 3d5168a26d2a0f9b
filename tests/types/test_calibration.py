"""What a calibration says of itself in plain values."""

import numpy as np

from folders import made_recording
from handeye.estimation import solve


def test_the_covariance_is_in_the_order_that_it_names() -> None:
    calibration = solve(made_recording(9))
    data = calibration.to_dict()
    assert data["covariance_order"] == ["tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad"]
    covariance = np.array(data["covariance"])
    # Metres come first: their deviations are those that are told beside, and so are those of the radians.
    translation, rotation = np.trace(covariance[:3, :3]), np.trace(covariance[3:, 3:])
    assert np.sqrt(translation) == calibration.sigma_translation_m
    assert np.sqrt(rotation) == calibration.sigma_rotation_rad
