"""Old data gone through again: radii fall, a repeated view does nothing, and planning needs fewer."""

import numpy as np

from handeye.estimation import AutoEstimator, Measurements
from handeye.planning.hindsight import Pictures, hindsight
from handeye.simulation.cells import CellOptions, ErrorKind, simulate


def test_a_recording_in_hindsight() -> None:
    recording = simulate(ErrorKind.WHITE_FLANGE, 3, CellOptions(views=(9, 9)))
    measurements = Measurements.of_recording(recording)
    found = hindsight(Pictures(measurements, AutoEstimator()))
    names = [view.name for view in recording.views]
    assert [step.view for step in found.steps] == names[2:]
    assert sorted(step.view for step in found.planned) == sorted(names[2:])
    last, planned = found.steps[-1].within, found.planned[-1].within
    assert last is not None
    assert planned is not None
    np.testing.assert_allclose(planned.translation_mm, last.translation_mm, rtol=0.05)
    assert found.enough is not None
    assert 3 <= found.enough <= 9
    assert len(found.repeat) == 3
    assert set(found.repeat) <= set(names)
    assert found.then is not None
    assert found.then.translation_mm < last.translation_mm
    assert found.then.rotation_deg < last.rotation_deg
