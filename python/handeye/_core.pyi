"""The extension module: float64 arrays in, new float64 arrays out.

Lengths are metres, angles radians, pixels have their centres at integers. A lens is named as in
`handeye.types.Camera`; its parameters are `fx, fy, cx, cy, distortion...` in OpenCV's order.
A wrong shape, a parameter out of its range or a transform that is not rigid raises
`handeye.errors.InputError`.
"""

from collections.abc import Sequence
from typing import TypeAlias

from numpy import bool_, float32, float64, int64, uint8
from numpy.typing import ArrayLike, NDArray

# Calls

def panic(message: str) -> None:
    """Fail as a mistake in the core would: a `RuntimeError` with the message.

    >>> _core.panic("a view of nothing")
    Traceback (most recent call last):
        ...
    RuntimeError: ...a view of nothing...
    """

# Rigid transforms

def se3_exp(xi: ArrayLike) -> NDArray[float64]:
    """Transforms (N, 4, 4) of twists (N, 6), `[rho; phi]`: translation first.

    >>> _core.se3_exp([[0.1, 0.0, 0.0, 0.0, 0.0, 0.0]])[0, :3, 3].tolist()
    [0.1, 0.0, 0.0]
    """

def se3_log(T: ArrayLike) -> NDArray[float64]:
    """Twists (N, 6) of transforms (N, 4, 4); rotation angles lie in [0, pi].

    >>> _core.se3_log([np.eye(4)]).tolist()
    [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
    """

def se3_adjoint(T: ArrayLike) -> NDArray[float64]:
    """Adjoints (N, 6, 6) of transforms (N, 4, 4): `exp(Ad(T) xi) = T exp(xi) T^-1`.

    >>> np.allclose(_core.se3_adjoint([np.eye(4)])[0], np.eye(6))
    True
    """

def nearest_rigid(T: ArrayLike) -> NDArray[float64]:
    """The rigid transform (4, 4) nearest to a matrix (4, 4) that is off by rounding, at most 1e-4.

    >>> np.allclose(_core.nearest_rigid(np.diag([1.00001, 1.0, 1.0, 1.0])), np.eye(4))
    True
    """

def are_rigid(T: ArrayLike, tolerance: float) -> NDArray[bool_]:
    """Whether matrices (N, 4, 4) are rigid as they stand, rotations orthogonal to the tolerance (N,).

    >>> _core.are_rigid([np.eye(4), 2 * np.eye(4)], 1e-12).tolist()
    [True, False]
    """

# Cameras

def lenses() -> list[tuple[str, list[str]]]:
    """Every lens, and the names of its coefficients after `fx, fy, cx, cy`.

    >>> dict(_core.lenses())["brown_conrady_5"]
    ['k1', 'k2', 'p1', 'p2', 'k3']
    """

def project(
    lens: str, parameters: ArrayLike, points_camera: ArrayLike
) -> tuple[NDArray[float64], NDArray[bool_]]:
    """Pixels (N, 2) of points (N, 3) in the camera frame, and which (N,) the lens sees; the others are NaN.

    Not seen are points behind the camera and points where the distortion has folded over.

    >>> pixels, seen = _core.project("pinhole", [1400, 1400, 640, 512], [[0.1, 0.0, 1.0]])
    >>> pixels.tolist(), seen.tolist()
    ([[780.0, 512.0]], [True])
    """

def camera_shift(lens: str, before: ArrayLike, after: ArrayLike, size_px: tuple[int, int]) -> float:
    """How far pixels move between two cameras of one lens, at most over a grid of rays in the image.

    Infinite where no ray is seen by both.

    >>> _core.camera_shift("pinhole", [1400, 1400, 640, 512], [1400, 1400, 641, 512], (1280, 1024))
    1.0
    """

def chain_information(
    x: ArrayLike,
    forward: ArrayLike,
    information: ArrayLike,
    sigmas_px: ArrayLike,
    *,
    left: ArrayLike | None = None,
    right: ArrayLike | None = None,
) -> NDArray[float64]:
    """Information (12, 12) of the twists of X and Y from the views alone, without any prior.

    `forward` (K, 4, 4) is `X A` of each view, `information` (K, 6, 6) that of its pose at 1 px, `sigmas_px`
    (K,) the deviation of its pixels, `left` or `right` (6, 6) the square root of the covariance of the
    robot's error on that side of `A`.

    >>> X, motions = estimate.X.matrix, measurements.motions
    >>> pixels = [pose.information for pose in measurements.poses]
    >>> _core.chain_information(X, X @ motions, pixels, np.full(len(pixels), 0.1)).shape
    (12, 12)
    """

