"""Pictures of boards where it is known where their points are."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye import _core
from handeye.cameras.render import Appearance, BoardRenderer
from handeye.detection import Detection, NotFound
from handeye.types import (
    AprilGrid,
    ArucoGrid,
    ArucoMarker,
    Camera,
    Charuco,
    Chessboard,
    CircleGrid,
    Pose,
    Target,
)
from handeye.types.arrays import FloatArray

WIDTH_PX, HEIGHT_PX = 520, 416
_F, _CENTRE = 560.0, (258.0, 210.0)

CAMERAS: dict[str, Camera] = {
    lens: Camera(lens, [_F, _F - 2, *_CENTRE, *coefficients], WIDTH_PX, HEIGHT_PX)
    for lens, coefficients in {
        "pinhole": [],
        "brown_conrady_4": [-0.15, 0.05, 1e-3, -8e-4],
        "brown_conrady_5": [-0.2, 0.08, 1e-3, -8e-4, -0.01],
        "brown_conrady_8": [0.3, 0.02, 1e-3, -8e-4, 0.01, 0.5, 0.05, 0.01],
        "brown_conrady_12": [-0.2, 0.05, 1e-3, -8e-4, 0.0, 0.02, 0.01, 0.0, 1e-3, -5e-4, 1e-3, 5e-4],
        "kannala_brandt": [-0.02, 0.005, -1e-3, 2e-4],
    }.items()
}
PINHOLE = CAMERAS["pinhole"]

TARGETS: dict[str, Target] = {
    "chessboard": Chessboard(6, 9, 0.03),
    "circles": CircleGrid(6, 8, 0.03, 0.016),
    "asymmetric circles": CircleGrid(7, 4, 0.02, 0.018, asymmetric=True),
    "marked circles": CircleGrid(6, 8, 0.03, 0.013, marked=19, marked_diameter_m=0.021),
    "charuco": Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50"),
    "april grid": AprilGrid(3, 4, 0.04, 0.3),
    "aruco grid": ArucoGrid(3, 4, 0.04, 0.008, "DICT_5X5_250", first_id=20),
    "marker": ArucoMarker(0.1, "DICT_ARUCO_ORIGINAL", 582),
}
TILTED = (0.35, -0.3, 0.2)


@dataclass(frozen=True, eq=False)
class Scene:
    """A camera, a target and where it is."""

    camera: Camera
    target: Target
    pose: Pose

    @property
    def pixels(self) -> FloatArray:
        """(P, 2) where the points are; NaN behind the camera or beyond the lens."""
        pixels, seen = _core.project_features(
            self.camera.lens,
            self.camera.parameters,
            self.pose.matrix,
            self.target.points,
            self.target.radii_m,
        )
        return np.where(seen[:, np.newaxis], pixels, np.nan)

    def picture(self, seed: int = 0, **look: Any) -> np.ndarray:
        """The picture; `look` are fields of `Appearance`."""
        renderer = BoardRenderer(self.camera, self.target, Appearance(**look))
        return renderer.image(self.pose, np.random.default_rng(seed))

    def errors_px(self, found: Detection | NotFound) -> FloatArray:
        """(N,) distances of what was found from where it is, under the labels as they are."""
        assert isinstance(found, Detection), found
        return np.linalg.norm(found.pixels - self.pixels[found.point_ids], axis=1)

    def rms_px(self, found: Detection | NotFound) -> float:
        """Root mean square distance, under whichever of the labels that look the same fits best."""
        assert isinstance(found, Detection), found
        squares = [
            ((found.pixels - self.pixels[p[found.point_ids]]) ** 2).sum(axis=1).mean()
            for p in self.target.symmetries
        ]
        return float(np.sqrt(min(squares)))


def scene(
    target: Target,
    camera: Camera = PINHOLE,
    turn: tuple[float, float, float] = TILTED,
    *,
    share: float = 0.6,
    at: tuple[float, float] = (0.0, 0.0),
) -> Scene:
    """A board that takes a share of the image's width, its middle off the image's by so many half sizes."""
    rotation = Pose.exp(np.array([0, 0, 0, *turn])).rotation
    plane = target.points
    middle = (plane.min(axis=0) + plane.max(axis=0)) / 2
    size = np.ptp(plane[:, :2], axis=0)
    distance = camera.parameters[0] * max(size[0] / camera.width_px, size[1] / camera.height_px) / share
    half = np.array(camera.size_px) / 2 / camera.parameters[0] * distance
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = np.append(half * at, distance) - rotation @ middle
    return Scene(camera, target, Pose(matrix))


def smaller(camera: Camera, factor: float) -> Camera:
    """The same camera with so many fewer pixels."""
    parameters = camera.parameters.copy()
    parameters[:2] *= factor
    parameters[2:4] = (parameters[2:4] + 0.5) * factor - 0.5
    size = round(camera.width_px * factor), round(camera.height_px * factor)
    return replace(camera, parameters=parameters, width_px=size[0], height_px=size[1])
