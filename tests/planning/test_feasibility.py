"""Candidates that an arm can take and that show the target."""

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.estimation import Measurements, make_estimator
from handeye.planning.constraints import ViewLimits
from handeye.planning.feasibility import Generator
from handeye.robots import open_arm
from handeye.session.configuration import begin, prepare
from handeye.types import Mounting
from handeye.types.calibration import ModelName
from sessions import configured


@pytest.mark.parametrize("mounting", list(Mounting))
def test_no_candidate_breaks_a_limit_judged_by_the_truth(mounting: Mounting, tmp_path) -> None:  # noqa: ANN001
    prepared = prepare(configured(11, mounting=mounting, most_views=5))
    session, store = begin(prepared, tmp_path / "s")
    session.run()
    store.close()
    measurements = Measurements.of_recording(store.recording)
    estimate = make_estimator(ModelName.AUTO)(measurements)
    limits = ViewLimits(distance_m=(0.3, 0.8), tilt_rad=float(np.deg2rad(40)), margin_px=25.0)
    generator = Generator(prepared.arm, prepared.cell.workspace, limits)
    postures = [view.joints_rad or () for view in store.recording.views]
    drawn = generator.draw(estimate, postures, np.random.default_rng(0), shunned=[])
    again = generator.draw(estimate, postures, np.random.default_rng(0), shunned=[])
    assert [c.T_base_flange for c in drawn.pool.candidates] == [
        c.T_base_flange for c in again.pool.candidates
    ]
    assert len(drawn.pool) > 30
    assert sum(drawn.turned_down.values()) + len(drawn.pool) == 900
    assert prepared.truth is not None
    X, Y = prepared.truth.X, prepared.truth.Y
    assert X is not None
    assert Y is not None
    camera, target = prepared.cell.camera, prepared.cell.target
    for candidate in drawn.pool.candidates:
        joints = drawn.joints[candidate.name]
        assert prepared.arm.within_limits(joints)
        assert prepared.cell.workspace.contains(candidate.T_base_flange.translation)
        assert np.allclose(prepared.arm.forward(joints), candidate.T_base_flange.matrix, atol=1e-9)
        seen = X @ mounting.chain(candidate.T_base_flange) @ Y
        pixels, good = camera.project(seen.act(target.points))
        assert good.all()
        assert (pixels > 20).all()
        assert (pixels < np.array(camera.size_px) - 21).all()
        middle = seen.act(target.points.mean(axis=0)[np.newaxis])[0]
        assert 0.29 < np.linalg.norm(middle) < 0.81
        assert seen.rotation[:, 2] @ middle / np.linalg.norm(middle) > np.cos(np.deg2rad(41))
    # A place where it failed is left alone.
    lost = drawn.joints[drawn.pool.candidates[0].name]
    wary = generator.draw(estimate, postures, np.random.default_rng(0), shunned=[lost])
    assert len(wary.pool) < len(drawn.pool)
    assert all(np.abs(q - lost).max() > 0 for q in wary.joints.values())


def test_limits_have_an_inside() -> None:
    assert open_arm("ur5e").within_limits(np.zeros(6))
    for bad in ({"distance_m": (0.5, 0.4)}, {"tilt_rad": 2.0}, {"margin_px": -1.0}):
        with pytest.raises(InputError):
            ViewLimits(**bad)