def project_jacobians(
    lens: str, parameters: ArrayLike, points_camera: ArrayLike
) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64], NDArray[bool_]]:
    """Pixels (N, 2), derivatives in points (N, 2, 3) and the n parameters (N, 2, n), and which are seen.

    >>> found = _core.project_jacobians("pinhole", [1400, 1400, 640, 512], [[0.0, 0.0, 2.0]])
    >>> found[1][0].tolist()  # px per metre
    [[700.0, 0.0, ...0.0], [0.0, 700.0, ...0.0]]
    """

def unproject(lens: str, parameters: ArrayLike, uv: ArrayLike) -> tuple[NDArray[float64], NDArray[bool_]]:
    """Unit rays (N, 3), camera frame, of pixels (N, 2), and which (N,) there are; the others are NaN.

    >>> rays, there = _core.unproject("pinhole", [1400, 1400, 640, 512], [[640.0, 512.0]])
    >>> rays.tolist()
    [[0.0, 0.0, 1.0]]
    """

def project_features(
    lens: str, parameters: ArrayLike, T_camera_target: ArrayLike, points: ArrayLike, radii: ArrayLike
) -> tuple[NDArray[float64], NDArray[bool_]]:
    """Pixels (N, 2) at which features are detected, and which (N,) are wholly in view; the others are NaN.

    A feature is a point (N, 3) of the target's frame with a radius (N,): 0 for a corner, which is seen where
    it projects to; otherwise a circle whose normal is the target's z axis, seen at the area centroid of its
    image.

    >>> lens = camera.lens, camera.parameters
    >>> T_camera_target = measurements.camera_poses[0]
    >>> pixels, seen = _core.project_features(*lens, T_camera_target, board.points, board.radii_m)
    >>> pixels.shape == (len(board.points), 2)
    True
    """

def refine_pose(
    lens: str,
    parameters: ArrayLike,
    points: ArrayLike,
    radii: ArrayLike,
    pixels: ArrayLike,
    T_camera_target: ArrayLike,
) -> tuple[NDArray[float64], float, NDArray[float64]]:
    """The pose (4, 4) of a target that fits its pixels (N, 2) best, near a starting one.

    By Levenberg-Marquardt. Also the root of the mean squared pixel distance over the features, and the
    information (6, 6) of the left perturbation `[rho; phi]` at a noise of 1 px. Raises `InputError` for fewer
    than three features or a pixel that is not finite, `DegenerateError` if the features do not determine the
    pose, and `SolveError` if one is not in view of the starting pose or the iteration does not converge.

    >>> view, known = recording.views[0], board.points[recording.views[0].point_ids]
    >>> lens, start = (camera.lens, camera.parameters), measurements.camera_poses[0]
    >>> pose, rmse_px, _ = _core.refine_pose(*lens, known, np.zeros(len(known)), view.pixels, start)
    >>> rmse_px < 1
    True
    """

# The pose of one view

_Fit: TypeAlias = tuple[NDArray[float64], float, NDArray[float64]]

def planar_pose(
    lens: str, parameters: ArrayLike, points: ArrayLike, radii: ArrayLike, pixels: ArrayLike
) -> tuple[_Fit, _Fit | None]:
    """Pose of a planar target without a start, and the mirrored second minimum if there is one.

    Each is `T_camera_target` (4, 4), its error in px (root mean square over the points of the residual)
    and its information (6, 6) at a pixel noise of 1 px.

    >>> view, known = recording.views[0], board.points[recording.views[0].point_ids]
    >>> best, mirrored = _core.planar_pose(
    ...     camera.lens, camera.parameters, known, np.zeros(len(known)), view.pixels
    ... )
    >>> best[1] < 1  # px
    True
    """

# Measuring in pictures

def fit_corners(
    image: NDArray[uint8],
    places: ArrayLike,
    directions: ArrayLike,
    curvatures: ArrayLike,
    radii: ArrayLike,
    beyonds: ArrayLike,
    bands: ArrayLike,
    turns: ArrayLike,
    is_crossing: bool,
    rough: bool,
) -> tuple[
    NDArray[float64], NDArray[float64], NDArray[float64], NDArray[float64], NDArray[float64], NDArray[float64]
]:
    """Corners (N, 2) fitted to grey values; NaN where there is none near the guess.

    Also the covariances (N, 2, 2) of the places for residuals of one grey value, the root mean squares (N,)
    of the residuals in the smoothed picture and of those that may move the place, the contrasts (N,), and the
    deviations (N,) of the Gaussian that blurs the edges of the smoothed picture, in pixels.

    `image` (H, W) is contiguous. `places` (N, 2) are guesses, `directions` (N, 2, 2) those of the two edges,
    `curvatures` (N, 2) theirs in 1 / px towards the normals (-sin, cos). `radii` (N,) are free of other
    edges, and `beyonds` (N,) away from where both directions lead; `bands` (N,) are the distances from the
    edges, in pixels, beyond which there is something else; `turns` (N,) the standard deviations of the
    directions in radians, infinite where those are only guesses. At a crossing diagonal parts are equal and
    the light may change; else the four parts may be of any grey. A `rough` fit ends near the place, as is
    enough where it tells another fit where to begin.

    >>> image = np.full((40, 40), 200, np.uint8)
    >>> image[:20, :20] = image[20:, 20:] = 50  # a crossing between pixels 19 and 20
    >>> guess = [[19.0, 20.0]], [[[1.0, 0.0], [0.0, 1.0]]], [[0.0, 0.0]], [8.0], [8.0], [4.0], [np.inf]
    >>> np.round(_core.fit_corners(image, *guess, is_crossing=True, rough=False)[0], 2).tolist()
    [[19.5, 19.5]]
    """

