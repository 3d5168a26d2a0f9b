"""An arm that is known: offsets and noise of its joints are found, and regions hold the truth."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from handeye import _core
from handeye.errors import InputError
from handeye.estimation import AutoEstimator, AutoOptions, Estimate, Measurements, calibrate
from handeye.planning import Pool, rank
from handeye.planning.prediction import Prediction, Sight
from handeye.robots import Arm, ArmKinematics, Joint, arm_kinematics, open_arm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Mounting, Pose, Recording, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import RobotSide
from handeye.validation.metrics import region_holds

ARM = open_arm("ur5e")
KNOWN = ArmKinematics(ARM)


def cell(
    kind: ErrorKind, seed: int, mounting: Mounting, offset_deg: tuple[float, float] = (0.05, 0.1)
) -> Recording:
    return simulate(kind, seed, CellOptions(mounting=mounting, offset_sigma_deg=offset_deg))


def estimated(recording: Recording, *, known: bool = True) -> Estimate:
    options = AutoOptions(kinematics=KNOWN if known else None)
    return AutoEstimator(options)(Measurements.of_recording(recording))


def error(recording: Recording, estimate: Estimate) -> FloatArray:
    assert recording.truth is not None
    assert recording.truth.X is not None
    return (estimate.X @ recording.truth.X.inverse()).log()


def misread(recording: Recording, offsets: FloatArray) -> Recording:
    """Return the recording of an exact arm, read as if its joints stood elsewhere by offsets."""
    views: list[View] = []
    for view in recording.views:
        assert view.joints_rad is not None
        read = np.array(view.joints_rad) - offsets
        views.append(
            View(
                view.name,
                Pose(ARM.forward(read)),
                view.point_ids,
                view.pixels,
                joints_rad=read.tolist(),
            )
        )
    return Recording(
        recording.name,
        recording.mounting,
        recording.camera,
        recording.target,
        tuple(views),
        recording.truth,
        recording.source,
    )


@pytest.mark.parametrize("mounting", list(Mounting))
class TestOffsets:
    def test_offsets_are_found_with_their_sign(self, mounting: Mounting) -> None:
        offsets = np.deg2rad([0.0, 0.08, -0.1, 0.06, -0.09, 0.0])
        for seed in range(4):
            recording = misread(cell(ErrorKind.PIXEL_ONLY, seed, mounting), offsets)
            estimate = estimated(recording)
            assert [found.joint for found in estimate.joint_offsets] == list(ARM.joint_names[1:5])
            for found, true in zip(estimate.joint_offsets, offsets[1:5], strict=True):
                assert abs(found.offset - true) < 4 * found.sigma + 1e-5, found
            assert max(found.sigma for found in estimate.joint_offsets) < np.deg2rad(0.08)

    def test_knowing_the_arm_is_worth_several_times_the_accuracy(self, mounting: Mounting) -> None:
        errors = {True: 0.0, False: 0.0}
        for seed in range(10):
            recording = cell(ErrorKind.JOINT_OFFSETS, seed, mounting)
            for known in errors:
                errors[known] += float(
                    np.linalg.norm(error(recording, estimated(recording, known=known))[:3])
                )
        assert errors[False] > {Mounting.EYE_IN_HAND: 4.0, Mounting.EYE_TO_HAND: 1.5}[mounting] * errors[True]

    def test_first_and_last_joint_only_say_where_base_and_flange_are(self, mounting: Mounting) -> None:
        """Offsets there move the answer by just that, and cost nothing."""
        recording = cell(ErrorKind.PIXEL_ONLY, 1, mounting)
        ends = np.deg2rad([0.3, 0, 0, 0, 0, -0.4])
        straight, turned = estimated(recording), estimated(misread(recording, ends))
        moved = (
            turned.X.inverse() @ straight.X
            if mounting is Mounting.EYE_IN_HAND
            else turned.X @ straight.X.inverse()
        )
        expected = ends[5] if mounting is Mounting.EYE_IN_HAND else ends[0]
        assert moved.rotation_angle_rad == pytest.approx(abs(expected), rel=1e-2)
        assert np.trace(turned.hand_eye_covariance) == pytest.approx(
            np.trace(straight.hand_eye_covariance), rel=0.2
        )


@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("kind", [ErrorKind.ENCODER, ErrorKind.JOINT_OFFSETS])
def test_regions_hold_the_truth(kind: ErrorKind, mounting: Mounting) -> None:
    """Modest: sixty cells tell a covariance that is wrong by half, not one that is wrong by a tenth."""
    trials, inside, nees = 60, 0, 0.0
    for seed in range(trials):
        recording = cell(kind, 100 + seed, mounting, (0.005, 0.05))
        estimate = estimated(recording)
        deviation = error(recording, estimate)
        distance = float(deviation @ np.linalg.solve(estimate.hand_eye_covariance, deviation))
        nees += distance / (6 * trials)
        inside += region_holds(distance, estimate.degrees_of_freedom)
    assert 0.6 < nees < 1.3
    assert inside >= 52


def test_noise_of_joints_is_told_in_joints_and_at_the_flange() -> None:
    recording = simulate(ErrorKind.ENCODER, 5, CellOptions(encoder_sigma_deg=(0.02, 0.02)))
    calibration = calibrate(Measurements.of_recording(recording), kinematics=KNOWN)
    noise = calibration.noise
    assert noise.robot_side is RobotSide.JOINTS
    assert np.rad2deg(noise.joint_rad) == pytest.approx(0.02, rel=0.4)
    # Six joints turn the flange by root two of one about each axis, and shift it by a few decimetres of lever.
    assert noise.robot_rotation_rad == pytest.approx(np.sqrt(2) * noise.joint_rad, rel=0.01)
    assert 0.2 < noise.robot_translation_m / noise.joint_rad < 0.9
    data = calibration.to_dict()
    assert data["noise"]["robot_side"] == "joints"
    assert data["noise"]["joint_deg"] == pytest.approx(np.rad2deg(noise.joint_rad))
    assert [offset["joint"] for offset in data["joint_offsets"]] == list(ARM.joint_names[1:5])
    assert data["diagnosis"][-1]["code"] == "blame_robot_joint_noise"
    without = calibrate(Measurements.of_recording(recording)).to_dict()
    assert "joint_offsets" not in without
    assert "joints" not in without["noise"]["evidence"]


def test_frames_of_the_controller_do_not_matter() -> None:
    """The same cell with a base that is turned and a tool: the same answer, in those frames."""
    recording = cell(ErrorKind.JOINT_OFFSETS, 7, Mounting.EYE_IN_HAND)
    root, tool = Pose.exp([0.3, 0.1, 0.7, 0, 0, 2.0]), Pose.exp([0, 0.03, 0.12, 0.4, 0, 1.0])
    views = [
        View(v.name, root @ v.T_base_flange @ tool, v.point_ids, v.pixels, joints_rad=v.joints_rad)
        for v in recording.views
    ]
    elsewhere = Measurements.of(recording.mounting, recording.camera, recording.target, views)
    there = AutoEstimator(AutoOptions(kinematics=arm_kinematics(ARM, views)))(elsewhere)
    here = estimated(recording)
    assert np.abs((there.X @ tool.inverse()).matrix - here.X.matrix).max() < 4e-5
    for a, b in zip(there.joint_offsets, here.joint_offsets, strict=True):
        # Noise of base and flange has its levels in their frames: what it hides differs a little.
        assert a.offset == pytest.approx(b.offset, abs=0.3 * b.sigma)


def sliding_arm() -> Arm:
    """Return the arm on a track of its own."""
    track = Joint("track", Pose.identity(), (0.0, 1.0, 0.0), sliding=True, lower=-1, upper=1)
    return Arm("ur5e on a track", (track, *ARM.joints), ARM.T_last_flange)


def test_an_arm_on_a_track() -> None:
    recording = cell(ErrorKind.JOINT_OFFSETS, 8, Mounting.EYE_IN_HAND)
    shift = np.random.default_rng(1).uniform(-0.3, 0.3, len(recording.views))
    views = [
        View(
            v.name,
            Pose.exp([0, s, 0, 0, 0, 0]) @ v.T_base_flange,
            v.point_ids,
            v.pixels,
            joints_rad=[s, *(v.joints_rad or ())],
        )
        for v, s in zip(recording.views, shift.tolist(), strict=True)
    ]
    # The target rides along: what is measured is the arm alone.
    still = Measurements.of(recording.mounting, recording.camera, recording.target, recording.views)
    jacobians = ArmKinematics(sliding_arm()).motion_jacobians(
        recording.mounting, np.array([v.joints_rad for v in views])
    )
    assert jacobians.shape == (len(views), 6, 7)
    assert np.allclose(jacobians[:, :, 1:], KNOWN.motion_jacobians(recording.mounting, still.joints))
    assert np.allclose(np.linalg.norm(jacobians[:, :3, 0], axis=1), 1)
    assert np.allclose(jacobians[:, 3:, 0], 0)


def without(matrix: FloatArray, index: int) -> FloatArray:
    return np.delete(np.delete(matrix, index, axis=0), index, axis=1)


class TestPlanning:
    @pytest.mark.parametrize("mounting", list(Mounting))
    def test_information_of_a_candidate_is_that_of_a_view(self, mounting: Mounting) -> None:
        """Against the formula: ``B' (sigma^2 M^-1 + S)^-1 B`` with B = [I, Ad(X A), Ad(X) D], S of both sides and the joints."""
        recording = simulate(ErrorKind.ENCODER, 9, CellOptions(mounting=mounting))
        options = AutoOptions(kinematics=KNOWN, camera_fixed=True)
        estimate = AutoEstimator(options)(Measurements.of_recording(recording))
        assert estimate.arm is not None
        assert estimate.board_scale is not None
        # The scale of the board is a parameter of its own, tested with the scorer.
        estimate = replace(estimate, board_scale=None, information=without(estimate.information, 12))
        pool = Pool.of_views(recording.views)
        motions = pool.motions(mounting)
        assert pool.joints is not None
        found = Prediction(estimate, Sight(known=True)).informations(motions, pool.joints)
        noise = estimate.station_noise
        roots, constants = estimate.arm.candidates(mounting, pool.joints, noise.joint_rad)
        left, right = noise.roots(mounting)
        to_x = estimate.X.adjoint()
        for k in range(len(pool)):
            chain = estimate.X.matrix @ motions[k] @ estimate.Y.matrix
            pixels, _ = estimate.camera.project(recording.target.points @ chain[:3, :3].T + chain[:3, 3])
            _, _, information = _core.refine_pose(
                estimate.camera.lens,
                estimate.camera.parameters,
                recording.target.points,
                recording.target.radii_m,
                pixels,
                chain,
            )
            to_y = _core.se3_adjoint((estimate.X.matrix @ motions[k])[np.newaxis])[0]
            covariance = np.linalg.inv(information) * estimate.candidate_sigma_px**2
            for root in (to_x @ roots[k], to_x @ left, to_y @ right):
                covariance = covariance + root @ root.T
            rows = np.hstack([np.eye(6), to_y, to_x @ constants[k]])
            expected = rows.T @ np.linalg.solve(covariance, rows)
            assert np.abs(found[k] - expected).max() < 1e-6 * np.abs(expected).max()

    def test_predicted_deviations_come_true(self) -> None:
        recording = cell(ErrorKind.JOINT_OFFSETS, 11, Mounting.EYE_IN_HAND)
        measurements = Measurements.of_recording(recording)
        estimator = AutoEstimator(AutoOptions(kinematics=KNOWN))
        ratios: list[float] = []
        for count in range(5, len(measurements)):
            before = estimator(measurements.select(range(count)))
            pool = Pool.of_views([measurements.views[count]])
            after = estimator(measurements.select(range(count + 1)), before)
            prediction = Prediction(before, Sight(known=True))
            predicted = prediction.covariances(pool.motions(before.mounting), pool.joints)[0]
            ratios.append(np.sqrt(np.trace(predicted[:3, :3]) / np.trace(after.hand_eye_covariance[:3, :3])))
        assert np.exp(np.mean(np.log(ratios))) == pytest.approx(1, abs=0.3)

    def test_candidates_without_joints_are_ranked_too(self) -> None:
        recording = cell(ErrorKind.ENCODER, 12, Mounting.EYE_IN_HAND)
        measurements = Measurements.of_recording(recording)
        estimate = AutoEstimator(AutoOptions(kinematics=KNOWN))(measurements.select(range(5)))
        views = measurements.views[5:]
        ranked = partial(rank, estimate, criterion=_core.Criterion("entropy"), sight=Sight(known=True))
        known, unknown = ranked(Pool.of_views(views)), ranked(Pool.of_poses([v.T_base_flange for v in views]))
        assert Pool.of_views(views).joints is not None
        assert Pool.of_poses([views[0].T_base_flange]).joints is None
        assert len(known.prospects) == len(unknown.prospects) == len(views)
        for prospects in (known.prospects, unknown.prospects):
            assert all(0 < p.sigma_translation_m < 0.01 and p.gain > 0 for p in prospects)


def test_views_without_joints_are_named() -> None:
    recording = simulate(ErrorKind.PIXEL_ONLY, 1)
    first, *others = recording.views
    bare = View(first.name, first.T_base_flange, first.point_ids, first.pixels)
    for views in ([*others, bare], [bare, *others]):
        measurements = Measurements.of(recording.mounting, recording.camera, recording.target, views)
        with pytest.raises(InputError, match="0 joint positions") as caught:
            AutoEstimator(AutoOptions(kinematics=KNOWN))(measurements)
        assert "without the arm" in str(caught.value.hint)
    seven = ArmKinematics(open_arm("lbr_iiwa_14"))
    with pytest.raises(InputError, match="6 joint positions, the arm 7"):
        AutoEstimator(AutoOptions(kinematics=seven))(Measurements.of_recording(recording))
