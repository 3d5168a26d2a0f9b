"""The shipped recording is what its script makes of the public pictures."""

from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import read_recording
from handeye.datasets.images import read_image
from handeye.datasets.rwhe_calib import read_poses
from handeye.datasets.shipped import SHIPPED, shipped_recording
from handeye.detection import Detection, detect


@pytest.mark.parametrize("name", ["im_01", "im_17"])
def test_corners_are_those_that_detection_finds(rwhe_calib: Path, name: str) -> None:
    recording = read_recording(shipped_recording()).recording
    found = detect(read_image(rwhe_calib / SHIPPED / f"{name}.png"), recording.target)
    assert isinstance(found, Detection)
    view = recording.view(name)
    np.testing.assert_array_equal(view.point_ids, found.point_ids)
    # Shipped as an earlier version measured them: it laid the windows once only, and larger.
    np.testing.assert_allclose(view.pixels, found.pixels, atol=4e-3)


def test_poses_are_those_of_the_set(rwhe_calib: Path) -> None:
    recording = read_recording(shipped_recording()).recording
    poses = read_poses(rwhe_calib / SHIPPED / "RobotPosesVec.txt")
    assert [view.T_base_flange for view in recording.views] == poses