def crossing_neighbours(places: ArrayLike, angles: ArrayLike, off: float) -> NDArray[int64]:
    """Number of the neighbour (N, 4) of each crossing along its edges, -1 for none.

    `places` (N, 2); `angles` (N, 2) of the edges from u towards v, dark between the first and the second.
    Rays are counted from u towards v from the first edge on; directions may be `off` by an angle in radians.

    >>> _core.crossing_neighbours([[10.0, 10.0]], [[0.0, 1.5]], 0.3).tolist()
    [[-1, -1, -1, -1]]
    """

def area_centroids(
    image: NDArray[uint8], centres: ArrayLike, shapes: ArrayLike, gaps: ArrayLike
) -> tuple[NDArray[float64], NDArray[float64]]:
    """Area centroids (N, 2) and shapes (N, 2, 2) of spots; NaN where there is no contrast or one is cut.

    `image` (H, W) is contiguous; `centres` (N, 2) and `shapes` (N, 2, 2) are guesses, `x' S^-1 x = 1` for x
    from the centre to the edge; `gaps` (N,) are the free distances to the next spot in pixels.

    >>> image = np.full((40, 40), 200, np.uint8)
    >>> image[15:26, 15:26] = 50  # a square spot
    >>> _core.area_centroids(image, [[21.0, 20.0]], [30.0 * np.eye(2)], [10.0])[0].round(1).tolist()
    [[20.0, 20.0]]
    """

def free_gaps(centres: ArrayLike, shapes: ArrayLike) -> NDArray[float64]:
    """Narrowest free distances (N,) in pixels from the edge of each spot to that of another, at least 1.

    >>> _core.free_gaps([[0.0, 0.0], [20.0, 0.0]], [4.0 * np.eye(2), 4.0 * np.eye(2)]).tolist()
    [16.0, 16.0]
    """

class PlaneMap:
    """A map from the plane of a target, in metres, to pixels: a homography, and what a lens adds to it.

    >>> corners = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]])
    >>> _core.PlaneMap.fitted(corners, 1000 * corners + 50).pixels([[0.05, 0.05]]).round(6).tolist()
    [[100.0, 100.0]]
    """

    @staticmethod
    def fitted(plane: ArrayLike, pixels: ArrayLike) -> PlaneMap | None:
        """The map that fits places (N, 2) and pixels (N, 2) best, least squares; None where there is none."""

    def pixels(self, plane: ArrayLike) -> NDArray[float64]:
        """Where places (N, 2) of the plane are in the image."""

    def steps(self, plane: ArrayLike, half: float) -> NDArray[float64]:
        """Pixels (N, 2, 2) per metre along each axis at places (N, 2), from both sides at `half` metres."""

class Printed:
    """The printed picture of a board, and what aligning an image with it needs.

    >>> paper = np.ones((20, 20), np.float32)
    >>> _core.Printed(paper, (0.0, 0.0), 100.0, 0.05, 5).drawn([[0.1, 0.1]]).tolist()
    [1.0]
    """

    def __init__(
        self,
        picture: NDArray[float32],
        low: tuple[float, float],
        scale: float,
        pitch: float,
        light_px: int,
    ) -> None:
        """From `picture` (H, W), 0 for ink and 1 for paper.

        `low` is the place in the plane of the outer corner of the first pixel, `scale` the pixels per metre,
        `pitch` the metres from point to point; the light around a place is that of `light_px` across.
        """

    def align(
        self,
        image: NDArray[uint8],
        plane: ArrayLike,
        pixels: ArrayLike,
        margin_px: float,
        also_negative: bool,
    ) -> Alignment | None:
        """Where the board lies in `image` (H, W), contiguous; None where it is not there.

        Places (N, 2) of the plane are expected at pixels (N, 2), within a margin. With `also_negative`
        ink may be lighter than paper.
        """

    def drawn(self, plane: ArrayLike) -> NDArray[float64]:
        """What the picture has (N,) at places (N, 2) of the plane."""

