"""Poses against an independent implementation (SciPy) and the laws of the group."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from handeye.errors import InputError
from handeye.types import Pose
from handeye.types.pose import through_twist
from strategies import plain_values, poses, twists, vectors

GENERIC = Pose.exp([0.3, -0.2, 0.9, 0.4, -1.1, 0.6])


def hat(xi: np.ndarray) -> np.ndarray:
    x, y, z, a, b, c = xi
    return np.array([[0, -c, b, x], [c, 0, -a, y], [-b, a, 0, z], [0, 0, 0, 0]])


@given(twists())
def test_exp_is_the_matrix_exponential(xi: np.ndarray) -> None:
    np.testing.assert_allclose(Pose.exp(xi).matrix, expm(hat(xi)), atol=1e-12)


@given(twists(angle_rad=0.99 * np.pi))
def test_log_undoes_exp(xi: np.ndarray) -> None:
    np.testing.assert_allclose(Pose.exp(xi).log(), xi, atol=1e-9)


@given(poses(), poses())
def test_product_and_inverse_are_those_of_matrices(a: Pose, b: Pose) -> None:
    np.testing.assert_allclose((a @ b).matrix, a.matrix @ b.matrix, atol=1e-12)
    np.testing.assert_allclose(a.inverse().matrix, np.linalg.inv(a.matrix), atol=1e-9)
    assert Pose.identity() == Pose(np.eye(4))


@given(poses(), twists(metres=0.5, angle_rad=1.0))
def test_adjoint_moves_a_perturbation_to_the_left(T: Pose, xi: np.ndarray) -> None:
    left = Pose.exp(T.adjoint() @ xi) @ T
    np.testing.assert_allclose(left.matrix, (T @ Pose.exp(xi)).matrix, atol=1e-9)


@given(poses(), vectors(3, 2.0))
def test_act_maps_points(T: Pose, p: np.ndarray) -> None:
    np.testing.assert_allclose(T.act([p, 2 * p])[1], (T.matrix @ [*(2 * p), 1])[:3], atol=1e-12)


@given(poses(angle_rad=np.pi))
def test_quaternion_agrees_with_scipy_and_reads_back(T: Pose) -> None:
    q = T.quaternion_xyzw
    assert q[3] >= 0
    np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), T.rotation, atol=1e-9)
    np.testing.assert_allclose(Pose.from_quaternion(T.translation, q).matrix, T.matrix, atol=1e-9)


@given(twists(angle_rad=np.pi))
def test_rotation_angle(xi: np.ndarray) -> None:
    assert Pose.exp(xi).rotation_angle_rad == pytest.approx(np.linalg.norm(xi[3:]), abs=1e-7)


@given(poses(angle_rad=np.pi))
def test_copies_are_equal_to_the_last_bit(T: Pose) -> None:
    for twin in (Pose(T.to_list()), Pose(T.matrix), pickle.loads(pickle.dumps(T)), copy.deepcopy(T)):
        assert twin == T
        assert hash(twin) == hash(T)


def test_a_matrix_rigid_to_rounding_is_kept_bit_for_bit() -> None:
    for wobble in (1e-13, -3e-14):
        matrix = GENERIC.matrix + wobble * np.eye(4)[:, [3, 0, 1, 2]] * [[1], [1], [1], [0]]
        np.testing.assert_array_equal(Pose(matrix).matrix, matrix)


@pytest.mark.parametrize(
    "axis", [[1, 0, 0], [-1, 0, 0], [0, -1, 0], [0, 0, -1], [-0.6, 0, 0.8], [0.6, -0.8, 0]]
)
@pytest.mark.parametrize("angle", [0.0, 1.0, 2.2, 3.0])
def test_quaternions_have_a_positive_real_part(axis: list[float], angle: float) -> None:
    q = Pose.exp([0, 0, 0, *(angle * np.array(axis))]).quaternion_xyzw
    np.testing.assert_allclose(q, [*(np.sin(angle / 2) * np.array(axis)), np.cos(angle / 2)], atol=1e-12)


def test_different_poses_differ() -> None:
    assert Pose.identity() != GENERIC
    assert "0.3" not in repr(Pose.identity())


def test_rounding_of_files_is_repaired() -> None:
    rounded = np.round(GENERIC.matrix, 5)
    repaired = Pose(rounded)
    np.testing.assert_allclose(repaired.rotation.T @ repaired.rotation, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(repaired.matrix, GENERIC.matrix, atol=2e-5)


def test_arrays_are_frozen_and_independent() -> None:
    source = np.eye(4)
    pose = Pose(source)
    source[0, 3] = 5
    assert pose.translation[0] == 0
    for array in (
        pose.matrix,
        pose.rotation,
        pose.translation,
        (pose @ pose).matrix,
        pose.inverse().matrix,
        np.asarray(pose),
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    own = np.array(pose)
    own[0, 0] = 7
    assert pose.matrix[0, 0] == 1


def test_a_pose_does_not_mix_with_arrays() -> None:
    left: Any = GENERIC
    for mix in (lambda: left @ np.eye(4), lambda: np.eye(4) @ left, lambda: left @ 2):
        with pytest.raises(TypeError):
            mix()


@pytest.mark.parametrize(
    ("matrix", "code"),
    [
        (np.diag([1.0, 1.0, 1.001, 1.0]), "not_rigid"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "not_rigid"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "not_rigid"),
        (np.eye(4) + 0.01 * np.eye(4, k=1), "not_rigid"),
        (np.zeros((4, 4)), "not_rigid"),
        (np.full((4, 4), 1e308), "out_of_range"),
        (np.eye(4) + 1e10 * np.eye(4, k=3), "out_of_range"),
        (np.diag([1e200, -1e200, 1e200, 1.0]), "not_rigid"),
        (np.full((4, 4), np.nan), "not_finite"),
        (np.where(np.eye(4, k=3) > 0, np.inf, np.eye(4)), "not_finite"),
        (np.eye(3), "wrong_shape"),
        (np.eye(4).ravel(), "wrong_shape"),
        (np.eye(4) * 1j, "not_numbers"),
        ([["1", "0", "0", "0"]] * 4, "not_numbers"),
        ([[1, 2], [3]], "not_numbers"),
        (None, "not_numbers"),
    ],
)
def test_what_is_no_rigid_transform_is_refused(matrix: Any, code: str) -> None:
    with pytest.raises(InputError) as caught:
        Pose(matrix)
    assert caught.value.code == code


@pytest.mark.parametrize(
    "quaternion", [[0, 0, 0, 0], [0, 0, 0, 1.01], [0, 0, 0, np.nan], [0, 0, 1], [1, 1, 1, 1]]
)
def test_bad_quaternions_are_refused(quaternion: list[float]) -> None:
    with pytest.raises(InputError):
        Pose.from_quaternion([0, 0, 0], quaternion)


def test_written_quaternions_are_normalised() -> None:
    pose = Pose.from_quaternion([1, 2, 3], [0, 0, 0.7071, 0.7071])
    np.testing.assert_allclose(pose.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


@given(plain_values())
def test_hostile_values_raise_only_our_error(value: Any) -> None:
    for construct in (Pose, Pose.exp, lambda v: Pose.from_quaternion([0, 0, 0], v)):
        try:
            pose = construct(value)
        except InputError:
            continue
        np.testing.assert_allclose(pose.rotation.T @ pose.rotation, np.eye(3), atol=1e-12)


@given(poses(angle_rad=np.pi))
def test_roll_pitch_yaw_agrees_with_scipy(T: Pose) -> None:
    again = Rotation.from_euler("xyz", T.roll_pitch_yaw_rad).as_matrix()
    np.testing.assert_allclose(again, T.rotation, atol=1e-12)


@pytest.mark.parametrize("from_the_end", [0, 1e-15, 1e-13, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("sign", [-1, 1])
def test_roll_pitch_yaw_near_the_end_of_pitch(from_the_end: float, sign: int) -> None:
    for roll, yaw in ((0.3, -0.8), (3.0, 2.9), (0, 0), (-1.2, 1.2)):
        rotation = Rotation.from_euler("xyz", [roll, sign * (np.pi / 2 - from_the_end), yaw]).as_matrix()
        T = Pose([[*row, 0] for row in rotation] + [[0, 0, 0, 1]])
        again = Rotation.from_euler("xyz", T.roll_pitch_yaw_rad).as_matrix()
        np.testing.assert_allclose(again, rotation, atol=1e-12)


@pytest.mark.parametrize("pitch", [-np.pi / 2, np.pi / 2])
def test_roll_pitch_yaw_at_the_end_of_pitch(pitch: float) -> None:
    rotation = Rotation.from_euler("xyz", [0.3, pitch, -0.8]).as_matrix()
    T = Pose([[*row, 0] for row in rotation] + [[0, 0, 0, 1]])
    assert T.roll_pitch_yaw_rad[0] == 0
    np.testing.assert_allclose(
        Rotation.from_euler("xyz", T.roll_pitch_yaw_rad).as_matrix(), rotation, atol=1e-12
    )


def test_derivatives_in_a_twist_are_those_of_the_moved_points() -> None:
    random = np.random.default_rng(5)
    points, weights = random.normal(size=(7, 3)), random.normal(size=(7, 2, 3))

    def values(xi: np.ndarray) -> np.ndarray:
        return np.einsum("nmk,nk->nm", weights, Pose.exp(xi).act(points))

    found = through_twist(points, weights)
    for i, step in enumerate(1e-6 * np.eye(6)):
        np.testing.assert_allclose(found[:, :, i], (values(step) - values(-step)) / 2e-6, atol=1e-8)


@pytest.mark.parametrize("decimals", [3, 4, 5, 6])
def test_few_written_decimals_are_made_rigid(decimals: int) -> None:
    rng = np.random.default_rng(decimals)
    for _ in range(200):
        pose = Pose.exp([0.1, 0.2, 0.3, *rng.normal(0, 1.5, 3)])
        written = pose.matrix.copy()
        written[:3, :3] = written[:3, :3].round(decimals)
        assert (Pose(written).inverse() @ pose).rotation_angle_rad < 10.0**-decimals


@pytest.mark.parametrize("factor", [1.001, 0.998, 1.01])
def test_what_rounding_does_not_explain_stays_refused(factor: float) -> None:
    rng = np.random.default_rng(8)
    for decimals in (3, 4, 6):
        pose = Pose.exp([0.1, 0.2, 0.3, *rng.normal(0, 1.5, 3)])
        written = pose.matrix.copy()
        written[:3, :3] = (factor * written[:3, :3]).round(decimals)
        if decimals == 3 and abs(factor - 1) < 2e-3:
            continue  # as small as what three decimals leave
        with pytest.raises(InputError, match=r"rigid|orthogonal|scale"):
            Pose(written)
