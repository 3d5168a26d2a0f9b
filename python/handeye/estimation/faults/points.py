"""Single points that were found in the wrong place, and views whose points do not fit the board at all.

The points of one view must fit one pose. The pose that fits most of them is found by least median of squares
over small subsets (Rousseeuw 1984); points far outside the noise of the others are left out and the pose is
found again.
"""

from dataclasses import dataclass, replace

import numpy as np

from handeye import _core
from handeye.errors import HandeyeError
from handeye.estimation.faults.agreement import BoolArray
from handeye.estimation.faults.kinds.points import MISDETECTED, OUTLYING
from handeye.estimation.measurements import Measurements, ViewPose, view_pose
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding
from handeye.types.view import View

# A point is gross beyond so many robust standard deviations of its view, and so many pixels.
GROSS_SIGMAS = 8.0
GROSS_PX = 0.75
# A view whose noise is so many times that of the others is looked at more closely too.
NOISY_RATIO = 5.0
# Beyond this it does not show the board as labelled.
MISDETECTED_RATIO = 20.0
MISDETECTED_PX = 1.5
FEWEST_POINTS = 8
MOST_GROSS_SHARE = 0.4
SUBSETS = 80
SUBSET_SIZE = 6
MOST_REFITS = 10
# From the median of absolute values to the standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True, eq=False)
class _Robust:
    """A pose, the residuals (N,) as distances, and the robust noise per axis."""

    pose: FloatArray
    distances_px: FloatArray
    sigma_px: float

    @property
    def gross(self) -> BoolArray:
        return self.distances_px > max(GROSS_SIGMAS * self.sigma_px, GROSS_PX)


def without_gross_points(measurements: Measurements) -> tuple[Measurements, tuple[Finding, ...]]:
    """Leave out gross points, and views that do not fit the board at all."""
    fits = [
        _fit(measurements, view, pose.T_camera_target.matrix)
        for view, pose in zip(measurements.views, measurements.poses, strict=True)
    ]
    usual = float(np.median([fit.sigma_px for fit in fits]))
    views: list[View] = []
    poses: list[ViewPose] = []
    rejected = dict(measurements.rejected)
    removed: dict[str, list[int]] = {}
    largest = 0.0
    findings: list[Finding] = []
    for view, pose, fit in zip(measurements.views, measurements.poses, fits, strict=True):
        noisy = fit.sigma_px > NOISY_RATIO * usual and fit.sigma_px > GROSS_PX
        kept = (view, pose)
        if len(view) >= FEWEST_POINTS and (noisy or fit.gross.any()):
            robust = _least_median(measurements, view, fit)
            gross = robust.gross
            if 0 < gross.sum() <= MOST_GROSS_SHARE * len(view):
                cleaned = _cleaned(measurements, view, ~gross)
                if cleaned is not None:
                    kept, fit = cleaned, robust  # noqa: PLW2901
                    removed[view.name] = view.point_ids[gross].tolist()
                    largest = max(largest, float(robust.distances_px[gross].max()))
        if fit.sigma_px > max(MISDETECTED_RATIO * usual, MISDETECTED_PX):
            findings.append(_misdetected(view.name, fit.sigma_px, usual))
            rejected[view.name] = "its points do not fit the board"
            continue
        views.append(kept[0])
        poses.append(kept[1])
    if not removed and not findings:
        return measurements, ()
    if removed:
        findings.insert(0, _outlying(removed, largest, usual))
    return replace(measurements, views=tuple(views), poses=tuple(poses), rejected=rejected), tuple(findings)


def _fit(measurements: Measurements, view: View, pose: FloatArray) -> _Robust:
    camera, target = measurements.camera, measurements.target
    points, radii = target.points[view.point_ids], target.radii_m[view.point_ids]
    projected, seen = _core.project_features(camera.lens, camera.parameters, pose, points, radii)
    residual = np.where(seen[:, np.newaxis], view.pixels - projected, 1e6)
    sigma = MAD_TO_SIGMA * float(np.median(np.abs(residual)))
    # The median of what six parameters were fitted to is too small.
    sigma *= float(np.sqrt(2 * len(view) / max(2 * len(view) - 6, 1)))
    return _Robust(pose, np.linalg.norm(residual, axis=1), sigma)


def _least_median(measurements: Measurements, view: View, start: _Robust) -> _Robust:
    """Return the pose with the smallest median residual over random subsets, refined on its inliers."""
    camera, target = measurements.camera, measurements.target
    random = np.random.default_rng(0)
    best = start
    for _ in range(SUBSETS):
        chosen = random.choice(len(view), SUBSET_SIZE, replace=False)
        ids = view.point_ids[chosen]
        try:
            pose, _ = _core.planar_pose(
                camera.lens, camera.parameters, target.points[ids], target.radii_m[ids], view.pixels[chosen]
            )
        except HandeyeError:
            continue
        fit = _fit(measurements, view, pose[0])
        if fit.sigma_px < best.sigma_px:
            best = fit
    # A small subset fits its own noise: refit to all that agree, until these are the same. At first half do.
    inside = best.distances_px <= max(GROSS_SIGMAS / 2 * best.sigma_px, float(np.median(best.distances_px)))
    for _ in range(MOST_REFITS):
        cleaned = _cleaned(measurements, view, inside)
        if cleaned is None:
            break
        best = _fit(measurements, view, cleaned[1].T_camera_target.matrix)
        if np.array_equal(inside, ~best.gross):
            break
        inside = ~best.gross
    return best


def _cleaned(measurements: Measurements, view: View, kept: BoolArray) -> tuple[View, ViewPose] | None:
    """Return a view with some of its points, and its pose; None if they determine none."""
    sigmas = None if view.sigmas_px is None else view.sigmas_px[kept]
    cleaned = replace(view, point_ids=view.point_ids[kept], pixels=view.pixels[kept], sigmas_px=sigmas)
    try:
        return cleaned, view_pose(measurements.camera, measurements.target, cleaned)
    except HandeyeError:
        return None


def _outlying(removed: dict[str, list[int]], largest_px: float, usual_px: float) -> Finding:
    counts = {name: len(ids) for name, ids in removed.items()}
    words = ", ".join(f"{count} in {name}" for name, count in counts.items())
    total = sum(counts.values())
    return Finding(
        OUTLYING.code,
        f"{total} point{'s' if total > 1 else ''} found in the wrong place, by up to {largest_px:.3g} px "
        f"where the noise is {usual_px:.2g} px: {words}; left out",
        {"views": list(removed), "points": removed, "largest_px": largest_px, "usual_px": usual_px},
    )


def _misdetected(name: str, sigma_px: float, usual_px: float) -> Finding:
    return Finding(
        MISDETECTED.code,
        f"{name}: its points fit no pose of the board within {sigma_px:.2g} px, where the other views fit "
        f"within {usual_px:.2g} px: the target was not found rightly; left out",
        {"views": [name], "sigma_px": sigma_px, "usual_px": usual_px},
    )