class Alignment:
    """Where a board lies in an image.

    >>> paper = np.kron(np.indices((4, 4)).sum(axis=0) % 2, np.ones((20, 20))).astype(np.float32)
    >>> printed = _core.Printed(paper, (0.0, 0.0), 1000.0, 0.02, 41)
    >>> plane = np.array([[0.02, 0.02], [0.06, 0.02], [0.06, 0.06], [0.02, 0.06], [0.04, 0.04]])
    >>> image = np.full((120, 120), 200, np.uint8)
    >>> image[20:100, 20:100] = 40 + 160 * paper
    >>> found = printed.align(image, plane, 1000 * plane + 19.5, 5.0, False)
    >>> bool(found.likeness(plane).min() > 0.9)
    True
    """

    def places(self, plane: ArrayLike) -> NDArray[float64]:
        """Where places (N, 2) of the plane are in the image."""

    def steps(self, plane: ArrayLike) -> NDArray[float64]:
        """Pixels (N, 2, 2) per metre along each axis at places (N, 2)."""

    def seen(self, plane: ArrayLike) -> NDArray[float64]:
        """Grey values (N,) at places (N, 2) of the plane, light where paper should be."""

    def likeness(self, plane: ArrayLike) -> NDArray[float64]:
        """How well image and picture agree, -1 to 1, one pitch around places (N, 2) of the plane."""

# Closed-form starts

def closed_form(method: str, A: ArrayLike, C: ArrayLike) -> tuple[NDArray[float64], NDArray[float64]]:
    """X and Y (4, 4) of `C[k] = X @ A[k] @ Y` for A and C (K, 4, 4), K >= 3.

    Eye in hand: X = T_camera_flange, A = T_flange_base, Y = T_base_target; eye to hand: X = T_camera_base,
    A = T_base_flange, Y = T_flange_target; C = T_camera_target. Raises InputError for an unknown method,
    lists of different length or too few views, DegenerateError where the views do not rotate about two axes
    and SolveError where the method fails although an answer exists.

    >>> X, Y = _core.closed_form("park_martin", measurements.motions, measurements.camera_poses)
    >>> X.shape
    (4, 4)
    """

def closed_form_methods() -> list[tuple[str, str, str]]:
    """Name, family ("AX = XB" or "AX = YB") and paper of every method.

    >>> [name for name, family, _ in _core.closed_form_methods() if family == "AX = XB"][:2]
    ['shiu_ahmad', 'tsai_lenz']
    """

# Least squares

class Model:
    """Assumptions of a solve, robot and camera taken as exact; parameters are `xi_x (6), xi_y (6)`.

    `pixel_sigma` (K,): noise of each view in px. `chain_prior`: means X, Y (4, 4) and standard deviations
    (6,) of their twists.

    >>> model = _core.Model([0.1] * len(measurements))  # px
    """

    def __init__(
        self,
        pixel_sigma: ArrayLike,
        *,
        chain_prior: tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike] | None = None,
    ) -> None: ...

class Problem:
    """Measurements: view k holds the points `offsets[k]:offsets[k + 1]` and was taken at `A = motions[k]`.

    >>> problem = measurements.problem
    >>> problem.view_count
    9
    >>> problem.squared_error(estimate.X.matrix, estimate.Y.matrix) > 0  # px^2
    True
    """

    def __init__(
        self,
        lens: str,
        parameters: ArrayLike,
        points: ArrayLike,
        radii: ArrayLike,
        pixels: ArrayLike,
        offsets: Sequence[int] | NDArray[int64],
        motions: ArrayLike,
    ) -> None: ...
    @property
    def view_count(self) -> int:
        """Number of views."""
    def through(self, lens: str, parameters: ArrayLike) -> Problem:
        """Return the same pixels as of another camera."""
    def refined(
        self, views: list[int], starts: ArrayLike
    ) -> tuple[NDArray[float64], list[float], NDArray[float64]]:
        """Refine poses (M, 4, 4) of these views, each from its start.

        Returns the poses, root mean squares in pixels, and information (M, 6, 6) at 1 px; raises as
        `refine_pose`.
        """
    def solve(
        self,
        x: ArrayLike,
        y: ArrayLike,
        model: Model,
        *,
        max_iterations: int = 100,
        cost_tolerance: float = 1e-10,
        step_tolerance: float = 1e-13,
        gradient_tolerance: float = 1e-12,
    ) -> Solution:
        """Minimise the reprojection error from X and Y (4, 4); raises SolveError where it diverges."""
    def squared_error(self, x: ArrayLike, y: ArrayLike, *, views: list[int] | None = None) -> float:
        """Sum of squared residuals in px^2; infinite where the target is out of sight."""

