"""The extension module: float64 arrays in, new float64 arrays out.

Lengths are metres, angles radians, pixels have their centres at integers. A lens is named as in
`handeye.types.Camera`; its parameters are `fx, fy, cx, cy, distortion...` in OpenCV's order.
A wrong shape, a parameter out of its range or a transform that is not rigid raises `handeye.errors.InputError`.
"""

from numpy import bool_, float64
from numpy.typing import ArrayLike, NDArray

# Rigid transforms

def se3_exp(xi: ArrayLike) -> NDArray[float64]:
    """Transforms (N, 4, 4) of twists (N, 6), `[rho; phi]`: translation first."""

def se3_log(T: ArrayLike) -> NDArray[float64]:
    """Twists (N, 6) of transforms (N, 4, 4); rotation angles lie in [0, pi]."""

def se3_adjoint(T: ArrayLike) -> NDArray[float64]:
    """Adjoints (N, 6, 6) of transforms (N, 4, 4): `exp(Ad(T) xi) = T exp(xi) T^-1`."""

def nearest_rigid(T: ArrayLike) -> NDArray[float64]:
    """The rigid transform (4, 4) nearest to a matrix (4, 4) that deviates from one by rounding, at most 1e-4."""

# Cameras

def lens_parameter_count(lens: str) -> int:
    """Number of parameters of a lens, focal lengths and principal point included."""

def project(
    lens: str, parameters: ArrayLike, points_camera: ArrayLike
) -> tuple[NDArray[float64], NDArray[bool_]]:
    """Pixels (N, 2) of points (N, 3) in the camera frame, and which (N,) the lens sees; the others are NaN.

    Not seen are points behind the camera and points where the distortion has folded over.
    """

def project_jacobians(
    lens: str, parameters: ArrayLike, points_camera: ArrayLike
) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64], NDArray[bool_]]:
    """Pixels (N, 2), their derivatives in the points (N, 2, 3) and in the n parameters (N, 2, n), and which are seen."""

def unproject(
    lens: str, parameters: ArrayLike, uv: ArrayLike
) -> tuple[NDArray[float64], NDArray[bool_]]:
    """Unit rays (N, 3) in the camera frame of pixels (N, 2), and which (N,) pixels have one; the others are NaN."""

def project_features(
    lens: str, parameters: ArrayLike, T_camera_target: ArrayLike, points: ArrayLike, radii: ArrayLike
) -> tuple[NDArray[float64], NDArray[bool_]]:
    """Pixels (N, 2) at which features are detected, and which (N,) are wholly in view; the others are NaN.

    A feature is a point (N, 3) of the target's frame with a radius (N,): 0 for a corner, which is seen where it
    projects to; otherwise a circle whose normal is the target's z axis, seen at the area centroid of its image.
    """

def refine_pose(
    lens: str,
    parameters: ArrayLike,
    points: ArrayLike,
    radii: ArrayLike,
    pixels: ArrayLike,
    T_camera_target: ArrayLike,
) -> tuple[NDArray[float64], float, NDArray[float64]]:
    """The pose (4, 4) of a target that fits its pixels (N, 2) best, near a starting one, by Levenberg-Marquardt.

    Also the root of the mean squared pixel distance over the features, and the information (6, 6) of the left
    perturbation `[rho; phi]` at a noise of 1 px. Raises `InputError` for fewer than three features or a pixel that is
    not finite, `DegenerateError` if the features do not determine the pose, and `SolveError` if one is not in view of the
    starting pose or the iteration does not converge.
    """
