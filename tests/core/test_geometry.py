"""The group of rigid transforms in the binding, against SciPy's matrix exponential and logarithm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from scipy.linalg import expm, logm

from handeye import _core
from handeye.errors import InputError

Array = NDArray[np.float64]

# Rotation angles below pi; no number so small that SciPy's logarithm overflows.
twists = hnp.arrays(np.float64, (3, 6), elements=st.floats(-1.7, 1.7).map(lambda x: round(x, 6)))


def wedge(xi: Array) -> Array:
    """The 4 x 4 matrix of a twist `[rho; phi]`."""
    rho, (a, b, c) = xi[:3], xi[3:]
    return np.array([[0, -c, b, rho[0]], [c, 0, -a, rho[1]], [-b, a, 0, rho[2]], [0, 0, 0, 0]])


@given(twists)
def test_exponential_agrees_with_scipy(xi: Array) -> None:
    expected = np.stack([expm(wedge(x)) for x in xi])
    np.testing.assert_allclose(_core.se3_exp(xi), expected, atol=1e-12)


@given(twists)
def test_logarithm_agrees_with_scipy(xi: Array) -> None:
    transforms = _core.se3_exp(xi)
    for twist, transform in zip(_core.se3_log(transforms), transforms, strict=True):
        np.testing.assert_allclose(wedge(twist), np.real(logm(transform)), atol=1e-8)


@given(twists)
def test_logarithm_inverts_exponential(xi: Array) -> None:
    np.testing.assert_allclose(_core.se3_log(_core.se3_exp(xi)), xi, atol=1e-9)


@given(twists)
def test_adjoint_moves_a_twist_through(xi: Array) -> None:
    T = _core.se3_exp(xi)
    moved = _core.se3_adjoint(T)[0] @ xi[1]
    np.testing.assert_allclose(wedge(moved), T[0] @ wedge(xi[1]) @ np.linalg.inv(T[0]), atol=1e-10)


def test_half_turns_have_a_logarithm() -> None:
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    twist = _core.se3_log(T[None])[0]
    np.testing.assert_allclose(np.abs(twist), [0, 0, 0, np.pi, 0, 0], atol=1e-12)


def test_nearest_rigid_repairs_rounding() -> None:
    exact = _core.se3_exp([[0.1, -0.2, 0.3, 0.5, -1.0, 0.2]])[0]
    rounded = np.round(exact, 6)
    repaired = _core.nearest_rigid(rounded)
    np.testing.assert_allclose(repaired[:3, :3] @ repaired[:3, :3].T, np.eye(3), atol=1e-14)
    u, _, vt = np.linalg.svd(rounded[:3, :3])
    np.testing.assert_allclose(repaired[:3, :3], u @ vt, atol=1e-9)
    np.testing.assert_array_equal(repaired[:3, 3], rounded[:3, 3])


NOT_RIGID = {
    "reflection": np.diag([1.0, 1, -1, 1]),
    "stretch": np.diag([1.001, 1, 1, 1]),
    "nan": np.full((4, 4), np.nan),
    "zero": np.zeros((4, 4)),
    "last_row": np.diag([1.0, 1, 1, 2]),
}


@pytest.mark.parametrize("broken", NOT_RIGID.values(), ids=list(NOT_RIGID))
def test_what_is_not_rigid_is_refused(broken: Array) -> None:
    with pytest.raises(InputError, match="not a rigid transform") as caught:
        _core.nearest_rigid(broken)
    assert caught.value.code == "not_rigid"
    with pytest.raises(InputError, match=r"T\[1\]"):
        _core.se3_log(np.stack([np.eye(4), broken]))


def test_a_wrong_shape_is_named() -> None:
    with pytest.raises(InputError, match=r"xi must have shape \(N, 6\), found \(6\)"):
        _core.se3_exp(np.zeros(6))
    with pytest.raises(InputError, match=r"T must have shape \(4, 4\), found \(3, 4\)"):
        _core.nearest_rigid(np.eye(4)[:3])


def test_empty_batches_stay_empty() -> None:
    assert _core.se3_exp(np.zeros((0, 6))).shape == (0, 4, 4)
    assert _core.se3_log(np.zeros((0, 4, 4))).shape == (0, 6)
