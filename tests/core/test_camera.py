"""Cameras and features in the binding, against OpenCV and SciPy."""

from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from scipy.optimize import least_squares

from handeye import _core
from handeye.errors import DegenerateError, HandeyeError, InputError, SolveError

Array = NDArray[np.float64]

MATRIX = (1400.0, 1390.0, 641.5, 478.2)
BROWN = (-0.28, 0.11, 1.2e-3, -0.8e-3, -0.02, 0.05, -0.03, 0.01, 2e-3, -1e-3, -1.5e-3, 0.7e-3)
FISHEYE = (0.06, -0.02, 0.008, -0.002)
COEFFICIENTS = {
    "pinhole": (),
    "brown_conrady_4": BROWN[:4],
    "brown_conrady_5": BROWN[:5],
    "brown_conrady_8": BROWN[:8],
    "brown_conrady_12": BROWN,
    "kannala_brandt": FISHEYE,
    "division": (-0.2,),
}
LENSES = sorted(COEFFICIENTS)
BROWNS = [lens for lens in LENSES if lens not in {"kannala_brandt", "division"}]


def parameters(lens: str) -> Array:
    return np.array(MATRIX + COEFFICIENTS[lens])


def opencv_matrix() -> Array:
    fx, fy, cx, cy = MATRIX
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def points_in_view(count: int = 200) -> Array:
    depth = np.random.default_rng(1).uniform(0.3, 2.0, count)
    across = np.random.default_rng(2).uniform(-0.6, 0.6, (count, 2))
    return np.column_stack([across * depth[:, None], depth])


def tilted(degrees: float = 50.0) -> Array:
    """A target half a metre away, off the axis, its normal tilted by so much."""
    T = _core.se3_exp([[0, 0, 0, np.radians(degrees) * 0.8, np.radians(degrees) * 0.6, 0]])[0]
    T[:3, 3] = 0.12, -0.09, 0.5
    return T


def grid(radius: float) -> tuple[Array, Array]:
    points = np.array([(i, j, 0) for j in range(4) for i in range(6)]) * 0.02 - (0.05, 0.03, 0)
    return points, np.full(len(points), radius)


@pytest.mark.parametrize("lens", LENSES)
def test_parameter_counts(lens: str) -> None:
    assert len(dict(_core.lenses())[lens]) == len(COEFFICIENTS[lens])


@pytest.mark.parametrize("lens", BROWNS)
def test_values_and_derivatives_agree_with_opencv(lens: str) -> None:
    points = points_in_view()
    zero = np.zeros(3)
    expected, jacobian = cv2.projectPoints(points, zero, zero, opencv_matrix(), np.array(COEFFICIENTS[lens]))
    jacobian = jacobian.reshape(len(points), 2, -1)
    uv, d_point, d_parameters, valid = _core.project_jacobians(lens, parameters(lens), points)
    assert valid.all()
    np.testing.assert_allclose(uv, expected[:, 0], atol=1e-10)
    np.testing.assert_array_equal(uv, _core.project(lens, parameters(lens), points)[0])
    # With the pose at the identity the derivative in OpenCV's translation is that in the point.
    np.testing.assert_allclose(d_point, jacobian[:, :, 3:6], rtol=1e-10, atol=1e-8)
    np.testing.assert_allclose(d_parameters, jacobian[:, :, 6 : 6 + len(parameters(lens))], atol=1e-9)


def test_fisheye_values_and_derivatives_agree_with_opencv() -> None:
    points = points_in_view()
    zero = np.zeros(3)
    expected, jacobian = cv2.fisheye.projectPoints(
        points[None], zero, zero, opencv_matrix(), np.array(FISHEYE)
    )
    jacobian = jacobian.reshape(len(points), 2, -1)
    uv, d_point, d_parameters, valid = _core.project_jacobians(
        "kannala_brandt", parameters("kannala_brandt"), points
    )
    assert valid.all()
    np.testing.assert_allclose(uv, expected[0], atol=1e-10)
    np.testing.assert_allclose(d_point, jacobian[:, :, 11:14], rtol=1e-10, atol=1e-8)
    np.testing.assert_allclose(d_parameters, jacobian[:, :, :8], atol=1e-9)


@pytest.mark.parametrize("lens", LENSES)
def test_rays_lead_back_to_their_points(lens: str) -> None:
    points = points_in_view()
    rays, valid = _core.unproject(lens, parameters(lens), _core.project(lens, parameters(lens), points)[0])
    assert valid.all()
    np.testing.assert_allclose(rays, points / np.linalg.norm(points, axis=1, keepdims=True), atol=1e-12)