class Solution:
    """The answer of a solve.

    >>> X, Y = _core.closed_form("park_martin", measurements.motions, measurements.camera_poses)
    >>> found = measurements.problem.solve(X, Y, _core.Model([0.1] * len(measurements)))
    >>> found.is_converged, found.covariance.shape
    (True, (12, 12))
    """

    @property
    def x(self) -> NDArray[float64]:
        """X (4, 4)."""
    @property
    def y(self) -> NDArray[float64]:
        """Y (4, 4)."""
    @property
    def information(self) -> NDArray[float64]:
        """Information (12, 12) of `[xi_x; xi_y]`, metres and radians, the prior included."""
    @property
    def covariance(self) -> NDArray[float64]:
        """Inverse of the information; raises DegenerateError if that is singular."""
    @property
    def cost(self) -> float:
        """Minus twice the log posterior up to constants."""
    @property
    def initial_cost(self) -> float:
        """The cost at the start."""
    @property
    def iterations(self) -> int:
        """Number of steps that were taken."""
    @property
    def ending(self) -> str:
        """How it ended."""
    @property
    def is_converged(self) -> bool:
        """Whether it came to rest at a minimum."""

def log_densities(deviations: ArrayLike, covariances: ArrayLike, variances: ArrayLike) -> NDArray[float64]:
    """Logarithms (K, M) of the densities of twists (K, 6), Gaussian about zero.

    Of each under its covariance (K, 6, 6) with each of M sets of variances (K, M, 6) beside it.

    >>> _core.log_densities(np.zeros((1, 6)), np.eye(6)[np.newaxis], np.zeros((1, 2, 6))).round(3).tolist()
    [[-5.514, -5.514]]
    """

class Agreement:
    """Views of one target through one camera, linearised at X and Y (4, 4), to be fitted in sets.

    `stations` are `T_base_flange` (N, 4, 4); at each the image `images[n]` of `seen` was taken, read as
    `poses[n]` (N, 4, 4). `variances_px2` and `camera` as in `estimate_cell`.

    >>> seen = _core.PoseMeasurements(measurements.problem, measurements.camera_poses, board_scale=True)
    >>> poses = np.array([view.T_base_flange.matrix for view in recording.views])
    >>> which, variances = list(range(len(poses))), seen.variances_px2
    >>> both = estimate.X.matrix, estimate.Y.matrix
    >>> known = True, 0, False, None  # a camera on the flange without free parameters
    >>> one = _core.Agreement(
    ...     poses, which, measurements.camera_poses, seen, variances, known, *both
    ... )
    >>> len(one.fit(which, None, 5)[8])  # probabilities of all views
    9
    """

    def __init__(
        self,
        stations: ArrayLike,
        images: Sequence[int] | NDArray[int64],
        poses: ArrayLike,
        seen: PoseMeasurements,
        variances_px2: Sequence[float],
        camera: tuple[bool, int, bool, tuple[ArrayLike, ArrayLike, bool] | None],
        x: ArrayLike,
        y: ArrayLike,
    ) -> None: ...
    def fit(
        self, members: Sequence[int] | NDArray[int64], levels: Sequence[float] | None, pairs: int
    ) -> tuple[
        float,
        list[tuple[str, float]],
        list[float],
        NDArray[float64],
        NDArray[float64],
        NDArray[float64],
        NDArray[float64],
        list[float],
        list[float],
    ]:
        """Logarithm of the evidence of a set, levels, constants, X, Y, and what is expected of every view.

        The search for the levels begins at `levels`, if given. Constants are the free parameters of the
        camera and the scale of the board, relative to what was given. What is expected of a member is what
        the other members say: twists (N, 6), their covariances (N, 6, 6), the logarithms of their densities
        (N,) and probabilities of twists at least as unusual (N,). Raises SolveError where the model is
        singular.
        """

# Information

