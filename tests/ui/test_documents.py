"""What the page is told to draw."""

import numpy as np
import pytest

from folders import made_recording
from handeye.estimation import Measurements, make_estimator
from handeye.estimation.work import USUAL_TOOL_M
from handeye.types import Mounting
from handeye.types.calibration import ModelName
from handeye.ui.documents import Shown, scene


@pytest.mark.parametrize("mounting", Mounting)
def test_ellipsoids_stand_at_camera_target_and_tool(mounting: Mounting) -> None:
    recording = made_recording(mounting=mounting)
    estimate = make_estimator(ModelName.AUTO)(Measurements.of_recording(recording))
    shown = Shown(mounting, recording.camera, recording.target, None, recording.views, estimate)
    drawn = {one["name"]: one for one in scene(shown)["ellipsoids"]}
    assert list(drawn) == ["camera", "a point at the target", "tool"]
    at = recording.views[-1].T_base_flange
    np.testing.assert_allclose(drawn["tool"]["middle"], at.act([USUAL_TOOL_M])[0], atol=1e-4)
    camera = (at if mounting is Mounting.EYE_IN_HAND else at @ at.inverse()) @ estimate.X.inverse()
    np.testing.assert_allclose(drawn["camera"]["middle"], camera.translation, atol=1e-4)
    # What a rotation of the camera moves is known worse, the farther it is from the camera.
    assert drawn["tool"]["longest_mm"] > drawn["camera"]["longest_mm"]
