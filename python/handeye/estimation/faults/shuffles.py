"""Images that were filed with the wrong robot pose.

Among views that do not belong, the image of one may be what was to be seen from the pose of another: two
images swapped, a list shifted by one. Where X and Y are known from the other views, every pair of image and
pose is weighed like a view. Where nothing agrees, the pairing is found from screws: rotation angle and
translation along the axis of a camera motion must be those of the robot motion it belongs to (Chen 1991),
three images at a time.
"""

from dataclasses import dataclass

import numpy as np

from handeye.estimation.faults.consensus import closed_forms, distances, refine, screws
from handeye.estimation.faults.relabel import Readings
from handeye.estimation.faults.selection import Selection, weigh_pairs
from handeye.estimation.faults.stations import Stations, inverted
from handeye.types.arrays import FloatArray, IndexArray

# Most images that are tried with other poses once X and Y are known.
MOST_IMAGES = 12
# Pairs further apart than this share of the working distance are not weighed.
NEAR = 0.1
# An image fits a second pose as well if that is within this of the best, as a logarithm of densities.
CLEAR = 5.0

# Search without X and Y: how well angles (radians) and translations (share of the working distance) must
# agree.
ANGLE_TOLERANCE_RAD = np.deg2rad(1.0)
SHIFT_TOLERANCE = 0.03
SEED_TRIPLES = 60
MOST_SEEDS = 400
# An image belongs to a pose that predicts it within this share of the working distance.
SAME_PLACE = 0.03
# Smallest rotation between the images of a seed.
SEED_ANGLE_RAD = np.deg2rad(8)


@dataclass(frozen=True)
class Pairing:
    """An image and the view whose robot pose it fits."""

    image: int
    motion: int
    label: int
    unambiguous: bool


def pair_suspects(selection: Selection, readings: Readings) -> list[Pairing]:
    """Find for the images of views that do not belong the robot poses that they fit, of any view."""
    images = np.flatnonzero(~selection.members)
    if not 0 < len(images) <= MOST_IMAGES:
        return []
    agreement = selection.agreement
    stations, kinds = agreement.stations, readings.poses.shape[1]
    each = np.indices((len(images), kinds, len(stations))).reshape(3, -1)
    image, label, motion = images[each[0]], each[1], each[2]
    poses = readings.poses[image, label]
    chain = agreement.X @ stations.motions[motion] @ agreement.Y
    lever = stations.distance_m
    near = distances(chain, poses, stations.centre_m, lever) < NEAR * lever
    chosen = np.flatnonzero(near & (image != motion))
    if len(chosen) == 0:
        return []
    image, label, motion = image[chosen], label[chosen], motion[chosen]
    odds, density = weigh_pairs(selection, image, motion, poses[chosen])
    fitting = [
        (float(density[n]), int(image[n]), int(motion[n]), int(label[n])) for n in np.flatnonzero(odds < 0)
    ]
    return _one_to_one(sorted(fitting, reverse=True))


def _one_to_one(fitting: list[tuple[float, int, int, int]]) -> list[Pairing]:
    """Take pairs in the order of their density; ambiguous where an image fits two poses nearly as well."""
    pairs: list[Pairing] = []
    for density, image, motion, label in fitting:
        if any(p.image == image for p in pairs) or any(p.motion == motion for p in pairs):
            continue
        rivals = [d for d, i, m, _ in fitting if (i == image) != (m == motion) and d > density - CLEAR]
        pairs.append(Pairing(image, motion, label, not rivals))
    return pairs


def find_pairing(stations: Stations) -> IndexArray | None:
    """Pair images with robot poses from scratch: (K,) the view whose pose each image fits, -1 for none.

    None where no pairing explains at least half of the images.
    """
    count = len(stations)
    if count < 4:
        return None
    lever = stations.distance_m
    seeds = _seeds(stations)
    if seeds is None:
        return None
    images, motions = seeds
    X, Y = closed_forms(stations.motions[motions], stations.poses[images])
    predicted = X[:, np.newaxis] @ stations.motions @ Y[:, np.newaxis]  # (N, motion, 4, 4)
    away = distances(
        predicted[:, np.newaxis], stations.poses[np.newaxis, :, np.newaxis], stations.centre_m, lever
    )
    nearest = away.min(axis=2)
    score = np.mean(np.log(np.square(nearest / lever) + 1e-5), axis=1)
    best: tuple[int, FloatArray, IndexArray] | None = None
    for seed in np.argsort(score)[:5]:
        pairing = _mutual(away[seed], SAME_PLACE * 3 * lever)
        x, y = X[seed], Y[seed]
        for _ in range(3):
            paired = np.flatnonzero(pairing >= 0)
            if len(paired) < 3:
                break
            motions, poses = stations.motions[pairing[paired]], stations.poses[paired]
            refined = refine(x[np.newaxis], y[np.newaxis], motions[np.newaxis], poses[np.newaxis], lever)
            x, y = refined[0][0], refined[1][0]
            chain = x @ stations.motions @ y
            here = distances(chain[np.newaxis], stations.poses[:, np.newaxis], stations.centre_m, lever)
            pairing = _mutual(here, SAME_PLACE * lever)
        found = int(np.sum(pairing >= 0))
        if best is None or found > best[0]:
            best = (found, x, pairing)
    if best is None or best[0] < max(4, (count + 1) // 2):
        return None
    return best[2]


def _mutual(away: FloatArray, limit_m: float) -> IndexArray:
    """(K,) for each image the pose that it is nearest to, if that is mutual and near enough; -1 otherwise."""
    to_motion, to_image = np.argmin(away, axis=1), np.argmin(away, axis=0)
    images = np.arange(len(away))
    good = (to_image[to_motion] == images) & (away[images, to_motion] < limit_m)
    return np.where(good, to_motion, -1)


def _seeds(stations: Stations) -> tuple[IndexArray, IndexArray] | None:
    """Triples of images and of robot poses (N, 3) whose screws are congruent, the best first."""
    count = len(stations)
    seen = screws(stations.poses[:, np.newaxis] @ inverted(stations.poses)[np.newaxis])
    moved = screws(stations.motions[:, np.newaxis] @ inverted(stations.motions)[np.newaxis])
    tolerance = SHIFT_TOLERANCE * stations.distance_m
    random = np.random.default_rng(0)
    images: list[IndexArray] = []
    found: list[IndexArray] = []
    quality: list[FloatArray] = []
    for _ in range(SEED_TRIPLES):
        i, j, k = random.permutation(count)[:3]
        if min(seen[i, j, 0], seen[i, k, 0], seen[j, k, 0]) < SEED_ANGLE_RAD:
            continue
        misfit = [
            np.square((seen[a, b, 0] - moved[..., 0]) / ANGLE_TOLERANCE_RAD)
            + np.square((seen[a, b, 1] - moved[..., 1]) / tolerance)
            for a, b in ((i, j), (i, k), (j, k))
        ]
        total = misfit[0][:, :, np.newaxis] + misfit[1][:, np.newaxis, :] + misfit[2][np.newaxis]
        a, b, c = np.nonzero(total < 6.0)
        distinct = (a != b) & (b != c) & (a != c)
        chosen = np.stack([a, b, c], axis=1)[distinct]
        images.append(np.tile(np.array([i, j, k], dtype=np.int64), (len(chosen), 1)))
        found.append(chosen.astype(np.int64))
        quality.append(total[tuple(chosen.T)])
    if not found or not sum(map(len, found)):
        return None
    order = np.argsort(np.concatenate(quality))[:MOST_SEEDS]
    return np.concatenate(images)[order], np.concatenate(found)[order]