class Belief:
    """Information (n, n) of all global parameters and what follows from it.

    Raises DegenerateError if it is singular.

    >>> _core.Belief(4 * np.eye(12)).covariance.max().tolist()
    0.25
    """

    def __init__(self, information: ArrayLike) -> None: ...
    @property
    def covariance(self) -> NDArray[float64]:
        """Inverse of the information (n, n)."""
    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the information."""
    @property
    def entropy(self) -> float:
        """Entropy of all parameters, nats."""
    @property
    def hand_eye_entropy(self) -> float:
        """Entropy of the hand-eye alone, nats."""

class Criterion:
    """Worth of a view: entropy, entropy_handeye, trace, eigenvalue_sum, min_eigenvalue, tool_point or task.

    `tasks` (P, d, n): rows over all parameters. A view is worth what it takes off the root mean square of the
    tasks' summed variances.

    >>> _core.Criterion("entropy").name
    'entropy'
    """

    def __init__(
        self,
        name: str,
        *,
        length_scale_m: float = 1e-3,
        angle_scale_rad: float = 1e-3,
        tool_points: ArrayLike | None = None,
        over: str = "mean",
        tasks: ArrayLike | None = None,
    ) -> None: ...
    @property
    def name(self) -> str:
        """Its name."""

class Predictor:
    """Predicts what candidate views would tell, at motions A (N, 4, 4).

    `robot_left`, `robot_right` (6, 6): square roots of the covariances of the robot's error on both sides of
    A. `kinematic_count`: constants of the arm among the parameters. `arm` of the candidates, (N, 6,
    kinematic_count + r) on the left of A: columns of the constants, then roots of the noise of the joints;
    without it the constants move nothing.

    >>> both = estimate.X.matrix, estimate.Y.matrix
    >>> on = camera.lens, camera.parameters, board.points, np.zeros(len(board.points))
    >>> predictor = _core.Predictor(*on, *both, pixel_sigma=0.1)
    >>> told = predictor.informations(measurements.motions)  # of the views that were taken
    >>> belief, criterion = _core.Belief(told.sum(axis=0)), _core.Criterion("entropy")
    >>> predictor.gains(belief, criterion, measurements.motions).shape
    (9,)
    """

    def __init__(
        self,
        lens: str,
        parameters: ArrayLike,
        points: ArrayLike,
        radii: ArrayLike,
        x: ArrayLike,
        y: ArrayLike,
        *,
        pixel_sigma: float,
        robot_left: ArrayLike | None = None,
        robot_right: ArrayLike | None = None,
        free_camera: list[int] | None = None,
        board_scale: bool = False,
        kinematic_count: int = 0,
        image_size: tuple[float, float] | None = None,
        margin_px: float = 0.0,
        fewest: int = 3,
    ) -> None: ...
    def gains(
        self,
        belief: Belief,
        criterion: Criterion,
        motions: ArrayLike,
        *,
        arm: ArrayLike | None = None,
        threads: int = 0,
        vector_unit: str | None = None,
    ) -> NDArray[float64]:
        """Gain (N,) of each candidate; NaN where too little of the target would be in sight.

        `threads` (0: as many as pay off) and `vector_unit` change nothing beyond rounding.
        """

    def in_sight(self, motions: ArrayLike) -> list[bool]:
        """Which candidates (N, 4, 4) would show enough of the target."""

    def informations(self, motions: ArrayLike, *, arm: ArrayLike | None = None) -> NDArray[float64]:
        """Information (N, n, n) of each candidate; zero where too little would be in sight."""

# Estimation

def start_from_poses(
    motions: ArrayLike,
    poses: ArrayLike,
    covariances: ArrayLike,
    *,
    start: tuple[ArrayLike, ArrayLike] | None = None,
    prior_sigma_m: float = 1.0,
) -> tuple[NDArray[float64], NDArray[float64], float, str]:
    """X, Y, cost and origin that fit `poses[k] ~ X motions[k] Y` (K, 4, 4), from many starts and a prior.

    >>> C, alike = measurements.camera_poses, np.tile(1e-6 * np.eye(6), (len(measurements), 1, 1))
    >>> X, Y, cost, origin = _core.start_from_poses(measurements.motions, C, alike)
    >>> np.allclose(X, estimate.X.matrix, atol=0.01)
    True
    """

class PoseMeasurements:
    """Views of one target through one camera, each as a pose (K, 4, 4) with its covariance.

    >>> seen = _core.PoseMeasurements(measurements.problem, measurements.camera_poses)
    >>> seen.covariances.shape
    (9, 6, 6)
    """

    def __init__(
        self,
        problem: Problem,
        poses: ArrayLike,
        *,
        free_camera: list[int] | None = None,
        board_scale: bool = False,
        sigmas_px: Sequence[ArrayLike | None] | None = None,
    ) -> None:
        """`sigmas_px`: deviations of the points of each view, which tell better points from worse."""
    @staticmethod
    def stated(motions: ArrayLike, poses: ArrayLike, covariances: ArrayLike) -> PoseMeasurements:
        """Poses (K, 4, 4) that somebody else's detector states.

        With the covariance (K, 6, 6) of their left perturbation, and the middle (K, 4, 4) of each chain.
        """

    def __len__(self) -> int: ...
    @property
    def variances_px2(self) -> list[float]:
        """Variance of the pixels of each view from its own residual, px^2."""
    @property
    def covariances(self) -> NDArray[float64]:
        """Covariances (K, 6, 6) of the poses at 1 px, metres and radians."""
    def camera_normal(self) -> tuple[NDArray[float64], NDArray[float64]]:
        """Information (n, n) and gradient (n,) of the free parameters, all views together, at 1 px."""
    @property
    def sensitivities(self) -> NDArray[float64]:
        """How each pose moves with the camera's free parameters and, last, the board's scale (K, 6, c)."""
    def shared_error(self, variances_px2: list[float]) -> float:
        """Factor on the variances for errors that neighbouring points share; one where there are none."""

    def shrunk_variances(self, *, prior_degrees: float, floor_px2: float) -> list[float]:
        """Pixel variance of each view, drawn to their median, px^2."""

class Posterior:
    """What is believed of a cell.

    >>> seen = _core.PoseMeasurements(measurements.problem, measurements.camera_poses)
    >>> stations = np.array([view.T_base_flange.matrix for view in recording.views])
    >>> one = 0, 0, seen, list(range(len(stations))), seen.variances_px2
    >>> on_flange = True, 0, False, None  # a camera that is taken as known
    >>> found = _core.estimate_cell(stations, [on_flange], [False], [one], pairs=5, most_rounds=20)
    >>> found.x.shape, found.covariance.shape
    ((1, 4, 4), (12, 12))
    """

    @property
    def x(self) -> NDArray[float64]:
        """X of each camera (C, 4, 4)."""
    @property
    def y(self) -> NDArray[float64]:
        """Y of each target (T, 4, 4)."""
    @property
    def theta(self) -> NDArray[float64]:
        """All parameters (n,): twists (zero), cameras, boards, constants of the arm."""
    @property
    def covariance(self) -> NDArray[float64]:
        """Covariance (n, n) of `theta`."""
    @property
    def information(self) -> NDArray[float64]:
        """Information (n, n) at the likeliest levels."""
    @property
    def constants(self) -> list[tuple[str, int, int]]:
        """Components with constants: name, first and one beyond the last of theirs in `theta`."""
    @property
    def level_names(self) -> list[str]:
        """Names (L) of the levels of noise."""
    @property
    def levels(self) -> NDArray[float64]:
        """Levels at each node (N, L), at the mode first."""
    @property
    def mode(self) -> list[float]:
        """Levels at the mode (L,)."""
    @property
    def weights(self) -> list[float]:
        """Share of each node (N,)."""
    @property
    def degrees_of_freedom(self) -> list[float]:
        """Degrees of freedom of the covariance of each X."""
    def degrees_of_freedom_of(self, combinations: ArrayLike) -> list[float]:
        """Degrees of freedom of the covariance of six linear combinations of `theta`, each of (K, 6, n)."""

    @property
    def attribution(self) -> list[tuple[str, float, float]]:
        """Components of the error: name, fall of the log likelihood without it, mean square misfit."""
    @property
    def robot_loss(self) -> float:
        """Fall of the log likelihood where the robot is taken as exact."""
    @property
    def value(self) -> float:
        """Minus the logarithm of the posterior density of the levels at their mode."""
    @property
    def effort(self) -> tuple[int, int, bool]:
        """Linearisations, steps of the levels, and whether all came to rest."""
    @property
    def origin(self) -> str:
        """Where the start came from."""

def estimate_cell(
    stations: ArrayLike,
    cameras: Sequence[tuple[bool, int, bool, tuple[ArrayLike, ArrayLike, bool] | None]],
    targets: Sequence[bool],
    seen: Sequence[tuple[int, int, PoseMeasurements, list[int], list[float]]],
    *,
    velocities: ArrayLike | None = None,
    arm: tuple[ArrayLike, ArrayLike, list[float], list[int], list[bool]] | None = None,
    approach: ArrayLike | None = None,
    exact_robot: bool = False,
    roughness: float = 1.0,
    board_scale: bool = False,
    start: tuple[ArrayLike, ArrayLike] | None = None,
    tips: Sequence[tuple[bool, ArrayLike, ArrayLike]] = ...,
    touches: Sequence[tuple[int, list[int], tuple[int, ArrayLike] | None, ArrayLike]] = ...,
    pairs: int,
    most_rounds: int,
    levels: list[tuple[str, float]] = ...,
) -> Posterior:
    """The posterior of everything in a cell.

    `stations` (S, 4, 4) are `T_base_flange` as reported. A camera is whether it is on the flange, its number
    of free parameters, whether its prior comes from these very pixels, and that prior: information (n, n),
    mean (n,), whether it may be too narrow by a level that is found. `targets`: whether each is on the
    flange. `seen`: camera, target, its views, and for each of these its station and pixel variance in px^2.
    `velocities` (S, 6): twists of the flange per second. `arm`: twists (S, 6, n) of the flange per joint
    and (S, 6, m) per way of displacing a joint on its link, what a deviation of one means for each joint,
    joints whose offset is a parameter, and which ways are in metres. `approach` (S, 6, n): twists of the
    flange per joint and its play, by the side that it came from. `start`: X (C, 4, 4) and Y (T, 4, 4).
    `levels` to begin with, by name, those of one name in order; others begin as usual.
    `roughness`: how many times larger hidden errors of the arm are believed to be than those of good arms.
    A tip is whether it is on the flange, where (3,), and how well that is known, information (3, 3); three
    parameters each behind those of the boards. A touch is its station, behind those of the pictures, one tip
    or two, a target with the point (3,) of it, and the covariance (3, 3) of how well the two met.

    >>> seen = _core.PoseMeasurements(measurements.problem, measurements.camera_poses)
    >>> stations = np.array([view.T_base_flange.matrix for view in recording.views])
    >>> one = 0, 0, seen, list(range(len(stations))), seen.variances_px2
    >>> on_flange = True, 0, False, None  # a camera that is taken as known
    >>> found = _core.estimate_cell(stations, [on_flange], [False], [one], pairs=5, most_rounds=20)
    >>> np.allclose(found.x[0], estimate.X.matrix, atol=0.01)
    True
    """

# Kinematics

class Chain:
    """A serial arm of n joints, at most 16, base first.

    Joint i has the pose `placements[i]` (4, 4) in the frame of the joint before it at position zero, turns
    about or slides along `axes[i]` (3,), and moves from `limits[i][0]` to `limits[i][1]` (radians or metres,
    may be infinite).
    `tip` (4, 4) is the flange in the frame of the last joint. Raises `InputError` for what is no chain.

    >>> turning = _core.Chain([np.eye(4)], [[0.0, 0.0, 1.0]], [False], [[-3.0, 3.0]], Pose.identity().matrix)
    >>> turning.forward([[0.0]])[0].tolist() == np.eye(4).tolist()
    True
    """

    def __init__(
        self, placements: ArrayLike, axes: ArrayLike, sliding: list[bool], limits: ArrayLike, tip: ArrayLike
    ) -> None: ...
    @property
    def joint_count(self) -> int:
        """Number of joints."""
    def forward(self, joints: ArrayLike) -> NDArray[float64]:
        """`T_base_flange` (N, 4, 4) at joints (N, n)."""

    def frames(self, joints: ArrayLike) -> NDArray[float64]:
        """Poses (N, n + 2, 4, 4) in the base at joints (N, n): the base itself, each joint, the flange."""

    def jacobians(self, joints: ArrayLike, frame: str) -> NDArray[float64]:
        """Twists (N, 6, n) per joint.

        `T(q + dq) = exp(J dq) T(q)` for "base", `T(q) exp(J dq)` for "flange".
        """

    def displacements(
        self, joints: ArrayLike, frame: str, which: list[int], twists: ArrayLike
    ) -> NDArray[float64]:
        """Twists (N, 6, m) of the flange per way of displacing a joint on the link before it.

        `which` joint each way displaces, and its twist (m, 6) in the joint's frame before it moves; frames as
        of `jacobians`.
        """

    def inverse(
        self,
        goals: ArrayLike,
        starts: ArrayLike,
        *,
        tolerance_m: float = 1e-9,
        tolerance_rad: float = 1e-9,
        steps: int = 60,
        attempts: int = 100,
    ) -> tuple[NDArray[float64], list[bool], list[tuple[float, float]]]:
        """Joints (N, n) within the limits for poses (N, 4, 4), from starts (N, n) and then from others.

        Also which poses are reached, and how far off (metres, radians) the nearest posture is where not.
        """

    def postures(
        self,
        goal: ArrayLike,
        *,
        tolerance_m: float = 1e-9,
        tolerance_rad: float = 1e-9,
        steps: int = 60,
        attempts: int = 100,
    ) -> NDArray[float64]:
        """All different joints (S, n) found that reach a pose (4, 4)."""

def least_gaps(
    points: ArrayLike, pairs: list[tuple[int, int, int, int]], radii: list[float]
) -> NDArray[float64]:
    """Least gap (N,) in metres of pairs of capsules; negative where two overlap, infinite without pairs.

    The ends of both capsules of a pair are among the points (N, P, 3) of a posture; `radii` are the sums of
    the radii of each pair. Ericson, Real-Time Collision Detection, 2005, section 5.1.9.

    >>> ends = [[[0.0, 0, 0], [1, 0, 0], [0, 0.5, 0], [1, 0.5, 0]]]  # two parallel rods
    >>> _core.least_gaps(ends, [(0, 1, 2, 3)], [0.2]).round(6).tolist()
    [0.3]
    """

# Several views at once

def select_views(
    base: ArrayLike,
    informations: ArrayLike,
    k: int,
    objective: str,
    *,
    tool_points: ArrayLike | None = None,
) -> tuple[list[int], float]:
    """Choose k of a pool (N, n, n) on top of `base` (n, n): indices and their worth.

    `objective`: entropy, entropy_handeye, or tool_point with points (P, 3) in the camera frame. Worth is
    `ln |Lambda|`, `ln |Lambda| - ln |Lambda_nn|`, or minus the mean variance in square metres.

    >>> pool = [np.eye(12), 3 * np.eye(12), 2 * np.eye(12)]
    >>> _core.select_views(np.eye(12), pool, 1, "entropy")[0]
    [1]
    """

def certify_views(
    base: ArrayLike,
    informations: ArrayLike,
    chosen: list[int],
    objective: str,
    *,
    tool_points: ArrayLike | None = None,
    iterations: int = 300,
    tolerance: float = 1e-4,
) -> tuple[float, float, float]:
    """Worth of a choice, a bound that no choice of as many views exceeds, and the efficiency between them.

    >>> pool = [np.eye(12), 3 * np.eye(12), 2 * np.eye(12)]
    >>> _, _, efficiency = _core.certify_views(np.eye(12), pool, [1], "entropy")
    >>> efficiency > 0.99
    True
    """
