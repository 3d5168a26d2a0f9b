"""Looking at a scene from afar: parallel projection, z of the world upwards."""

from dataclasses import dataclass

import numpy as np

from handeye.types.arrays import FloatArray

ELEVATION_RAD = np.deg2rad(24.0)
# Directions to look from, clear of the axes, along which a grid has no depth.
_AZIMUTHS_RAD = np.deg2rad([quarter + within for quarter in (0, 90, 180, 270) for within in (25, 45, 65)])


@dataclass(frozen=True, eq=False)
class Outlook:
    """Where a point (3,) of the world is in the picture.

    Parameters
    ----------
    azimuth_rad
        Direction that one looks from, from x towards y.
    scale, offset
        Of the picture.
    """

    azimuth_rad: float
    scale: float = 1.0
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def _axes(self) -> FloatArray:
        """Right, down and towards the viewer (3, 3), one a row."""
        sine, cosine = np.sin(self.azimuth_rad), np.cos(self.azimuth_rad)
        up, flat = np.sin(ELEVATION_RAD), np.cos(ELEVATION_RAD)
        return np.array(
            [[-sine, cosine, 0.0], [up * cosine, up * sine, -flat], [flat * cosine, flat * sine, up]]
        )

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return places (N, 2) of points (N, 3)."""
        return points @ self._axes[:2].T * self.scale + self.offset

    def nearness(self, points: FloatArray) -> FloatArray:
        """Return how near (N,) points (N, 3) are to the viewer."""
        return points @ self._axes[2]


def outlook_on(points: FloatArray, width: float, height: float, margin: float) -> Outlook:
    """Return the outlook from which points (N, 3) spread best, fitted into a picture."""
    room = np.array([width, height]) - 2 * margin

    def fitted(azimuth: float) -> Outlook:
        places = Outlook(azimuth)(points)
        low, high = places.min(axis=0), places.max(axis=0)
        scale = float(np.min(room / np.maximum(high - low, 1e-9)))
        x, y = np.array([width, height]) / 2 - scale * (low + high) / 2
        return Outlook(azimuth, scale, (float(x), float(y)))

    def spread(outlook: Outlook) -> float:
        # How much of the plane the points fill, however long and thin the scene is.
        return float(np.linalg.det(np.cov(outlook(points).T)))

    return max((fitted(float(azimuth)) for azimuth in _AZIMUTHS_RAD), key=spread)