@pytest.mark.parametrize("lens", LENSES)
def test_what_the_lens_does_not_see_is_nan(lens: str) -> None:
    points = np.array([[0.1, 0.1, 1], [0.1, 0.1, -1], [0.1, 0.1, 0], [np.nan, 0, 1], [np.inf, 0, 1]])
    uv, d_point, d_parameters, valid = _core.project_jacobians(lens, parameters(lens), points)
    np.testing.assert_array_equal(valid, [True, False, False, False, False])
    for values in (uv, d_point, d_parameters):
        assert np.isfinite(values[0]).all()
        assert np.isnan(values[1:]).all()
    np.testing.assert_array_equal(_core.project(lens, parameters(lens), points)[1], valid)


def test_the_fold_of_the_distortion_is_not_seen() -> None:
    # r (1 - r^2 / 3) turns back at r = 1: beyond, OpenCV maps points into the image again.
    lens, folding = "brown_conrady_4", [1000.0, 1000, 0, 0, -1 / 3, 0, 0, 0]
    _, valid = _core.project(lens, folding, [[0.99, 0, 1], [1.01, 0, 1], [1.7, 0, 1]])
    np.testing.assert_array_equal(valid, [True, False, False])
    _, valid = _core.unproject(lens, folding, [[666, 0], [667, 0], [np.nan, 0]])
    np.testing.assert_array_equal(valid, [True, False, False])


@given(
    st.sampled_from(LENSES),
    hnp.arrays(np.float64, 12, elements=st.floats(-1e3, 1e3)),
    hnp.arrays(np.float64, (5, 3), elements=st.floats()),
)
def test_a_valid_pixel_is_a_finite_pixel(lens: str, coefficients: Array, points: Array) -> None:
    count = len(dict(_core.lenses())[lens])
    camera = np.concatenate([MATRIX, coefficients[:count]])
    uv, d_point, d_parameters, valid = _core.project_jacobians(lens, camera, points)
    assert np.isfinite(uv[valid]).all()
    assert np.isfinite(d_point[valid]).all()
    assert np.isfinite(d_parameters[valid]).all()
    assert np.isnan(uv[~valid]).all()


@pytest.mark.parametrize("lens", LENSES)
def test_corners_are_seen_where_they_project_to(lens: str) -> None:
    points, radii = grid(0.0)
    T = tilted()
    uv, valid = _core.project_features(lens, parameters(lens), T, points, radii)
    expected, _ = _core.project(lens, parameters(lens), points @ T[:3, :3].T + T[:3, 3])
    assert valid.all()
    np.testing.assert_allclose(uv, expected, atol=1e-10)


def polygon_centroid(lens: str, T: Array, centre: Array, radius: float) -> Array:
    """Area centroid of the polygon of many boundary points, projected by OpenCV (shoelace formula)."""
    angles = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    rim = centre + radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    rotation, _ = cv2.Rodrigues(T[:3, :3])
    coefficients = np.array(COEFFICIENTS[lens])
    if lens == "kannala_brandt":
        uv, _ = cv2.fisheye.projectPoints(rim[None], rotation, T[:3, 3], opencv_matrix(), coefficients)
        uv = uv[0]
    elif lens == "division":
        uv, _ = _core.project(lens, parameters(lens), rim @ T[:3, :3].T + T[:3, 3])
    else:
        uv, _ = cv2.projectPoints(rim, rotation, T[:3, 3], opencv_matrix(), coefficients)
        uv = uv[:, 0]
    middle = uv.mean(axis=0)
    here = uv - middle
    there = np.roll(here, -1, axis=0)
    pieces = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    return middle + ((here + there) * pieces[:, None]).sum(axis=0) / (3 * pieces.sum())


@pytest.mark.parametrize("lens", LENSES)
def test_circles_are_seen_at_the_centroid_of_their_image(lens: str) -> None:
    T, centre, radius = tilted(), np.array([0.01, -0.02, 0.0]), 0.01
    uv, valid = _core.project_features(lens, parameters(lens), T, [centre], [radius])
    assert valid.all()
    expected = polygon_centroid(lens, T, centre, radius)
    assert np.linalg.norm(uv[0] - expected) < 1e-5
    projected, _ = _core.project_features(lens, parameters(lens), T, [centre], [0.0])
    assert np.linalg.norm(projected[0] - expected) > 0.1


