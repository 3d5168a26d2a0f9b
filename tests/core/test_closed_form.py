"""Closed-form starts in the binding: truth, refusals, and agreement with OpenCV's `calibrateHandEye` family.

OpenCV's functions are called with `method=` by keyword; given by position it is taken for an output and Tsai's method
runs whatever was asked. OpenCV 5 may lack the functions; those tests are then skipped.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from handeye import _core
from handeye.errors import DegenerateError, HandeyeError, InputError

Array = NDArray[np.float64]

METHODS = [name for name, _, _ in _core.closed_form_methods()]
OPENCV_HAND_EYE = {
    "tsai_lenz": "CALIB_HAND_EYE_TSAI",
    "park_martin": "CALIB_HAND_EYE_PARK",
    "horaud_dornaika": "CALIB_HAND_EYE_HORAUD",
    "andreff": "CALIB_HAND_EYE_ANDREFF",
    "daniilidis": "CALIB_HAND_EYE_DANIILIDIS",
}
OPENCV_ROBOT_WORLD = {
    "li_wang_wu": "CALIB_ROBOT_WORLD_HAND_EYE_LI",
    "shah": "CALIB_ROBOT_WORLD_HAND_EYE_SHAH",
}
OPENCV = sorted(OPENCV_HAND_EYE | OPENCV_ROBOT_WORLD)

needs_opencv_4 = pytest.mark.skipif(
    not (hasattr(cv2, "calibrateHandEye") and hasattr(cv2, "calibrateRobotWorldHandEye")),
    reason=f"OpenCV {cv2.__version__} has no calibrateHandEye or calibrateRobotWorldHandEye in Python",
)


@dataclass(frozen=True)
class Scene:
    """True X and Y (4, 4), motions A (K, 4, 4), measured poses C (K, 4, 4)."""

    X: Array
    Y: Array
    A: Array
    C: Array


def turned(rng: np.random.Generator, angle_rad: float, metres: float) -> Array:
    """A transform turned by an angle about a random axis."""
    axis = rng.normal(size=3)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(angle_rad * axis / np.linalg.norm(axis)).as_matrix()
    T[:3, 3] = rng.uniform(-metres, metres, 3)
    return T


def disturbed(rng: np.random.Generator, T: Array, metres: float, radians: float) -> Array:
    return _core.se3_exp(rng.normal(size=(len(T), 6)) * np.repeat([metres, radians], 3)) @ T


def scene(
    seed: int, views: int, angle_rad: float = 0.8, noise: float = 1.0, motions: Array | None = None
) -> Scene:
    """Noise 1: arm 0.2 mm and 0.2 mrad, camera 0.5 mm and 1 mrad, per component."""
    rng = np.random.default_rng(seed)
    X, Y, home = (turned(rng, rng.uniform(0.3, 3.0), metres) for metres in (0.2, 1.0, 1.0))
    if motions is None:
        motions = np.stack([turned(rng, rng.uniform(0.3, 1.0) * angle_rad, 0.3) for _ in range(views)])
    A = motions @ home
    C = X @ A @ Y
    if noise:
        A, C = disturbed(rng, A, 2e-4 * noise, 2e-4 * noise), disturbed(rng, C, 5e-4 * noise, 1e-3 * noise)
    return Scene(X, Y, A, C)


def errors(estimate: Array, truth: Array) -> tuple[float, float]:
    """Rotation (rad) and translation (m) between two transforms."""
    difference = np.linalg.inv(truth) @ estimate
    angle = Rotation.from_matrix(difference[:3, :3]).magnitude()
    return float(angle), float(np.linalg.norm(difference[:3, 3]))


def opencv(method: str, A: Array, C: Array) -> tuple[Array, Array | None]:
    """X, and Y where OpenCV gives it, under our names."""
    R_C, t_C = list(C[:, :3, :3]), list(C[:, :3, 3])
    if method in OPENCV_HAND_EYE:
        gripper = np.linalg.inv(A)
        code = getattr(cv2, OPENCV_HAND_EYE[method])
        R, t = cv2.calibrateHandEye(list(gripper[:, :3, :3]), list(gripper[:, :3, 3]), R_C, t_C, method=code)
        return np.linalg.inv(rigid(R, t)), None
    code = getattr(cv2, OPENCV_ROBOT_WORLD[method])
    R_world, t_world, R_camera, t_camera = cv2.calibrateRobotWorldHandEye(
        R_C, t_C, list(A[:, :3, :3]), list(A[:, :3, 3]), method=code
    )
    return rigid(R_camera, t_camera), np.linalg.inv(rigid(R_world, t_world))


def rigid(R: Array, t: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, np.ravel(t)
    return T


def test_methods_have_a_family_and_a_paper() -> None:
    table = _core.closed_form_methods()
    assert [name for name, family, _ in table if family == "AX = XB"] == [
        "shiu_ahmad", "tsai_lenz", "chen", "park_martin", "horaud_dornaika", "andreff", "daniilidis",
        "fassi_legnani", "liang_mao",
    ]  # fmt: skip
    assert [name for name, family, _ in table if family == "AX = YB"] == [
        "zhuang_roth_sudhakar", "dornaika_horaud", "li_wang_wu", "shah",
    ]  # fmt: skip
    assert all(len(paper) > 40 for _, _, paper in table)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("mounting", ["eye_in_hand", "eye_to_hand"])
def test_truth_without_noise_in_both_mountings(method: str, mounting: str) -> None:
    """Built from the frames, with a generic truth: a transform used in the wrong direction would show."""
    for seed, views in enumerate([3, 4, 10, 30]):
        rng = np.random.default_rng(seed)
        T_base_flange = np.stack([turned(rng, rng.uniform(0.3, 2.0), 0.5) for _ in range(views)])
        if mounting == "eye_in_hand":
            T_flange_camera, T_base_target = turned(rng, 2.9, 0.2), turned(rng, 1.9, 1.0)
            C = np.linalg.inv(T_base_flange @ T_flange_camera) @ T_base_target
            A, X, Y = np.linalg.inv(T_base_flange), np.linalg.inv(T_flange_camera), T_base_target
        else:
            T_base_camera, T_flange_target = turned(rng, 2.9, 1.0), turned(rng, 1.9, 0.2)
            C = np.linalg.inv(T_base_camera) @ T_base_flange @ T_flange_target
            A, X, Y = T_base_flange, np.linalg.inv(T_base_camera), T_flange_target
        x, y = _core.closed_form(method, A, C)
        np.testing.assert_allclose(x, X, atol=1e-9)
        np.testing.assert_allclose(y, Y, atol=1e-9)


@needs_opencv_4
@pytest.mark.parametrize("method", ["park_martin", "horaud_dornaika", "daniilidis", "shah"])
def test_same_formula_same_answer_as_opencv(method: str) -> None:
    """The same pairs and the same formula: equal to rounding."""
    for seed in range(100):
        truth = scene(seed, views=[4, 10, 30][seed % 3])
        x, y = _core.closed_form(method, truth.A, truth.C)
        x_opencv, y_opencv = opencv(method, truth.A, truth.C)
        np.testing.assert_allclose(x, x_opencv, atol=1e-9)
        if y_opencv is not None:
            np.testing.assert_allclose(y, y_opencv, atol=1e-9)


@needs_opencv_4
@pytest.mark.parametrize("method", ["andreff", "li_wang_wu"])
def test_same_rotation_and_better_translation_than_opencv(method: str) -> None:
    """The same linear system, so the same rotations. OpenCV leaves the translations as they were before the rotation
    was made orthogonal; we solve for them again."""
    ours, theirs = [], []
    for seed in range(100):
        truth = scene(seed, views=[4, 10, 30][seed % 3])
        x, y = _core.closed_form(method, truth.A, truth.C)
        x_opencv, y_opencv = opencv(method, truth.A, truth.C)
        np.testing.assert_allclose(x[:3, :3], x_opencv[:3, :3], atol=1e-9)
        if y_opencv is not None:
            np.testing.assert_allclose(y[:3, :3], y_opencv[:3, :3], atol=1e-9)
        ours.append(errors(x, truth.X)[1])
        theirs.append(errors(x_opencv, truth.X)[1])
    assert np.mean(ours) < np.mean(theirs)


def motions_of_middling_size(seed: int) -> Array:
    """Views of which every pair is turned by 20 to 110 deg: OpenCV's Tsai drops pairs below 17 and above 116 deg."""
    rng = np.random.default_rng(seed)
    chosen = [np.eye(4)]
    while len(chosen) < 5:
        candidate = turned(rng, rng.uniform(0.4, 1.2), 0.3)
        angles = [Rotation.from_matrix(candidate[:3, :3] @ T[:3, :3].T).magnitude() for T in chosen]
        if min(angles) > np.radians(20) and max(angles) < np.radians(110):
            chosen.append(candidate)
    return np.stack(chosen)


