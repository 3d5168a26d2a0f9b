"""Calibrate from a recording, and see how far the answer can be trusted."""

import numpy as np
from handeye.evaluation.region import position_region

from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.solving import solve

# A folder with recording.toml and corners/; this one comes with the package.
recording = read_recording(shipped_recording()).recording
calibration = solve(recording)

T_flange_camera = calibration.results["T_flange_camera"]
x, y, z = T_flange_camera.translation * 1e3
print(f"the camera sits at {x:.2f} {y:.2f} {z:.2f} mm in the flange frame")
print("turned by the quaternion (x y z w)", np.round(T_flange_camera.quaternion_xyzw, 5))

sigma_mm = calibration.sigma_translation_m * 1e3
sigma_deg = np.rad2deg(calibration.sigma_rotation_rad)
region = position_region(calibration)
print(f"one standard deviation: {sigma_mm:.3f} mm, {sigma_deg:.4f} deg")
print("95 % ellipsoid of the position, semi-axes in mm:", np.round(region.semi_axes_m * 1e3, 3))

noise = calibration.noise
robot_mm = noise.robot_translation_m * 1e3
print(f"found in the data: the robot errs by {robot_mm:.3f} mm, on the side of the {noise.robot_side}")

# The pictures were rendered, so the truth is known; X of the chain is T_camera_flange.
assert recording.truth is not None
assert recording.truth.X is not None
error = T_flange_camera @ recording.truth.X
print(f"true error: {np.linalg.norm(error.translation) * 1e3:.3f} mm")