@pytest.mark.parametrize("radius", [0.0, 0.008])
def test_the_refined_pose_is_scipys(radius: float) -> None:
    lens = "brown_conrady_5"
    camera = parameters(lens)
    (points, radii), truth = grid(radius), tilted(30)
    exact, _ = _core.project_features(lens, camera, truth, points, radii)
    pixels = exact + np.random.default_rng(5).normal(0, 0.3, exact.shape)
    start = _core.se3_exp([[0.02, -0.01, 0.03, 0.1, -0.05, 0.08]])[0] @ truth
    T, rmse_px, information = _core.refine_pose(lens, camera, points, radii, pixels, start)

    def residual(xi: Array) -> Array:
        moved = _core.se3_exp(xi[None])[0] @ T
        return (_core.project_features(lens, camera, moved, points, radii)[0] - pixels).ravel()

    peer: Any = least_squares(residual, np.zeros(6), jac="3-point", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    cost = 0.5 * np.sum(residual(np.zeros(6)) ** 2)
    assert cost <= peer.cost * (1 + 1e-9)
    np.testing.assert_allclose(peer.x, 0, atol=1e-7)
    np.testing.assert_allclose(information, peer.jac.T @ peer.jac, rtol=1e-5, atol=1e-2)
    assert rmse_px == pytest.approx(np.sqrt(2 * cost / len(points)), rel=1e-12)


def test_a_pose_that_cannot_be_refined_says_why() -> None:
    lens, camera, T = "pinhole", parameters("pinhole"), tilted()
    points, radii = grid(0.0)
    pixels, _ = _core.project_features(lens, camera, T, points, radii)
    with pytest.raises(DegenerateError, match="one line"):
        _core.refine_pose(lens, camera, points[:6], radii[:6], pixels[:6], T)
    with pytest.raises(InputError, match="at least 3"):
        _core.refine_pose(lens, camera, points[:2], radii[:2], pixels[:2], T)
    with pytest.raises(InputError, match="24 features but 23 pixels"):
        _core.refine_pose(lens, camera, points, radii, pixels[1:], T)
    with pytest.raises(InputError, match="24 points but 23 radii"):
        _core.refine_pose(lens, camera, points, radii[1:], pixels, T)
    with pytest.raises(InputError, match="feature 1: the radius"):
        _core.project_features(lens, camera, T, points[:2], [0.1, -0.1])
    behind = T.copy()
    behind[2, 3] = -0.5
    with pytest.raises(SolveError, match="not in view"):
        _core.refine_pose(lens, camera, points, radii, pixels, behind)
    pixels[3] = np.nan
    with pytest.raises(InputError, match="pixel 3"):
        _core.refine_pose(lens, camera, points, radii, pixels, T)


@pytest.mark.parametrize(
    ("lens", "values", "message"),
    [
        ("fisheye", [1, 1, 0, 0], 'unknown lens "fisheye"; the lenses are pinhole'),
        ("pinhole", [1, 1, 0], "has 4 parameters, found 3"),
        ("pinhole", [1, -1, 0, 0], "focal lengths must be positive"),
        ("pinhole", [1, np.nan, 0, 0], "parameter 1 is NaN"),
        ("pinhole", [[1, 1, 0, 0]], r"parameters must have shape \(N\), found \(1, 4\)"),
    ],
)
def test_unusable_cameras_are_refused(lens: str, values: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        _core.project(lens, values, np.zeros((1, 3)))
    assert isinstance(caught.value, HandeyeError)
    assert caught.value.code == "invalid_input"


def test_any_array_of_numbers_will_do() -> None:
    points = points_in_view(8)
    expected, _ = _core.project("pinhole", MATRIX, points)
    strided = np.repeat(points, 2, axis=0)[::2]
    fortran = np.asfortranarray(points)
    for same in (points.tolist(), strided, fortran):
        np.testing.assert_array_equal(_core.project("pinhole", list(MATRIX), same)[0], expected)
    narrow = points.astype(np.float32)
    np.testing.assert_array_equal(
        _core.project("pinhole", MATRIX, narrow)[0], _core.project("pinhole", MATRIX, narrow.astype(float))[0]
    )
    assert _core.project("pinhole", MATRIX, np.zeros((0, 3)))[0].shape == (0, 2)
