"""Why a robot pose cannot serve as a view: what the camera would see of the target there."""

import numpy as np

from handeye.estimation.estimate import Estimate
from handeye.planning.prediction import Sight
from handeye.types.arrays import FloatArray

# Candidates whose projected points are held in memory at a time.
_BATCH = 1000


def obstacles(estimate: Estimate, motions: FloatArray, sight: Sight) -> list[str | None]:
    """Say for each motion A (N, 4, 4) what is in the way of a view, None if nothing is.

    Judged by the current estimate, in this order: the target behind the camera, seen from its back, too many
    points where the lens cannot see or outside the image. A candidate known to show the target has nothing in
    its way.
    """
    if sight.known:
        return [None] * len(motions)
    answers: list[str | None] = []
    for first in range(0, len(motions), _BATCH):
        poses = estimate.X.matrix @ motions[first : first + _BATCH] @ estimate.Y.matrix
        answers += _obstacles(estimate, poses, sight)
    return answers


def _obstacles(estimate: Estimate, poses: FloatArray, sight: Sight) -> list[str | None]:
    target, camera = estimate.target, estimate.camera
    count = target.point_count
    needed = sight.fewest or count
    points = target.points @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, None, :3, 3]
    in_front = np.count_nonzero(points[:, :, 2] > 0, axis=1)
    # The target's z axis points away from a camera that sees its face.
    from_behind = np.einsum("ki,ki->k", poses[:, :3, 2], poses[:, :3, 3]) < 0
    pixels, seen = camera.project(points.reshape(-1, 3))
    low, high = sight.margin_px, np.array(camera.size_px) - 1 - sight.margin_px
    with np.errstate(invalid="ignore"):
        inside = seen & np.all((pixels >= low) & (pixels <= high), axis=1)
    in_lens = np.count_nonzero(seen.reshape(-1, count), axis=1)
    in_image = np.count_nonzero(inside.reshape(-1, count), axis=1)
    answers: list[str | None] = []
    for k in range(len(poses)):
        if in_front[k] < needed:
            answers.append("the target would lie behind the camera")
        elif from_behind[k]:
            answers.append("the camera would see the back of the target")
        elif in_lens[k] < needed:
            answers.append(f"the lens would see {in_lens[k]} of {count} points")
        elif in_image[k] < needed:
            answers.append(f"{in_image[k]} of {count} points would be in the image, {needed} are needed")
        else:
            answers.append(None)
    return answers
