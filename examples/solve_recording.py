"""Calibrate from a recording, and see how far the answer can be trusted."""

import numpy as np

from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.estimation import solve
from handeye.estimation.confidence import within

# A folder with recording.toml and corners/; this one comes with the package.
recording = read_recording(shipped_recording()).recording
calibration = solve(recording)

T_flange_camera = calibration.results["T_flange_camera"]
x, y, z = T_flange_camera.translation * 1e3
print(f"the camera sits at {x:.2f} {y:.2f} {z:.2f} mm in the flange frame")
print("turned by the quaternion (x y z w)", np.round(T_flange_camera.quaternion_xyzw, 5))

known = within(calibration.covariance, calibration.degrees_of_freedom)
print(f"with 95 % probability within {known.translation_mm:.3f} mm and {known.rotation_deg:.4f} deg")

robot_mm = calibration.noise.robot_translation_m * 1e3
print(f"found in the data: the robot errs by {robot_mm:.4f} mm per axis, another way at each view")

# The pictures were rendered, so the truth is known; X of the chain is T_camera_flange.
assert recording.truth is not None
assert recording.truth.X is not None
error = T_flange_camera @ recording.truth.X
print(f"true error: {np.linalg.norm(error.translation) * 1e3:.3f} mm")