@needs_opencv_4
def test_tsai_lenz_agrees_where_opencv_drops_no_pair() -> None:
    """And where the camera is not mounted near half a turn, where we turn its frame and OpenCV loses accuracy."""
    compared = 0
    for seed in range(100):
        truth = scene(seed, views=0, motions=motions_of_middling_size(seed))
        if Rotation.from_matrix(truth.X[:3, :3]).magnitude() > np.radians(100):
            continue
        x, _ = _core.closed_form("tsai_lenz", truth.A, truth.C)
        np.testing.assert_allclose(x, opencv("tsai_lenz", truth.A, truth.C)[0], atol=1e-9)
        compared += 1
    assert compared > 20


@needs_opencv_4
@pytest.mark.parametrize("method", OPENCV)
@pytest.mark.parametrize("angle_rad", [0.5, 1.0])
def test_errors_are_no_larger_than_those_of_opencv(method: str, angle_rad: float) -> None:
    """Also where pairs are dropped or frames turned: mean errors of X over 100 seeds at most 10 % larger."""
    ours, theirs = [], []
    for seed in range(100):
        truth = scene(seed, views=8, angle_rad=angle_rad)
        ours.append(errors(_core.closed_form(method, truth.A, truth.C)[0], truth.X))
        theirs.append(errors(opencv(method, truth.A, truth.C)[0], truth.X))
    assert np.all(np.mean(ours, axis=0) <= 1.1 * np.mean(theirs, axis=0))


