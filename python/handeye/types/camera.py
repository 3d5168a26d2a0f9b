"""A calibrated camera.

Frame as in OpenCV: x right, y down, z forward; pixel centres at whole numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import LARGEST, FloatArray, count, finite_array
from handeye.types.plain import Document, read_document, without_none

# Parameters of each lens in order; distortion in the order of OpenCV. Focal lengths and centre in pixels.
LENSES: Mapping[str, tuple[str, ...]] = {
    name: ("fx", "fy", "cx", "cy", *coefficients) for name, coefficients in _core.lenses()
}
_LENS_OF_COEFFICIENTS = {0: "pinhole", 4: "brown_conrady_4", 5: "brown_conrady_5", 8: "brown_conrady_8"}
_LENS_OF_COEFFICIENTS[12] = "brown_conrady_12"
# Lenses that OpenCV has too, parameters in its order.
OPENCV_LENSES = frozenset({*_LENS_OF_COEFFICIENTS.values(), "kannala_brandt"})
# OpenCV's fourteen: the twelve and the two angles of a tilted sensor.
_TILTED = 14
MAX_IMAGE_SIDE_PX = 100_000
# Of one picture: twice the largest cameras of industry.
MAX_PIXELS = 1 << 28


class _CameraDocument(Document):
    lens: str
    parameters: list[float]
    width_px: int
    height_px: int
    covariance: list[list[float]] | None = None
    from_views: bool | None = None


@dataclass(frozen=True, eq=False, init=False)
class Camera:
    """Lens, its parameters and the size of the image.

    Parameters
    ----------
    lens
        One of `LENSES`.
    parameters
        (n,) fx, fy, cx, cy in pixels, then the distortion coefficients in the order of `LENSES[lens]`.
    width_px, height_px
        Size of the image.
    covariance
        (n, n) covariance of the parameters, in their units; None if unknown.
    from_views
        Whether it was calibrated from the very pictures that it is used with. What these say of it is in the
        covariance then, and is not counted again.

    Raises
    ------
    InputError
        Unknown lens, wrong number of parameters, not finite, a focal length that is not positive, a size
        that is not 1 to 100 000, or a covariance that is not symmetric and positive semidefinite.

    Examples
    --------
    >>> camera = Camera("brown_conrady_5", (900, 900, 640, 512, -0.1, 0, 0, 0, 0), 1280, 1024)
    >>> camera.size_px
    (1280, 1024)
    """

    lens: str
    parameters: FloatArray
    width_px: int
    height_px: int
    covariance: FloatArray | None
    from_views: bool

    def __init__(
        self,
        lens: str,
        parameters: ArrayLike,
        width_px: int,
        height_px: int,
        covariance: ArrayLike | None = None,
        *,
        from_views: bool = False,
    ) -> None:
        names = LENSES.get(lens)
        if names is None:
            raise InputError(
                f"camera: lens {lens!r}, expected one of {', '.join(LENSES)}", code=Code.UNKNOWN_LENS
            )
        values = finite_array(parameters, (None,), "camera: parameters")
        if len(values) != len(names):
            raise InputError(
                f"camera: {len(values)} parameters for {lens}, expected {len(names)}: {', '.join(names)}",
                code=Code.WRONG_SHAPE,
            )
        if np.abs(values).max() > LARGEST:
            raise InputError(f"camera: a parameter of {np.abs(values).max():.3g}", code=Code.OUT_OF_RANGE)
        if min(values[:2]) <= 0:
            raise InputError(
                f"camera: focal lengths {values[:2]}, expected above zero", code=Code.OUT_OF_RANGE
            )
        _set(self, "lens", lens)
        _set(self, "parameters", values)
        _set(self, "width_px", count(width_px, 1, MAX_IMAGE_SIDE_PX, "camera: width_px"))
        _set(self, "height_px", count(height_px, 1, MAX_IMAGE_SIDE_PX, "camera: height_px"))
        _set(self, "covariance", None if covariance is None else _covariance(covariance, len(names)))
        _set(self, "from_views", from_views)

    @classmethod
    def from_opencv(
        cls,
        camera_matrix: ArrayLike,
        distortion: ArrayLike | None,
        size: tuple[int, int],
        *,
        fisheye: bool = False,
    ) -> "Camera":
        """Return the camera of OpenCV's camera matrix (3, 3), coefficients and size (width, height).

        None or no coefficients is a pinhole; 4, 5, 8 and 12 are Brown-Conrady; with `fisheye` the four of
        `cv2.fisheye` (Kannala-Brandt).

        Raises
        ------
        InputError
            A matrix with skew, another number of coefficients, or a tilted sensor (14 coefficients, last not
            zero).
        """
        matrix = finite_array(camera_matrix, (3, 3), "camera matrix")
        expected = np.array([[matrix[0, 0], 0, matrix[0, 2]], [0, matrix[1, 1], matrix[1, 2]], [0, 0, 1]])
        if not np.allclose(matrix, expected, rtol=0, atol=1e-9):
            raise InputError(
                "camera matrix: expected fx 0 cx / 0 fy cy / 0 0 1 (no skew)", code=Code.INVALID_FIELD
            )
        raw = np.zeros(0) if distortion is None else np.ravel(np.asarray(distortion))
        coefficients = finite_array(raw, (None,), "distortion")
        if len(coefficients) == _TILTED and not coefficients[12:].any():
            coefficients = coefficients[:12]
        if fisheye:
            lens = "kannala_brandt" if len(coefficients) == 4 else None
        else:
            lens = _LENS_OF_COEFFICIENTS.get(len(coefficients))
        if lens is None:
            wanted = "4 for a fisheye" if fisheye else "0, 4, 5, 8 or 12"
            raise InputError(
                f"distortion: {len(coefficients)} coefficients, expected {wanted}",
                code=Code.UNKNOWN_LENS,
                hint="calibrate the camera with one of these lens models",
            )
        head = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]
        return cls(lens, np.concatenate([head, coefficients]), *size)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return LENSES[self.lens]

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) camera matrix in pixels."""
        fx, fy, cx, cy = self.parameters[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> FloatArray:
        """(n - 4,) distortion coefficients in the order of OpenCV; empty for a pinhole."""
        return self.parameters[4:]

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the image in pixels."""
        return self.width_px, self.height_px

    def project(self, points_camera: ArrayLike) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Project points (N, 3) of the camera frame, in metres.

        Returns pixels (N, 2) and a mask (N,): False where the point lies behind the camera or outside the
        region in which the lens model is one to one; the pixel is NaN there. The size of the image is not
        considered.

        Raises
        ------
        InputError
            Not (N, 3) or not finite.
        """
        points = finite_array(points_camera, (None, 3), "points_camera")
        return _core.project(self.lens, self.parameters, points)

    def unproject(self, uv: ArrayLike) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return unit rays (N, 3) of the camera frame through pixels (N, 2), and a mask (N,) as in `project`.

        Raises
        ------
        InputError
            Not (N, 2) or not finite.
        """
        return _core.unproject(self.lens, self.parameters, finite_array(uv, (None, 2), "uv"))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or TOML; `from_dict` reads them back."""
        return without_none(
            lens=self.lens,
            parameters=self.parameters.tolist(),
            width_px=self.width_px,
            height_px=self.height_px,
            covariance=None if self.covariance is None else self.covariance.tolist(),
            from_views=self.from_views or None,
        )

    @classmethod
    def from_dict(cls, data: object) -> "Camera":
        """Read what `to_dict` wrote.

        Raises
        ------
        InputError
            A missing, unknown or unusable field.
        """
        document = read_document(data, _CameraDocument, "camera")
        return cls(
            document.lens,
            document.parameters,
            document.width_px,
            document.height_px,
            document.covariance,
            from_views=bool(document.from_views),
        )

    def with_parameters(self, parameters: ArrayLike) -> "Camera":
        """Return the same camera with other parameters (n,)."""
        return Camera(self.lens, parameters, *self.size_px, self.covariance, from_views=self.from_views)

    def _key(self) -> tuple[object, ...]:
        covariance = None if self.covariance is None else tuple(self.covariance.ravel())
        return self.lens, tuple(self.parameters), self.size_px, covariance, self.from_views

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())


def _set(camera: Camera, name: str, value: object) -> None:
    object.__setattr__(camera, name, value)  # the one way to fill a frozen dataclass


def _covariance(values: ArrayLike, n: int) -> FloatArray:
    covariance = finite_array(values, (n, n), "camera: covariance")
    scale = float(np.abs(covariance).max())
    if not np.allclose(covariance, covariance.T, rtol=0, atol=1e-9 * scale):
        raise InputError("camera: covariance is not symmetric", code=Code.INVALID_FIELD)
    # Scaled to a correlation first: pixels squared and squared coefficients differ by ten orders of
    # magnitude.
    deviations = np.sqrt(np.clip(np.diag(covariance), 0, None))
    scales = np.where(deviations > 0, deviations, 1.0)
    with np.errstate(all="ignore"):
        correlation = covariance / scales / scales[:, np.newaxis]
    usable = np.diag(covariance).min() >= 0 and bool(np.isfinite(correlation).all())
    if not usable or np.linalg.eigvalsh(correlation).min() < -1e-6:
        raise InputError("camera: covariance is not positive semidefinite", code=Code.INVALID_FIELD)
    return covariance
