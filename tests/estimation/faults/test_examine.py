"""Planted mistakes are named, clean recordings are left alone, and the answer survives."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.errors import InputError
from handeye.estimation import Measurements, solve
from handeye.estimation.faults import CODES, examine
from handeye.studies.planted import EXPECTED, Mistake, made_up, plant
from handeye.studies.protocol import true_hand_eye
from handeye.types import Chessboard, Mounting, Pose, Recording, View
from handeye.types.calibration import Finding
from handeye.validation import metrics

SINGLE = (Mistake.FLIP, Mistake.SWAP, Mistake.MOVING, Mistake.GROSS_POSE)
SHARED = (Mistake.WRONG_UNIT, Mistake.WRONG_DIRECTION)
# One of each target, mounting and error of the arm.
NUMBERS = (0, 5, 10, 19)


def found(recording: Recording) -> tuple[Finding, ...]:
    return examine(Measurements.of_recording(recording)).findings


@pytest.mark.parametrize("number", NUMBERS)
def test_a_clean_recording_is_left_alone(number: int) -> None:
    measurements = Measurements.of_recording(made_up(number, 3))
    examination = examine(measurements)
    assert examination.findings == ()
    assert [v.name for v in examination.measurements.views] == [v.name for v in measurements.views]


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("mistake", SINGLE)
def test_a_mistake_of_single_views_is_named(mistake: Mistake, number: int) -> None:
    recording, views = plant(made_up(number, 3), mistake, np.random.default_rng(number))
    (finding,) = found(recording)
    assert finding.code == EXPECTED[mistake]
    assert sorted(finding.evidence["views"]) == sorted(views)
    assert all(name in finding.sentence for name in views)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("mistake", SHARED)
def test_a_mistake_of_all_views_is_refused(mistake: Mistake, number: int) -> None:
    recording, _ = plant(made_up(number, 3), mistake, np.random.default_rng(number))
    with pytest.raises(InputError) as caught:
        solve(recording)
    assert caught.value.code == EXPECTED[mistake]
    assert caught.value.hint


@pytest.mark.parametrize("off_m", [1.0, 48.0, 100.0])
@pytest.mark.parametrize("number", NUMBERS)
def test_a_pose_whose_decimal_point_was_lost_is_left_out_however_far_off_it_is(
    number: int, off_m: float
) -> None:
    recording = made_up(number, 3)
    views = list(recording.views)
    far = Pose.exp([off_m, 0, 0, 0, 0, 0]) @ views[4].T_base_flange
    views[4] = replace(views[4], T_base_flange=far)
    (finding,) = found(recording.with_views(views))
    assert (finding.code, finding.evidence["views"]) == ("gross_pose", [views[4].name])


def test_where_joints_tell_the_poses_no_notation_is_blamed() -> None:
    recording = made_up(0, 3)
    turned = [
        replace(view, T_base_flange=Pose.from_quaternion(T.translation, T.quaternion_xyzw * [1, 1, 1, -1]))
        for view, T in ((view, view.T_base_flange) for view in recording.views)
    ]
    measurements = Measurements.of_recording(recording.with_views(turned))
    for by_joints, code in ((False, "wrong_rotation"), (True, "inconsistent")):
        with pytest.raises(InputError) as caught:
            examine(measurements, by_joints=by_joints)
        assert caught.value.code == code


def shifted(recording: Recording, first: int, length: int) -> Recording:
    """The recording with some images in a row each filed with the pose of the view before."""
    views = list(recording.views)
    row = views[first : first + length]
    views[first : first + length] = [
        replace(view, point_ids=following.point_ids, pixels=following.pixels)
        for view, following in zip(row, [*row[1:], row[0]], strict=True)
    ]
    return recording.with_views(views)


def test_views_are_shown_as_they_are_used() -> None:
    clean = made_up(5, 3)
    recording, flipped = plant(clean, Mistake.FLIP, np.random.default_rng(0))
    wrong: list[str] = flipped
    random = np.random.default_rng(0)
    twice = recording
    while wrong == flipped:
        twice, wrong = plant(recording, Mistake.GROSS_POSE, random)
    recording = twice
    given = Measurements.of_recording(recording)
    shown = examine(given).among(given)
    assert [view.name for view in shown.views] == [view.name for view in clean.views]
    for view, before, right in zip(shown.views, given.views, clean.views, strict=True):
        assert (view == before) == (view.name not in flipped)
        np.testing.assert_array_equal(view.point_ids, right.point_ids)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_shifted_list_of_images_is_refused(number: int) -> None:
    clean = made_up(number, 3)
    with pytest.raises(InputError, match="shifted by 1") as caught:
        solve(shifted(clean, 0, len(clean.views)))
    assert caught.value.code == "view_shuffled"


@pytest.mark.parametrize("number", NUMBERS)
def test_a_few_shifted_images_are_paired_anew(number: int) -> None:
    clean = made_up(number, 3)
    calibration = solve(shifted(clean, 2, 3))
    (finding,) = (f for f in calibration.diagnosis if f.code in CODES)
    assert finding.code == "view_shuffled"
    names = [view.name for view in clean.views]
    assert finding.evidence["views"] == names[2:5]
    assert finding.evidence["pose_of_image"] == {names[2]: names[3], names[3]: names[4], names[4]: names[2]}
    assert calibration.used == tuple(names)
    np.testing.assert_allclose(calibration.X.matrix, solve(clean).X.matrix, atol=1e-6)


@pytest.mark.parametrize("mistake", SINGLE)
def test_the_answer_survives(mistake: Mistake) -> None:
    clean = made_up(5, 3)
    recording, views = plant(clean, mistake, np.random.default_rng(0))
    calibration = solve(recording)
    used = set(calibration.used)
    repaired = mistake in {Mistake.FLIP, Mistake.SWAP}
    assert (set(views) <= used) == repaired
    assert all(result.reason for result in calibration.views if result.name in views)
    assert [f.code for f in calibration.diagnosis if f.code in CODES] == [EXPECTED[mistake]]
    before = metrics.absolute_error(solve(clean).X, true_hand_eye(clean)).translation_mm
    after = metrics.absolute_error(calibration.X, true_hand_eye(recording)).translation_mm
    assert after < max(2 * before, 0.5)


def test_two_mistakes_do_not_hide_each_other() -> None:
    random = np.random.default_rng(4)
    recording, flipped = plant(made_up(4, 3), Mistake.FLIP, random)
    twice, wrong = plant(recording, Mistake.GROSS_POSE, random)
    assert wrong != flipped
    assert {(f.code, *f.evidence["views"]) for f in found(twice)} == {
        ("view_flipped", *flipped),
        ("gross_pose", *wrong),
    }


def test_any_labels_of_a_symmetric_grid() -> None:
    clean = made_up(5, 3)
    random = np.random.default_rng(0)
    turns = clean.target.turns
    views = [
        replace(v, point_ids=turns[int(random.integers(4))].permutation[v.point_ids]) for v in clean.views
    ]
    calibration = solve(clean.with_views(views))
    assert len(calibration.used) == len(views)
    np.testing.assert_allclose(calibration.X.matrix, solve(clean).X.matrix, atol=1e-6)


def test_everything_in_millimetres_is_refused() -> None:
    clean = made_up(0, 3)
    assert isinstance(clean.target, Chessboard)
    views: list[View] = []
    for view in clean.views:
        matrix = view.T_base_flange.matrix.copy()
        matrix[:3, 3] *= 1000
        views.append(replace(view, T_base_flange=Pose(matrix)))
    with pytest.raises(InputError, match="millimetres") as caught:
        solve(replace(clean, target=replace(clean.target, pitch_m=25.0), views=tuple(views)))
    assert caught.value.code == "wrong_unit"


def test_nothing_that_fits_is_said_to_be_so() -> None:
    clean = made_up(0, 3)
    random = np.random.default_rng(0)
    nonsense = [
        replace(v, T_base_flange=Pose.exp(random.normal(size=6)), joints_rad=None) for v in clean.views
    ]
    with pytest.raises(InputError) as caught:
        solve(clean.with_views(nonsense))
    assert caught.value.code == "inconsistent"


@pytest.mark.parametrize("mounting", Mounting)
def test_views_that_determine_nothing_do_not_disturb(mounting: Mounting) -> None:
    clean = replace(made_up(0, 3), mounting=mounting)
    random = np.random.default_rng(0)
    first = clean.views[0]
    same = [
        replace(first, name=f"view_{k}", pixels=first.pixels + random.normal(0, 0.1, first.pixels.shape))
        for k in range(5)
    ]
    assert found(clean.with_views(same)) == ()


def test_a_published_set_has_no_mistakes() -> None:
    assert found(read_recording(shipped_recording()).recording) == ()