@needs_opencv_4
def test_cameras_mounted_half_a_turn_round_are_no_obstacle_to_tsai_lenz() -> None:
    """A usual mounting, and that of the simulated sets of Ali et al.: the paper's parameter is infinite there."""
    ours, theirs = [], []
    for seed in range(50):
        truth = scene(seed, views=8, angle_rad=0.6)
        X = np.diag([1.0, -1.0, -1.0, 1.0])
        C = X @ np.linalg.inv(truth.X) @ truth.C
        ours.append(errors(_core.closed_form("tsai_lenz", truth.A, C)[0], X))
        theirs.append(errors(opencv("tsai_lenz", truth.A, C)[0], X))
    assert np.mean(ours, axis=0)[0] < 0.25 * np.mean(theirs, axis=0)[0]
    assert np.mean(ours, axis=0)[0] < 5e-3


@pytest.mark.parametrize("method", METHODS)
def test_degenerate_views_are_refused_in_words(method: str) -> None:
    rng = np.random.default_rng(5)
    about_z = np.stack([np.eye(4)] * 6)
    about_z[:, :3, :3] = Rotation.from_euler("z", rng.uniform(-1, 1, 6)[:, None]).as_matrix()
    about_z[:, :3, 3] = rng.uniform(-0.3, 0.3, (6, 3))
    moved = np.stack([np.eye(4)] * 6)
    moved[:, :3, 3] = rng.uniform(-0.3, 0.3, (6, 3))
    for motions, words in [
        (about_z, r"parallel.*\(0\.000, 0\.000, 1\.000\)"),
        (moved, "translation only"),
        (np.stack([np.eye(4)] * 6), "alike"),
    ]:
        for noise in (0.0, 1.0):
            truth = scene(1, views=6, motions=motions, noise=0.0)
            C = disturbed(rng, truth.C, 5e-4 * noise, 1e-3 * noise)
            with pytest.raises(DegenerateError, match=words):
                _core.closed_form(method, truth.A, C)


def test_wrong_pairing_is_refused() -> None:
    truth = scene(2, views=10)
    for method in METHODS:
        with pytest.raises(DegenerateError, match="paired wrongly"):
            _core.closed_form(method, truth.A, np.roll(truth.C, 3, axis=0))


def test_unusable_arguments_are_refused() -> None:
    truth = scene(3, views=5)
    with pytest.raises(InputError, match="shiu_ahmad, tsai_lenz"):
        _core.closed_form("tsai", truth.A, truth.C)
    with pytest.raises(InputError, match="at least 3") as refused:
        _core.closed_form("shah", truth.A[:2], truth.C[:2])
    assert refused.value.code == "too_few_views"
    with pytest.raises(InputError, match=r"5 .* 4 "):
        _core.closed_form("shah", truth.A, truth.C[:4])
    with pytest.raises(InputError, match="shape"):
        _core.closed_form("shah", truth.A[0], truth.C[0])
    for bad in (np.nan, np.inf):
        A = truth.A.copy()
        A[2, 1, 3] = bad
        with pytest.raises(InputError, match=r"A\[2\]"):
            _core.closed_form("shah", A, truth.C)
    scaled = truth.C.copy()
    scaled[1, :3, :3] *= 1.01
    with pytest.raises(InputError, match=r"C\[1\]"):
        _core.closed_form("shah", truth.A, scaled)


twists = hnp.arrays(np.float64, st.tuples(st.integers(0, 6), st.just(6)), elements=st.floats(-3.0, 3.0))


@given(twists, twists, st.sampled_from(METHODS))
def test_any_poses_give_rigid_transforms_or_an_error(a: Array, c: Array, method: str) -> None:
    try:
        found = _core.closed_form(method, _core.se3_exp(a), _core.se3_exp(c))
    except HandeyeError as error:
        assert len(error.message) > 10
        return
    for T in found:
        np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-9)
        assert np.linalg.det(T) > 0
        assert np.all(np.isfinite(T))
        np.testing.assert_array_equal(T[3], [0, 0, 0, 1])
