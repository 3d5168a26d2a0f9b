"""The touch error: its rows are the derivatives of a touch, its radius holds, and it says what limits it."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements, calibrate, make_estimator
from handeye.estimation.estimate import StationNoise
from handeye.estimation.touch import Depth, Touches, limits, touch_error, touch_rows
from handeye.estimation.work import Work, lay_out, touch_map
from handeye.robots import ArmKinematics, open_arm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Camera, Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.touch import WorkBox

ARM = open_arm("ur5e")
BOTH = (Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)
TOOL = np.array([0.0, 0.02, 0.15])


def solved(mounting: Mounting, *, arm_known: bool = True) -> tuple[Estimate, Measurements]:
    recording = simulate(ErrorKind.MIXTURE_CELL, 3, CellOptions(mounting=mounting, views=(8, 8)))
    measurements = Measurements.of_recording(recording)
    return make_estimator(ModelName.AUTO, ArmKinematics(ARM) if arm_known else None)(
        measurements
    ), measurements


def lands(estimate: Estimate, touches: Touches, change: FloatArray) -> FloatArray:
    """Error (Q, 3) of touches where the truth is the estimate changed by `change`, step by step."""
    arm = estimate.arm
    assert arm is not None
    assert touches.seeing_rad is not None
    assert touches.touching_rad is not None
    count = len(estimate.free_camera)
    X = Pose.exp(change[:6]) @ estimate.X
    parameters = np.array(estimate.camera.parameters)
    parameters[list(estimate.free_camera)] += change[12 : 12 + count]
    true_camera = Camera(estimate.camera.lens, parameters, *estimate.camera.size_px)
    correction = arm.correction(change[-arm.constants :])
    mounting = estimate.mounting

    def truly(poses: FloatArray, joints: FloatArray) -> list[Pose]:
        twists = arm.kinematics.motion_jacobians(Mounting.EYE_TO_HAND, joints) @ correction.joint_offsets
        twists += arm.kinematics.link_jacobians(Mounting.EYE_TO_HAND, joints) @ correction.displacements
        return [Pose.exp(twist) @ Pose(pose) for twist, pose in zip(twists, poses, strict=True)]

    seen = truly(touches.seen_from, touches.seeing_rad)
    touched = truly(touches.touched_from, touches.touching_rad)
    errors = []
    for i, point in enumerate(touches.points_m):
        chain = (
            mounting.chain(Pose(touches.seen_from[i]))
            if mounting is Mounting.EYE_IN_HAND
            else Pose.identity()
        )
        true_chain = mounting.chain(seen[i]) if mounting is Mounting.EYE_IN_HAND else Pose.identity()
        believed = (estimate.X @ chain).act([point])[0]
        pixel = estimate.camera.project([believed])[0][0]
        truth = believed
        if touches.depth is Depth.SIZE:
            truth = same_size(estimate.camera, true_camera, believed, pixel)
        else:
            for _ in range(20):
                off = pixel - true_camera.project([truth])[0][0]
                truth = truth + np.append(off / parameters[:2] * truth[2], 0.0)
        where = (X @ true_chain).inverse().act([truth])[0]
        errors.append(touched[i].act([TOOL])[0] - where)
    return np.array(errors)


def same_size(camera: Camera, other: Camera, point: FloatArray, pixel: FloatArray) -> FloatArray:
    """Point that the other camera sees at a pixel, in such a distance that a small square looks as large."""

    def area(one: Camera, at: FloatArray) -> float:
        corners = at + 1e-4 * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
        right, left, down, up = one.project(corners)[0]
        a, b = right - left, down - up
        return abs(a[0] * b[1] - a[1] * b[0])

    wanted, at = area(camera, point), point
    for _ in range(40):
        off = pixel - other.project([at])[0][0]
        at = at + np.append(off / other.parameters[:2] * at[2], 0.0)
        at = at * np.sqrt(area(other, at) / wanted)
    return at


@pytest.mark.parametrize("depth", list(Depth))
@pytest.mark.parametrize("mounting", BOTH)
def test_rows_are_the_derivatives_of_a_touch(mounting: Mounting, depth: Depth) -> None:
    estimate, measurements = solved(mounting)
    # Where nothing was found of the arm, a touch without change lands where it should.
    work = Work(tool_m=(0.0, 0.02, 0.15), depth=depth)
    laid = lay_out(estimate, measurements, work).touches
    few = Touches(
        laid.points_m[:4],
        laid.seen_from[:4],
        laid.touched_from[:4],
        TOOL,
        None if laid.seeing_rad is None else laid.seeing_rad[:4],
        None if laid.touching_rad is None else laid.touching_rad[:4],
        depth,
    )
    rows, _ = touch_rows(estimate, few)
    np.testing.assert_allclose(lands(estimate, few, np.zeros(rows.shape[2])), 0.0, atol=1e-9)
    scale = np.sqrt(np.diag(estimate.covariance))
    assert estimate.arm is not None
    board = rows.shape[2] - estimate.arm.constants - 1
    for j in range(rows.shape[2]):
        change = np.zeros(rows.shape[2])
        change[j] = 0.02 * scale[j]
        slope = (lands(estimate, few, change) - lands(estimate, few, -change)) / (2 * change[j])
        if j in range(6, 12) or j == board:  # where the board is, and how large, moves no touch
            np.testing.assert_array_equal(rows[:, :, j], 0.0)
        else:
            np.testing.assert_allclose(rows[:, :, j] * scale[j], slope * scale[j], atol=3e-8, rtol=1e-3)


@pytest.mark.parametrize("mounting", BOTH)
def test_noise_of_the_arm_is_what_it_does_to_a_touch(mounting: Mounting) -> None:
    estimate, measurements = solved(mounting, arm_known=False)
    noise = StationNoise(flange=(2e-4, 1e-3), base=(1e-4, 5e-4))
    estimate = replace(estimate, covariance=0 * estimate.covariance, expected_noise=noise)
    touches = lay_out(estimate, measurements, Work()).touches
    one = Touches(touches.points_m[:1], touches.seen_from[:1], touches.touched_from[:1], touches.tool_m)
    random = np.random.default_rng(0)

    def stands(pose: FloatArray) -> Pose:
        at_base, at_flange = (
            Pose.exp(random.normal(0, np.repeat(side, 3))) for side in (noise.base, noise.flange)
        )
        return at_base @ Pose(pose) @ at_flange

    misses = []
    for _ in range(4000):
        place = one.points_m[0]
        if mounting is Mounting.EYE_IN_HAND:
            place = stands(one.seen_from[0]).act(Pose(one.seen_from[0]).inverse().act([place]))[0]
        misses.append(stands(one.touched_from[0]).act([one.tool_m])[0] - place)
    found = touch_error(estimate, one).covariances[0]
    np.testing.assert_allclose(np.cov(np.array(misses).T), found, rtol=0.12, atol=0.04 * np.trace(found))


def test_a_focus_that_is_not_known_limits_what_is_measured_by_its_size() -> None:
    estimate, measurements = solved(Mounting.EYE_TO_HAND)
    covariance = np.array(estimate.covariance)
    covariance[12:14] = covariance[:, 12:14] = 0.0
    covariance[12, 12] = covariance[13, 13] = covariance[12, 13] = covariance[13, 12] = 20.0**2
    wide = replace(estimate, covariance=covariance)
    by_size, by_sensor = (touch_map(wide, measurements, Work(depth=depth)) for depth in Depth)
    assert by_size.limits["camera"] > 0.9
    assert by_size.named_limits[0][0] == "camera"
    assert "calibrate the camera" in by_size.advice
    # 20 px of 1400 at 1 m are 14 mm along the line of sight, of which a sensor has nothing; across it, it has.
    assert by_size.worst_m > 2 * by_sensor.worst_m


def test_putting_the_arm_right_is_worth_what_is_said() -> None:
    estimate, measurements = solved(Mounting.EYE_IN_HAND)
    found = touch_map(estimate, measurements, Work())
    assert found.mean_m < found.as_reported_m
    assert found.worst_m == found.radii_m.max()
    shares = limits(estimate, touch_error(estimate, lay_out(estimate, measurements, Work()).touches))
    assert set(shares) == {"hand_eye", "camera", "board", "arm", "robot_noise"}
    assert all(0 <= share <= 1 for share in shares.values())


def test_a_box_that_nothing_reaches_is_refused_only_if_it_was_asked_for() -> None:
    recording = simulate(ErrorKind.MIXTURE_CELL, 3, CellOptions(views=(8, 8)))
    measurements = Measurements.of_recording(recording)
    far = Work(WorkBox((5.0, 5.0, 0.0), (5.1, 5.1, 0.1)))
    known = ArmKinematics(ARM)
    with pytest.raises(InputError, match="out of reach of the arm"):
        calibrate(measurements, kinematics=known, work=far)
    assert calibrate(measurements, kinematics=known).touch is None
    with pytest.raises(InputError, match="expected the lower first"):
        WorkBox((0, 0, 0), (1, 0, 1))


def test_beside_the_robot_the_tool_points_down_where_the_arm_can() -> None:
    estimate, measurements = solved(Mounting.EYE_TO_HAND)
    work = Work(tool_m=(0.0, 0.02, 0.15))
    touches = lay_out(estimate, measurements, work).touches
    along = touches.touched_from[:, :3, :3] @ (TOOL / np.linalg.norm(TOOL))
    down = along[:, 2] < -1 + 1e-9
    assert 0.5 < down.mean() <= 1
    tips = touches.touched_from[:, :3, :3] @ TOOL + touches.touched_from[:, :3, 3]
    np.testing.assert_allclose(tips, touches.points_m, atol=1e-12)
    assert touches.touching_rad is not None
    np.testing.assert_allclose(ARM.forward(touches.touching_rad), touches.touched_from, atol=1e-5)


def test_an_arm_that_cannot_point_down_touches_as_it_held_the_board() -> None:
    estimate, measurements = solved(Mounting.EYE_TO_HAND)
    # A tool so long that for most points the flange would have to stand above what the arm reaches.
    work = Work(tool_m=(0.0, 0.0, 0.6))
    touches = lay_out(estimate, measurements, work).touches
    held = [view.T_base_flange.rotation for view in measurements.views]
    turns = touches.touched_from[:, :3, :3]
    down = turns[:, 2, 2] < -1 + 1e-9
    as_held = [any(np.allclose(turn, one) for one in held) for turn in turns]
    assert 0 < down.mean() < 0.7
    assert (down | np.array(as_held)).all()
