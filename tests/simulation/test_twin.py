"""The twin of the paper's cell: an arm as wrong as it is said to be, and parts that are kept apart."""

import sys
from pathlib import Path

import numpy as np
import pytest

from handeye import _core
from handeye.compute.checkpoint import Checkpoint
from handeye.errors import InputError
from handeye.simulation.twin import SIZE_PX, TARGET, TwinOptions, arm_error, twin_set
from handeye.studies.comparison import POLICIES
from handeye.studies.twin import Twin, study_twin, trajectories
from handeye.studies.twin_plots import table_figure, trajectory_figure
from handeye.types import Pose

SMALL = TwinOptions(training_views=10, validation_views=4)


@pytest.fixture(scope="module")
def twin() -> Twin:
    return study_twin(models=("paper",), sets=2, trials=1, options=SMALL)


def test_the_arm_is_as_wrong_as_asked_and_the_truth_explains_the_pixels_better() -> None:
    one = twin_set(0)
    assert one.arm_error_mm == pytest.approx(1.0, rel=1e-3)
    assert 0.02 < one.arm_error_deg < 0.5
    recording = one.recording
    truth = recording.truth
    assert truth is not None
    assert truth.X is not None
    assert truth.Y is not None
    off = []
    for view in recording.views:
        assert view.joints_rad is not None
        pose = truth.X @ recording.mounting.chain(view.T_base_flange) @ truth.Y
        pixels, _ = recording.camera.project(pose.act(TARGET.points))
        off.append(np.linalg.norm(pixels - view.pixels, axis=1).mean())
        assert (view.pixels > 0).all()
        assert (view.pixels < SIZE_PX).all()
    # About a millimetre at half a metre and some tenths of a degree, with a focal length of 1400 px.
    assert 1 < np.mean(off) < 30


def test_a_base_that_stands_elsewhere_is_no_error_of_the_arm() -> None:
    random = np.random.default_rng(2)
    true = _core.se3_exp(random.normal(size=(8, 6)) * 0.5)
    base, flange = Pose.exp([0.01, 0.02, -0.01, 0.02, 0, 0.01]), Pose.exp([0.003, 0, 0, 0, 0.02, 0])
    moved = base.matrix @ true @ flange.matrix
    assert max(arm_error(moved, true)) < 1e-6
    wrong = moved @ _core.se3_exp(np.tile([1e-3, 0, 0, 0, 0, 0], (8, 1)) * np.array([[1], [-1]] * 4))
    assert 0.3e-3 < arm_error(wrong, true)[0] < 1.01e-3


def test_a_set_depends_on_its_number_and_the_seed_alone() -> None:
    first, again, other = twin_set(1, SMALL), twin_set(1, SMALL), twin_set(1, SMALL, seed=1)
    assert first.recording == again.recording
    assert first.recording != other.recording
    assert len(first.training) == 10
    assert set(first.training).isdisjoint(first.validation)


def test_pictures_may_be_rendered_and_the_circles_are_found_where_they_are() -> None:
    options = TwinOptions(training_views=8, validation_views=2, rendered=True)
    seen, projected = twin_set(0, options), twin_set(0, TwinOptions(training_views=8, validation_views=2))
    assert len(seen.recording) == 10
    off = [
        np.abs(a.pixels[np.argsort(a.point_ids)] - b.pixels).max()
        for a, b in zip(seen.recording.views, projected.recording.views, strict=True)
    ]
    assert max(off) < 0.3


def test_what_validates_is_never_chosen(twin: Twin) -> None:
    for one, result in zip(twin.sets, twin.models["paper"].sets, strict=True):
        for trial in result.trials:
            assert trial.trial.held_out == one.validation
            assert set(trial.trial.start) | set(trial.trial.pool) == set(one.training)
            assert {len(trial.steps[policy]) for policy in POLICIES} == {6}


def test_the_pictures_say_what_was_run(twin: Twin) -> None:
    text = table_figure(twin).get_suptitle()
    assert "2 sets x 1 random starts" in text
    paths = trajectories(twin)
    assert [len(path) for path in paths.values()] == [8, 8, 8]
    for path in paths.values():
        assert np.array_equal([p.matrix for p in path[:3]], [p.matrix for p in paths["random"][:3]])
    assert len(trajectory_figure(twin).axes) == 3


def test_what_was_finished_is_not_run_again(
    twin: Twin, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kept() -> Twin:
        return study_twin(models=("paper",), sets=2, trials=1, options=SMALL, workers=Checkpoint(tmp_path))

    assert kept().to_dict() == twin.to_dict()
    monkeypatch.setattr(sys.modules[study_twin.__module__], "run_trial", None)
    assert kept().to_dict() == twin.to_dict()


def test_what_cannot_be_run_is_refused() -> None:
    with pytest.raises(InputError, match="expected some of paper"):
        study_twin(models=("perfect",))
    with pytest.raises(InputError):
        TwinOptions(training_views=5)
